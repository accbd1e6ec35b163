"""The verdict: five words over what is known, never green on what is old or doubtful, and until where to correct."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from schemas import check_answer, shown_on

from groundstation.config import GroundConfig
from groundstation.service.alarms.verdict import (
    WINDS,
    HoleVerdict,
    Known,
    VerdictDoubt,
    Word,
    compass_point,
    deviation_azimuth,
    judge_hole,
)
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import round_to_std, rounded_std
from groundstation.service.answers.shapes.answer_fields import fields_of_answer
from groundstation.service.answers.shapes.column_shapes import Verdict as VerdictAnswer
from groundstation.service.answers.verdict_views import verdict_line
from groundstation.survey.wall.column_deviation import Deviation

LENGTH, LIMIT = 20.0, 0.45
CURVATURE = math.radians(0.5)


def off(used: float, at: float = LENGTH, towards_deg: float = 253.0, std: float = 0.002) -> Deviation:
    """A deviation that uses a share of a tolerance of 45 cm."""
    size, towards = used * LIMIT, math.radians(towards_deg)
    return Deviation(at, at, size * np.array([math.cos(towards), math.sin(towards)]), std**2 * np.eye(2), LIMIT)


def known(end: float, worst: float = 0.1, bit: float = 12.0, **more: object) -> Known:
    return Known(LENGTH, CURVATURE, bit, off(worst, bit), off(end), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("worst", "end", "word"),
    [
        (0.1, 0.2, Word.ON_TARGET),
        (0.1, 0.499, Word.ON_TARGET),
        (0.1, 0.501, Word.WATCH),
        (0.51, 0.2, Word.WATCH),
        (0.1, 0.801, Word.STEER),
        (0.99, 0.81, Word.STEER),
        (1.001, 0.2, Word.OUT),
        (1.3, 1.6, Word.OUT),
    ],
)
def test_each_level_of_the_tolerance_has_its_word(worst: float, end: float, word: Word) -> None:
    found = judge_hole(known(end, worst))
    assert (found.word, found.by_surveys) == (word, word)


def test_the_line_of_a_hole_that_is_to_be_steered() -> None:
    facts = known(0.9733)
    assert (
        verdict_line(judge_hole(facts))
        == "STEER: ends 43.8 ± 0.2 cm at 253 deg WSW; limit 45 (97 %); act before 13.0 m"
    )


def test_a_hole_that_cannot_be_brought_back_is_out_before_it_is_outside() -> None:
    facts = known(1.5, bit=18.0)
    assert judge_hole(facts).word is Word.OUT
    assert "no correction can bring it back" in judge_hole(facts).why[0]
    assert judge_hole(known(1.5, bit=2.0)).word is Word.STEER


def test_too_uncertain_to_tell_is_not_on_target() -> None:
    facts = Known(LENGTH, CURVATURE, 12.0, off(0.1, 12.0), off(0.2, std=0.23))
    assert judge_hole(facts).word is Word.DONT_KNOW
    assert judge_hole(facts).doubts == (VerdictDoubt.UNCERTAIN,)
    nearly = Known(LENGTH, CURVATURE, 12.0, off(0.1, 12.0), off(0.45, std=0.15))
    assert judge_hole(nearly).word is Word.WATCH


@given(
    worst=st.floats(0.0, 3.0),
    end=st.floats(0.0, 3.0),
    std=st.floats(0.0, 1.0),
    bit=st.none() | st.floats(0.0, LENGTH),
    doubts=st.lists(st.sampled_from(list(VerdictDoubt)), max_size=3),
)
def test_it_is_never_green_on_what_is_doubtful_and_never_better_than_the_tolerance(
    worst: float, end: float, std: float, bit: float | None, doubts: list[VerdictDoubt]
) -> None:
    facts = Known(
        LENGTH, CURVATURE, bit, off(worst, 10.0, std=std), off(end, std=std), tuple((d, d.value) for d in doubts)
    )
    found = judge_hole(facts)
    if doubts:
        assert found.word is Word.DONT_KNOW
        assert found.why[: len(doubts)] == tuple(d.value for d in doubts)
    if found.word is Word.ON_TARGET:
        assert max(worst, end) < 0.5
        assert end * LIMIT + 2.0 * std < LIMIT
    if worst >= 1.001:
        assert found.by_surveys is Word.OUT
    assert verdict_line(found)


@given(end=st.floats(0.81, 2.0), bit=st.floats(0.0, LENGTH))
def test_a_correction_begun_in_time_ends_where_it_says(end: float, bit: float) -> None:
    """Bent back from there by the rig's curvature, the hole ends at the lowest level, or at the limit if late."""
    found = judge_hole(known(end, bit=bit))
    if found.act_before is None or found.left is None or found.left < 0.0:
        return
    moved = 0.5 * CURVATURE * (LENGTH - found.act_before) ** 2
    reached = (end * LIMIT - moved) / LIMIT
    assert any(reached == pytest.approx(level) for level in (0.5, 1.0)) or (end < 1.0 and found.act_before == LENGTH)
    assert found.act_before == pytest.approx(bit + found.left)


@given(azimuth_deg=st.floats(-720.0, 720.0))
def test_the_word_of_a_direction_is_within_its_wind(azimuth_deg: float) -> None:
    centre = 22.5 * WINDS.index(compass_point(math.radians(azimuth_deg)))
    assert abs((azimuth_deg - centre + 180.0) % 360.0 - 180.0) <= 11.25 + 1e-9


def test_north_is_0_and_east_is_90() -> None:
    for towards, word in ((0.0, "N"), (90.0, "E"), (180.0, "S"), (270.0, "W"), (253.0, "WSW")):
        assert math.degrees(deviation_azimuth(off(1.0, towards_deg=towards))) == pytest.approx(towards)
        assert compass_point(math.radians(towards)) == word


@pytest.mark.parametrize(
    ("value", "std", "told", "told_std"),
    [(44.1234, 0.2345, 44.12, 0.24), (44.1234, 12.3, 44.0, 13.0), (1.0, 0.0, 1.0, 0.0), (123.4, 123.4, 120.0, 130.0)],
)
def test_numbers_have_the_digits_that_they_are_worth(value: float, std: float, told: float, told_std: float) -> None:
    assert round_to_std(value, std) == told
    assert rounded_std(std) == told_std


@given(st.floats(1e-5, 1e3))
def test_a_standard_deviation_is_never_told_smaller(std: float) -> None:
    assert std * (1.0 - 1e-6) <= rounded_std(std) <= 1.12 * std


def test_a_ground_station_that_knows_nothing_says_so(tmp_path: Path) -> None:
    answer = shown_on(RigModel.begin(GroundConfig(folder=tmp_path)), "verdict")
    check_answer(answer, fields_of_answer(VerdictAnswer))
    assert answer["verdict"] == "dont_know"
    assert answer["doubts"] == ["no_survey", "setup", "clock", "depth", "stale"]
    assert answer["line"] == "DON'T KNOW: no station has been surveyed yet"


def test_a_verdict_without_a_deviation_has_a_line() -> None:
    nothing = Known(LENGTH, CURVATURE)
    assert judge_hole(nothing) == HoleVerdict(
        Word.DONT_KNOW, Word.DONT_KNOW, ("no station has been surveyed yet",), (VerdictDoubt.NO_SURVEY,)
    )
