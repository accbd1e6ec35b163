"""The inside of a window of a FIFO, by its frames: what it shows of the cycle before, and of the eighths of its own."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from node.kernels.record.filter_record import PARTS

Array = npt.NDArray[np.float64]
LEAST = 2 * PARTS  # frames of a window that is looked into
OFF: Final = 0.1  # of the delay that a data sheet tells of a sensor's filter, its standard deviation


def window_std(clock_std: float, delay: float) -> float:
    """Standard deviation (s) of when a window ends that is dated by its frames and by the delay of their filter.

    A data sheet tells one figure for every part of a kind: of the MPU-6500's filter of 20 Hz 9.9 ms, where two poles at
    20 Hz have 1 / (sqrt(2) pi 20 Hz) = 11.3 ms.

    Parameters
    ----------
    clock_std : s, of the newest frame, as ``FrameClock`` has it
    delay : s, of the filter
    """
    return math.hypot(clock_std, OFF * delay)


def parts_of(rates: Array, window: tuple[float, float], begin: float, end: float) -> tuple[float, ...]:
    """Mean rates before a cycle and over its eighths (9), of a window that ends in the last of them; else nothing.

    A border inside a frame shares it: the turn is linear from one end of a frame to the other.

    Parameters
    ----------
    rates : (n,) rad/s, of frames of equal length
    window : s, from when to when they stand for the motion
    begin, end : s, of the cycle
    """
    first, last = window
    borders = begin + (end - begin) * (np.arange(PARTS + 1) / PARTS)
    borders[-1] = last
    if len(rates) < LEAST or not (first <= begin and borders[-2] < last <= end):
        return ()
    borders = np.concatenate([[first], borders])
    turned = np.concatenate([[0.0], np.cumsum(rates)]) * ((last - first) / len(rates))
    at = np.interp(borders, np.linspace(first, last, len(rates) + 1), turned)
    lengths = np.diff(borders)
    return tuple(np.divide(np.diff(at), lengths, out=np.zeros(PARTS + 1), where=lengths > 0.0).tolist())
