"""What one run of a campaign draws once: joints, mounts, clocks, sensors, and what the encoder measured.

These are the draws of the world of the same seed (``sim.world``), so a run has the string that a rig of its seed has;
what is drawn cycle by cycle comes from ``sim.campaign.philox``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.firmware.settings import crew_record
from node.kernels.layout import PERIOD, default_config
from node.kernels.record import new_node
from sim.rig.direct_string import NEVER, aiding_passes
from sim.rig.encoder_course import measured_of
from sim.world.imu_errors import ImuErrors
from sim.world.scenario import ScenarioFile
from sim.world.streams import Stream, stream
from sim.world.world import World

Array = npt.NDArray[np.float64]


class Noise(NamedTuple):
    """Standard deviations of what is drawn in every cycle; the same for all runs."""

    rate: Array  # (3,) rad/s, white, of a cycle's mean
    wander: Array  # (3,) rad/s, of the Gauss-Markov part
    wander_phi: float  # what is left of it after a cycle
    force: float  # m/s^2, of a cycle's mean
    shaking: float  # m/s^2, likewise, while the bit shakes the string
    step: float  # rad/s, resolution of the gyroscope; 0: none
    limit: float  # rad/s, its range
    clock: float  # s, wander of rig time across each joint
    clock_phi: float
    loss: float  # of an aiding on one hop
    late: float  # s, by which the aiding is dated beside its validity, once
    late_by_hop: float  # s, likewise, each hop


class Draws(NamedTuple):
    """The constants of one run, tube 1 first."""

    frame: Array  # (tubes,) rad, of the IMU's frame with the head at 0
    spread: Array  # (tubes, 3, 3) reading of the gyroscope by the true rates
    pull: float  # rad/s by m/s^2, of the force on each axis of the gyroscope
    rate_bias: Array  # (tubes, 3) rad/s
    force_bias: Array  # (tubes, 3) m/s^2
    clock: Array  # (tubes,) s, error of rig time across each joint from the head down
    clock_var: Array  # (tubes,) s^2, stated, by hops
    systematic: Array  # (tubes, tubes + 1) rad, error of the marks by tube and the top tube
    measured: Array  # (cycles, AIDING) what the encoder said
    heard: npt.NDArray[np.bool_]  # (cycles,) and whether it was heard


def noise_of(file: ScenarioFile) -> Noise:
    """What is drawn in every cycle of a scenario."""
    g, a, medium, clocks = file.gyroscope, file.accelerometer, file.medium, file.clocks
    tilt = math.radians(1.0) * a.gravity_mps2
    arrival = medium.dated_by == "arrival"
    return Noise(
        rate=np.radians(np.array(g.noise_dps_rthz)) / math.sqrt(PERIOD),
        wander=np.radians(np.array(g.bias_std_dps)),
        wander_phi=math.exp(-PERIOD / g.bias_tau_s),
        force=a.noise_deg * tilt,
        shaking=a.vibration_mps2,
        step=math.radians(g.resolution_dps),
        limit=math.radians(g.range_dps),
        clock=1e-3 * clocks.wander_std_ms,
        clock_phi=math.exp(-PERIOD / clocks.wander_tau_s),
        loss=medium.loss,
        late=1e-3 * medium.delay_ms if arrival else 0.0,
        late_by_hop=medium.latency if arrival else 0.0,
    )


def draws_of(world: World) -> Draws:
    """The constants of the run of a world's seed."""
    file, count, seed = world.scenario.file, world.scenario.tubes, world.seed
    tubes = range(1, count + 1)
    errors = ImuErrors(file.gyroscope, file.accelerometer)
    sensors = [errors.constants(stream(seed, Stream.GYRO, tube)) for tube in tubes]
    force_bias = [errors.force_bias(stream(seed, Stream.ACCELEROMETER, tube)) for tube in tubes]
    clocks = file.clocks
    stated = clocks.joint_std_ms if clocks.stated_std_ms is None else clocks.stated_std_ms
    return Draws(
        frame=world.first_angle + np.array([world.frame_angle(tube) for tube in tubes]),
        spread=np.stack([spread for _, spread in sensors]),
        pull=math.radians(file.gyroscope.g_sensitivity_dps_per_g) / file.accelerometer.gravity_mps2,
        rate_bias=np.stack([bias for bias, _ in sensors]),
        force_bias=np.stack(force_bias),
        clock=1e-3 * clocks.joint_std_ms * stream(seed, Stream.AIDING_CLOCKS).standard_normal(count),
        clock_var=(1e-3 * stated) ** 2 * np.arange(1.0, count + 1.0),
        systematic=np.array([[world.marks_error(tube, max(top, tube)) for top in range(count + 1)] for tube in tubes]),
        measured=measured_of(world),
        heard=aiding_passes(file.aiding, world.ends - world.begin, seed),
    )


def fresh_nodes(world: World) -> tuple[Array, Array]:
    """Records of the tubes as new and their settings, of dtype ``NODE`` and ``SETTINGS``."""
    config = default_config()
    for name, value in world.scenario.file.node.tuning.items():
        config[0][name] = value
    tubes = range(1, world.scenario.tubes + 1)
    crews = np.concatenate([crew_record(world.tube_settings(tube), config) for tube in tubes])
    crews["state_every"] = NEVER
    return np.repeat(new_node(config), len(tubes)), crews
