"""The verdict of a ground station while a hole drifts off, and while one after the other of its sources fails."""

from pathlib import Path

import pytest
from hand_fed import Rig

from telemetry.messages import NodeFlag


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    for stop in range(1, 4):
        rig.drill(stop, 0.3)
    return rig


def said(rig: Rig) -> str:
    return str(rig.ask("verdict")["verdict"])


@pytest.mark.parametrize(
    ("inclinations_deg", "words"),
    [
        ((0.45, 0.65, 0.9, 1.5, 8.0), ["on_target", "on_target", "on_target", "watch", "out"]),
        ((1.0, 1.6, 2.2, 2.8, 3.4, 4.0), ["steer", "steer", "steer", "out", "out", "out"]),  # it bends by 0.3 deg/m
        ((1.0, 1.6, 2.0, 6.0, 8.0), ["steer", "steer", "steer", "out", "out"]),
    ],
)
def test_a_hole_that_drifts_off_is_watched_then_steered_then_out(
    rig: Rig, inclinations_deg: tuple[float, ...], words: list[str]
) -> None:
    seen = []
    assert said(rig) == "on_target"
    for stop, inclination_deg in enumerate(inclinations_deg, 4):
        rig.drill(stop, inclination_deg)
        seen.append(said(rig))
    assert seen == words


def test_the_published_bore_is_foreseen_within_what_is_said_of_it(tmp_path: Path) -> None:
    """Wellbore 1 ended 51.5 cm off: from 4 m on every end that is told holds that within its ±."""
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    for stop, inclination_deg in enumerate((0.08, 0.32, 0.59, 0.89, 1.32, 1.70, 2.36, 2.80, 3.00), 1):
        rig.drill(stop, inclination_deg)
        off = rig.ask("column")
        assert stop == 1 or abs(off["projection"]["deviation_cm"] - 51.5) < off["ahead"]["half_width_cm"] + 0.1
    assert said(rig) == "out"
    rig.ground.close()


def test_at_its_depth_the_verdict_stops_advising(rig: Rig) -> None:
    for stop in range(4, 11):
        rig.drill(stop, 0.3)
    answer = rig.ask("verdict")
    assert answer["verdict"] == "on_target"
    assert answer["line"].startswith("ON TARGET: ended 9.8 ± ")
    assert (answer["steer"], answer["todo"]) == (None, "the hole is at its depth: nothing is left to steer")
    assert rig.ask("column")["ahead"]["within_percent"] > 99.0


def test_what_to_do_stands_beside_the_word(rig: Rig) -> None:
    rig.drill(4, 1.0)
    rig.drill(5, 1.8)
    answer = rig.ask("verdict")
    assert answer["what"] == "projection"
    assert answer["off"]["wind"] == "N"
    assert answer["steer"]["wind"] == "S"
    assert answer["off"]["limit_cm"] == 45.0
    assert answer["bit_md_m"] == 10.0 < answer["steer"]["before_md_m"] < 20.0
    assert answer["steer"]["left_m"] == pytest.approx(answer["steer"]["before_md_m"] - 10.0, abs=0.05)


def test_silence_is_dont_know_although_the_surveys_were_good(rig: Rig) -> None:
    rig.run(rig.ground.config.stale_after + 1.0)
    answer = rig.ask("verdict")
    assert (answer["verdict"], answer["by_surveys"]) == ("dont_know", "on_target")
    assert "stale" in answer["doubts"]


def test_a_silent_tube_is_dont_know_while_depth_and_others_are_heard(rig: Rig) -> None:
    for _ in range(8):
        rig.state(3, 1)
        rig.read_depth(rig.md)
    answer = rig.ask("verdict")
    assert answer["verdict"] == "dont_know"
    assert "silent: tubes 2, 1" in answer["why"]


def test_a_depth_that_jumped_is_dont_know_until_somebody_has_looked(rig: Rig) -> None:
    rig.run(0.5)
    rig.read_depth(2.5)
    rig.speak(3)
    assert rig.ask("verdict")["doubts"] == ["depth"]
    rig.ground.operator.order("accept_depth", {"action": "confirm"})
    rig.md = 6.0
    for _ in range(2):
        rig.speak(3)
    assert said(rig) == "on_target"


def test_an_untrusted_yaw_is_dont_know_until_another_tube_has_surveyed_there(rig: Rig) -> None:
    rig.drill(4, 0.3, NodeFlag.YAW_UNTRUSTED)
    answer = rig.ask("verdict")
    assert answer["verdict"] == "dont_know"
    assert answer["doubts"][0] == "yaw"


def test_a_bit_far_below_the_deepest_survey_is_dont_know(rig: Rig) -> None:
    rig.speak(5)
    rig.depth(10.0)
    rig.speak(5)
    answer = rig.ask("verdict")
    assert answer["why"] == ["the bit is at 10.0 m, the deepest survey at 6.0 m"]


def test_after_a_restart_nothing_is_known_until_it_is_heard_again(rig: Rig, tmp_path: Path) -> None:
    rig.ground.close()
    again = Rig(tmp_path, target=20.0)
    answer = again.ask("verdict")
    assert (answer["verdict"], answer["by_surveys"]) == ("dont_know", "on_target")
    again.ground.close()
