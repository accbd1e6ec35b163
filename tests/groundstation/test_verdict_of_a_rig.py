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


def test_a_hole_that_drifts_off_is_watched_then_steered_then_out(rig: Rig) -> None:
    seen = [said(rig)]
    for stop, inclination_deg in enumerate((1.0, 1.6, 2.0, 6.0, 8.0), 4):
        rig.drill(stop, inclination_deg)
        seen.append(said(rig))
    assert seen == ["on_target", "watch", "steer", "steer", "out", "out"]


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
