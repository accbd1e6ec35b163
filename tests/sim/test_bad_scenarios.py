"""Scenarios, paths and faults that cannot be: each is refused, in one line that names the place and the remedy."""

from pathlib import Path

import pytest

from sim.errors import ScenarioError
from sim.world.scenario import load_scenario
from sim.world.world import World

SCENARIOS = Path(__file__).parents[2] / "scenarios"
DISPLACEMENTS = 'displacements = "wellbore-1-path.csv"'
STATIONS = 'stations = "wellbore-1-path.csv"'


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    for name in ("rig-3.toml", "wellbore-1-path.csv"):
        (tmp_path / name).write_text((SCENARIOS / name).read_text())
    return tmp_path / "rig-3.toml"


def refusal(scenario: Path, *faults: str) -> str:
    with pytest.raises(ScenarioError) as refused:
        World(load_scenario(scenario, faults), 1)
    message = str(refused.value)
    assert len(message.splitlines()) == 1
    return message


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("tubes = 3", "tubes = 3\ncolour = 1", "rig.colour: unknown key; expected one of tubes, tube_length_m"),
        ("[rig]", "[colour]\n[rig]", "colour: unknown key; expected one of version, rig, path"),
        ("tubes = 3", "tube = 3", "rig.tube: unknown key; did you mean tubes? expected one of tubes, tube_length_m"),
        ("[schedule]", "[shedule]", "shedule: unknown key; did you mean schedule? expected one of version, rig, path"),
        (
            "[rig]",
            "[torsion]\nouter_diameter = 0.06\n[rig]",
            "torsion.outer_diameter: unknown key; did you mean outer",
        ),
        ("[rig]", "version = 2\n[rig]", "version: expected at most 1, got 2; it needs a newer borechain"),
        ("[rig]", 'version = "new"\n[rig]', "version: "),
        ("[rig]", "version = 0\n[rig]", "version: "),
        ("tubes = 3", 'tubes = "three"', "rig.tubes"),
        ("tube_length_m = 2.0", "tube_length_m = -2.0", "rig.tube_length_m"),
        ("turns = 5", "turns = -5", "rotation.turns"),
        ("turns = 5", "turns = inf", "rotation.turns"),
        ("turns = 5", "turns = 5\nacceleration_dps2 = inf", "rotation.acceleration_dps2"),
        ("turns = 5", "turns = 5\nrate_dps = 342.1", "57 rev/min"),
        ("stop_s = 26.0", "stop_s = inf", "schedule.stop_s"),
        ("stop_s = 26.0", "stop_s = 26.0\nbegin_s = inf", "schedule.begin_s"),
        ("add_s = 58.0", "add_s = 10.0\njoint_s = 10.0", "schedule.joint_s"),
        ("[rig]", "[gyroscope]\nconstant_bias_dps = [nan, 0, 0]\n[rig]", "gyroscope.constant_bias_dps"),
        ("bias_std_deg = 0.002", "noise_deg = inf", "accelerometer.noise_deg"),
        ("[rig]", "[medium]\nlatency_ms = inf\n[rig]", "medium.latency_ms"),
        ("[rig]", "[medium]\nloss = 0.95\n[rig]", "medium.loss"),
        ("[rig]", '[node]\nscheme = "guess"\n[rig]', "node.scheme"),
        (
            "[rig]",
            '[node]\nkernel = "published"\n[rig]',
            "node.kernel: expected one of float64, fixed, got",
        ),
        ("[rig]", '[node]\nscheme = "estimate"\njoints = "solved"\n[rig]', "node.joints: expected marks"),
        ("[rig]", '[node]\njoints = "guessed"\n[rig]', "node.joints"),
        ("[rig]", '[node]\ntorsion = "guess"\n[rig]', "node.torsion"),
        ("[rig]", "[torsion]\ninner_diameter_m = 0.06\n[rig]", "torsion.inner_diameter_m: expected less than"),
        ("[rig]", "[torsion]\nouter_diameter_m = 0.0\n[rig]", "torsion.outer_diameter_m"),
        ("[rig]", "[torsion]\nbit_torque_nm = inf\n[rig]", "torsion.bit_torque_nm"),
        ("[rig]", "[torsion]\nrelease_s = 0.0\n[rig]", "torsion.release_s"),
        ("[rig]", "[torsion]\nrelease_after_s = 10.0\n[rig]", "schedule.stop_s: expected at least 35 s"),
        ("[rig]", "[torsion]\ntrapped_fraction = 0.6\n[rig]", "torsion.trapped_fraction"),
        ("[rig]", "[torsion]\ncolour = 1\n[rig]", "torsion.colour: unknown key; expected one of outer_diameter_m"),
        ("tubes = 3", "tubes = 11", "drill fewer tubes"),
        (DISPLACEMENTS, "", "exactly one of displacements, stations, straight, spiral and drawn, got 0"),
        (
            DISPLACEMENTS,
            f"{DISPLACEMENTS}\n{STATIONS}",
            "exactly one of displacements, stations, straight, spiral and drawn, got 2",
        ),
        ("[rig]", "[told]\njoint_tube = 4\njoint_deg = 1\n[rig]", "told.joint_tube: expected one of 3 tubes, got 4"),
        (
            "[rig]",
            "[told]\nlengths_off_m = [0, 0, 0, 1]\n[rig]",
            "told.lengths_off_m: expected at most 3, one a tube, got 4",
        ),
        ("[rig]", "[told]\ndepth_stuck_s = 9\n[rig]", "told.depth_stuck_s: expected depth_stuck_after_s with it"),
        ("[rig]", "[told]\ndepth_scale = 1.0\n[rig]", "told.depth_scale"),
        ("[rig]", "[path.moved]\nafter_s = 9\nfrom_m = 4\nto_m = 3\n[rig]", "path.moved.to_m: expected more than"),
        ("[rig]", "[path.moved]\nafter_s = 9\nfrom_m = 4\nto_m = 30\n[rig]", "path.moved.to_m: expected at most"),
        (DISPLACEMENTS, 'drawn = {kind = "curly"}', "path.drawn.kind"),
        ("[rig]", "[disturbance.force-step]\ntube = 5\n[rig]", "disturbance.force-step.tube: expected one of 3 tubes"),
        ("[rig]", "[disturbance.play]\nsigma_deg = -1\n[rig]", "disturbance.play: sigma_deg"),
        (
            "[rig]",
            "[disturbance.calibration-exchanged]\ntubes = [2, 2]\n[rig]",
            "disturbance.calibration-exchanged.tubes: expected two tubes",
        ),
        ("[rig]", "[rig", "not TOML"),
    ],
)
def test_a_key_that_cannot_be_is_named_with_its_file(scenario: Path, old: str, new: str, named: str) -> None:
    text = scenario.read_text()
    assert old in text
    scenario.write_text(text.replace(old, new, 1))
    message = refusal(scenario)
    assert message.startswith(f"{scenario}: ")
    assert named in message


@pytest.mark.parametrize(
    ("rows", "named"),
    [
        ("", "at least two stations"),
        ("0,0,0\n", "at least two stations"),
        ("1,0,0\n6,0,0\n", "expected measured depth 0, got 1 m"),
        ("0,0,0\n4,1,0\n2,1,0\n", "station 2: the path turns back"),
        ("0,0,0\n2,1,0\n2,1,0\n", "station 2: the path turns back"),
        ("0,0,0\n2,nonsense,0\n", "line 3: expected numbers"),
        ("0,0,0\n2,1\n", "line 3: expected numbers"),
        ("0,0,0\n2,900,0\n", "cannot be"),
        ("0,0,0\n6,nan,0\n", "cannot be"),
        ("0,0,0\n2,1,0\ninf,1,0\n", "station 2: expected a finite measured depth"),
    ],
)
def test_a_record_that_cannot_be_is_named_with_its_row(scenario: Path, rows: str, named: str) -> None:
    record = scenario.parent / "wellbore-1-path.csv"
    record.write_text("md_m,a_cm,b_cm\n" + rows)
    message = refusal(scenario)
    assert message.startswith(f"{record}: ")
    assert named in message


@pytest.mark.parametrize(
    ("rows", "named"),
    [
        ("0,0,0\n3,10,0\n6,175,180\n", "station 2 at 6 m: the path turns back, 175 deg"),
        ("0,0,0\n3,-1,0\n6,0,0\n", "station 1: expected an inclination"),
        ("0,0,0\n3,5,inf\n6,0,0\n", "station 1: expected an inclination"),
        ("0,180,0\n6,180,0\n", "station 0: expected an inclination"),
    ],
)
def test_stations_that_cannot_be_are_named(scenario: Path, rows: str, named: str) -> None:
    scenario.write_text(scenario.read_text().replace(DISPLACEMENTS, STATIONS))
    (scenario.parent / "wellbore-1-path.csv").write_text("md_m,inclination_deg,azimuth_deg\n" + rows)
    assert named in refusal(scenario)


@pytest.mark.parametrize(
    ("content", "named"),
    [(b"a,b\n1,2\n", "expected the columns md_m, a_cm, b_cm, got a, b"), (b"\xff\xfe\x00", "not a text file")],
)
def test_a_file_that_is_no_record_is_named(scenario: Path, content: bytes, named: str) -> None:
    record = scenario.parent / "wellbore-1-path.csv"
    record.write_bytes(content)
    message = refusal(scenario)
    assert str(record) in message
    assert named in message


@pytest.mark.parametrize("name", ["rig-3.toml", "wellbore-1-path.csv"])
def test_a_missing_file_is_named(scenario: Path, name: str) -> None:
    (scenario.parent / name).unlink()
    message = refusal(scenario)
    assert str(scenario.parent / name) in message
    assert "No such file" in message


def test_a_fault_of_a_file_is_named_with_the_file(scenario: Path) -> None:
    scenario.write_text('faults = ["melt:3@1"]\n' + scenario.read_text())
    message = refusal(scenario)
    assert message.startswith(f"{scenario}: faults: ")
    assert "melt:3@1" in message


def test_a_fault_before_its_tube_is_there_names_the_times(scenario: Path) -> None:
    assert "when the tube is added" in refusal(scenario, "kill-node:3@10")


@pytest.mark.parametrize(
    "second",
    [
        "kill-node:2@310+20",  # begins while the node is still down
        "kill-node:2@290+20",  # is still down when the first begins
        "kill-node:2@320+5",  # at the moment of the restart
    ],
)
def test_a_node_that_is_down_cannot_lose_power_again(scenario: Path, second: str) -> None:
    message = refusal(scenario, "kill-node:2@300+20", second)
    assert "kill-node:2@300+20" in message
    assert second in message


def test_power_cuts_of_one_node_after_another_and_of_two_nodes_at_once_are_possible(scenario: Path) -> None:
    faults = ("kill-node:2@320.5+5", "kill-node:2@300+20", "kill-node:1@305+20")
    assert len(World(load_scenario(scenario, faults), 1).faults) == 3
