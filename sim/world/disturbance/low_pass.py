"""The filter of a sensor before its frames are taken."""

from __future__ import annotations

import numpy as np

from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.scenario_file import ScenarioFile


def butterworth_coefficients(low_pass: float, hertz: float) -> tuple[Array, Array]:
    """Coefficients (3,) of the numerator and denominator of a low-pass of two poles at ``low_pass`` Hz."""
    from scipy.signal import butter  # a second that only a world with a filter pays

    b, a = butter(2, min(low_pass / (0.5 * hertz), 0.99))
    return b, a


def low_passed(values: Array, low_pass: float, hertz: float) -> Array:
    """What a filter at ``low_pass`` Hz, at rest before the first, makes of ``values`` (n, m) at ``hertz`` samples/s."""
    from scipy.signal import lfilter, lfilter_zi

    b, a = butterworth_coefficients(low_pass, hertz)
    before = lfilter_zi(b, a)[:, None] * values[0]
    return np.asarray(lfilter(b, a, values, axis=0, zi=before)[0])


def filter_signal(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Pass rates and forces through the filter, if there is one."""
    low_pass = imu.rough.sensor.low_pass_hz
    if low_pass > 0.0:
        hertz = 1.0 / float(samples.t[1] - samples.t[0])
        samples.rate = low_passed(samples.rate, low_pass, hertz)
        samples.force = low_passed(samples.force, low_pass, hertz)


def needs_filter(file: ScenarioFile) -> dict[str, bool]:
    """Frames lie between those of a finer grid, on which nothing is smooth that no filter has passed."""
    sensor = None if file.rough is None else file.rough.sensor
    off = sensor is not None and sensor.delay_off_ms != 0.0
    rough = sensor is not None and sensor.frames_hz > 0.0 == sensor.low_pass_hz
    return {"rough.sensor.low_pass_hz = 0": rough, "rough.sensor.delay_off_ms": off}


LOW_PASS = Disturbance(  # a campaign has the frames of a perfect sensor behind it, ``sim.world.disturbance.frame_sums``
    "low-pass",
    ("rough.sensor.low_pass_hz", "rough.sensor.delay_off_ms"),
    ActsOn.GRID,
    filter_signal,
    compiled=Compiled(),
    beyond=needs_filter,
)
