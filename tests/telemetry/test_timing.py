"""Statistics of durations against exact ones, and deadlines that do not drift."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import PERIOD
from telemetry.application.commands import STAGES
from telemetry.runtime.own_clock import Schedule
from telemetry.runtime.timing import BIN_RATIO, CycleStage, Durations

seconds = st.floats(2e-6, 50.0)


@given(st.lists(seconds, min_size=1, max_size=200), st.sampled_from([0.01, 0.5, 0.9, 0.99, 1.0]))
def test_a_quantile_is_the_true_one_rounded_up_by_a_bin(values: list[float], share: float) -> None:
    durations = Durations()
    for value in values:
        durations.add(value)
    exact = float(np.quantile(values, share, method="inverted_cdf"))
    assert exact * (1.0 - 1e-12) <= durations.quantile(share) <= exact * BIN_RATIO * (1.0 + 1e-12)
    assert durations.count == len(values)
    assert durations.mean == pytest.approx(np.mean(values))
    assert durations.largest == max(values)


def test_known_answers() -> None:
    durations = Durations()
    assert (durations.mean, durations.quantile(0.5), durations.largest) == (0.0, 0.0, 0.0)
    for value in (*[1e-3] * 98, 0.5, 4e3):
        durations.add(value)
    assert durations.quantile(0.98) == pytest.approx(1e-3, rel=0.08)
    assert durations.quantile(0.99) == pytest.approx(0.5, rel=0.08)
    assert durations.quantile(1.0) == 4e3
    durations.add(-1.0)
    assert durations.quantile(0.001) <= 1e-6


@given(st.lists(st.floats(1e-6, 4.0), min_size=1, max_size=100), st.floats(1.0, 1e6))
def test_deadlines_stay_on_their_grid_and_a_late_end_leaves_out_those_that_passed(
    lasting: list[float], begin: float
) -> None:
    schedule, left_out = Schedule(begin, PERIOD), 0
    for number, duration in enumerate(lasting, start=1):
        due = schedule.due
        assert due == pytest.approx(begin + (number + left_out) * PERIOD, abs=1e-9)
        ended = due + duration
        missed = schedule.finish(ended)
        assert schedule.due > ended - 1e-9
        assert missed == pytest.approx(math.floor(duration / PERIOD), abs=1 if duration % PERIOD < 1e-6 else 0)
        left_out += missed


def test_the_table_of_commands_names_every_stage() -> None:
    assert tuple(stage.value for stage in CycleStage) == STAGES
