"""What one run of a campaign draws of its sensors once: the draws of the world of the same seed (``sim.world``)."""

from __future__ import annotations

import math

import numpy as np

from node.kernels.arithmetic.formats import PERIOD, Array
from sim.campaign.sensors import NOISE, TUBE
from sim.world.imu_errors import ImuErrors
from sim.world.scenario_file import ScenarioFile
from sim.world.streams import Stream, stream
from sim.world.world import World


def noise_of(file: ScenarioFile) -> Array:
    """What is drawn in every cycle of a scenario, (1,) of dtype ``NOISE``; the same for all runs."""
    g, a = file.gyroscope, file.accelerometer
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
    return noise


def tubes_of(world: World, frame: Array) -> Array:
    """Sensors of a world's tubes, (tubes,) of dtype ``TUBE``; ``frame`` (tubes,) rad, of their IMUs."""
    file, seed = world.scenario.file, world.seed
    tubes = np.zeros(len(frame), TUBE)
    errors = ImuErrors(file.gyroscope, file.accelerometer)
    for number, tube in enumerate(tubes, 1):
        tube["cos"], tube["sin"] = math.cos(frame[number - 1]), math.sin(frame[number - 1])
        tube["rate_bias"], tube["spread"] = errors.constants(stream(seed, Stream.GYRO, number))
        tube["force_bias"] = errors.force_bias(stream(seed, Stream.ACCELEROMETER, number))
    return tubes


def frames_of(world: World) -> Array:
    """Angles (tubes,) rad of the IMUs' frames with the head at 0."""
    tubes = range(1, world.scenario.tubes + 1)
    return np.asarray(world.first_angle + np.array([world.marks.frame_angle(tube) for tube in tubes]))
