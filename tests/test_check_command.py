"""``borechain check`` before a rig starts: ready or not, by its exit status, and what is missing by its name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from forked_commands import run, warm_forker

ROOT = Path(__file__).parents[1]
NORTH = "north-std-deg = 0.3\nnorth-check-deg = 0.2\nnorth-check-std-deg = 0.5"
pytestmark = pytest.mark.slow


def check(*words: object) -> tuple[int, str, str]:
    done = run("check", *words, timeout=120.0, source=warm_forker(), cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


def scenario(folder: Path, untold: str, unchecked: str = "[]") -> Path:
    text = (ROOT / "scenarios" / "rig-3.toml").read_text()
    path = (ROOT / "scenarios" / "wellbore-1-path.csv").read_bytes()
    (folder / "wellbore-1-path.csv").write_bytes(path)
    (folder / "rig.toml").write_text(f"{text}\n[setup]\nuntold = {untold}\nunchecked = {unchecked}\n")
    return folder / "rig.toml"


def test_a_scenario_whose_crew_tells_everything_is_ready() -> None:
    status, told, _ = check("rig-3")
    assert status == 0
    assert told.splitlines()[0] == "READY TO DRILL"
    assert "assumed  length of 3 tubes ± 0.001 m, as it is made: 0.2 cm at the toe along the hole" in told


def test_what_a_crew_does_not_tell_is_named(tmp_path: Path) -> None:
    status, told, _ = check(scenario(tmp_path, '["north", "joints", "collar"]'), "--json")
    found = json.loads(told)
    assert (status, found["ready"]) == (1, False)
    assert found["missing"] == ["north", *(f"joint.{name}" for name in ("drive-3", "drive-2", "drive-1", "3-2", "2-1"))]
    assert {row["item"]: row["source"] for row in found["items"]}["collar"] == "design"
    assert found["todo"].startswith("tell north")


def test_what_a_crew_does_not_check_is_named_with_what_would(tmp_path: Path) -> None:
    status, told, _ = check(scenario(tmp_path, "[]", '["north", "stick-up"]'), "--json")
    found = json.loads(told)
    assert (status, found["ready"], found["unchecked"]) == (1, False, ["north", "stick_up"])
    assert found["todo"].startswith("check north: cmd/north?action=check")


@pytest.mark.parametrize(
    ("lines", "status", "said"),
    [
        (f"{NORTH}\ncollar-std-deg = 0.2", 0, "READY TO DRILL"),
        ("north-std-deg = 0.3", 1, "check    north, not checked: a second bearing is"),
        (
            f"{NORTH}\nstick-up-m = 0.4\nstick-up-std-m = 0.01",
            1,
            "check    stick_up, not checked: the bit at the collar",
        ),
        (
            f"north-deg = 3.0\n{NORTH}",
            1,
            "wrong    north is told as 3 ± 0.3 deg and checked as 0.2 ± 0.5 deg, 5 sigma apart",
        ),
        ("north-std-deg = 0.3\nnorth-check-deg = 1.0", 2, "expected north_check_deg and north_check_std_deg together"),
        ("tube-length-m = 2.0", 1, "missing  north"),
        ("north-std-deg = 0.0", 2, "'--north-std-deg': 0.0 is not in the range x>0.0"),
        ("north-deg = 3.0", 2, "Error: expected north_std_deg beside the value that it is of"),
        ("nort-deg = 3.0", 2, "nort-deg: unknown key"),
        (f'joint = [["4-3", 12.5, 0.05]]\n{NORTH}', 0, "READY TO DRILL"),
        (f"{NORTH}\ndepth-rate-mps = 0.5\nstale-after-s = 9", 0, "READY TO DRILL"),
        ("depth-rate-mps = 50", 2, "depth_rate: expected a speed of the bit of 0.001..5 m/s, got 50.0"),
        ("survey-after-s = 0", 2, "survey_after: expected a time of a stop of 5..3600 s, got 0.0"),
        ('joint = [["4", 12.5, 0.05]]\nnorth-std-deg = 0.3', 2, "joints.0.0: String should match pattern"),
    ],
)
def test_the_options_of_a_ground_station_that_is_to_start(tmp_path: Path, lines: str, status: int, said: str) -> None:
    (tmp_path / "ground.toml").write_text(f"{lines}\n")
    found, told, errors = check("--ground-config", tmp_path / "ground.toml")
    assert found == status, (told, errors)
    assert said in told + errors


def test_the_page_about_boards_tells_a_ground_station_all_that_is_needed(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "deploy.md").read_text().partition("`/etc/borechain/ground.toml`")[2]
    block = [line[4:] for line in page.splitlines()[2:] if line.startswith("    ")]
    end = next(place for place, line in enumerate(block) if "=" not in line)
    (tmp_path / "ground.toml").write_text("\n".join(block[:end]))
    status, told, errors = check("--ground-config", tmp_path / "ground.toml")
    assert (status, told.splitlines()[0]) == (0, "READY TO DRILL"), errors


def test_an_unknown_scenario_is_refused() -> None:
    status, _, errors = check("nothere")
    assert status == 2
    assert "nothere: expected a scenario file or a name" in errors
