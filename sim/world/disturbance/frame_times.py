"""When the driver of a sensor takes the frames of its FIFO to be: the node's own ``FrameClock``, once for all runs.

What it finds depends on where a sensor's first frame lies in the tube's first cycle, and on nothing else that a run
draws. So it is worked out for ``PLACES`` of them, each when a tube first has it, and a frame is moved by half a place
at most: 0.3 ms of frames at 50 Hz, which the driver dates as it finds them there.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.frame_clock import FrameClock

Array = npt.NDArray[np.float64]
PLACES: Final = 32  # of the first frame, within the time from one to the next


class FrameTimes(NamedTuple):
    """What the driver finds, a row a place; nothing where no tube had it yet."""

    cuts: npt.NDArray[np.int64]  # (PLACES, cycles + 1) frames before the begin and the ends of cycles, from the first
    late: Array  # (PLACES, cycles) s, by which a window ends before its cycle, the filter's delay left out
    late_std: Array  # (PLACES, cycles) s, of it
    frame: Array  # (PLACES, cycles) s, from one frame to the next as the driver has found it


def no_frames(cycles: int) -> FrameTimes:
    """Before any tube had a place."""
    times = (np.zeros((PLACES, cycles)) for _ in range(3))
    return FrameTimes(np.zeros((PLACES, cycles + 1), np.int64), *times)


def find_frames(times: FrameTimes, place: int, rate: float, frame: float) -> None:
    """Fill a row: frames that come every ``frame`` s and are told to come at ``rate`` Hz."""
    if times.frame[place, 0] > 0.0:
        return
    cycles = times.late.shape[1]
    ends = PERIOD * np.arange(cycles + 1.0)
    times.cuts[place] = np.ceil(ends / frame + (place + 0.5) / PLACES) - 1
    clock = FrameClock(rate)
    for k, (end, found) in enumerate(zip(ends[1:].tolist(), np.diff(times.cuts[place]).tolist(), strict=True)):
        clock.on_read(end, found)
        times.late[place, k], times.late_std[place, k] = end - clock.end, clock.std
        times.frame[place, k] = clock.period
