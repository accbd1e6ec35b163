"""The rack: its truth in closed form, its schedule, drift of the sensors, and sections that cannot be."""

import math
from pathlib import Path

import numpy as np
import pytest

from borechain.drilling.inline import InlineRig
from groundstation.calibration.attitudes import true_vectors
from node.kernels.arithmetic.formats import PERIOD
from sim.errors import ScenarioError
from sim.rig.rig_progress import RigProgress
from sim.rig.scheduler import Scheduler
from sim.world.disturbance.drift import Drift
from sim.world.rack import Rack
from sim.world.scenario import Scenario, load_scenario
from sim.world.scenario_file import CalibrationSection, DriftSection
from sim.world.world import World
from telemetry.messages import BASE

SCENARIOS = Path(__file__).parents[2] / "scenarios"
FIELD = SCENARIOS / "field-calibration.toml"
MOUNT = 0.02


def rack(std_deg: float = 0.0) -> Rack:
    section = load_scenario(FIELD).file.calibration
    assert section is not None
    return Rack(section.model_copy(update={"attitude_std_deg": std_deg}), 1000.0)


def without(section: str) -> Scenario:
    scenario = load_scenario(FIELD)
    return Scenario(scenario.file.model_copy(update={section: None}), scenario.hole, ())


def test_at_rest_the_force_is_that_of_the_preset_turned_by_the_mount() -> None:
    it = rack()
    pitch, roll = np.radians(np.array(it.section.attitudes_deg)).T
    truth = it.truth(np.random.default_rng(1), MOUNT, 9.81)
    c, s = math.cos(MOUNT), math.sin(MOUNT)
    by_marks = truth.force(it.arrivals + 1.0) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    np.testing.assert_allclose(by_marks, -9.81 * true_vectors(pitch, roll), atol=1e-12)


def test_rates_are_the_derivative_of_the_attitude_and_vanish_at_rest() -> None:
    it, h = rack(0.5), 1e-4
    truth = it.truth(np.random.default_rng(1), MOUNT, 9.81)
    for t in np.linspace(1000.0, it.end, 300):
        first, second = truth.attitude(np.array([t - h, t + h]))
        numeric = (first.inv() * second).as_rotvec() / (2.0 * h)
        rate = truth.cycle_means(np.array([t + h]), 2.0 * h)[0][0]
        np.testing.assert_allclose(rate, numeric, atol=1e-9)
    at_rest = np.arange(it.rest_from - 20.0, it.end, PERIOD)
    assert not truth.cycle_means(at_rest, PERIOD)[0].any()


def test_mean_forces_are_the_mean_of_the_forces() -> None:
    it = rack()
    truth = it.truth(np.random.default_rng(1), 0.0, 9.81)
    end = float(it.arrivals[3]) - 3.0
    fine = truth.force(np.linspace(end - PERIOD, end, 20_001)[:-1] + PERIOD / 40_000.0)
    np.testing.assert_allclose(truth.cycle_means(np.array([end]), PERIOD)[1][0], fine.mean(axis=0), atol=1e-8)


def test_the_error_of_the_rack_is_its_own_at_each_attitude() -> None:
    it = rack(0.1)
    perfect = rack().truth(np.random.default_rng(1), 0.0, 9.81).attitude(it.arrivals)
    off = (perfect.inv() * it.truth(np.random.default_rng(1), 0.0, 9.81).attitude(it.arrivals)).as_rotvec()
    assert 0.05 < math.degrees(float(np.sqrt(np.mean(off**2)))) < 0.15
    assert len(np.unique(off)) == off.size


def test_drilling_follows_the_rack_and_is_that_of_a_rig_without_one() -> None:
    world = World(load_scenario(FIELD), 1)
    assert world.rack is not None
    assert world.begin == world.rack.begin
    assert world.phases[0].start == world.rack.end
    plain = World(without("calibration"), 1)
    shift = world.rack.end - plain.begin
    for tube in (1, 3):
        t = np.array([plain.begin + 200.0])
        np.testing.assert_allclose(world.truth(tube).force(t + shift), plain.truth(tube).force(t), atol=1e-9)


def test_cues_have_names_of_their_own_and_come_in_order() -> None:
    cues = rack().cues()
    assert len({cue.name for cue in cues}) == len(cues) == 15
    assert [cue.at for cue in cues] == sorted(cue.at for cue in cues)


def test_drift_changes_raw_readings_by_its_matrix_and_bias_alone() -> None:
    drifted, plain = World(load_scenario(FIELD), 1), World(without("drift"), 1)
    drift = drifted.sensors.drift(2)
    assert drift is not None
    assert plain.sensors.drift(2) is None
    for cycle in (10, 200, 1200):
        clean, felt = np.array(plain.imu_sample(2, cycle)), np.array(drifted.imu_sample(2, cycle))
        np.testing.assert_array_equal(clean[:3], felt[:3])
        np.testing.assert_allclose(felt[3:], drift.matrix @ clean[3:] + drift.bias, atol=0.01)  # noise is not drifted
    assert not np.allclose(drift.matrix, drifted.sensors.drift(1).matrix)  # type: ignore[union-attr]
    np.testing.assert_array_equal(drift.matrix, World(load_scenario(FIELD), 1).sensors.drift(2).matrix)  # type: ignore[union-attr]


def test_drift_has_its_standard_deviations() -> None:
    section = DriftSection(
        accelerometer_scale_std=0.004, accelerometer_misalignment_std_deg=0.3, accelerometer_bias_std_mps2=0.05,
        gyroscope_bias_std_dps=0.02,
    )  # fmt: skip
    random = np.random.default_rng(1)
    drawn = [Drift.draw(section, random) for _ in range(4000)]
    matrices = np.array([d.matrix - np.eye(3) for d in drawn])
    std = matrices.std(axis=0)
    np.testing.assert_allclose(np.diag(std), 0.004, rtol=0.05)
    np.testing.assert_allclose(std[~np.eye(3, dtype=bool)], math.radians(0.3), rtol=0.05)
    np.testing.assert_allclose(np.array([d.bias for d in drawn]).std(axis=0), 0.05, rtol=0.05)
    np.testing.assert_allclose(np.array([d.rate for d in drawn]).std(axis=0), math.radians(0.02), rtol=0.05)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        (
            "[calibration]",
            "[calibration]\ncolour = 1",
            "calibration.colour: unknown key; expected one of attitudes_deg",
        ),
        ("[drift]", "[drift]\ncolour = 1", "drift.colour: unknown key; expected one of accelerometer_scale_std"),
        ("[calibration]", "[calibration]\nrecord_s = 25", "expected at most hold_s - 8 s"),
        ("[-90, 0], [-45, 0],", "[-90, 200],", "calibration.attitudes_deg"),
        ("[0, 0], [0, 45], [0, 90], [0, 135],", "", "calibration.attitudes_deg"),
        ("[45, 0], [90, 0], [-90, 0], [-45, 0],", "[0, 10],", "rank 3; add some"),
        ("scale_std = 0.004", "scale_std = 0.4", "drift.accelerometer_scale_std"),
        ("@474+15", "@574+30", "kill-node:2@574+30"),
    ],
)
def test_a_section_that_cannot_be_is_named(tmp_path: Path, old: str, new: str, named: str) -> None:
    (tmp_path / "field-calibration-path.csv").write_text((SCENARIOS / "field-calibration-path.csv").read_text())
    text = FIELD.read_text()
    assert old in text
    (tmp_path / "field.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(ScenarioError, match=named.replace("+", r"\+")):
        World(load_scenario(tmp_path / "field.toml"), 1)


def test_a_section_without_presets_is_none() -> None:
    with pytest.raises(ValueError, match="attitudes_deg"):
        CalibrationSection()  # type: ignore[call-arg]


@pytest.mark.slow
def test_an_operator_waits_for_a_ground_station_that_does_not_know_the_time_yet(tmp_path: Path) -> None:
    world = World(load_scenario(FIELD), 1)
    rig = InlineRig(world, {}, "rig-1", tmp_path)
    cues: list[str] = []

    def follow(progress: RigProgress) -> None:
        rig.stepper.follow(progress)
        if progress.cue:
            cues.append(progress.cue)
            if cues == ["begin", "attitude 1", "attitude 2"]:
                rig.close()
                rig.stepper.drop(BASE)
                rig.stepper.follow(progress)

    scheduler = Scheduler(world, rig.stepper, follow, cued=True)
    scheduler.begin()
    scheduler.advance(until=lambda: "attitude 3" in cues)
    assert cues.count("attitude 1") == 1
    assert cues.count("attitude 2") > 1
    assert len(rig.ask("recalibration")["attitudes"]) == 3
    rig.close()
