"""Calibration in the field on a whole rig in real processes, with a power cut in the middle of the upload."""

import json
import math
import os
import signal
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forked_commands import run
from rigs import REPOSITORY, ends, free_endpoint, running_rig

from groundstation.calibration.block import read_calibration
from groundstation.calibration.field_calibration import force_inclination
from groundstation.service.disk.ground_store import Store
from sim.rig.report import root_mean_square
from sim.world.scenario import load_scenario
from sim.world.world import World
from telemetry.messages import SurveyMeasurement
from telemetry.parameters import ParameterBlock

SCENARIO = "scenarios/field-calibration.toml"
GROUND = "borechain/*/ground"


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    with running_rig(tmp_path_factory.mktemp("rig"), "--seed", "1", scenario=SCENARIO) as rig:
        result = rig.result()
        assert ends(rig.process.pid)
    return result, rig.out


def written(folder: Path, text: str) -> Path:
    """A scenario in a folder, beside its path."""
    path = "field-calibration-path.csv"
    (folder / path).write_text((REPOSITORY / "scenarios" / path).read_text())
    scenario = folder / "scenario.toml"
    scenario.write_text(text)
    return scenario


def test_drifted_accelerometers_are_calibrated_through_the_chain(calibrated: tuple[dict[str, Any], Path]) -> None:
    calibration = calibrated[0]["calibration"]
    assert calibration["state"] == "done"
    assert calibration["inclination_rms_deg"]["before"] > 0.1
    assert calibration["inclination_rms_deg"]["after"] < 0.03
    assert [row["tube"] for row in calibration["tubes"]] == [1, 2, 3]
    for row in calibration["tubes"]:
        assert row["hash_before"] == ParameterBlock(row["tube"], 0).sha256().hex()
        assert row["hash"] == row["hash_proposed"] != row["hash_before"]
        assert (row["version"], row["records"]) == (1, 12)
        assert 0.0 < row["residual_rms"] < 0.005
    drilled = [station["measurements"] for station in calibrated[0]["stations"] if station["md_m"] > 0.0]
    assert drilled == [3, 2, 1]
    assert calibrated[0]["figures"]["toe_error_m"] < 0.005


def test_a_power_cut_in_the_upload_leaves_the_old_block_until_it_is_asked_again(
    calibrated: tuple[dict[str, Any], Path],
) -> None:
    rows = {row["tube"]: row for row in calibrated[0]["calibration"]["tubes"]}
    assert [rows[tube]["restarted"] for tube in (1, 2, 3)] == [False, True, False]
    assert rows[2]["hash_after_restart"] == rows[2]["hash_before"]
    assert rows[2]["uploads"] == 2
    assert rows[2]["hash"] == rows[2]["hash_proposed"]


def test_every_calibration_lies_whole_in_its_file(calibrated: tuple[dict[str, Any], Path]) -> None:
    for tube in (1, 2, 3):
        kept = read_calibration(calibrated[1] / "state" / "ground" / "calibrations" / f"field-{tube}-v1.json")
        assert kept.provenance.design.startswith("12 attitudes")
        assert 0.0 < kept.provenance.bias_std.max() < 0.002


def test_what_is_said_of_before_is_what_an_uncalibrated_rig_shows(
    calibrated: tuple[dict[str, Any], Path], tmp_path: Path
) -> None:
    text = (REPOSITORY / SCENARIO).read_text()
    drifted = written(tmp_path, text[: text.index("[calibration]")].replace('"kill-node:2@474+15"', ""))
    with running_rig(tmp_path, "--seed", "1", "--inline", scenario=str(drifted)) as rig:
        assert "calibration" not in rig.result()
    world = World(load_scenario(drifted), 1)
    errors = []
    with closing(Store(f"sqlite:///{rig.out / 'state' / 'ground' / 'ground.sqlite'}")) as store:
        for stored in store.messages():
            if isinstance(stored.message, SurveyMeasurement) and stored.md is not None:
                force = np.array([stored.message.imus[0].force])
                truth = world.truth_station(stored.md)["inclination_deg"]
                errors.append(math.degrees(force_inclination(force)[0]) - truth)
    assert len(errors) == 6
    said = calibrated[0]["calibration"]["inclination_rms_deg"]["before"]
    assert root_mean_square(errors) == pytest.approx(said, rel=0.02)


def test_a_ground_station_killed_while_it_collects_goes_on_to_its_blocks(tmp_path: Path, ask: Any) -> None:
    text = (REPOSITORY / SCENARIO).read_text().replace("tubes = 3", "tubes = 2").replace('"kill-node:2@474+15"', "")
    scenario = written(tmp_path, text)
    rack = load_scenario(scenario).file.calibration
    assert rack is not None
    with running_rig(tmp_path, "--seed", "1", "--speed", "60", scenario=str(scenario)) as rig:

        def shown() -> dict[str, Any]:
            return ask(rig, f"{GROUND}/recalibration") or {"attitudes": [], "rig_time_s": None}

        gone = rig.until(lambda: len(shown()["attitudes"]) >= 3 and shown()["rig_time_s"])
        os.kill(rig.pid_of("borechain ground"), signal.SIGKILL)
        away = rig.until(lambda: shown()["rig_time_s"]) - gone
        result = rig.result()
    # the rack goes on meanwhile, by the clock on the wall: an attitude without an order of a record is lost
    lost = 1 + int(away / (rack.hold_s + rack.move_s))
    print(f"away for {away:.0f} s of rig time, at most {lost} attitudes lost")
    calibration = result["calibration"]
    assert result["restarts"] == 1
    assert calibration["state"] == "done"
    assert [row["tube"] for row in calibration["tubes"]] == [1, 2]
    assert {row["phase"] for row in calibration["tubes"]} == {"done"}
    assert min(row["records"] for row in calibration["tubes"]) >= len(rack.attitudes_deg) - lost
    assert calibration["inclination_rms_deg"]["after"] < 0.03


def test_an_operator_is_refused_what_is_not_due(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "4") as rig:
        rig.until(lambda: ask(rig, f"{GROUND}/recalibration"))
        order = "borechain/rig-1/cmd/recalibrate"
        for parameters, named in (("", "action=begin|attitude"), ("?action=solve", "it is idle")):
            done = run("query", f"{order}{parameters}", "--endpoint", rig.endpoint)
            assert done.returncode == 2
            assert named in done.stderr
        begun = run("query", f"{order}?action=begin;tubes=1", "--endpoint", rig.endpoint, "--json")
        assert json.loads(begun.stdout)["state"] == "collecting"
        cancelled = run("query", f"{order}?action=cancel", "--endpoint", rig.endpoint, "--json")
        assert json.loads(cancelled.stdout)["state"] == "idle"


def test_a_design_that_cannot_be_is_refused_before_anything_starts(tmp_path: Path) -> None:
    text = (REPOSITORY / SCENARIO).read_text()
    (tmp_path / "flat.toml").write_text(text.replace("[45, 0], [90, 0], [-90, 0], [-45, 0],", "[0, 10],"))
    done = run("rig", str(tmp_path / "flat.toml"), "--endpoint", free_endpoint(), cwd=tmp_path)
    assert done.returncode == 2
    assert "rank 3" in done.stderr
    assert not (tmp_path / "out").exists()
