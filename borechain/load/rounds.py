"""Two ways of doing the same, timed in rounds by turns: how many times slower one is, with its interval."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from math import comb
from typing import Any

CONFIDENCE = 0.95


def compare_rounds(ours: Sequence[float], peer: Sequence[float]) -> dict[str, Any]:
    """Row of a benchmark, of the times of each round (s).

    A round gives a ratio; ``slower`` is the median of these, so that a spell in which the machine was busy weighs no
    more than any other round. ``slower_interval`` is where the median lies with ``CONFIDENCE``, by the order of the
    ratios alone.
    """
    ratios = sorted(one / other for one, other in zip(ours, peer, strict=True))
    slower, left_out = statistics.median(ratios), below_interval(len(ratios))
    return {
        "ours": statistics.median(ours),
        "peer": statistics.median(peer),
        "ratio": 1.0 / slower,
        "slower": slower,
        "slower_interval": [ratios[left_out], ratios[-1 - left_out]],
    }


def below_interval(count: int) -> int:
    """Number of ``count`` ordered values below the interval of their median, and as many above it.

    Source: the number of values below the median is binomial with one half.
    """
    below, tail = 0, 0.5**count
    while below < (count - 1) // 2 and tail + comb(count, below + 1) * 0.5**count <= 0.5 * (1.0 - CONFIDENCE):
        below += 1
        tail += comb(count, below) * 0.5**count
    return below
