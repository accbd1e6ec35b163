"""Numbers of a tube's messages: what has not come is known, whatever the order in which the rest comes."""

from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.string.message_numbers import MessageNumbers
from telemetry.application.series import SERIES_SHIFT


def gaps(numbers: MessageNumbers, tube: int) -> list[tuple[int, int]]:
    """Every gap, by giving up one after the other."""
    found = []
    while (gap := numbers.gap(tube)) is not None:
        found.append(gap)
        numbers.give_up(tube, gap)
    return found


@given(st.sets(st.integers(1, 60)), st.integers(0, 60), st.randoms(), st.sampled_from([0, 7]))
def test_what_is_missing_is_what_did_not_come(came: set[int], told: int, random: object, series: int) -> None:
    base, numbers, order = series << SERIES_SHIFT, MessageNumbers(), list(came)
    random.shuffle(order)  # type: ignore[attr-defined]
    for number in order:
        numbers.add_number(3, base + number)
    if told:
        numbers.on_told(3, base + told)
    missing = {number - base for first, last in gaps(numbers, 3) for number in range(first, last + 1)}
    assert missing == set(range(1, max([told, *came], default=0) + 1)) - came


def test_a_tube_that_counts_anew_is_noticed() -> None:
    numbers = MessageNumbers()
    assert not numbers.on_told(1, 5)
    assert not numbers.on_told(1, 6)
    assert numbers.on_told(1, 2)
    assert numbers.on_told(1, (3 << SERIES_SHIFT) + 1)
    assert not numbers.on_told(1, (3 << SERIES_SHIFT) + 2)


def test_a_huge_forged_number_costs_no_memory() -> None:
    numbers = MessageNumbers()
    numbers.on_told(1, (1 << SERIES_SHIFT) - 1)
    assert gaps(numbers, 1) == [(1, (1 << SERIES_SHIFT) - 1)]
