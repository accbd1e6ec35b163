"""Vibration as the frames of a sensor show it, drawn at once for a run and read by every tube from elsewhere.

The world draws noise of a flat band on its fine grid, passes it through the sensor's filter and takes it at the frames
(``sim.world.disturbance.vibration``). What the frames then hold is a stationary normal process whose spectrum is that
of the filtered band folded at the frames' rate; it is drawn as such. Its alias near 0 Hz is what the yaw drifts by, so
the mean over a cycle of the vibration itself would not do. It is cut off where the string starts and stops, so the jump
that an angle makes there is not shown.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from sim.world.disturbance.low_pass import butterworth_coefficients
from sim.world.disturbance.vibration import G
from sim.world.rough_section import RoughSection

Array = npt.NDArray[np.float64]
SPARE: Final = 4  # times the frames of a run that are drawn, so that tubes seldom read the same
ANGLE_STEPS: Final = 4096  # of a band, to integrate over it


def frames_drawn(frames: int) -> int:
    """How many frames are drawn for a run of so many: a power of two, for its transforms."""
    return 1 << (SPARE * frames - 1).bit_length()


class Vibration:
    """Vibration of a scenario's tubes.

    Parameters
    ----------
    section : the scenario's
    frame : s, between two frames
    count : of frames that are drawn
    """

    def __init__(self, section: RoughSection, frame: float, count: int) -> None:
        vibration = section.vibration
        self._count = count
        self._force = G * vibration.turning_g * folded_amplitude(section, frame, count, is_angle=False)
        self._rate = math.radians(vibration.torsional_dps) * folded_amplitude(section, frame, count, is_angle=True)
        hertz = np.linspace(vibration.lowest_hz, vibration.highest_hz, ANGLE_STEPS)
        self.angle_std = math.radians(vibration.torsional_dps) * math.sqrt(float(np.mean((math.tau * hertz) ** -2)))

    def drawn(self, random: np.random.Generator) -> tuple[Array, Array]:
        """Sums of the frames before each, (count + 1,): rate about the axis (rad/s) and force of an axis (m/s^2)."""
        rate, force = (self._sums(random, shape) for shape in (self._rate, self._force))
        return rate, force

    def _sums(self, random: np.random.Generator, shape: Array) -> Array:
        sums = np.zeros(self._count + 1)
        if shape.any():
            white = random.standard_normal((len(shape), 2)).view(np.complex128)[:, 0] * math.sqrt(0.5 * self._count)
            np.cumsum(np.fft.irfft(white * shape, self._count), out=sums[1:])
        return sums


def folded_amplitude(section: RoughSection, frame: float, count: int, *, is_angle: bool) -> Array:
    """Amplitude (count // 2 + 1,) by which white noise of the frames becomes a vibration of rms 1 at its source.

    The rate of an angle on the grid is the mean of two of its steps, and a frame lies anywhere between two samples.
    """
    from scipy.signal import freqz

    vibration, hertz = section.vibration, section.samples_hz
    b, a = butterworth_coefficients(section.sensor.low_pass_hz, hertz)
    base = np.fft.rfftfreq(count, frame)
    power = np.zeros_like(base)
    most = math.ceil(vibration.highest_hz * frame) + 1
    for fold in range(-most, most + 1):
        at = np.abs(base + fold / frame)
        inside = (at >= vibration.lowest_hz) & (at <= vibration.highest_hz)
        angle = math.tau * at[inside] / hertz
        passed = np.abs(freqz(b, a, angle)[1]) ** 2 * (2.0 + np.cos(angle)) / 3.0
        power[inside] += passed * np.cos(0.5 * angle) ** 2 if is_angle else passed
    return np.asarray(np.sqrt(power * 0.5 / (frame * (vibration.highest_hz - vibration.lowest_hz))))
