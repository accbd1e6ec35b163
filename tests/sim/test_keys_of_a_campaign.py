"""Every key of a scenario changes what a campaign reads or finds, is refused, or is listed as unused."""

import ast
import functools
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from campaign_readings import keys_of_file, read_campaign

from sim.campaign.chunk import Campaign
from sim.errors import ScenarioError
from sim.string.allowlist import UNUSED, is_expressed, refused_keys
from sim.studies.scenarios import Tables, change_sections
from sim.world.scenario import scenario_of
from sim.world.scenario_file import ScenarioFile

pytestmark = pytest.mark.slow

SEED = 3
RESTING = {"add_s": 30.0, "stop_s": 24.0, "finish_s": 5.0, "joint_s": 20.0}
HONEST: Tables = {
    "rig": {"tubes": 2, "tube_length_m": 2.0, "tubes_at_start": 1},
    "path": {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}},
    "schedule": RESTING,
    "rotation": {"turns": 2.0},
    "medium": {"link": "off", "loss": 0.1},
}
IN_FIELD: Tables = change_sections(
    HONEST,
    encoder={"phase": "random"},
    rough={
        "samples_hz": 500.0,
        "drive": {"ripple": 0.1, "stick_slip": 0.1, "dead_stop_dps": 2.0, "turns_back_deg": 1.0},
        "string": {"backlash_deg": 0.1, "twist_deg": 0.5},
        "encoder": {"eccentricity_deg": 0.05, "belt_slip": 0.001, "outliers": 0.3},
        "vibration": {"turning_g": 0.2, "torsional_dps": 2.0, "highest_hz": 200.0},
        "sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0, "warm_up_dps": 0.1, "warm_up_c": 5.0},
    },
)
FOLDER = Path(__file__).parents[2] / "scenarios"
SPIRAL = {"inclination_deg": 20.0, "azimuth_deg": 35.0, "turn_deg": 10.0}
MOVED = {"after_s": 10.0, "from_m": 1.0, "to_m": 2.0, "north_deg": 1.0}
ATTITUDES = [[0, 0], [0, 45], [0, 90], [0, 135], [0, 180], [0, -135], [45, 0], [90, 0], [-90, 0], [-45, 0]]
SOIL = [{"sand": 0.5, "clay": 0.1, "water": 0.1}]
HOLES = [{"name": "a"}, {"name": "b", "north_m": 1.0}]
# what a key needs beside it to mean anything, by the key or the table that it is in
BESIDE: dict[str, dict[str, Any]] = {
    "path.spiral.": {"path": {"straight": None, "spiral": SPIRAL}},
    "path.drawn.": {"path": {"straight": None, "drawn": {}}},
    "path.moved.": {"path": {"moved": MOVED}},
    "told.joint_tube": {"told": {"joint_deg": 5.0}},
    "told.joint_deg": {"told": {"joint_tube": 2}},
    "told.depth_stuck_s": {"told": {"depth_stuck_after_s": 10.0}},
    "torsion": {"schedule": {"stop_s": 40.0}},
    "aiding.on_s": {"aiding": {"off_s": 10.0}},
    "medium.delay_ms": {"medium": {"dated_by": "arrival"}},
    "medium.latency_ms": {"medium": {"dated_by": "arrival"}},
    "calibration.": {"calibration": {"attitudes_deg": ATTITUDES}},
    "radio": {"medium": {"link": "on"}},
    "radio.": {"radio": {"soil": SOIL}},
    "radio.pipe": {"radio": {"soil": [], "mode": "pipe", "pipe": {}, "frequency_mhz": 5800.0}},
    "site.": {"site": {"holes": HOLES}},
}
# other values than the usual ones, where the rule of ``other_value`` has none that can be or that would be noticed
OTHER: dict[str, Any] = {
    "rough.encoder.stuck_bit": 3,
    "rig.tubes": 3,
    "rig.tube_length_m": 2.5,
    "rig.tubes_at_start": 0,
    "rig.depth_at_start_m": 1.0,
    "path.straight": {"inclination_deg": 10.0},
    "path.drawn.seed": 2,
    "path.moved": MOVED,
    "path.moved.after_s": 20.0,
    "path.moved.from_m": 0.5,
    "path.moved.to_m": 3.0,
    "setup.untold": ["joints"],
    "setup.unchecked": ["north"],
    "told.joint_tube": 2,
    "told.lengths_off_m": [0.5],
    "told.depth_stuck_after_s": 10.0,
    "told.depth_stuck_s": 20.0,
    "schedule.blocks": 3,
    "rotation.advance_m": 1.0,
    "joints.head_turn_deg": 10.0,
    "gyroscope.range_dps": 60.0,
    "encoder.counts_per_turn": 2048,
    "clocks.stated_std_ms": 1.0,
    "medium.transports": ["can"],
    "radio": {"soil": SOIL},
    "radio.attempts": 4,
    "radio.soil": [{"sand": 0.3, "clay": 0.1, "water": 0.1}],
    "radio.burst_every_s": 100.0,
    "radio.pipe.reach": 1,
    "aiding.off_s": 10.0,
    "aiding.every_s": 5.0,
    "node.tuning": {"gyro_noise": 1e-3},
    "node.kernel": "fixed",
    "node.imus": 2,
    "node.imu_noise": [2.0],
    "design.length_m": 5.0,
    "calibration": {"attitudes_deg": ATTITUDES},
    "calibration.attitudes_deg": [*ATTITUDES, [0, -90]],
    "site": {"holes": HOLES},
    "site.name": "other",
    "site.holes": [{"name": "a"}, {"name": "c", "north_m": 1.0}],
    "rough.latitude_deg": 50.0,
    "rough.encoder.outliers": 0.1,
    "rough.vibration.highest_hz": 150.0,
    "rough.sensor.frames_hz": 100.0,
    "rough.sensor.low_pass_hz": 15.0,
    "rough.sensor.crystal": 0.01,
    "rough.sensor.force_range_g": 0.9,
    "faults": ["kill-node:1@60+5"],
}
# tables of the other scenario, of a key that takes the place of others
INSTEAD: dict[str, dict[str, Any]] = {
    "path.displacements": {"path": {"straight": None, "displacements": str(FOLDER / "wellbore-1-path.csv")}},
    "path.stations": {"path": {"straight": None, "stations": str(FOLDER / "field-calibration-path.csv")}},
    "path.spiral": {"path": {"straight": None, "spiral": SPIRAL}},
    "path.drawn": {"path": {"straight": None, "drawn": {"inclination_deg": 20.0}}},
    "radio.mode": {"medium": {"link": "on"}, "radio": {"mode": "pipe", "pipe": {}, "frequency_mhz": 5800.0}},
    "rough": {"rough": IN_FIELD["rough"], "encoder": IN_FIELD["encoder"]},
}
# the format has one version, and tables below ``disturbance`` are tried row by row
ELSEWHERE = ("version", "disturbance")


KEYS = dict(keys_of_file(ScenarioFile))


def other_value(key: str) -> Any:
    """Another value than the usual one, that the scenario may have."""
    usual, field = KEYS[key]
    if key in OTHER:
        return OTHER[key]
    if isinstance(usual, bool):
        return not usual
    if choices := [value for value in get_args(field.annotation) if isinstance(value, str)]:
        return next(value for value in choices if value != usual)
    if isinstance(usual, tuple):
        return tuple(1.1 * value for value in usual)
    if usual is None:
        return {}
    return 1.1 * usual if usual else 0.03


def usual_tables(key: str) -> Tables:
    """A scenario of few tubes in which a key means something."""
    tables = IN_FIELD if key.startswith("rough.") else HONEST
    for name, needed in BESIDE.items():
        if key == name or key.startswith(name):
            tables = change_sections(tables, **needed)
    return tables


def other_tables(key: str) -> Tables:
    """The same with another value of the key."""
    if key in INSTEAD:
        return change_sections(HONEST, **INSTEAD[key])
    *within, last = key.split(".")
    return put(dict(usual_tables(key)), within, last, other_value(key))


def put(tables: dict[str, Any], within: list[str], last: str, value: Any) -> dict[str, Any]:
    """Tables with a value at a key."""
    if not within:
        return {**tables, last: value}
    first, *deeper = within
    return {**tables, first: put(tables.get(first) or {}, deeper, last, value)}


@functools.lru_cache(maxsize=8)
def _found(tables: str) -> tuple[dict[str, np.ndarray], list[np.ndarray]]:
    campaign = Campaign(scenario_of(ast.literal_eval(tables)))
    chunk = campaign.chunk(SEED, SEED)
    columns = {**chunk.surveys, **{f"epochs {name}": values for name, values in chunk.epochs.items()}}
    measured, rows = read_campaign(campaign.string, SEED)
    return columns, [measured, *rows]


def found_alike(one: Tables, other: Tables) -> bool:
    """Whether campaigns of two scenarios measure, read and find the same, to the last bit."""
    (columns, rows), (others, other_rows) = _found(repr(dict(one))), _found(repr(dict(other)))
    pairs = [*((values, others[name]) for name, values in columns.items()), *zip(rows, other_rows, strict=False)]
    return len(rows) == len(other_rows) and all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs)


@pytest.mark.parametrize("key", [key for key in KEYS if key not in ELSEWHERE])
def test_a_key_changes_what_a_campaign_reads_or_finds_or_is_refused_or_is_listed_as_unused(key: str) -> None:
    usual, other = usual_tables(key), other_tables(key)
    if refused := list(refused_keys(scenario_of(dict(other)))):
        assert any(key == name.split(" ")[0] or key.startswith(f"{name}.") for name in refused), refused
        with pytest.raises(ScenarioError) as said:
            Campaign(scenario_of(dict(other)))
        assert str(said.value).startswith(f"{refused[0]}: a campaign cannot express it; borechain rig runs")
        assert key not in UNUSED
        return
    assert found_alike(usual, other) == (key in UNUSED)


def test_a_key_that_neither_a_row_nor_a_part_of_the_string_has_is_refused() -> None:
    assert not is_expressed("gyroscope.hysteresis_dps")
    assert is_expressed("gyroscope.noise_dps_rthz")
    assert not is_expressed("gyroscope.bias_step_dps")
