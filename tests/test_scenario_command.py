"""``borechain scenario``: what comes with the program is listed, shown and copied to be changed."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from borechain.cli.scenario.scenario_command import group
from sim.world.scenario import load_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(group, [str(word) for word in words])


def test_every_scenario_is_listed_with_what_it_is() -> None:
    listed = json.loads(run("list", "--json").output)
    assert set(listed["scenarios"]) == {path.stem for path in SCENARIOS.glob("*.toml")}
    assert all(listed["scenarios"].values())
    assert "wellbore-1           The published field record of a 20 m bore" in run("list").output


def test_a_scenario_is_shown_by_its_name_or_its_path() -> None:
    text = (SCENARIOS / "rig-3.toml").read_text()
    assert run("show", "rig-3").output == text
    assert run("show", SCENARIOS / "rig-3.toml").output == text


def test_a_folder_of_the_same_name_hides_no_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig-3").mkdir()
    assert run("show", "rig-3").exit_code == 0


def test_a_copy_can_be_drilled_and_overwrites_nothing(tmp_path: Path) -> None:
    assert run("copy", "rig-3", tmp_path / "mine").exit_code == 0
    assert load_scenario(tmp_path / "mine" / "rig-3.toml").tubes == 3
    again = run("copy", "rig-3", tmp_path / "mine")
    assert (again.exit_code, "already there" in again.output) == (1, True)


def test_a_name_of_no_scenario_is_refused_with_what_was_meant() -> None:
    refused = run("show", "wellbore1")
    assert (refused.exit_code, "did you mean wellbore-1?" in refused.output) == (2, True)
