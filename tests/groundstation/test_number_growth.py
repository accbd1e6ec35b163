"""Each gap of the numbers waits from when its numbers were given out, whatever gap was looked at meanwhile."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.string.number_growth import REMEMBERED, NumberGrowth

LATE = 1e9


@given(st.lists(st.tuples(st.integers(1, 2), st.integers(0, 200)), max_size=REMEMBERED))
def test_a_number_is_given_out_when_one_as_large_is_first_known(noted: list[tuple[int, int]]) -> None:
    growth = NumberGrowth()
    for at, (tube, newest) in enumerate(noted):
        growth.note(tube, newest, float(at))
    for tube in (1, 2):
        for number in range(0, 201, 7):
            known = [float(at) for at, (one, newest) in enumerate(noted) if one == tube and newest >= number]
            assert growth.given_out_at(tube, number, LATE) == min(known, default=LATE)


def test_what_is_forgotten_waits_from_the_oldest_that_is_known() -> None:
    growth = NumberGrowth()
    for number in range(1, 2 * REMEMBERED + 1):
        growth.note(1, number, float(number))
    assert growth.given_out_at(1, 1, LATE) == REMEMBERED + 1.0
    assert growth.given_out_at(1, 2 * REMEMBERED, LATE) == 2.0 * REMEMBERED
    assert growth.given_out_at(1, 2 * REMEMBERED + 1, LATE) == LATE
