"""The converters of an IMU: how far they reach, and in which steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.kernel import shared_body
from sim.world.disturbance.reach import most_force, most_rate
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, Mask, OneImu
from sim.world.disturbance.vibration import G
from sim.world.scenario_file import ScenarioFile

GYRO_CLIPPED, FORCE_CLIPPED = 1, 2  # bits of a cycle
AT_RANGE = 0.999  # of a range, from where a sample stands at it
FRAME_STEPS = 32768.0  # of a range


def clip_values(values: Array, limit: float) -> tuple[Array, Mask]:
    """Values (n, 3) within a range, and whether any of a row stood at it (n,)."""
    if max(values.max(), -values.min()) < AT_RANGE * limit:
        return values, np.zeros(len(values), np.bool_)
    return np.clip(values, -limit, limit), np.any(np.abs(values) >= AT_RANGE * limit, axis=1)


def clip_forces(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Cut what the converter of the accelerometer does not reach."""
    samples.force, at_range = clip_values(samples.force, G * imu.rough.sensor.force_range_g)
    samples.clipped |= FORCE_CLIPPED * at_range


def clip_signal(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Cut what the converter of the gyroscope does not reach."""
    samples.rate, at_range = clip_values(samples.rate, math.radians(imu.file.gyroscope.range_dps))
    samples.clipped |= GYRO_CLIPPED * at_range


def clips_forces(file: ScenarioFile) -> dict[str, bool]:
    """What is cut is not linear in the readings, so it cannot be added up frame by frame."""
    rough = file.rough
    reached = rough is not None and most_force(file, rough) >= AT_RANGE * rough.sensor.force_range_g
    return {"rough.sensor.force_range_g": reached}


def clips_rates(file: ScenarioFile) -> dict[str, bool]:
    """Likewise of the gyroscope in a rough world; in a plain one the mean of a cycle is cut."""
    rough = file.rough
    reached = rough is not None and most_rate(file, rough) >= AT_RANGE * file.gyroscope.range_dps
    return {"gyroscope.range_dps": reached}


def step_of(file: ScenarioFile, *, is_frame: bool) -> float:
    """Step (rad/s) of a frame, or of the mean of a cycle; 0: none."""
    g = file.gyroscope
    if g.resolution_dps == 0.0:
        return 0.0
    return math.radians(g.range_dps / FRAME_STEPS if is_frame else g.resolution_dps)


def quantise_rates(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Round the rates to the step."""
    if (step := step_of(imu.file, is_frame=samples.is_frame)) > 0.0:
        samples.rate = np.round(samples.rate / step) * step


def clip_rates(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Cut the rates at the range."""
    limit = math.radians(imu.file.gyroscope.range_dps)
    samples.rate = np.clip(samples.rate, -limit, limit)


def set_step(shared: Any, file: ScenarioFile) -> None:
    """Step of a mean; that of frames is smaller than their noise, so that its error is one more noise."""
    if file.rough is None:
        shared["step"] = step_of(file, is_frame=False)
    else:
        shared["white"] = np.sqrt(shared["white"] ** 2 + step_of(file, is_frame=True) ** 2 / 12.0)


@shared_body
def read_steps(shared: Any, _tube: Any, _now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Round the rates to the step."""
    if shared.step > 0.0:
        for i in range(3):
            row[i] = np.round(row[i] / shared.step) * shared.step


def set_limit(shared: Any, file: ScenarioFile) -> None:
    """Range of the gyroscope."""
    shared["limit"] = math.radians(file.gyroscope.range_dps)


@shared_body
def read_within(shared: Any, _tube: Any, _now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Cut the rates at the range."""
    for i in range(3):
        row[i] = min(max(row[i], -shared.limit), shared.limit)


CLIPPED_RATES = Disturbance(
    "clipped-rates", ("gyroscope.range_dps",), ActsOn.GRID, clip_signal, compiled=Compiled(), beyond=clips_rates
)
CLIPPED_FORCES = Disturbance(
    "clipped-forces",
    ("rough.sensor.force_range_g",),
    ActsOn.GRID,
    clip_forces,
    compiled=Compiled(),
    beyond=clips_forces,
)
STEPS = Disturbance(
    "steps",
    ("gyroscope.resolution_dps",),
    ActsOn.SAMPLES,
    quantise_rates,
    compiled=Compiled(shared=(("step", "f8"),), set_shared=set_step, read=read_steps),  # rad/s; 0: none
)
RANGE = Disturbance(
    "range",
    ("gyroscope.range_dps",),
    ActsOn.SAMPLES,
    clip_rates,
    compiled=Compiled(shared=(("limit", "f8"),), set_shared=set_limit, read=read_within),  # rad/s
)
