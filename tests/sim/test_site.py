"""A site: three holes drilled one after the other, whose joints are judged while the third is drilled."""

import json
import re
from itertools import groupby
from pathlib import Path

import pytest
from click.testing import CliRunner

from borechain.cli.rig.rig_command import rig
from borechain.cli.survey.wall_command import wall
from sim.errors import ScenarioError
from sim.world.scenario import load_scenario, scenario_of

pytestmark = pytest.mark.slow

SCENARIO = """
[rig]
tubes = 2
tube_length_m = 2.0
[path.straight]
[rotation]
turns = 5
[schedule]
add_s = 58.0
stop_s = 26.0
[site]
holes = [
  { name = "H1" },
  { name = "H2", east_m = 0.75, inclination_deg = 0.1 },
  { name = "H3", east_m = 1.50, inclination_deg = 4.0, azimuth_deg = 90.0 },
]
"""
JOINT = re.compile(r"joint +(\S+) (\w+): P\(opening\) (\S+), (\d+) % surveyed")


def test_the_joint_opens_on_the_key_while_the_third_hole_is_drilled(tmp_path: Path) -> None:
    scenario = tmp_path / "site.toml"
    scenario.write_text(SCENARIO)
    out = tmp_path / "run"
    done = CliRunner().invoke(rig, [str(scenario), "--inline", "--speed", "max", "--out", str(out), "--view", "log"])
    assert done.exit_code == 0, done.output
    holes = re.split(r" hole +H\d", done.output)
    assert len(holes) == 4
    third = [(name, state, float(chance), int(surveyed)) for name, state, chance, surveyed in JOINT.findall(holes[3])]
    assert {row[0] for row in third} == {"H2-H3"}
    states = [state for state, _ in groupby(third, key=lambda row: row[1])]
    assert states in (["missing", "surveyed"], ["missing", "unsurveyed", "surveyed"])  # drilled, then surveyed
    assert third[-2][1] != "surveyed"
    assert [row[3] for row in third] == sorted(row[3] for row in third)
    assert third[0][2] < 0.01 < 0.99 < third[-1][2]
    result = json.loads((out / "H3" / "result.json").read_text())
    assert result["wall"]["verdict"] == "not_tight"
    second = json.loads((out / "H2" / "result.json").read_text())["wall"]
    closed = next(joint for joint in second["joints"] if joint["joint"] == "H1-H2")
    assert (closed["state"], closed["probability"] < 0.01) == ("surveyed", True)
    judged = CliRunner().invoke(wall, [str(out / "wall.toml"), "--json"])
    assert judged.exit_code == 3, judged.output  # not tight: the same word afterwards
    # and the same message, thickness and chance: what was drawn of a hole is what its file says of it
    found, last = json.loads(judged.stdout), result["wall"]
    assert [finding["text"] for finding in found["findings"]] == last["findings"]
    whole = {joint["joint"]: joint for joint in found["joints"]}
    for joint in (closed, *last["joints"]):
        same = whole[joint["joint"]]
        assert joint["thickness_m"] == pytest.approx(same["thickness_m"], abs=1e-4)
        assert joint["probability"] == pytest.approx(same["probability"], abs=1e-6)


def test_the_site_that_is_shipped_is_a_scenario_with_three_holes() -> None:
    scenario = load_scenario(Path("three-holes"))
    assert scenario.file.site is not None
    assert [hole.name for hole in scenario.file.site.holes] == ["H1", "H2", "H3"]
    assert scenario.drilling("H3").hole is not scenario.hole
    with pytest.raises(ScenarioError, match="hole H9: expected one of H1, H2, H3"):
        scenario.drilling("H9")
    with pytest.raises(ScenarioError, match="expected one of none, the scenario has no site"):
        load_scenario(Path("rig-3")).drilling("H1")


@pytest.mark.parametrize("holes", [[], [{"name": "H1"}], [{"name": "a b"}, {"name": "H2"}]])
def test_a_site_that_is_no_wall_is_refused(holes: list[dict[str, str]]) -> None:
    with pytest.raises(ScenarioError, match=r"site\.holes"):
        scenario_of({"rig": {"tubes": 1, "tube_length_m": 2.0}, "path": {"straight": {}}, "site": {"holes": holes}})
