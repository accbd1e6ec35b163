"""The word of a verdict at each of its bounds and one number further; chances are stated, not worked out."""

import math

import numpy as np
import pytest
from scipy.stats import ncx2

from groundstation.service.alarms import verdict
from groundstation.service.alarms.verdict import Deadline, Known, correction_deadline, judge_hole, missed_text
from groundstation.service.alarms.verdict_words import VerdictDoubt, Word
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import REACHED, ProjectedEnd

TARGET, LIMIT, STOP = 20.0, 0.5, 2.0
CURVATURE = 0.01  # rad/m


def off(metres: float, limit: float = LIMIT) -> Deviation:
    return Deviation(12.0, 12.0, np.array([metres, 0.0]), 1e-6 * np.eye(2), limit)


def ending(within: float, centred: float = 1.0, metres: float = 0.1, surveyed: float = 0.001) -> ProjectedEnd:
    """An end whose chances are what they are told to be."""
    ends = off(metres)
    found = ProjectedEnd(ends, NormalMixture(np.ones(1), ends.offset[None], ends.cov[None]), surveyed**2 * np.eye(2))
    found.__dict__.update(within=within, centred=centred)
    return found


def less(value: float) -> float:
    return math.nextafter(value, -math.inf)


def more(value: float) -> float:
    return math.nextafter(value, math.inf)


def word(end: ProjectedEnd, bit: float | None = 12.0, worst: Deviation | None = None, unfound: float = 0.0) -> Word:
    return judge_hole(Known(TARGET, CURVATURE, STOP, bit, worst or off(0.0), end, (), unfound)).by_surveys


@pytest.fixture
def deadline(monkeypatch: pytest.MonkeyPatch) -> list[Deadline]:
    """The deadline that a test puts in place of the one that would be worked out."""
    stated = [Deadline(15.0, 5.0, 0.9)]
    monkeypatch.setattr(verdict, "correction_deadline", lambda _end, _known: stated[0])
    return stated


@pytest.mark.parametrize(
    ("used", "end", "expected"),
    [
        (1.0, 0.99, Word.OUT),  # the whole tolerance
        (less(1.0), 0.99, Word.WATCH),
        (0.5, 0.95, Word.WATCH),  # half of it, and surely within
        (less(0.5), 0.95, Word.ON_TARGET),
        (0.5, less(0.95), Word.WATCH),  # by its end then, with a deadline
    ],
)
def test_of_the_tolerance(used: float, end: float, expected: Word) -> None:
    worst = off(used, 1.0)
    assert worst.ratio == used
    found = judge_hole(Known(TARGET, CURVATURE, STOP, 12.0, worst, ending(end)))
    assert found.word is expected
    by_way = used > 0.5 or (used == 0.5 and end == 0.95)
    assert (found.what, found.about is worst) == (("deviation", True) if by_way else ("projection", False))


@pytest.mark.parametrize(
    ("within", "expected", "steered"), [(0.95, Word.ON_TARGET, False), (less(0.95), Word.WATCH, True)]
)
def test_of_a_sure_end(within: float, expected: Word, steered: bool, deadline: list[Deadline]) -> None:
    found = judge_hole(Known(TARGET, CURVATURE, STOP, 12.0, off(0.0), ending(within)))
    assert (found.word, found.deadline) == (expected, deadline[0] if steered else None)


@pytest.mark.parametrize(("within", "expected"), [(0.5, Word.WATCH), (less(0.5), Word.OUT)])
def test_of_an_even_end_at_its_depth(within: float, expected: Word) -> None:
    assert word(ending(within), bit=TARGET) is expected


@pytest.mark.parametrize(
    ("within", "centred", "expected"),
    [
        (less(0.5), 0.5, Word.STEER),
        (0.5, 0.5, Word.WATCH),
        (less(0.5), less(0.5), Word.WATCH),  # too early to say
    ],
)
def test_of_an_end_that_is_more_likely_out(
    within: float, centred: float, expected: Word, deadline: list[Deadline]
) -> None:
    found = judge_hole(Known(TARGET, CURVATURE, STOP, 12.0, off(0.0), ending(within, centred)))
    assert (found.word, found.deadline) == (expected, deadline[0])
    assert found.why[0].endswith("too early to say where it ends") is (centred < 0.5)


@pytest.mark.parametrize(
    ("left", "best", "expected"),
    [
        (STOP, 0.9, Word.WATCH),  # the next survey comes just in time
        (less(STOP), 0.9, Word.STEER),
        (0.0, 0.1, Word.STEER),  # not missed yet
        (less(0.0), 0.5, Word.STEER),
        (less(0.0), less(0.5), Word.OUT),
        (None, 0.1, Word.WATCH),  # where the bit is is not known
    ],
)
def test_of_a_deadline(left: float | None, best: float, expected: Word, deadline: list[Deadline]) -> None:
    deadline[0] = Deadline(15.0, left, best)
    assert word(ending(0.8)) is expected


@pytest.mark.parametrize(
    ("bit", "expected"), [(TARGET - REACHED, Word.OUT), (less(TARGET - REACHED), Word.WATCH), (None, Word.WATCH)]
)
def test_of_the_depth(bit: float | None, expected: Word, deadline: list[Deadline]) -> None:
    assert word(ending(0.4, 0.4), bit) is expected
    assert Known(TARGET, CURVATURE, STOP, bit).is_at_end is (expected is Word.OUT)


@pytest.mark.parametrize(
    ("unfound", "bit", "expected"),
    [
        (0.375, TARGET, Word.ON_TARGET),  # 0.125 m off and 0.375 m unfound are the limit
        (0.3750001, TARGET, Word.WATCH),
        (0.3750001, 12.0, Word.ON_TARGET),
    ],
)
def test_of_what_one_look_may_hide(unfound: float, bit: float, expected: Word) -> None:
    assert word(ending(0.99, metres=0.125), bit, unfound=unfound) is expected


@pytest.mark.parametrize(("unfound", "told"), [(0.05, 2), (less(0.05), 1)])
def test_of_what_is_worth_telling(unfound: float, told: int) -> None:
    assert verdict.WORTH_TELLING * LIMIT == 0.05
    assert len(judge_hole(Known(TARGET, CURVATURE, STOP, 12.0, off(0.0), ending(0.99), (), unfound)).why) == told


@pytest.mark.parametrize(("spread", "doubts"), [(0.25, (VerdictDoubt.UNCERTAIN,)), (0.2499999, ())])
def test_of_surveys_that_leave_the_end_open(spread: float, doubts: tuple[VerdictDoubt, ...]) -> None:
    """Twice the spread is the limit."""
    end = ending(0.99, surveyed=spread)
    assert end.surveyed_std == spread
    assert judge_hole(Known(TARGET, CURVATURE, STOP, 12.0, off(0.0), end)).doubts == doubts


@pytest.mark.parametrize(("metres", "expected"), [(1.0, Word.DONT_KNOW), (more(1.0), Word.OUT)])
def test_of_an_end_out_however_open(metres: float, expected: Word) -> None:
    """Limit and twice the spread reach 1 m: what ends there may still be within."""
    end = ending(0.0, metres=metres, surveyed=0.25)
    found = judge_hole(Known(TARGET, CURVATURE, STOP, TARGET, off(0.0), end))
    assert (found.word, found.by_surveys) == (expected, Word.OUT)


@pytest.mark.parametrize(("bit", "way"), [(19.5, 0.5), (20.0, 0.0), (20.5, 0.0), (17.0, 3.0)])
def test_of_the_way_that_a_correction_has(bit: float, way: float) -> None:
    """Along the way left it bends the end by k way^2 / 2: 1.25 mm in half a metre; beyond its end by nothing."""
    ends = Deviation(12.0, 12.0, np.array([0.52, 0.0]), 1e-4 * np.eye(2), LIMIT)
    end = ProjectedEnd(ends, NormalMixture(np.ones(1), ends.offset[None], ends.cov[None]), 1e-6 * np.eye(2))
    found = correction_deadline(end, Known(TARGET, CURVATURE, STOP, bit, off(0.0), end))
    reach = LIMIT + 0.5 * CURVATURE * way**2
    assert found.best == pytest.approx(ncx2.cdf((reach / 0.01) ** 2, 2, 52.0**2), rel=1e-6)
    assert found.left == pytest.approx(found.before - bit, abs=1e-12)


@pytest.mark.parametrize(
    ("before", "told"), [(0.04, "95 % was to be had until 0.0 m"), (0.0, "95 % was never to be had")]
)
def test_of_a_depth_that_was_the_last(before: float, told: str) -> None:
    assert missed_text(0.95, before) == told
