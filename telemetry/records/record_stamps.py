"""Times of a record's rows by stamps as they come: counters that wrap, rows that arrive in bursts, gaps and jumps.

A stamp that a host gives on arrival is late by a delay of zero or more, so rows at a steady rate lie on the lower
envelope of their stamps. A pause of the host is not a gap of the sensor: its rows come afterwards, faster. Rows were
lost where the stamps stay behind by what the pause was long.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
MODULI: Final = (2.0**16, 2.0**24, 2.0**31, 2.0**32, 1e6)  # ticks at which counters of loggers begin anew
NEAR_WRAP: Final = 50.0  # usual steps, within which a step across a wrap lies
JUMP: Final = 3600.0  # s; a longer step is a clock that was set, and says nothing of time that passed
JUMP_STEPS: Final = 1000.0  # and in usual steps
GAP_STEPS: Final = 2.5  # of rows that come steadily: two or more are lost
BURSTY: Final = 0.5  # of a period, by which one step in ten of rows in bursts is off
CATCH_UP: Final = 3.0  # s, in which a host that paused reads what has gathered
PAUSE: Final = 8.0  # periods; a shorter one is not looked at
SHARE_LOST: Final = 0.5  # of a pause, by which the rows stay behind where they were lost
DRIFT: Final = 0.005  # relative, by which a sensor's rate and the delays of a host wander


@dataclass(frozen=True, slots=True)
class RowTimes:
    """Times (n,) s of rows and what was found of their stamps.

    ``breaks`` (n,): the row does not follow on the one before. ``period`` is the mean step where nothing is missing, s.
    ``gaps`` are rows and lengths (s) of what is missing before them, ``jumps`` rows and steps (s) of a clock that was
    set, ``wraps`` the number of times a counter began anew, ``strays`` rows whose stamp lies off its neighbours',
    ``repeats`` steps of zero, ``bursts`` the median and largest delay (s) of rows in bursts.
    """

    times: Array
    breaks: Mask
    period: float
    gaps: tuple[tuple[int, float], ...] = ()
    jumps: tuple[tuple[int, float], ...] = ()
    wraps: int = 0
    strays: tuple[int, ...] = ()
    repeats: int = 0
    bursts: tuple[float, float] | None = None


def times_of_stamps(stamps: Array, tick: float, whole: bool, again: Mask) -> RowTimes:
    """Times of rows by their stamps.

    Parameters
    ----------
    stamps : (n,) s, all finite, n at least 2
    tick : s, of the unit they were written in
    whole : whether they are whole numbers of it, as a counter gives
    again : (n,) rows before which the logger began anew
    """
    t, wraps = _unwrapped(stamps.copy(), tick, whole)
    t, strays = _without_strays(t)
    steps = np.diff(t, prepend=t[0])
    usual = _usual_step(steps)
    set_anew = (steps < 0.0) | ((steps > JUMP) & (steps > JUMP_STEPS * usual))
    jumps = tuple((int(k), float(steps[k])) for k in np.flatnonzero(set_anew))
    steps[set_anew] = usual
    t = t[0] + np.cumsum(steps)
    breaks = again | set_anew
    repeats = int(np.sum(steps[1:] == 0.0))
    period = _period(t, breaks)
    if _are_bursts(steps[1:], period):
        gaps = _lost(t, steps, breaks, period)
        for k, _ in gaps:
            breaks[k] = True
        period = _fitted_period(t, breaks)
        times = _enveloped(t, breaks, period)
        late = t - times
        found = (float(np.median(late)), float(late.max()))
        return RowTimes(times, breaks, period, gaps, jumps, wraps, strays, repeats, found)
    gaps = tuple((int(k), float(steps[k])) for k in np.flatnonzero((steps > GAP_STEPS * usual) & ~set_anew))
    for k, _ in gaps:
        breaks[k] = True
    return RowTimes(t, breaks, _period(t, breaks), gaps, jumps, wraps, strays, repeats)


def times_of_rate(count: int, rate: float, again: Mask) -> RowTimes:
    """Times of rows without stamps that come at a rate (Hz)."""
    return RowTimes(np.arange(count) / rate, again.copy(), 1.0 / rate)


def stretches_of(breaks: Mask) -> list[slice]:
    """Stretches of rows that follow on each other."""
    edges = [0, *(int(k) for k in np.flatnonzero(breaks) if k > 0), len(breaks)]
    return [slice(a, b) for a, b in itertools.pairwise(edges)]


def _usual_step(steps: Array) -> float:
    later = steps[1:]
    forward = later[later > 0.0]
    return float(np.median(forward)) if forward.size else 1.0


def _unwrapped(t: Array, tick: float, whole: bool) -> tuple[Array, int]:
    """Stamps that go on where a counter began anew, and how often it did."""
    if not whole:
        return t, 0
    steps = np.diff(t)
    usual = _usual_step(np.concatenate([[0.0], steps]))
    back = np.flatnonzero(steps < 0.0)
    for modulus in MODULI:
        whole_turn = modulus * tick
        if t.max() >= whole_turn or not back.size:
            continue
        across = steps[back] + whole_turn
        wrapped = back[(across >= 0.0) & (across <= max(NEAR_WRAP * usual, 0.001 * whole_turn))]
        if wrapped.size:
            t = t.copy()
            for k in wrapped:
                t[k + 1 :] += whole_turn
            return t, int(wrapped.size)
    return t, 0


def _without_strays(t: Array) -> tuple[Array, tuple[int, ...]]:
    """Put a stamp that lies outside its neighbours', which fit each other, between them."""
    usual = _usual_step(np.diff(t, prepend=t[0]))
    before, here, after = t[:-2], t[1:-1], t[2:]
    fits = (after > before) & (after - before <= 2.0 * GAP_STEPS * usual)
    stray = 1 + np.flatnonzero(fits & ((here < before) | (here > after)))
    stray = stray[np.diff(stray, prepend=-2) > 1]
    t = t.copy()
    t[stray] = 0.5 * (t[stray - 1] + t[stray + 1])
    return t, tuple(int(k) for k in stray)


def _period(t: Array, breaks: Mask) -> float:
    total, count = 0.0, 0
    for part in stretches_of(breaks):
        total += float(t[part][-1] - t[part][0])
        count += part.stop - part.start - 1
    return total / count if count and total > 0.0 else 1.0


def _fitted_period(t: Array, breaks: Mask) -> float:
    """Slope of the stamps over their rows, by least squares within each stretch: the ends alone are late by a burst."""
    over, under = 0.0, 0.0
    for part in stretches_of(breaks):
        n = np.arange(part.stop - part.start) - 0.5 * (part.stop - part.start - 1)
        over, under = over + float(n @ t[part]), under + float(n @ n)
    return over / under


def _are_bursts(steps: Array, period: float) -> bool:
    return len(steps) > 100 and float(np.quantile(np.abs(steps / period - 1.0), 0.9)) > BURSTY


def _lost(t: Array, steps: Array, breaks: Mask, period: float) -> tuple[tuple[int, float], ...]:
    """Pauses after which the rows stay behind."""
    behind = t - period * np.arange(len(t))
    reach = max(2, round(CATCH_UP / period))
    found = []
    for k in np.flatnonzero((steps > PAUSE * period) & ~breaks):
        before, after = behind[max(0, k - reach) : k], behind[k : k + reach]
        if float(after.min() - before.min()) > SHARE_LOST * float(steps[k]):
            found.append((int(k), float(steps[k])))
    return tuple(found)


def _enveloped(t: Array, breaks: Mask, period: float) -> Array:
    """Times below the stamps, stretch by stretch: the latest whose rate is never farther than `DRIFT` off the mean."""
    times = np.empty_like(t)
    slope = DRIFT * period
    for part in stretches_of(breaks):
        stamps = t[part]
        n = np.arange(len(stamps))
        behind = stamps - period * n
        behind = np.minimum.accumulate(behind - slope * n) + slope * n
        back = np.minimum.accumulate((behind + slope * n)[::-1])[::-1] - slope * n
        times[part] = period * n + back
    return times
