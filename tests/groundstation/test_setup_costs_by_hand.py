"""What items of a setup cost at the toe, what is to be told next, and in which words: rules of unequal numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_setup_by_hand import DEG, K, book_of, told

from groundstation.service.setup import readiness
from groundstation.service.setup.setup_items import SetupItem, joint_item, missing_names
from groundstation.service.setup.setup_priors import (
    setup_priors,
)
from groundstation.service.setup.toe_costs import course_of, designed_course, toe_costs
from groundstation.service.setup.told_value import (
    DRIVE,
    SetupKind,
    SetupSource,
    item_name,
)
from telemetry.messages import UNKNOWN_YAW_STD, NodeFlag

# costs


def test_every_item_costs_what_its_rule_says_of_a_hole_of_unequal_legs() -> None:
    """Legs of 1, 4 and 3 m by two tubes; 8 m long, 2 m away from the collar."""
    positions = np.array([[0.0, 0.0, 0.0], [0.2, 0.1, 1.0], [0.7, 0.9, 4.9], [1.2, 1.6, 7.8]])
    trajectory: Any = SimpleNamespace(md=np.array([2.0, 3.0, 7.0, 10.0]), positions=positions)
    course = course_of(trajectory, 2)
    assert (course.length, course.closure, course.first_leg) == pytest.approx((8.0, 2.0, 1.0))
    assert (course.longest_leg, course.legs, course.tubes) == pytest.approx((4.0, 3, 2))
    s = 0.01
    expected = {
        (K.NORTH, ""): s * 2.0, (K.COLLAR, ""): s * 0.5, (K.MOUNT, "5"): s * 4.0, (K.MOUNT, "4"): s * 4.0,
        (K.MOUNT_TURN, "5"): s * 1.0, (K.ACCELEROMETER, "5"): s / 9.81 * 4.0, (K.LENGTH, "5"): s,
        (K.STICK_UP, ""): s, (K.DEPTH_SCALE, ""): s * 8.0, (K.PLAY, ""): s * 8.0 / math.sqrt(6.0),
        (K.PATH, ""): s * 16.0 / 8.0 * math.sqrt(3.0), (K.GRAVITY, ""): 0.0, (K.GYROSCOPE, "5"): 0.0,
        (K.JOINT, "drive-5"): s * 2.0, (K.JOINT, "drive-4"): s * 2.0 / 3.0, (K.JOINT, "9-8"): 0.0,
        (K.JOINT, "5-4"): s * math.hypot(0.5, 0.7), (K.JOINT, "drive-9"): 0.0,
    }  # fmt: skip
    items = [SetupItem(kind, subject, (), s, "", SetupSource.DEFAULT, "") for kind, subject in expected]
    found = toe_costs(setup_priors(items), trajectory)
    assert found == {item_name(*one): pytest.approx(cost) for one, cost in expected.items()}
    any_yaw = SetupItem(K.NORTH, "", (), 9.0, "rad", SetupSource.DEFAULT, "")
    assert toe_costs(setup_priors([any_yaw]), trajectory)["north"] == pytest.approx(2.0 * math.sqrt(2.0))
    one_leg: Any = SimpleNamespace(md=np.array([0.0, 5.0]), positions=positions[[0, 3]])
    collar = SetupItem(K.COLLAR, "", (), s, "rad", SetupSource.DEFAULT, "")
    assert toe_costs(setup_priors([collar]), one_leg)["collar"] == pytest.approx(s * 5.0)


@pytest.mark.parametrize(("length", "leg", "legs"), [(0.4, 2.0, 1), (2.9, 2.0, 1), (3.1, 2.0, 2), (20.0, 2.0, 10)])
def test_a_designed_hole_has_legs_of_about_the_length_that_is_asked_for(length: float, leg: float, legs: int) -> None:
    design: Any = SimpleNamespace(inclination=0.2, azimuth=1.0, length=length)
    drawn = designed_course(design, leg)
    assert list(drawn.md) == pytest.approx([length * k / legs for k in range(legs + 1)])
    assert drawn.positions[-1] == pytest.approx(
        [length * math.sin(0.2) * math.cos(1.0), length * math.sin(0.2) * math.sin(1.0), length * math.cos(0.2)]
    )


# what is to be told next

Make = Callable[..., SetupItem]


def item(kind: SetupKind, subject: str = "", source: SetupSource = SetupSource.DEFAULT, **more: Any) -> SetupItem:
    return SetupItem(kind, subject, (), 1.0, "", source, "", **more)


def test_what_is_missing_comes_before_what_is_unchecked_before_what_costs_most_across() -> None:
    joint, north = item(K.JOINT, "4-3", is_needed=True), item(K.NORTH, is_needed=True)
    unchecked = item(K.NORTH, source=SetupSource.TOLD, is_unchecked=True)
    length, mount, other = item(K.LENGTH, "4"), item(K.MOUNT, "4"), item(K.MOUNT, "3")
    costs = {"length.4": 9.0, "mount.4": 0.02, "mount.3": 0.03, "play": 5.0}
    everything = [length, mount, other, unchecked, item(K.PLAY), joint, north]
    steps = []
    while everything:
        steps.append(readiness.next_step(everything, costs))
        everything = {
            0: [one for one in everything if one is not joint], 1: [one for one in everything if one is not north],
            2: [one for one in everything if one is not unchecked], 3: [one for one in everything if one is not other],
            4: [one for one in everything if one is not mount], 5: [one for one in everything if one is not length],
        }.get(len(steps) - 1, [])  # fmt: skip
    assert steps == [
        "tell joint 4-3: cmd/joint?tube=3;angle_deg=..;sigma_deg=..",
        "tell north: cmd/north?action=tell;angle_deg=..;sigma_deg=..",
        "check north: cmd/north?action=check;angle_deg=..;sigma_deg=..",
        "align tube 3 in slow turns: cmd/align?tube=3",
        "align tube 4 in slow turns: cmd/align?tube=4",
        "measure tube 4: cmd/length?tube=4;length_m=..;sigma_m=..",
        "nothing: the setup is told",
    ]
    assert readiness.order_of(item(K.JOINT, "drive-4")).endswith("sigma_deg=..;upper=0")


@pytest.mark.parametrize(("cost", "is_worth"), [(0.005, True), (0.004999, False)])
def test_what_costs_half_a_centimetre_is_worth_telling(cost: float, is_worth: bool) -> None:
    asked = readiness.next_step([item(K.STICK_UP)], {"stick_up": cost})
    assert asked.startswith("tell the stick-up" if is_worth else "nothing")
    measured = [item(K.MOUNT, "3", SetupSource.MEASURED), item(K.MOUNT, "4", SetupSource.TOLD)]
    assert readiness.next_step(measured, {"mount.3": 9.0, "mount.4": 9.0}).startswith("nothing")
    designed = readiness.next_step([item(K.MOUNT, "3", SetupSource.DESIGN)], {"mount.3": 9.0})
    assert designed.startswith("align tube 3")


def test_the_worst_item_is_the_one_across_the_hole_with_its_centimetres() -> None:
    items = [item(K.LENGTH, "4"), item(K.MOUNT, "4"), item(K.ACCELEROMETER, "3")]
    costs = {"length.4": 9.0, "mount.4": 0.0125, "accelerometer.3": 0.02}
    assert readiness.say_worst(items, costs) == "accelerometer of tube 3, 2.0 cm"
    assert readiness.say_worst(items[:1], costs) == "length of tube 4, 900.0 cm"
    assert readiness.words_of(item(K.DEPTH_SCALE)) == "depth scale"
    joint = item(K.JOINT, "4-3", is_needed=True)
    assert readiness.say_worst([joint], {}) == "joint 4-3, 0.0 cm"
    for cost, said in (
        (0.00099, "no item costs as much as a millimetre"),
        (0.001, "turn of the mount of tube 3, 0.1 cm"),
    ):
        assert readiness.say_worst([item(K.MOUNT_TURN, "3")], {"mount_turn.3": cost}) == said


def test_names_are_said_as_a_crew_says_them() -> None:
    joints = [f"joint.{n}-{n - 1}" for n in (9, 8, 7, 6, 5)]
    assert readiness.told_briefly(["north"]) == "north"
    assert readiness.told_briefly(["north", joints[0]]) == "north, joint 9-8"
    assert readiness.told_briefly([*joints[:3], "north"]) == "north, joints 9-8, 8-7, 7-6"
    assert readiness.told_briefly(joints) == "joints 9-8, 8-7, 7-6 and 2 more"
    assert readiness.say_hold(["a", "b"], ["c"], ["d is wrong", "e too"]) == (
        "not told: a, b; not checked: c; d is wrong; e too"
    )  # fmt: skip
    assert readiness.say_hold([], ["c", "d"], []) == "not checked: c, d"
    needed = [item(K.NORTH, is_needed=True), item(K.LENGTH, "3"), item(K.JOINT, "4-3", is_needed=True)]
    assert missing_names(needed) == ["north", "joint.4-3"]


def test_a_joint_of_which_nobody_has_spoken_is_no_item(tmp_path: Path) -> None:
    book = book_of(tmp_path)
    assert joint_item(book, (4, 3)) is None
    book.on_flags(4, 2, NodeFlag.LOWER_UNTOLD)
    untold = joint_item(book, (4, 3))
    book.on_flags(4, 2, NodeFlag.NONE)
    known = joint_item(book, (4, 3))
    assert untold is not None
    assert known is not None
    assert (untold.sigma, untold.is_missing, untold.is_needed) == (UNKNOWN_YAW_STD, True, True)
    assert known.sigma == pytest.approx(0.05 * DEG)
    assert not known.is_missing
    assert untold.detail == "the node of tube 4 was not told: the yaw below may be any"
    book.on_flags(4, 1, NodeFlag.DRIVE_UNTOLD)
    head = joint_item(book, (DRIVE, 4))
    assert head is not None
    assert head.detail.startswith("the node of tube 4 ")
    book.add([told(1, K.JOINT, "4-3", 0.5, sigma=0.02, used=0.25)])
    here = joint_item(book, (4, 3))
    assert here is not None
    assert (here.values, here.sigma, here.by, here.utc, here.times_told) == ((0.5,), 0.02, "anna", "at 1", 1)
    assert here.detail == f"by anna, its node computes by {math.degrees(0.25):g} deg"
