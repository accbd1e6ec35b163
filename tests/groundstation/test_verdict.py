"""The verdict: five words by stated chances, never green on what is old or doubtful, and until where to correct."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from schemas import check_answer, shown_on
from scipy.stats import ncx2

from groundstation.config import GroundConfig
from groundstation.service.alarms.verdict import (
    HoleVerdict,
    Known,
    chance_text,
    compass_point,
    deviation_azimuth,
    judge_hole,
)
from groundstation.service.alarms.verdict_words import WINDS, VerdictDoubt, Word
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import largest_first, round_to_std, rounded_std
from groundstation.service.answers.shapes.answer_fields import fields_of_answer
from groundstation.service.answers.shapes.column_shapes import Verdict as VerdictAnswer
from groundstation.service.answers.verdict_views import steering_view, todo_line, verdict_line
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd

LENGTH, LIMIT, STOP = 20.0, 0.45, 2.0
CURVATURE = math.radians(0.5)


def off(used: float, at: float = LENGTH, towards_deg: float = 253.0, std: float = 0.002) -> Deviation:
    """A deviation that uses a share of a tolerance of 45 cm."""
    size, towards = used * LIMIT, math.radians(towards_deg)
    return Deviation(at, at, size * np.array([math.cos(towards), math.sin(towards)]), std**2 * np.eye(2), LIMIT)


def ending(used: float, std: float = 0.002, surveyed: float = 0.001, **more: object) -> ProjectedEnd:
    """An end that is foreseen as one round normal."""
    ends = off(used, std=std)
    foreseen = NormalMixture(np.ones(1), ends.offset[None], ends.cov[None])
    return ProjectedEnd(ends, foreseen, surveyed**2 * np.eye(2), **more)  # type: ignore[arg-type]


def known(end: float, worst: float = 0.1, bit: float | None = 12.0, std: float = 0.002, **more: object) -> Known:
    at = 12.0 if bit is None else bit
    return Known(LENGTH, CURVATURE, STOP, bit, off(worst, at), ending(end, std), **more)  # type: ignore[arg-type]


def chance(used: float, std: float, radius: float = LIMIT) -> float:
    """Chance of a round normal within a circle: the distance squared is non-central chi-square."""
    return float(ncx2.cdf((radius / std) ** 2, 2, (used * LIMIT / std) ** 2))


@pytest.mark.parametrize(
    ("worst", "end", "std", "bit", "word"),
    [
        (0.1, 0.2, 0.002, 12.0, Word.ON_TARGET),
        (0.1, 0.98, 0.002, 12.0, Word.ON_TARGET),  # 4.5 standard deviations within
        (0.51, 0.2, 0.002, 12.0, Word.WATCH),  # half of the tolerance is used up on the way
        (0.1, 0.6, 0.1, 12.0, Word.ON_TARGET),
        (0.1, 0.7, 0.1, 12.0, Word.WATCH),  # 90 %
        (0.1, 0.95, 0.1, 12.0, Word.WATCH),  # 55 %
        (0.1, 1.02, 0.1, 12.0, Word.STEER),  # 44 %
        (0.1, 0.3, 0.45, 2.0, Word.WATCH),  # 38 %, and no steering by what is known now makes it 50 %
        (0.1, 0.95, 0.1, 14.5, Word.STEER),  # the correction must begin before the next survey
        (0.1, 0.95, 0.1, 19.0, Word.STEER),  # it is late, and still better than none
        (0.99, 1.02, 0.1, 12.0, Word.STEER),
        (1.001, 0.2, 0.002, 12.0, Word.OUT),
        (1.3, 1.6, 0.002, 12.0, Word.OUT),
    ],
)
def test_each_chance_has_its_word(worst: float, end: float, std: float, bit: float, word: Word) -> None:
    found = judge_hole(known(end, worst, bit, std))
    assert (found.word, found.by_surveys) == (word, word)


@given(st.floats(0.0, 2.0), st.floats(0.002, 0.6), st.floats(0.0, 19.8))
def test_the_words_are_what_their_chances_say(end: float, std: float, bit: float) -> None:
    """Each word against its definition by non-central chi-square."""
    found = judge_hole(known(end, bit=bit, std=std))
    now = chance(end, std)
    corrected = chance(end, std, LIMIT + 0.5 * CURVATURE * (LENGTH - bit) ** 2)
    if now > 0.9501:
        assert found.word is Word.ON_TARGET
    elif now < 0.9499:
        assert found.word is not Word.ON_TARGET
        assert (found.word is Word.OUT) == (corrected < 0.5) or abs(corrected - 0.5) < 1e-4
        late = corrected < 0.9499
        more_out_than_in = now < 0.4999 and chance(0.0, std) > 0.5001
        if corrected > 0.5001 and (late or more_out_than_in):
            assert found.word is Word.STEER


def test_the_line_of_a_hole_that_is_to_be_steered() -> None:
    """38 cm and 12 cm of 95 %: the numbers of the line are those of the normal that was given."""
    facts = known(38.0 / 45.0, std=0.12 / 1.96, bit=10.0)
    assert chance(38.0 / 45.0, 0.12 / 1.96) == pytest.approx(0.857, abs=0.0005)
    assert verdict_line(judge_hole(facts)) == (
        "WATCH: ends 38 ± 12 cm (95 %) at 253 deg WSW; within 45 cm: 86 %; act before 17.2 m"
    )
    late = judge_hole(known(38.0 / 45.0, std=0.12 / 1.96, bit=17.5))
    assert verdict_line(late) == "STEER: ends 38 ± 12 cm (95 %) at 253 deg WSW; within 45 cm: 86 %; act at once"


def test_a_deadline_that_was_missed_says_so_and_stays_where_it_was() -> None:
    """It never becomes another goal: the depth stays, and what can still be had is told beside it."""
    deadlines = []
    for bit in np.linspace(2.0, 19.5, 36):
        found = judge_hole(known(1.0, bit=float(bit), std=0.1))
        assert found.deadline is not None
        deadlines.append(found.deadline.before)
        assert found.deadline.is_missed == (bit > found.deadline.before)
        assert found.deadline.left == pytest.approx(found.deadline.before - bit)
        if found.deadline.is_missed and found.word is Word.STEER:
            facts = known(1.0, bit=float(bit), std=0.1)
            way = steering_view(found.about, found.deadline, facts)  # type: ignore[arg-type]
            assert way.missed
            told = todo_line(found, way)
            assert "at once: 95 % was to be had until" in told
            assert told.endswith(f"now {chance_text(0.01 * way.best_percent)} at best")
    assert max(deadlines) - min(deadlines) < 1e-9


@given(end=st.floats(0.5, 2.5), std=st.floats(0.005, 0.3), bit=st.floats(0.0, 19.5))
def test_a_correction_begun_in_time_makes_the_end_sure(end: float, std: float, bit: float) -> None:
    """Bent back from the deadline on, nearer by what that moves, it ends within by just 95 %; and so does ``best``."""
    found = judge_hole(known(end, bit=bit, std=std))
    if found.deadline is None:
        assert chance(end, std) > 0.9499
        return
    moved = 0.5 * CURVATURE * (LENGTH - found.deadline.before) ** 2
    assert chance(end, std, LIMIT + moved) == pytest.approx(0.95, abs=1e-5)
    from_now = 0.5 * CURVATURE * (LENGTH - bit) ** 2
    assert found.deadline.best == pytest.approx(chance(end, std, LIMIT + from_now), abs=1e-5)


@pytest.mark.parametrize(
    ("end", "std", "word", "line"),
    [
        (0.3, 0.002, Word.ON_TARGET, "ON TARGET: ended 13.5 ± 0.4 cm (95 %) at 253 deg WSW; within 45 cm: > 99 %"),
        (0.95, 0.03, Word.WATCH, "WATCH: ended 42.8 ± 5.9 cm (95 %) at 253 deg WSW; within 45 cm: 76 %"),
        (1.05, 0.03, Word.OUT, "OUT: ended 47.2 ± 5.9 cm (95 %) at 253 deg WSW; within 45 cm: 22 %"),
    ],
)
def test_at_its_depth_nothing_is_advised(end: float, std: float, word: Word, line: str) -> None:
    facts = Known(LENGTH, CURVATURE, STOP, LENGTH, off(0.1), ending(end, std, is_reached=True))
    found = judge_hole(facts)
    assert (found.word, found.deadline, verdict_line(found)) == (word, None, line)
    assert todo_line(found, None) == "the hole is at its depth: nothing is left to steer"


@pytest.mark.parametrize(
    ("unfound", "reached", "word", "told"),
    [
        (0.02, True, Word.ON_TARGET, False),  # less than a tenth of the limit of 45 cm
        (0.10, True, Word.ON_TARGET, True),  # 13.5 and 10 cm are within
        (0.32, True, Word.WATCH, True),  # 13.5 and 32 cm are not
        (0.32, False, Word.ON_TARGET, True),  # further on the next survey shows it in time
    ],
)
def test_what_one_look_alone_may_hide_at_the_toe_is_told_and_counts_at_the_end(
    unfound: float, reached: bool, word: Word, told: bool
) -> None:
    bit = LENGTH if reached else 12.0
    facts = Known(LENGTH, CURVATURE, STOP, bit, off(0.1), ending(0.3, 0.002, is_reached=reached), (), unfound)
    found = judge_hole(facts)
    assert found.word is word
    said = (
        f"one tube alone has read the last station: were it wrong there, the toe would be up to {100 * unfound:.1f} cm"
    )
    assert any(why.startswith(said) for why in found.why) is told
    assert found.why[0].startswith("within 45 cm: ")


@pytest.mark.parametrize(
    ("unfound", "drift", "reached", "word", "told"),
    [
        (0.0, 0.044, True, Word.ON_TARGET, False),
        (0.0, 0.046, True, Word.ON_TARGET, True),
        (0.0, 0.31, True, Word.ON_TARGET, True),
        (0.0, 0.32, True, Word.WATCH, True),
        (0.0, 0.32, False, Word.ON_TARGET, True),
        (0.3, 0.3, True, Word.ON_TARGET, True),  # one of both at a time
        (0.3, 0.32, True, Word.WATCH, True),
    ],
)
def test_what_a_belt_may_do_unfound_is_told_and_counts_at_the_end(
    unfound: float, drift: float, reached: bool, word: Word, told: bool
) -> None:
    """The hole ends 13.5 cm off where 45 cm are allowed."""
    bit = LENGTH if reached else 12.0
    facts = Known(LENGTH, CURVATURE, STOP, bit, off(0.1), ending(0.3, 0.002, is_reached=reached), (), unfound, drift)
    found = judge_hole(facts)
    assert found.word is word
    said = "a belt of the encoder that slips a little at every stop, too little to be found, would have the toe up to "
    assert any(why.startswith(f"{said}{100 * drift:.1f} cm off") for why in found.why) is told


def test_a_bit_at_the_end_is_not_steered_although_its_survey_is_to_come() -> None:
    found = judge_hole(known(0.95, bit=LENGTH, std=0.1))
    assert (found.word, found.deadline) == (Word.WATCH, None)


def test_a_hole_that_cannot_be_brought_back_is_out_before_it_is_outside() -> None:
    facts = known(1.5, bit=18.0)
    assert judge_hole(facts).word is Word.OUT
    assert judge_hole(facts).why[0] == "within 45 cm: 0 %; 95 % was to be had until 12.8 m, now 0 % at best"
    assert judge_hole(known(1.5, bit=2.0)).word is Word.STEER


def test_a_hole_that_does_not_come_to_its_depth_is_out() -> None:
    found = judge_hole(Known(LENGTH, CURVATURE, STOP, 12.0, off(0.1), ending(0.1, comes_there=False)))
    assert (found.word, found.by_surveys) == (Word.OUT, Word.OUT)


def test_surveys_too_uncertain_to_tell_are_not_on_target() -> None:
    """What the ground may still do is a chance; what the surveys leave open is not known."""
    facts = Known(LENGTH, CURVATURE, STOP, 12.0, off(0.1, 12.0), ending(0.2, std=0.3, surveyed=0.23))
    assert judge_hole(facts).word is Word.DONT_KNOW
    assert judge_hole(facts).doubts == (VerdictDoubt.UNCERTAIN,)
    assert judge_hole(facts).why == ("the surveys leave the end open by ±46 cm, the limit is 45 cm",)
    nearly = Known(LENGTH, CURVATURE, STOP, 10.0, off(0.1, 10.0), ending(0.45, std=0.25, surveyed=0.15))
    assert judge_hole(nearly).word is Word.WATCH


@pytest.mark.parametrize(
    ("used", "surveyed", "word"),
    [
        (0.2, 3.6, Word.DONT_KNOW),  # 9 cm off, and open by metres: it is in by less than one in a hundred, and not out
        (5.0, 1.2, Word.DONT_KNOW),
        (50.0, 1.2, Word.OUT),  # out however far it is open
    ],
)
def test_an_end_that_is_wide_open_is_out_only_where_all_of_it_is(used: float, surveyed: float, word: Word) -> None:
    end = ending(used, surveyed, surveyed, is_reached=True)
    found = judge_hole(Known(LENGTH, CURVATURE, STOP, LENGTH, off(0.1), end))
    assert (found.word, found.by_surveys) == (word, Word.OUT)
    assert found.doubts == ((VerdictDoubt.UNCERTAIN,) if word is Word.DONT_KNOW else ())


@given(
    worst=st.floats(0.0, 3.0),
    end=st.floats(0.0, 3.0),
    std=st.floats(1e-4, 1.0),
    surveyed=st.floats(1e-4, 1.0),
    bit=st.none() | st.floats(0.0, LENGTH),
    doubts=st.lists(st.sampled_from(list(VerdictDoubt)), max_size=3),
)
def test_it_is_never_green_on_what_is_doubtful_and_never_better_than_its_chance(
    worst: float, end: float, std: float, surveyed: float, bit: float | None, doubts: list[VerdictDoubt]
) -> None:
    told = tuple((doubt, doubt.value) for doubt in doubts)
    facts = Known(LENGTH, CURVATURE, STOP, bit, off(worst, 10.0, std=std), ending(end, std, surveyed), told)
    found = judge_hole(facts)
    if doubts:
        assert found.word is Word.DONT_KNOW
        assert found.why[: len(doubts)] == tuple(d.value for d in doubts)
    if found.word is Word.ON_TARGET:
        assert worst < 0.5
        assert chance(end, std) > 0.9499
        assert 2.0 * surveyed < LIMIT
    if worst >= 1.001:
        assert found.by_surveys is Word.OUT
    assert verdict_line(found)


@pytest.mark.parametrize(
    ("of", "text"),
    [(0.0, "0 %"), (0.004, "< 1 %"), (0.12, "12 %"), (0.99, "99 %"), (0.996, "> 99 %"), (1.0, "100 %")],
)
def test_a_chance_is_never_told_as_certain(of: float, text: str) -> None:
    assert chance_text(of) == text


def test_a_depth_above_the_collar_is_told_as_none() -> None:
    found = judge_hole(known(9.0, bit=4.0, std=0.1))
    assert found.why == ("within 45 cm: < 1 %; 95 % was never to be had, now < 1 % at best",)


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


def test_rows_of_sizes_that_only_rounding_parts_stay_as_they_stand() -> None:
    third = 1.0 / 3.0
    rows = [("joint", third), ("mount", math.nextafter(third, 1.0)), ("north", 0.4), ("bias", 0.0), ("play", 0.333334)]
    found = sorted(rows, key=lambda row: largest_first(row[1]))
    assert [name for name, _ in found] == ["north", "play", "joint", "mount", "bias"]


def test_a_ground_station_that_knows_nothing_says_so(tmp_path: Path) -> None:
    answer = shown_on(RigModel.begin(GroundConfig(folder=tmp_path)), "verdict")
    check_answer(answer, fields_of_answer(VerdictAnswer))
    assert answer["verdict"] == "dont_know"
    assert answer["doubts"] == ["no_survey", "setup", "clock", "depth", "stale"]
    assert answer["line"] == "DON'T KNOW: no station has been surveyed yet"


def test_a_verdict_without_a_deviation_has_a_line() -> None:
    nothing = Known(LENGTH, CURVATURE, STOP)
    assert judge_hole(nothing) == HoleVerdict(
        Word.DONT_KNOW, Word.DONT_KNOW, ("no station has been surveyed yet",), (VerdictDoubt.NO_SURVEY,)
    )
