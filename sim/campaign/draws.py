"""What one run of a campaign draws once: joints, mounts, clocks, sensors, and what the encoder measured.

These are the draws of the world of the same seed (``sim.world``), so a run has the string that a rig of its seed has;
what is drawn cycle by cycle comes from ``sim.campaign.philox``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.firmware.tube_settings import settings_record
from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from sim.campaign.sensors import NOISE, TUBE
from sim.rig.direct_string import NEVER, aiding_passes
from sim.world.imu_errors import ImuErrors
from sim.world.scenario_file import ScenarioFile
from sim.world.streams import Stream, stream
from sim.world.world import World


class Draws(NamedTuple):
    """The constants of one run, tube 1 first."""

    frame: Array  # (tubes,) rad, of the IMU's frame with the head at 0
    phase: Array  # (tubes,) s, by which its cycles end after the encoder's
    clock_var: Array  # (tubes,) s^2, stated, by hops
    systematic: Array  # (tubes, tubes + 1) rad, error of the marks by tube and the top tube
    measured: Array  # (cycles, AIDING) what the encoder said
    heard: npt.NDArray[np.bool_]  # (cycles,) and whether it was heard


def noise_of(file: ScenarioFile) -> Array:
    """What is drawn in every cycle of a scenario, (1,) of dtype ``NOISE``; the same for all runs."""
    g, a, medium, clocks = file.gyroscope, file.accelerometer, file.medium, file.clocks
    noise = np.zeros(1, NOISE)
    noise["rate"] = np.radians(np.array(g.noise_dps_rthz)) / math.sqrt(PERIOD)
    noise["wander"] = np.radians(np.array(g.bias_std_dps))
    noise["wander_phi"] = phi = math.exp(-PERIOD / g.bias_tau_s)
    noise["wander_fresh"] = math.sqrt(1.0 - phi**2)
    noise["force"] = a.noise_deg * (math.radians(1.0) * a.gravity_mps2)
    noise["shaking"] = a.vibration_mps2
    noise["pull"] = math.radians(g.g_sensitivity_dps_per_g) / a.gravity_mps2
    noise["step"] = math.radians(g.resolution_dps)
    noise["limit"] = math.radians(g.range_dps)
    noise["clock"] = 1e-3 * clocks.wander_std_ms
    noise["clock_phi"] = phi = math.exp(-PERIOD / clocks.wander_tau_s)
    noise["clock_fresh"] = math.sqrt(1.0 - phi**2)
    noise["loss"] = medium.loss
    if medium.dated_by == "arrival":
        noise["late"], noise["late_by_hop"] = 1e-3 * medium.delay_ms, medium.latency
    return noise


def tubes_of(world: World, frame: Array) -> Array:
    """Sensors and hops of a world's tubes, (tubes,) of dtype ``TUBE``; ``frame`` (tubes,) rad, of their IMUs."""
    file, seed = world.scenario.file, world.seed
    tubes = np.zeros(len(frame), TUBE)
    errors = ImuErrors(file.gyroscope, file.accelerometer)
    for number, tube in enumerate(tubes, 1):
        tube["phase"] = world.phase(number)
        tube["cos"], tube["sin"] = math.cos(frame[number - 1]), math.sin(frame[number - 1])
        tube["rate_bias"], tube["spread"] = errors.constants(stream(seed, Stream.GYRO, number))
        tube["force_bias"] = errors.force_bias(stream(seed, Stream.ACCELEROMETER, number))
    drawn = stream(seed, Stream.AIDING_CLOCKS).standard_normal(len(frame))
    tubes["hop_clock"] = 1e-3 * file.clocks.joint_std_ms * drawn
    return tubes


def draws_of(world: World, measured: Array) -> Draws:
    """The constants of the run of a world's seed, whose encoder ``measured`` (cycles, AIDING)."""
    file, count, seed = world.scenario.file, world.scenario.tubes, world.seed
    tubes = range(1, count + 1)
    clocks = file.clocks
    stated = clocks.joint_std_ms if clocks.stated_std_ms is None else clocks.stated_std_ms
    return Draws(
        frame=world.first_angle + np.array([world.marks.frame_angle(tube) for tube in tubes]),
        phase=np.array([world.phase(tube) for tube in tubes]),
        clock_var=(1e-3 * stated) ** 2 * np.arange(1.0, count + 1.0),
        systematic=np.array([np.pad(world.marks.errors(tube), (tube, 0), "edge") for tube in tubes]),
        measured=measured,
        heard=aiding_passes(file.aiding, world.ends - world.begin, seed),
    )


def fresh_nodes(world: World) -> tuple[Array, Array]:
    """Records of the tubes as new and their settings, of dtype ``NODE`` and ``SETTINGS``."""
    config = default_config()
    for name, value in world.scenario.file.node.tuning.items():
        config[0][name] = value
    tubes = range(1, world.scenario.tubes + 1)
    crews = np.concatenate([settings_record(world.tube_settings(tube), config) for tube in tubes])
    crews["state_every"] = NEVER
    return np.repeat(new_node(config), len(tubes)), crews
