"""An encoder that is off by the same angle again and again, and readings that are wrong each in its own way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.kernels.turns.same_errors import REMEMBERED, follow_same_errors, same_error_var

SIGMA = math.radians(0.012)


class Aided:
    """A node that is told nothing but innovations."""

    def __init__(self) -> None:
        self.node: Any = new_node(default_config())[0]

    def aid(self, innovation: float, row: int = 0) -> None:
        """One aiding, of a series of rejected ones the ``row``-th; 0 is used."""
        state = self.node["filter"]
        state["innovation"], state["innovation_var"], state["rejected"] = innovation, SIGMA**2, row
        follow_same_errors(self.node, 1 if row > 0 else 0)

    @property
    def off(self) -> float:
        """Standard deviation of the yaw by it, rad."""
        return math.sqrt(same_error_var(self.node))


@pytest.mark.parametrize("bit", [2, 3, 6])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bit_that_is_stuck_is_worth_its_angle(bit: int, seed: int) -> None:
    random, off, row, aided = np.random.default_rng(seed), 2**bit / 4096 * math.tau, 0, Aided()
    for _ in range(30):
        is_wrong = random.random() < 0.5
        row = row + 1 if is_wrong and row < 4 else 0
        noise = SIGMA * random.standard_normal()
        aided.aid(noise + off if row > 0 else noise, row)
    aided.aid(off, 1)
    assert aided.off == pytest.approx(off, abs=5.0 * SIGMA)
    for _ in range(REMEMBERED):
        assert aided.off > 0.0
        aided.aid(0.0)
    assert aided.off == 0.0


@given(st.integers(0, 10**6))
def test_readings_that_are_wrong_each_in_its_own_way_are_not(seed: int) -> None:
    random, aided = np.random.default_rng(seed), Aided()
    for _ in range(200):
        is_wrong = random.random() < 0.2
        aided.aid(random.uniform(-math.pi, math.pi) if is_wrong else SIGMA * random.standard_normal(), int(is_wrong))
        assert aided.off == 0.0


def test_a_slip_that_is_rejected_five_times_in_a_row_is_met_once() -> None:
    aided = Aided()
    for row in range(1, 5):
        aided.aid(math.radians(1.0), row)
    assert aided.off == 0.0
    assert int(aided.node["guard"]["same"]["seen"]) == 0
