"""Random numbers by counter: the published known answers, and the moments of what is made of them."""

import math

import numpy as np
import pytest

from sim.world.disturbance.philox import fill_normal, fill_uniform, philox_words

# kat_vectors of the authors' library, philox4x32-10
KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "answer"), KNOWN)
def test_published_answers(counter: tuple[int, ...], key: tuple[int, ...], answer: tuple[int, ...]) -> None:
    words = np.zeros(4, np.uint64)
    philox_words(np.array(counter, np.uint64), np.array(key, np.uint64), words)
    assert tuple(words.tolist()) == answer


def drawn(key: int, cycle: int, count: int) -> np.ndarray:
    numbers = np.zeros(count)
    counter = np.array([cycle, 3, 0, 0], np.uint64)
    fill_uniform(counter, np.array([key, 0], np.uint64), np.zeros(4, np.uint64), numbers)
    return numbers


def test_numbers_are_inside_the_unit_interval_and_spread_evenly() -> None:
    numbers = drawn(1, 0, 100_000)
    assert 0.0 < numbers.min() < 1e-4
    assert 1.0 - 1e-4 < numbers.max() < 1.0
    counts = np.histogram(numbers, 100, (0.0, 1.0))[0]
    assert np.sum((counts - 1000.0) ** 2 / 1000.0) < 148.2  # chi^2, 99 degrees of freedom, 0.1 %


def test_normal_numbers_have_the_moments_of_their_distribution() -> None:
    numbers = drawn(7, 1, 200_000)
    fill_normal(numbers)
    for power, moment, spread in ((1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)):
        assert abs(np.mean(numbers**power) - moment) < 4.0 * math.sqrt(spread / len(numbers))
    assert abs(np.corrcoef(numbers[::2], numbers[1::2])[0, 1]) < 4.0 / math.sqrt(len(numbers) / 2)


def test_another_key_cycle_or_place_gives_other_numbers() -> None:
    usual = drawn(1, 0, 12)
    assert np.array_equal(usual, drawn(1, 0, 12))
    assert not np.any(np.isin(usual, drawn(2, 0, 12)))
    assert not np.any(np.isin(usual, drawn(1, 1, 12)))
