"""How many hypotheses there are, against those that are made one by one."""

import numpy as np
import pytest
from drawn_strings import draw_string
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.adjustment.hypotheses import all_hypotheses
from groundstation.survey.adjustment.hypothesis_count import count_hypotheses


@pytest.mark.parametrize("count", [8, 10, 30])
def test_as_many_are_counted_as_are_made(count: int) -> None:
    drawn = draw_string(3, count=count)
    assert count_hypotheses(drawn.looks, drawn.run) == sum(1 for _ in all_hypotheses(drawn.looks, drawn.run))


@given(st.integers(0, 1000), st.floats(0.05, 1.0))
def test_as_many_of_a_string_that_was_heard_in_part(seed: int, share: float) -> None:
    """Looks are missing anywhere: whole tubes, whole stops, whole stations."""
    drawn, random = draw_string(seed % 7), np.random.default_rng(seed)
    kept = np.flatnonzero(random.random(len(drawn.looks)) < share)
    kept = kept if len(kept) else np.zeros(1, np.intp)
    looks = drawn.looks.part(kept)
    assert count_hypotheses(looks, drawn.run) == sum(1 for _ in all_hypotheses(looks, drawn.run))
