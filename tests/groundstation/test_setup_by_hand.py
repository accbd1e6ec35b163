"""The setup by hand: each rule of it written out with unequal numbers, each bound at its value, each order twice."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from groundstation.config import GroundConfig
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_checks import (
    APART,
    STICK_UP_STD,
    contradicted_kinds,
    counted_std,
    is_unchecked,
    least_slip,
    say_check,
    say_contradiction,
    say_unchecked,
    slip_between,
    unchecked_kinds,
)
from groundstation.service.setup.setup_correction import chain_of, corrected_measurement, depth_shift
from groundstation.service.setup.setup_items import JOINT_STD
from groundstation.service.setup.told_value import (
    DRIVE,
    SetupKind,
    ToldValue,
    shown_value,
)
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement

DEG = math.pi / 180.0
K = SetupKind
COV = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))


def book_of(folder: Path, **settings: Any) -> SetupBook:
    return SetupBook(GroundConfig(folder=folder, **settings))


def told(number: int, kind: SetupKind, subject: str, *values: float, sigma: float = 0.1, **more: Any) -> ToldValue:
    return ToldValue(number, kind, subject, values, sigma, "anna", f"at {number}", **more)


# the book


def test_the_newest_entry_that_was_not_taken_back_stands_and_all_are_kept(tmp_path: Path) -> None:
    book = book_of(tmp_path, north_std_deg=2.0, north_deg=7.0)
    assert (book.next_number(), book.newest()) == (1, None)
    assert book.north == pytest.approx(7.0 * DEG)
    for number, values in ((1, 0.5), (2, 0.6)):
        book.add([told(number, K.NORTH, "", values)])
        newest = book.newest()
        assert newest is not None
        assert (book.north, newest.number, book.next_number()) == (values, number, number + 1)
    book.add([told(3, K.LENGTH, "4", 3.1), told(4, K.NORTH, "", sigma=0.2, takes_back=2)])
    assert (book.north, book.told_before("north"), book.told_before("length.4")) == (0.5, 2, 1)
    newest = book.newest()
    assert newest is not None
    assert newest.number == 3  # the one that was taken back, and what took it back, are not
    book.add([told(5, K.DOUBLED, "4", 1.0, 50.0, 2.0, 5.0)])
    newest = book.newest()
    assert newest is not None
    assert newest.number == 3  # what was found is not taken back
    book.add([told(6, K.LENGTH, "4", takes_back=3), told(7, K.NORTH, "", takes_back=1)])
    assert (book.newest(), book.lengths, book.moves_depths) == (None, {}, False)
    assert book.north == pytest.approx(7.0 * DEG)  # what the configuration tells stands again
    assert (book.version, book.revision, len(book.entries)) == (5, 5, 7)


def test_lengths_or_a_stick_up_move_depths_and_each_stands_by_its_tube(tmp_path: Path) -> None:
    book = book_of(tmp_path)
    for entries, moves in (
        ([told(1, K.STICK_UP, "", 0.0)], False), ([told(2, K.STICK_UP, "", 0.25)], True),
        ([told(3, K.STICK_UP, "", takes_back=2)], False), ([told(4, K.LENGTH, "12", 3.0)], True),
    ):  # fmt: skip
        book.add(entries)
        assert book.moves_depths == moves
    book.add([told(5, K.LENGTH, "3", 2.5), told(6, K.JOINT, "4-3", 1.5), told(7, K.JOINT, "drive-4", 0.25)])
    assert {tube: one.values for tube, one in book.lengths.items()} == {12: (3.0,), 3: (2.5,)}
    assert {pair: one.values for pair, one in book.joints.items()} == {(4, 3): (1.5,), (DRIVE, 4): (0.25,)}


def test_what_a_node_says_of_its_joints_is_of_the_one_below_and_at_the_top_of_the_drive(tmp_path: Path) -> None:
    book = book_of(tmp_path)
    lower, drive = NodeFlag.LOWER_UNTOLD, NodeFlag.DRIVE_UNTOLD
    assert (book.node_knows((4, 3)), book.was_untold((4, 3))) == (None, True)
    for flags, knows in ((lower, False), (NodeFlag.NONE, True), (lower | drive, False)):
        for _ in range(2):
            book.on_flags(4, 2, flags)
            assert (book.node_knows((4, 3)), book.node_knows((DRIVE, 4))) == (knows, None)
    assert book.revision == 3  # what is said again is no news
    book.on_flags(4, 1, drive)
    assert (book.node_knows((4, 3)), book.node_knows((DRIVE, 4)), book.was_untold((DRIVE, 4))) == (True, False, True)
    book.on_flags(5, 1, NodeFlag.NONE)
    assert (book.was_untold((DRIVE, 5)), book.was_untold((5, 4))) == (False, False)
    assert (book.revision, book.version) == (5, 0)
    book.add([told(1, K.JOINT, "5-4", 0.5)])
    before = book.version
    for flags in (lower, lower, NodeFlag.NONE):
        book.on_flags(5, 1, flags)
    assert book.version == before + 2  # where an angle stands it matters what the node knows of it
    assert book.joints_of([6, 5, 4, 3]) == [(DRIVE, 6), (DRIVE, 5), (DRIVE, 4), (6, 5), (5, 4), (4, 3)]
    assert book.joints_of([]) == []
    other = book_of(tmp_path)
    for flags in (lower, NodeFlag.NONE):
        other.on_flags(4, 1, flags)
        assert (other.was_untold((4, 3)), other.was_untold((DRIVE, 4))) == (True, False)
    for flags in (drive, NodeFlag.NONE):
        other.on_flags(7, 1, flags)
        assert (other.was_untold((7, 6)), other.was_untold((DRIVE, 7))) == (False, True)


def test_everything_that_the_configuration_tells_has_its_own_numbers(tmp_path: Path) -> None:
    book = book_of(
        tmp_path, north_deg=11.0, north_std_deg=0.5, collar_inclination_deg=3.0, collar_azimuth_deg=40.0,
        collar_std_deg=0.25, stick_up_m=0.75, stick_up_std_m=0.02, north_check_deg=12.0, north_check_std_deg=0.6,
        stick_up_check_m=0.8, stick_up_check_std_m=0.03, joints=(("4-3", 31.0, 0.1), ("drive-4", 17.0, 0.2)),
    )  # fmt: skip
    assert {name: (*one.values, one.sigma) for name, one in book._standing.items()} == {
        "north": pytest.approx((11.0 * DEG, 0.5 * DEG)), "north.check": pytest.approx((12.0 * DEG, 0.6 * DEG)),
        "collar": pytest.approx((3.0 * DEG, 40.0 * DEG, 0.25 * DEG)), "stick_up": (0.75, 0.02),
        "stick_up.check": (0.8, 0.03), "joint.4-3": pytest.approx((31.0 * DEG, 0.1 * DEG)),
        "joint.drive-4": pytest.approx((17.0 * DEG, 0.2 * DEG)),
    }  # fmt: skip
    assert {(one.number, one.by, one.utc, one.checks) for one in book._standing.values() if not one.checks} == {
        (0, "configuration", "", False)
    }
    half = book_of(tmp_path, north_deg=11.0, north_std_deg=0.5, collar_std_deg=0.25)
    assert set(half._standing) == {"north", "collar"}
    assert half._standing["collar"].values == (0.0, 0.0)


# checks


@pytest.mark.parametrize(("kind", "subject"), [(K.NORTH, ""), (K.STICK_UP, "")])
def test_a_check_contradicts_beyond_exactly_what_both_may_err_by(tmp_path: Path, kind: SetupKind, subject: str) -> None:
    one, s, t = 0.03, 0.012, 0.005  # sigmas that make 0.013
    limit = 3.5 * 0.013
    assert limit == pytest.approx(APART * math.hypot(s, t))
    for off, contradicts in ((0.0, False), (limit - 1e-9, False), (limit + 1e-9, True), (-limit - 1e-9, True)):
        book = book_of(tmp_path)
        book.add([told(1, kind, subject, one, sigma=s)])
        assert unchecked_kinds(book) == [kind]
        assert counted_std(book, told(1, kind, subject, one, sigma=s)) == s
        book.add([told(2, kind, subject, one + off, sigma=t, checks=True)])
        assert (unchecked_kinds(book), is_unchecked(book, kind)) == ([], False)
        assert contradicted_kinds(book) == ([kind] if contradicts else [])
        standing, check = book.standing(kind), book.check_of(kind)
        assert standing is not None
        assert check is not None
        assert slip_between(standing, check) == pytest.approx(abs(off))
        assert least_slip(standing, check) == pytest.approx(limit)
        words = say_check(book, kind)
        assert words.startswith("contradicted by " if contradicts else "checked by ")
        assert words.endswith(" of anna")
        if contradicts:
            assert f", {abs(off) / 0.013:.0f} sigma apart: one of the two is wrong" in say_contradiction(book, kind)
            shown = [shown_value(standing), shown_value(check)]
            assert f"is told as {shown[0]} and checked as {shown[1]}" in say_contradiction(book, kind)
    assert counted_std(book, told(1, kind, subject, one, sigma=0.001)) == t  # as good as what checks it
    assert counted_std(book, told(1, K.COLLAR, "", one, sigma=0.001)) == 0.001


def test_of_angles_the_shorter_way_round_is_what_a_check_is_off_by() -> None:
    for one, other in ((359.0, 2.0), (2.0, 359.0), (-1.0, 362.0)):
        pair = told(1, K.NORTH, "", one * DEG), told(2, K.NORTH, "", other * DEG, checks=True)
        assert slip_between(*pair) == pytest.approx(3.0 * DEG)
    assert slip_between(told(1, K.STICK_UP, "", 7.0), told(2, K.STICK_UP, "", 0.5)) == 6.5


@pytest.mark.parametrize(("sigma", "needs"), [(STICK_UP_STD - 1e-9, True), (STICK_UP_STD, False)])
def test_a_stick_up_needs_a_check_where_it_is_told_better_than_an_untold_one(
    tmp_path: Path, sigma: float, needs: bool
) -> None:
    book = book_of(tmp_path)
    assert (say_check(book, K.STICK_UP), say_check(book, K.NORTH), unchecked_kinds(book)) == ("", "", [])
    book.add([told(1, K.STICK_UP, "", 0.5, sigma=sigma)])
    assert is_unchecked(book, K.STICK_UP) == needs
    assert say_check(book, K.STICK_UP) == ("not checked: the bit at the collar's edge is" if needs else "")
    book.add([told(2, K.COLLAR, "", 0.1, 0.2)])
    assert not is_unchecked(book, K.COLLAR)


def test_what_nothing_checks_is_said_of_one_and_of_two() -> None:
    assert say_unchecked([K.NORTH]) == "north was told once, check it by a second bearing"
    both = "north and stick-up were told once, check them by a second bearing, the bit at the collar's edge"
    assert say_unchecked([K.NORTH, K.STICK_UP]) == both


# corrections


def measured(tube: int, yaw: float, systematic: float) -> SurveyMeasurement:
    imus = (ImuMean((0.1, 0.0, -9.8), COV),)
    return SurveyMeasurement(tube, 1, 100.0, 1, imus, yaw, 1e-6, systematic, 32, 20.0, NodeFlag.NONE)


def test_a_measurement_is_turned_by_north_and_by_joints_and_stays_itself_where_nothing_was_told(tmp_path: Path) -> None:
    book = book_of(tmp_path)
    plain = measured(3, 6.0, 2e-6)
    assert corrected_measurement(plain, [4, 5], book) is plain
    book.add([told(1, K.NORTH, "", 0.5, sigma=0.3)])
    for above in (None, [4, 5], []):
        found = corrected_measurement(plain, above, book)
        assert found.yaw == pytest.approx(6.5 - math.tau)
        assert found.systematic_var == 2e-6  # what north errs by is alike in all
    book.add(
        [told(2, K.JOINT, "4-3", 1.0, sigma=0.02, used=0.75), told(3, K.JOINT, "drive-5", 0.1, sigma=0.01, used=0.0)]
    )
    found = corrected_measurement(plain, [4, 5], book)
    assert found.yaw == pytest.approx(6.0 + 0.5 + 0.25 + 0.1 - math.tau)
    assert found.systematic_var == pytest.approx(2e-6 + 0.02**2 + 0.01**2)
    assert corrected_measurement(plain, None, book).systematic_var == 2e-6
    assert corrected_measurement(measured(9, 6.0, 2e-6), [8], book).yaw == pytest.approx(6.5 - math.tau)
    assert chain_of(3, [4, 5]) == [(4, 3), (5, 4), (DRIVE, 5)]
    assert chain_of(3, []) == [(DRIVE, 3)]


@pytest.mark.parametrize(("share", "is_any"), [(0.499, False), (0.5, True), (1.25, True)])
def test_from_half_the_variance_of_any_yaw_on_an_angle_was_not_told(tmp_path: Path, share: float, is_any: bool) -> None:
    book = book_of(tmp_path)
    for tube, hops, flags in ((5, 1, NodeFlag.NONE), (4, 2, NodeFlag.LOWER_UNTOLD), (3, 3, NodeFlag.NONE)):
        book.on_flags(tube, hops, flags)
    var = share * UNKNOWN_YAW_VAR
    found = corrected_measurement(measured(3, 1.0, var), [4, 5], book)
    expected = max(var - UNKNOWN_YAW_VAR, 0.0) + 2 * JOINT_STD**2 + UNKNOWN_YAW_VAR if is_any else var
    assert found.systematic_var == pytest.approx(expected)
    assert found.yaw == 1.0


def test_a_node_is_deeper_by_what_tubes_below_it_are_shorter_and_higher_by_the_stick_up(tmp_path: Path) -> None:
    book = book_of(tmp_path)
    book.add([told(1, K.STICK_UP, "", 0.3)])
    assert depth_shift(5, [6, 5, 4, 3], 3.0, book) == -0.3
    book.add([told(n, K.LENGTH, str(tube), length) for n, tube, length in ((2, 6, 9.0), (3, 5, 8.0), (4, 4, 2.9))])
    book.add([told(5, K.LENGTH, "3", 3.25), told(6, K.LENGTH, "77", 1.0)])
    shifts = {6: -5.0 + 0.1 - 0.25, 5: 0.1 - 0.25, 4: -0.25, 3: 0.0, 99: 0.0}
    for tube, shift in shifts.items():
        assert depth_shift(tube, [6, 5, 4, 3], 3.0, book) == pytest.approx(shift - 0.3)
