"""When the newest frame of a sensor's FIFO was taken: its own crystal, found by counting frames between reads.

A read at t that brings the count of frames to n says that frame n came at t at the latest and frame n + 1 later. Frames
come evenly, at a + p n, so of the last reads

    t_i - p (n_i + 1)  <  a  <=  t_i - p n_i

and the a and p are taken that stay farthest from all of these bounds. Reads fall anywhere between two frames, so the
bounds close in as 1 over the number of reads: to 0.2 ms in half a minute. Where a cycle is nearly a whole number of
frames they close in slowly, and what they leave is told as a standard deviation. A crystal that wanders as it warms up
keeps no bounds for long: then fewer of the last reads are looked at.

Within the fewest of them no crystal wanders. Where those contradict each other again and again it is the reads that are
off their time, as on a busy machine, and bounds that a few of them set by chance say nothing: narrow ones least of all.
Then the a and p are taken by which the bounds are exceeded least, in squares, over all of the last reads:

    sum max(0, t_i - p (n_i + 1) - a)^2 + max(0, a - t_i + p n_i)^2   is least

Reads fall anywhere between two frames and are late as often as early, so as many exceed one bound as the other. Its
error is that of an M-estimator (Huber 1964): H^-1 (sum e_i^2 x_i x_i^T) H^-1, with the excesses e_i, x_i = (1, n_i)
and H = sum x_i x_i^T over the reads that exceed. Where the newest reads exceed to one side the time of reads has been
moved, and the reads before say no more.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel

READS: Final = (256, 64, 16)  # that are looked at: two minutes of cycles, or fewer where they contradict each other
ENOUGH: Final = 16  # of them, from where the crystal is known
KNOWN: Final = 1e-3  # of a period that is known, by which it may wander until it is looked at again
LARGEST_ERROR: Final = 0.2  # of a crystal; more is a FIFO that was read late
NARROWER: Final = 16  # times that the range of the period is cut by a third
OFF_TIME: Final = 2 * READS[-1]  # of the last reads: more contradictions than two reads make that were late by chance
MOVED: Final = 5  # sigmas that the excesses of the fewest reads together are off 0, from where the time was moved
ROUNDS: Final = 20  # of Newton's method at most: the excesses are linear between changes of sign, so few are needed


class FrameClock:
    """Of one sensor, whose frames come at about ``rate`` (Hz)."""

    def __init__(self, rate: float) -> None:
        self._nominal = self.period = 1.0 / rate  # s; the period is that of the frames as found so far
        self._spread = LARGEST_ERROR  # of it
        self._reads: deque[tuple[float, float]] = deque(maxlen=READS[0])
        self._apart: deque[bool] = deque(maxlen=READS[0])  # whether the fewest reads contradicted each other
        self.newest = math.nan  # s, on the clock that reads it
        self.std = math.nan  # s, of it

    def begin(self) -> None:
        """Forget the phase: the FIFO was emptied. The crystal is the same."""
        self._reads.clear()
        self.newest = math.nan

    @property
    def end(self) -> float:
        """Until when the frames read so far stand for the motion, s: half a period beyond the newest."""
        return self.newest + 0.5 * self.period

    def on_read(self, at: float, frames: int) -> float:
        """Time of the newest of ``frames`` that were read at ``at`` (s)."""
        if self._reads:
            before, count = self._reads[-1]
            expected = (at - before) / self._nominal
            if abs(frames - expected) > LARGEST_ERROR * expected + 1.0:  # some were lost
                self._reads.clear()
            else:
                frames += int(count)
        self._reads.append((at, float(frames)))
        t, n = np.array(self._reads).T
        for count in READS:
            self._look_at(t[-count:], n[-count:])
            if self.std > 0.0:
                break
        self._apart.append(self.std <= 0.0)
        if sum(self._apart) > OFF_TIME and len(t) >= ENOUGH:
            self._fit_to(t, n)
        self.std = abs(self.std)
        return self.newest

    def _fit_to(self, t: Array, n: Array) -> None:
        """Find period and phase by reads at ``t`` (k,) s, off their time, that brought the counts ``n`` (k,)."""
        since = n - n[-1]
        newest, period, var = least_excess(t, since, self.newest, self.period)
        if var == 0.0:
            return
        if is_moved(t - period * since - newest, period):
            last = self._reads[-1]
            self.begin()
            self._reads.append(last)
            self._look_at(t[-1:], n[-1:])
        else:
            self.newest, self.period, self.std = newest, period, math.sqrt(var)

    def _look_at(self, t: Array, n: Array) -> None:
        """Find period and phase by reads at ``t`` (k,) s that brought the counts ``n`` (k,)."""
        period = self.period
        if len(t) > 1:
            counted = (t[-1] - t[0]) / (n[-1] - n[0])
            spread = 1.0 / (n[-1] - n[0])
            lowest = max(counted * (1.0 - spread), period * (1.0 - self._spread))
            highest = min(counted * (1.0 + spread), period * (1.0 + self._spread))
            period = farthest_period(t, n, lowest, highest) if lowest < highest else counted
            self._spread = KNOWN if len(t) >= ENOUGH else LARGEST_ERROR
        earliest, latest = phase_bounds(t, n, period)
        self.period, self.std = period, (latest - earliest) / math.sqrt(12.0)
        self.newest = min(0.5 * (earliest + latest) + period * n[-1], t[-1])


@kernel
def phase_bounds(t: Array, n: Array, period: float) -> tuple[float, float]:
    """What the phase a is between (s), by reads at ``t`` (k,) s that brought the counts ``n`` (k,)."""
    earliest = latest = t[0] - period * n[0]
    for k in range(1, t.shape[0]):
        phase = t[k] - period * n[k]
        earliest, latest = max(earliest, phase), min(latest, phase)
    return earliest - period, latest


@kernel
def farthest_period(t: Array, n: Array, lowest: float, highest: float) -> float:
    """The period (s) between two that leaves the phase the widest bounds, whose width is a concave function of it."""
    for _ in range(NARROWER):
        third = (highest - lowest) / 3.0
        low, high = lowest + third, highest - third
        (after, before), (later, sooner) = phase_bounds(t, n, low), phase_bounds(t, n, high)
        if before - after < sooner - later:
            lowest = low
        else:
            highest = high
    return 0.5 * (lowest + highest)


def is_moved(since: Array, period: float) -> bool:
    """Whether the time of the newest reads is another one: the fewest of them exceed their bounds to one side.

    ``since`` (k,) s is what passed between the frame that each read found last and the read.
    """
    excess = np.minimum(since, 0.0) + np.maximum(since - period, 0.0)
    newest = excess[-READS[-1] :]
    is_beyond = np.sum(newest) ** 2 > MOVED**2 * len(newest) * np.mean(excess**2)
    return bool(len(excess) > 2 * len(newest) and is_beyond)


@kernel
def least_excess(t: Array, n: Array, phase: float, period: float) -> tuple[float, float, float]:
    """Phase and period (s) by which reads exceed their bounds least, and the variance of that phase (s^2).

    The variance is 0 where fewer than three reads exceed their bounds: they tell neither.

    Parameters
    ----------
    t, n : (k,) s and counts of the reads, the counts from that of the frame whose time the phase is
    phase, period : s, to begin with
    """
    var = 0.0
    for _ in range(ROUNDS):
        count = with_n = with_nn = total = total_n = squares = squares_n = squares_nn = 0.0
        for k in range(t.shape[0]):
            off = t[k] - period * n[k] - phase
            excess = off if off < 0.0 else max(off - period, 0.0)
            if excess != 0.0:
                m = n[k] if off < 0.0 else n[k] + 1.0
                count, with_n, with_nn = count + 1.0, with_n + m, with_nn + m * m
                total, total_n = total + excess, total_n + excess * m
                squares, squares_n = squares + excess * excess, squares_n + excess * excess * m
                squares_nn += excess * excess * m * m
        det = count * with_nn - with_n * with_n
        if count < 3.0 or det <= 0.0:
            return phase, period, 0.0
        a, b = with_nn / det, -with_n / det  # the first row of H^-1
        phase += a * total + b * total_n
        period += (count * total_n - with_n * total) / det
        var = a * a * squares + 2.0 * a * b * squares_n + b * b * squares_nn
    return phase, period, var
