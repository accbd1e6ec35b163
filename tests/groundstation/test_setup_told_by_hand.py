"""Orders of the setup, what is kept of them, and its priors: rules written out, each bound at its value."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_setup_by_hand import DEG, K, book_of, told

from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_items import SetupItem, setup_items
from groundstation.service.setup.setup_orders import SetupOrders
from groundstation.service.setup.setup_priors import (
    collar_direction,
    depth_errors,
    length_stds,
    north_std,
    setup_priors,
)
from groundstation.service.setup.told_value import (
    DRIVE,
    DamagedSetupError,
    SetupKind,
    SetupSource,
    ToldValue,
    item_name,
    joint_subject,
    shown_value,
    told_of_text,
    told_to_text,
)
from telemetry.application.commands import COMMANDS
from telemetry.messages import UNKNOWN_YAW_STD, NodeFlag

# values as they are told, kept and shown


def test_a_told_value_comes_back_from_its_text_with_every_part() -> None:
    for one in (
        told(3, K.JOINT, "drive-4", 0.5, sigma=0.25, used=0.125), told(4, K.COLLAR, "", 0.1, 0.2),
        told(5, K.NORTH, "", sigma=0.5, takes_back=3), told(6, K.STICK_UP, "", 0.75, checks=True),
        told(7, K.DOUBLED, "200", 1.0, 2.5, 3.0, 4.0),
    ):  # fmt: skip
        again = told_of_text(told_to_text(one))
        assert again == one
        assert isinstance(again.values, tuple)
        assert isinstance(again.kind, SetupKind)


@pytest.mark.parametrize(
    ("kind", "subject", "is_one"),
    [
        (K.NORTH, "", True), (K.NORTH, "3", False), (K.JOINT, "4-3", True), (K.JOINT, "drive-250", True),
        (K.JOINT, "4-drive", False), (K.JOINT, "1234-3", False), (K.JOINT, "4-3 ", False), (K.JOINT, "", False),
        (K.LENGTH, "250", True), (K.LENGTH, "2500", False), (K.LENGTH, "", False), (K.LENGTH, "-3", False),
        (K.DOUBLED, "7", True), (K.DOUBLED, "", False), (K.SAME_NUMBER, "12", True), (K.SAME_NUMBER, "a", False),
    ],
)  # fmt: skip
def test_a_text_names_a_subject_of_its_kind(kind: SetupKind, subject: str, is_one: bool) -> None:
    text = told_to_text(told(1, kind, subject, 0.5))
    if is_one:
        assert told_of_text(text).subject == subject
        return
    with pytest.raises(DamagedSetupError, match="expected a value of the setup, got"):
        told_of_text(text)


@pytest.mark.parametrize("place", ["values", "sigma", "used"])
@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_text_with_a_number_that_is_none_is_damaged(place: str, number: float) -> None:
    whole: dict[str, Any] = {"values": (0.5, 0.25), "sigma": 0.1, "used": 0.2}
    whole[place] = (0.5, number) if place == "values" else number
    one = ToldValue(1, K.COLLAR, "", by="anna", utc="", **whole)
    with pytest.raises(DamagedSetupError, match="expected finite numbers"):
        told_of_text(told_to_text(one))


def test_a_text_that_tells_nothing_and_takes_nothing_back_is_damaged() -> None:
    with pytest.raises(DamagedSetupError):
        told_of_text(told_to_text(told(1, K.NORTH, "")))
    for text in ("[]", "{}", "x", '{"kind": "north"}', told_to_text(told(1, K.NORTH, "", 1.0)).replace("north", "so")):
        with pytest.raises(DamagedSetupError):
            told_of_text(text)


def test_values_are_shown_with_their_unit_and_names_with_their_subject() -> None:
    assert shown_value(told(1, K.NORTH, "", 12.5 * DEG, sigma=0.25 * DEG)) == "12.5 ± 0.25 deg"
    assert shown_value(told(1, K.COLLAR, "", 3.0 * DEG, 40.0 * DEG, sigma=0.5 * DEG)) == "3 to 40 ± 0.5 deg"
    for kind in (K.LENGTH, K.STICK_UP):
        assert shown_value(told(1, kind, "", 1.25, sigma=0.002)) == "1.25 ± 0.002 m"
    shown = [shown_value(told(1, K.SAME_NUMBER, "4", which)) for which in (1.0, 0.0)]
    assert shown == ["the upper of both", "the lower of both"]
    assert [item_name(K.LENGTH, 0), item_name(K.NORTH)] == ["length.0", "north"]
    assert [joint_subject(4, 3), joint_subject(DRIVE, 12)] == ["4-3", "drive-12"]
    assert told(1, K.NORTH, "", 1.0, checks=True).name == "north.check"
    corrections = [told(1, K.JOINT, "4-3", 0.5, used=used).correction for used in (None, 0.0, 0.125)]
    assert corrections == [0.5, 0.5, 0.375]


# orders


class Desk:
    """Orders of a rig of tubes 5, 4 and 3, of which a test says what each node was told."""

    def __init__(self, folder: Path, *, surveys: int = 0, doubt: str = "") -> None:
        self.book, self.done = book_of(folder), list[str]()
        self.surveys, self.doubt, self.refuses = surveys, doubt, False
        self.orders = SetupOrders(self.book, self, lambda: [5, 4, 3], self.follow, self.check)

    def keep_told(self, entry: ToldValue) -> None:
        if self.refuses:
            raise OSError("full")
        assert entry not in self.book.entries  # kept before it is entered
        self.done.append(f"kept {entry.number}")

    def follow(self) -> int:
        self.done.append(f"followed {len(self.book.entries)}")
        return self.surveys

    def check(self) -> str:
        self.done.append("collar")
        return self.doubt

    def obey(self, name: str, action: str = "tell", tube: int | None = None, **arguments: Any) -> str:
        spec = next(one for one in COMMANDS if one.name == name and one.action in (action, ""))
        order: Any = SimpleNamespace(spec=spec, tube=tube, arguments=arguments, by="ben", utc="noon")
        return self.orders.obey(order)


def test_what_is_told_is_kept_entered_and_followed_in_this_order_and_told_back(tmp_path: Path) -> None:
    desk = Desk(tmp_path, surveys=7)
    assert desk.obey("north", angle=12.0 * DEG, sigma=0.5 * DEG) == (
        "north is 12 ± 0.5 deg; 7 surveys were adjusted to it"
    )  # fmt: skip
    assert desk.done == ["kept 1", "followed 1"]
    desk.surveys = 0
    assert desk.obey("north", angle=12.0 * DEG, sigma=0.5 * DEG) == "north is 12 ± 0.5 deg"  # the same is no change
    again = desk.obey("north", angle=12.0 * DEG, sigma=1.0 * DEG)
    assert again == "north is 12 ± 1 deg; before it was 12 ± 0.5 deg by ben, which is kept too"
    again = desk.obey("north", angle=13.0 * DEG, sigma=1.0 * DEG)
    assert again == "north is 13 ± 1 deg; before it was 12 ± 1 deg by ben, which is kept too"
    assert [one.values[0] / DEG for one in desk.book.entries] == pytest.approx([12.0, 12.0, 12.0, 13.0])
    assert {(one.by, one.utc) for one in desk.book.entries} == {("ben", "noon")}
    desk.refuses = True
    with pytest.raises(OSError, match="full"):
        desk.obey("north", angle=1.0, sigma=1.0)
    assert len(desk.book.entries) == 4
    assert desk.book.north == pytest.approx(13.0 * DEG)


def test_only_a_collar_is_looked_at_beside_the_first_station(tmp_path: Path) -> None:
    desk = Desk(tmp_path, doubt="the first station leans the other way")
    said = desk.obey("collar", inclination=3.0 * DEG, azimuth=40.0 * DEG, sigma=0.5 * DEG)
    assert said == "collar is 3 to 40 ± 0.5 deg; the first station leans the other way"
    assert desk.book.entries[0].values == (3.0 * DEG, 40.0 * DEG)
    assert "leans" not in desk.obey("stick_up", height=0.5, sigma=0.01)
    assert desk.obey("length", tube=4, length=2.5, sigma=0.001) == "length.4 is 2.5 ± 0.001 m"
    assert desk.done.count("collar") == 1


def test_a_check_is_entered_beside_what_was_told_and_told_back_whether_it_bears_it_out(tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    with pytest.raises(SelectorError, match="stick_up: expected it to be told before it is checked: action=tell"):
        desk.obey("stick_up", "check", height=0.5, sigma=0.01)
    desk.obey("stick_up", height=0.5, sigma=0.01)
    said = desk.obey("stick_up", "check", height=0.51, sigma=0.02)
    assert said == "the check of stick_up is 0.51 ± 0.02 m; it bears out what was told"
    assert desk.book.stick_up == 0.5
    said = desk.obey("stick_up", "check", height=0.75, sigma=0.02)
    assert said.startswith("the check of stick_up is 0.75 ± 0.02 m; stick-up is told as 0.5 ± 0.01 m and checked as")
    assert said.endswith("one of the two is wrong; tell it again, or take the check back")
    assert desk.obey("setup", "undo") == "the check of stick_up is taken back"
    check = desk.book.check_of(K.STICK_UP)
    assert check is not None
    assert check.values == (0.51,)  # the one before it stands again


def test_entries_are_taken_back_one_after_the_other_from_the_newest_on(tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    desk.obey("north", angle=12.0 * DEG, sigma=0.5 * DEG)
    desk.obey("length", tube=4, length=2.5, sigma=0.001)
    said = [desk.obey("setup", "undo") for _ in range(2)]
    assert said == ["length.4 is taken back", "north is taken back"]
    assert [one.takes_back for one in desk.book.entries] == [0, 0, 2, 1]
    assert [one.sigma for one in desk.book.entries[2:]] == [0.001, 0.5 * DEG]
    with pytest.raises(SelectorError, match="there is nothing to take back"):
        desk.obey("setup", "undo")
    assert len(desk.done) == 8


def test_a_joint_is_that_above_its_tube_and_its_node_has_spoken(tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    refusals: list[tuple[dict[str, Any], str]] = [
        ({"tube": 4}, "joint 5-4: expected a tube that has spoken, tube 5 has not said which angles it was told"),
        ({"tube": 5}, "joint drive-5: expected a tube that has spoken, tube 5 has not hung from the drive head"),
        ({"tube": 4, "upper": 3}, "joint 3-4: expected joint 5-4 above tube 4, or upper=0 for the drive head"),
        ({"tube": 77, "upper": 5}, "joint 5-77: expected joint drive-77 above tube 77, or upper=0"),
    ]
    for arguments, told_back in refusals:
        with pytest.raises(SelectorError, match=told_back):
            desk.obey("joint", angle=0.5, sigma=0.01, **arguments)
    assert (desk.book.entries, desk.done) == ([], [])
    desk.book.on_flags(5, 1, NodeFlag.LOWER_UNTOLD | NodeFlag.DRIVE_UNTOLD)
    desk.book.on_flags(4, 2, NodeFlag.NONE)
    with pytest.raises(SelectorError, match="the node of tube 5 was told no angle; expected no used_deg"):
        desk.obey("joint", tube=4, angle=0.5, sigma=0.01, used=0.25)
    with pytest.raises(SelectorError, match="the node of tube 4 was told its angle, which is in every yaw below"):
        desk.obey("joint", tube=3, angle=0.5, sigma=0.01)
    desk.obey("joint", tube=4, angle=0.5, sigma=0.01)
    desk.obey("joint", tube=3, angle=0.75, sigma=0.02, used=0.25)
    desk.obey("joint", tube=5, angle=0.125, sigma=0.03)
    desk.obey("joint", tube=5, upper=0, angle=0.25, sigma=0.03)
    subjects = [(one.subject, one.used, one.values[0]) for one in desk.book.entries]
    assert subjects == [("5-4", None, 0.5), ("4-3", 0.25, 0.75), ("drive-5", None, 0.125), ("drive-5", None, 0.25)]


def test_which_of_two_of_one_number_is_told_of_those_that_are_doubled_alone(tmp_path: Path) -> None:
    desk = Desk(tmp_path)
    with pytest.raises(SelectorError, match="same_number: tube 4: expected a number that two tubes give themselves"):
        desk.obey("same_number", tube=4, which="upper")
    desk.book.add([told(1, K.DOUBLED, "4", 1.0, 50.0, 2.0, 5.0)])
    for which, shown in (("upper", "the upper of both"), ("lower", "the lower of both")):
        said = desk.obey("same_number", tube=4, which=which)
        assert said.startswith(f"same_number.4 is {shown}")
        assert desk.book.doubled.is_upper == {4: which == "upper"}


# priors


def test_priors_have_each_value_and_the_sigma_that_counts(tmp_path: Path) -> None:
    config = GroundConfig(folder=tmp_path, depth_offset_std=0.02)
    book = SetupBook(config)
    assert north_std(book) == UNKNOWN_YAW_STD
    assert depth_errors(config, book).offset_std == 0.1  # of an untold stick-up, though depths err by less
    assert depth_errors(GroundConfig(folder=tmp_path, depth_offset_std=0.3), book).offset_std == 0.3
    book.add([told(1, K.NORTH, "", 0.1, sigma=0.02), told(2, K.STICK_UP, "", 0.1, sigma=0.003)])
    book.add([told(3, K.LENGTH, "4", 3.0, sigma=0.004), told(4, K.LENGTH, "3", 3.0, sigma=0.005)])
    assert (north_std(book), depth_errors(config, book).offset_std) == (0.02, 0.003)
    assert depth_errors(config, book).scale_std == config.depth_errors.scale_std
    assert length_stds(book) == {4: 0.004, 3: 0.005}
    book.add(
        [told(5, K.NORTH, "", 0.1, sigma=0.05, checks=True), told(6, K.STICK_UP, "", 0.1, sigma=0.001, checks=True)]
    )
    assert (north_std(book), depth_errors(config, book).offset_std) == (0.05, 0.003)
    item = SetupItem(K.MOUNT, "3", (0.1, 0.2), 0.3, "rad", SetupSource.MEASURED, "")
    other = SetupItem(K.LENGTH, "4", (2.0,), 0.5, "m", SetupSource.DESIGN, "")
    found = setup_priors([item, other], 9)
    assert (found.version, list(found.by_name)) == (9, ["mount.3", "length.4"])
    rows = [(one.kind, one.subject, one.mean, one.sigma, one.is_told) for one in found.by_name.values()]
    assert rows == [(K.MOUNT, "3", (0.1, 0.2), 0.3, True), (K.LENGTH, "4", (2.0,), 0.5, False)]


def test_a_collar_is_that_of_the_design_within_a_degree_until_it_is_told(tmp_path: Path) -> None:
    config = GroundConfig(folder=tmp_path)
    book = SetupBook(config)
    assert collar_direction(config, book).cov == pytest.approx(DEG**2 * np.eye(2))
    leaning: Any = SimpleNamespace(design=SimpleNamespace(inclination=0.25, azimuth=1.5))
    designed = collar_direction(leaning, book)
    assert designed.lean == pytest.approx([math.sin(0.25) * math.cos(1.5), math.sin(0.25) * math.sin(1.5)])
    assert np.trace(designed.cov) == pytest.approx(DEG**2 * (1.0 + math.cos(0.25) ** 2))
    book.add([told(1, K.COLLAR, "", 0.5, 1.2, sigma=0.01)])
    found = collar_direction(config, book)
    assert found.lean == pytest.approx([math.sin(0.5) * math.cos(1.2), math.sin(0.5) * math.sin(1.2)])
    along, across = np.array([math.cos(1.2), math.sin(1.2)]), np.array([-math.sin(1.2), math.cos(1.2)])
    assert along @ found.cov @ along == pytest.approx((0.01 * math.cos(0.5)) ** 2)
    assert across @ found.cov @ across == pytest.approx(0.01**2)
    assert along @ found.cov @ across == pytest.approx(0.0, abs=1e-12)


def test_an_item_that_is_checked_has_the_worse_sigma_the_words_and_the_smallest_slip(tmp_path: Path) -> None:
    config = GroundConfig(folder=tmp_path)
    book, string = SetupBook(config), SimpleNamespace(tubes=[], states=SimpleNamespace(newest={}))

    def north() -> SetupItem:
        return setup_items(config, book, string)[0]  # type: ignore[arg-type]

    assert (north().is_missing, north().check, north().is_unchecked, north().least_slip) == (True, "", False, None)
    book.add([told(1, K.NORTH, "", 0.1, sigma=0.03)])
    assert (north().is_missing, north().sigma, north().is_unchecked, north().least_slip) == (False, 0.03, True, None)
    assert north().check == "not checked: a second bearing is"
    book.add([told(2, K.NORTH, "", 0.12, sigma=0.04, checks=True)])
    assert (north().sigma, north().is_unchecked) == (0.04, False)
    assert north().least_slip == pytest.approx(3.5 * 0.05)
    assert north().check.startswith("checked by ")
    book.add([told(3, K.COLLAR, "", 0.1, 0.2, sigma=0.03)])
    collar = setup_items(config, book, string)[1]  # type: ignore[arg-type]
    assert (collar.check, collar.least_slip, collar.is_needed, collar.sigma) == ("", None, False, 0.03)
