"""Words of an adjustment's sources, names of calibrations in a block, answers in a crew's picture: each case once."""

import json
from pathlib import Path
from typing import Any

import pytest

from borechain.crew.picture import Picture, is_outdated
from groundstation.service.answers.adjustment_words import say_fit, say_next_stop, say_part, say_second
from groundstation.service.orders.blocks import block_of_files
from telemetry.errors import CalibrationError
from telemetry.parameters import ParameterBlock

WORDS = {
    "force_noise": "noise of the accelerometers (most: tube 3)", "yaw_noise": "noise of the yaws (most: tube 3)",
    "play": "tubes that lie askew in the hole (most: tube 3)", "bias": "accelerometers (most: tube 3)",
    "tilt": "mounts that are tilted (most: tube 3)", "mount": "mounts that are turned (most: tube 3)",
    "joint": "angles of the joints (most: above tube 3)",
    "drive": "angles of the joints to the drive head (most: tube 3)", "string": "angles of all joints (most: tube 3)",
    "turn": "other turns of the yaws (most: tube 3)", "north": "north, as it was told (most: tube 3)",
    "gravity": "gravity of the site (most: tube 3)", "collar": "direction at the collar (most: tube 3)",
    "path": "bends that no reading shows (most: tube 3)", "legs": "way of the hole between stations (most: tube 3)",
    "depth": "depths and lengths of tubes (most: tube 3)",
    "blunder": "mistakes found, whose size is not exact (most: tube 3)", "of_another": "of another (most: tube 3)",
}  # fmt: skip


@pytest.mark.parametrize("source", WORDS)
def test_a_source_is_said_with_the_tube_that_gives_most_of_it(source: str) -> None:
    assert say_part(source, "tube 3") == WORDS[source]
    assert say_part(source, "") == WORDS[source].partition(" (")[0]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((7, 0, 0), "all 7 readings fit together: nothing is wrong"),
        ((1, 0, 0), "one reading: nothing to compare it with yet"),
        ((2, 0, 0), "all 2 readings fit together: nothing is wrong"),
        ((1, 1, 0), "1 thing is wrong, found among 1 reading and put right"),
        ((9, 2, 0), "2 things are wrong, found among 9 readings and put right"),
        ((9, 2, 1), "9 readings contradict each other: it may be one thing or another"),
        ((1, 0, 3), "1 reading contradict each other: it may be one thing or another"),
    ],
)
def test_whether_surveys_fit(given: tuple[int, int, int], said: str) -> None:
    assert say_fit(*given) == said


def test_a_second_explanation_is_likelier_up_to_four_decades() -> None:
    assert say_second("x", 9.0, is_doubt=True) == "x (nearly as likely)"
    assert say_second("x", 3.999, is_doubt=False) == "x (some hundred times less likely)"
    assert say_second("x", 4.0, is_doubt=False) == "x (far less likely)"


@pytest.mark.parametrize(
    ("turn", "sigma", "same", "said"),
    [
        (90.0, 0.456, 1.25, "turn the string on by 90 deg: sigma at the toe 0.46 cm, without a turn 1.2"),
        (180.0, 1.0, 3.14159, "turn the string on by 180 deg: sigma at the toe 1.0 cm, without a turn 3.1"),
        (181.0, 1.0, 3.14159, "turn the string back by 179 deg: sigma at the toe 1.0 cm, without a turn 3.1"),
        (90.0, 0.5, 0.5499, "any angle: a turn makes the toe no better known (sigma 0.55 cm)"),
        (90.0, 0.5, 0.5501, "turn the string on by 90 deg: sigma at the toe 0.50 cm, without a turn 0.55"),
        (90.0, 9.51, 10.0, "any angle: a turn makes the toe no better known (sigma 10.0 cm)"),
        (90.0, 9.49, 10.0, "turn the string on by 90 deg: sigma at the toe 9.5 cm, without a turn 10.0"),
    ],
)
def test_a_turn_is_advised_where_it_is_worth_it(turn: float, sigma: float, same: float, said: str) -> None:
    assert say_next_stop(turn, sigma, same) == said


def test_a_block_is_of_files_by_their_plain_names(tmp_path: Path) -> None:
    assert block_of_files(tmp_path, 3, 7, "identity", "identity") == ParameterBlock(3, 7)
    for wrong in ("", "../x", "a.json", "a" * 65, "ä"):
        for names in ((wrong, "identity"), ("identity", wrong)):
            with pytest.raises(CalibrationError) as refused:
                block_of_files(tmp_path, 3, 7, *names)
            told = f"expected the name of a file below {tmp_path} without its .json, got {wrong!r:.80}"
            assert str(refused.value) == told
    with pytest.raises(CalibrationError, match=r"none\.json"):
        block_of_files(tmp_path, 3, 7, "none", "identity")
    (tmp_path / "broken.json").write_text(json.dumps({"sensor": 3}))
    with pytest.raises(CalibrationError, match=r"broken\.json"):
        block_of_files(tmp_path, 3, 7, "identity", "broken")


def view(revision: int | None, second: int, **more: Any) -> dict[str, Any]:
    said = {"utc": f"2026-01-01T00:00:{second:02}Z", **more}
    return said if revision is None else said | {"revision": revision}


@pytest.mark.parametrize(
    ("known", "new", "is_taken"),
    [
        (view(5, 10), view(4, 9), False),
        (view(5, 10), view(4, 10), True),  # the same time: of another start
        (view(5, 10), view(5, 9), True),
        (view(5, 10), view(6, 9), True),
        (view(5, 10), view(4, 11), True),
        (view(1, 10), view(None, 9), False),  # without a number it is that of a start
        (view(None, 10), view(None, 9), True),
        (view(None, 10), view(0, 9), True),
    ],
)
def test_an_older_answer_changes_nothing_but_that_something_was_heard(known: Any, new: Any, is_taken: bool) -> None:
    for path in ("status", "verdict"):
        picture = Picture("rig-1")
        picture.on_answer(path, known, 1.0)
        picture.on_answer(path, new, 3.0)
        assert picture.answers[path] is (new if is_taken else known)
        assert (picture.heard_at, picture.age(4.5)) == (3.0, 1.5)
        assert picture.verdict_at == (-float("inf") if path == "status" else 3.0 if is_taken else 1.0)


def test_what_was_missed_is_what_has_changed_since_it_was_heard() -> None:
    picture = Picture("rig-1")
    assert picture.missed == []
    picture.on_answer("changes", view(9, 30, changes=[{"path": "status", "changed_at": 7}]), 0.0)
    every = ["status", "verdict", "string", "column", "wall", "alarms", "orders", "setup", "adjustment"]
    assert picture.missed == every
    for path in every:
        picture.on_answer(path, view(7, 20), 0.0)
    assert picture.missed == []
    picture.answers["status"] = view(6, 20)
    assert picture.missed == ["status"]
    told = view(9, 30)
    assert not is_outdated(view(7, 20), told, 7)
    assert is_outdated(view(7, 20), told, 8)
    assert is_outdated(view(10, 29), told, 8)  # of an earlier start, which had come farther
    assert not is_outdated(view(10, 30), told, 8)
    assert not is_outdated(view(9, 29), told, 8)
    assert is_outdated(None, told, 0)
