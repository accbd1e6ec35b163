"""A sensor warms up: its gyroscopes drift, and the temperature that it tells rises."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.record.node_record import TEMPERATURE
from sim.kernel import shared_body
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.scenario_file import ScenarioFile


def warm_fraction(imu: OneImu, t: Array) -> Array:
    """How far (n,), 0..1, the sensor has warmed up by rig times ``t`` (n,), s."""
    since = np.maximum(t - imu.cold_at, 0.0)
    return np.asarray(1.0 - np.exp(-since / imu.rough.sensor.warm_up_s))


def warm_up(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the drift of each gyroscope."""
    if imu.file.rough is not None:
        drift = math.radians(imu.rough.sensor.warm_up_dps) * warm_fraction(imu, samples.t)
        samples.rate = samples.rate + drift[:, None]


def set_warm_up(shared: Any, file: ScenarioFile) -> None:
    """Size and time constant; nothing warms in a plain world."""
    shared["warm_up_s"] = 1.0
    if file.rough is not None:
        sensor = file.rough.sensor
        shared["warm_up"], shared["warm_up_c"] = math.radians(sensor.warm_up_dps), sensor.warm_up_c
        shared["warm_up_s"] = sensor.warm_up_s


@shared_body
def feel_warm_up(shared: Any, _tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Drift in the middle of the samples, which is their mean."""
    if shared.warm_up != 0.0:
        drift = shared.warm_up * (1.0 - math.exp(-now.since / shared.warm_up_s))
        for i in range(3):
            row[i] += drift


@shared_body
def tell_warmth(shared: Any, _tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Temperature that the driver reads at the end of a cycle."""
    if shared.warm_up_c != 0.0:
        row[TEMPERATURE] += shared.warm_up_c * (1.0 - math.exp(-now.age / shared.warm_up_s))


@shared_body
def part_warm_up(
    shared: Any,
    tube: Any,
    now: Any,
    _drawn: Array,
    _at: int,
    _further: Array,
    borders: Array,
    pieces: int,
    parts: Array,
) -> None:
    """What the parts of a window have more or less of it than their mean, as it rises evenly."""
    if shared.warm_up == 0.0:
        return
    rising = shared.warm_up * math.exp(-now.since / shared.warm_up_s) * now.frame / shared.warm_up_s
    shown = tube.gains[2, 0] + tube.gains[2, 1] + tube.gains[2, 2]
    middle = borders[0] + 0.5 * (now.found - 1)
    for piece in range(pieces):
        length = borders[piece + 1] - borders[piece]
        centre = 0.5 * (borders[piece + 1] + borders[piece] - 1.0)
        parts[piece] += shown * rising * (centre - middle) * length


WARM_UP = Disturbance(
    "warm-up",
    ("rough.sensor.warm_up_dps", "rough.sensor.warm_up_s", "rough.sensor.warm_up_c"),
    ActsOn.SAMPLES,
    warm_up,
    compiled=Compiled(
        shared=(("warm_up", "f8"), ("warm_up_c", "f8"), ("warm_up_s", "f8")),  # rad/s, C and s
        set_shared=set_warm_up,
        felt=feel_warm_up,
        read=tell_warmth,
        parts=part_warm_up,
    ),
)
