"""What is told is a doubt until a second measurement bears it out, and never better known than that."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from told_rig import azimuths, drilled, item, order, started_again

from groundstation.config import checked_config
from groundstation.errors import ConfigurationError, SelectorError

UNCHECKED: dict[str, Any] = {"north_check_deg": None, "north_check_std_deg": None}


def test_a_north_that_was_told_once_is_a_doubt_until_a_second_bearing_checks_it(tmp_path: Path) -> None:
    rig = drilled(tmp_path, **UNCHECKED)
    verdict, setup = rig.ask("verdict"), rig.ask("setup")
    assert (verdict["verdict"], verdict["doubts"]) == ("dont_know", ["unchecked"])
    assert verdict["line"] == "DON'T KNOW: north was told once, check it by a second bearing"
    assert (setup["ready"], setup["missing"], setup["unchecked"]) == (False, [], ["north"])
    assert setup["hold"] == "not checked: north"
    assert setup["todo"] == "check north: cmd/north?action=check;angle_deg=..;sigma_deg=.."
    before = rig.ask("stations")["stations"]
    detail = order(rig, "north", action="check", angle_deg=0.1, sigma_deg=0.2)
    assert detail.startswith("the check of north is 0.1 ± 0.2 deg")
    assert detail.endswith("it bears out what was told")
    assert azimuths(rig) == pytest.approx([row["azimuth_deg"] for row in before], abs=1e-9)
    assert rig.ask("verdict")["verdict"] == verdict["by_surveys"]
    assert rig.ask("setup")["ready"]
    assert item(rig, "north")["check"] == "checked by 0.1 ± 0.2 deg of anna"
    assert item(started_again(rig), "north")["check"] == "checked by 0.1 ± 0.2 deg of anna"
    assert order(rig, "setup", action="undo").startswith("the check of north is taken back")
    assert rig.ask("verdict")["doubts"][0] == "unchecked"


@pytest.mark.parametrize(
    ("told_deg", "sigma_deg", "check_deg", "check_sigma_deg", "apart"),
    [
        (40.0, 0.1, 41.0, 0.1, 7),  # by a degree: 1 / hypot(0.1, 0.1) = 7.07
        (40.0, 0.1, 130.0, 1.0, 90),
        (0.2, 0.3, 358.0, 0.4, 4),  # the shorter way round: 2.2 / 0.5
        (40.0, 0.3, 41.7, 0.4, 0),  # 1.7 / 0.5 = 3.4: may be
        (359.9, 0.1, 0.1, 0.1, 0),
    ],
)
def test_a_check_that_is_further_off_than_both_may_err_is_a_contradiction(
    tmp_path: Path, told_deg: float, sigma_deg: float, check_deg: float, check_sigma_deg: float, apart: int
) -> None:
    rig = drilled(tmp_path, 1, north_deg=told_deg, north_std_deg=sigma_deg, **UNCHECKED)
    detail = order(rig, "north", action="check", angle_deg=check_deg, sigma_deg=check_sigma_deg)
    verdict, setup = rig.ask("verdict"), rig.ask("setup")
    assert (f"{apart} sigma apart: one of the two is wrong" in detail) == bool(apart)
    assert ("contradiction" in verdict["doubts"]) == bool(apart) == (not setup["ready"])
    if not apart:
        return
    assert setup["contradicted"] == [verdict["why"][0]]
    assert setup["hold"] == setup["contradicted"][0]
    order(rig, "north", action="tell", angle_deg=check_deg, sigma_deg=0.5)
    assert "contradiction" not in rig.ask("verdict")["doubts"]


def test_nothing_counts_as_better_known_than_its_check_and_the_smallest_slip_that_it_shows_is_said(
    tmp_path: Path,
) -> None:
    rig = drilled(tmp_path, north_std_deg=0.1, stick_up_std_m=0.01, **UNCHECKED)
    sure, deep = item(rig, "north")["toe_cm"], item(rig, "stick_up")
    assert (item(rig, "north")["least_slip"], deep["check"]) == (None, "not checked: the bit at the collar's edge is")
    order(rig, "north", action="check", angle_deg=0.0, sigma_deg=1.0)
    order(rig, "stick_up", action="check", height_m=0.005, sigma_m=0.02)
    north, stick_up = item(rig, "north"), item(rig, "stick_up")
    assert (north["sigma"], stick_up["sigma"]) == (1.0, 0.02)
    assert north["toe_cm"] == pytest.approx(10.0 * sure, rel=0.02)
    assert north["least_slip"] == pytest.approx(3.5 * math.hypot(0.1, 1.0), rel=1e-5)
    assert stick_up["least_slip"] == pytest.approx(3.5 * math.hypot(0.01, 0.02), rel=1e-5)
    order(rig, "north", action="check", angle_deg=0.0, sigma_deg=0.05)
    assert item(rig, "north")["sigma"] == 0.1


def test_a_stick_up_that_is_told_no_better_than_one_that_was_not_needs_no_check(tmp_path: Path) -> None:
    rig = drilled(tmp_path, 1)
    assert rig.ask("setup")["unchecked"] == []
    order(rig, "stick_up", action="tell", height_m=0.0, sigma_m=0.1)
    assert rig.ask("setup")["unchecked"] == []
    order(rig, "stick_up", action="tell", height_m=0.0, sigma_m=0.02)
    assert rig.ask("setup")["unchecked"] == ["stick_up"]
    assert "unchecked" in rig.ask("verdict")["doubts"]


def test_a_check_of_what_was_not_told_and_one_without_its_sigma_are_refused(tmp_path: Path) -> None:
    rig = drilled(tmp_path, 1)
    with pytest.raises(SelectorError, match="stick_up: expected it to be told before it is checked"):
        order(rig, "stick_up", action="check", height_m=0.0, sigma_m=0.02)
    with pytest.raises(SelectorError, match="sigma"):
        order(rig, "north", action="check", angle_deg=0.0)
    with pytest.raises(ConfigurationError, match="expected north_check_deg and north_check_std_deg together"):
        checked_config(folder=tmp_path, north_check_deg=3.0)
