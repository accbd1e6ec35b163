"""Orders about the setup over the bus: obeyed, kept over a kill of the ground station, and taken back."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from rigs import REPOSITORY, Rig, run, running_rig

pytestmark = pytest.mark.process
GROUND, ORDER = "borechain/*/ground", "borechain/rig-1/cmd"
NORTH_DEG = 30.0


def test_north_told_to_a_running_rig_outlives_a_kill_and_turns_every_survey(tmp_path: Path, ask: Any) -> None:
    for file in (REPOSITORY / "scenarios").glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    scenario = tmp_path / "untold.toml"
    scenario.write_text((REPOSITORY / "scenarios" / "rig-3.toml").read_text() + '\n[setup]\nuntold = ["north"]\n')

    def stations(rig: Rig) -> Any:
        return (ask(rig, f"{GROUND}/stations") or {}).get("stations")

    def north(rig: Rig) -> Any:
        rows = (ask(rig, f"{GROUND}/setup") or {}).get("items", [])
        return next((row for row in rows if row["item"] == "north"), None)

    with running_rig(tmp_path, "--speed", "20", "--seed", "5", scenario=str(scenario)) as rig:
        rig.until(lambda: stations(rig))
        checked = run("check", "--endpoint", rig.endpoint)
        assert checked.returncode == 1
        assert checked.stdout.splitlines()[:2] == ["NOT READY TO DRILL", "missing  north"]
        before = stations(rig)[0]["azimuth_deg"]
        told = ask(rig, f"{ORDER}/north?action=tell;angle_deg={NORTH_DEG};sigma_deg=0.2;by=anna")
        assert (told["state"], told["by"]) == ("done", "anna")
        # the first station may have been read once more in between, by degrees in a hole that is nearly upright
        turned = (stations(rig)[0]["azimuth_deg"] - before - NORTH_DEG + 180.0) % 360.0 - 180.0
        assert abs(turned) < 5.0
        os.kill(rig.pid_of("borechain ground"), signal.SIGKILL)
        again = rig.until(lambda: north(rig))
        assert (again["by"], again["value"], again["sigma"]) == ("anna", [NORTH_DEG], 0.2)
        result = rig.result()
    inline = run("rig", "rig-3", "--inline", "--json", "--seed", "5", "--out", str(tmp_path / "inline"))
    plain = json.loads(inline.stdout.splitlines()[-1])["stations"]
    for found, row in zip(result["stations"], plain, strict=True):
        off = (found["azimuth_deg"] - row["azimuth_deg"] - NORTH_DEG + 180.0) % 360.0 - 180.0
        # a kill changes what the link carries, and so the clocks of the nodes by microseconds
        assert off == pytest.approx(0.0, abs=0.005)
        assert found["inclination_deg"] == pytest.approx(row["inclination_deg"], abs=1e-6)
    assert result["restarts"] == 1


def test_what_was_told_is_taken_back_by_one_order(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: (ask(rig, f"{GROUND}/status") or {}).get("measurements"))
        before = ask(rig, f"{GROUND}/setup")["missing"]
        ask(rig, f"{ORDER}/north?action=tell;angle_deg=12;sigma_deg=0.2;by=anna")
        undone = ask(rig, f"{ORDER}/setup?action=undo;by=anna")
        assert undone["detail"].startswith("north is taken back")
        after = ask(rig, f"{GROUND}/setup")
        assert after["missing"] == before == []
        assert next(row["detail"] for row in after["items"] if row["item"] == "north") == "configuration"
        rig.result()
