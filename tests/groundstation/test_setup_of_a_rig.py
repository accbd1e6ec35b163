"""Nodes that were started without a joint angle, as a whole rig: what is said before and after the angles are told."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from borechain.drilling.inline import InlineRig
from borechain.setup_check import check_scenario
from sim.errors import RigError
from sim.rig.ground_settings import ground_settings
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow
TUBES, INCLINATION_DEG, AZIMUTH_DEG, SIGMA_DEG = 3, 3.0, -117.0, 0.05
TABLES: dict[str, Any] = {
    "rig": {"tubes": TUBES, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": INCLINATION_DEG, "azimuth_deg": AZIMUTH_DEG}},
    "design": {"inclination_deg": INCLINATION_DEG, "azimuth_deg": AZIMUTH_DEG},
    "accelerometer": {"bias_std_deg": 0.002},
}


def tell(rig: InlineRig, tube: int, angle: float, **more: str) -> None:
    given = {"tube": str(tube), "angle_deg": repr(math.degrees(angle)), "sigma_deg": str(SIGMA_DEG)}
    assert rig.command("joint", given | more)["state"] == "done"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_untold_joints_are_named_and_once_told_the_azimuth_is_right_within_its_sigma(tmp_path: Path, seed: int) -> None:
    world = World(scenario_of(TABLES | {"setup": {"untold": ["joints"]}}), seed)
    rig = InlineRig(world, ground_settings(world), "rig-1", tmp_path)
    rig.run()
    verdict = rig.ask("verdict")
    assert verdict["verdict"] == "dont_know"
    assert verdict["doubts"][0] == "setup"
    assert verdict["line"] == "DON'T KNOW: not told: joints drive-3, drive-2, drive-1 and 2 more"
    joints = [f"joint.{name}" for name in ("drive-3", "drive-2", "drive-1", "3-2", "2-1")]
    assert rig.ask("setup")["missing"] == joints
    untold = rig.ask("stations")["stations"]
    for row in untold:  # what the collar says, and how sharply this hole bends
        off = (row["azimuth_deg"] - AZIMUTH_DEG + 180.0) % 360.0 - 180.0
        assert abs(off) < 3.0 * row["sigma_azimuth_deg"]
    assert untold[-1]["sigma_azimuth_deg"] > 2.0
    with pytest.raises(RigError, match=r"joint 3-2: .* was told no angle; expected no used_deg"):
        tell(rig, 2, 0.0, used_deg="0")

    marks = World(scenario_of(TABLES), seed).marks  # what a crew reads of the same string
    for tube in range(TUBES, 0, -1):
        tell(rig, tube, marks.read(tube).drive_joint.angle, upper="0")
        if tube > 1:
            tell(rig, tube - 1, marks.read(tube).lower_joint.angle)
    assert rig.ask("setup")["missing"] == []
    assert rig.ask("verdict")["verdict"] == "on_target"
    for row in rig.ask("stations")["stations"]:
        off = (row["azimuth_deg"] - AZIMUTH_DEG + 180.0) % 360.0 - 180.0
        assert abs(off) < 4.0 * row["sigma_azimuth_deg"]
        assert row["sigma_azimuth_deg"] < 2.0
        # the drive head's mark, those of two joints at most, and the mount
        assert SIGMA_DEG < row["sigma_systematic_deg"] <= math.sqrt(4.0) * SIGMA_DEG + 1e-6
    rig.close()


def test_what_the_crew_of_a_scenario_does_not_tell_stands_by_design_or_is_missing(tmp_path: Path) -> None:
    for untold in ((), ("north",), ("joints", "north", "collar", "mounts")):
        world = World(scenario_of(TABLES | {"setup": {"untold": untold}}), 1)
        folder = tmp_path / "-".join(["run", *untold])
        folder.mkdir()
        rig = InlineRig(world, ground_settings(world), "rig-1", folder)
        rig.run()
        setup = rig.ask("setup")
        assert setup["ready"] == (untold == ())
        assert ("north" in setup["missing"]) == ("north" in untold)
        named = {row["item"]: row["source"] for row in setup["items"]}
        assert (named["collar"], named["mount.3"]) == (("design",) * 2 if "mounts" in untold else ("told",) * 2)
        rig.close()


def test_the_shipped_scenarios_are_ready_to_drill() -> None:
    for name in ("wellbore-1", "rig-3", "pipe-5"):
        found = check_scenario(Path(name), 1)
        assert (found.ready, found.missing) == (True, [])
