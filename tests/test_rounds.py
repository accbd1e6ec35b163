"""A ratio of two times measured in rounds, and the interval in which it lies."""

from __future__ import annotations

import random
import statistics
from math import comb

import pytest

from borechain.load.rounds import CONFIDENCE, below_interval, compare_rounds


def test_a_round_in_which_the_machine_was_busy_moves_neither_the_ratio_nor_its_interval() -> None:
    peer = [1.0 + 0.01 * k for k in range(25)]
    ours = [2.0 * time for time in peer]
    ours[7], peer[20] = 500.0, 500.0
    row = compare_rounds(ours, peer)
    assert row["slower"] == pytest.approx(2.0)
    assert row["slower_interval"] == pytest.approx([2.0, 2.0])
    assert row["ratio"] == pytest.approx(0.5)


@pytest.mark.parametrize("count", [1, 5, 6, 9, 25, 100])
def test_the_interval_is_the_narrowest_that_holds_the_median_often_enough(count: int) -> None:
    def missed(below: int) -> float:
        return 2.0 * sum(comb(count, k) for k in range(below + 1)) / 2.0**count

    below = below_interval(count)
    assert below == 0 or missed(below) <= 1.0 - CONFIDENCE
    assert below == (count - 1) // 2 or missed(below + 1) > 1.0 - CONFIDENCE


def test_the_interval_holds_the_true_median_as_often_as_it_says() -> None:
    draw = random.Random(1)
    held = []
    for _ in range(2000):
        low, high = compare_rounds([draw.expovariate(1.0) for _ in range(15)], [1.0] * 15)["slower_interval"]
        held.append(low <= 0.6931 <= high)  # ln 2
    assert statistics.fmean(held) >= CONFIDENCE
