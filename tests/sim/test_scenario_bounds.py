"""Every limit between two keys of a scenario, at its very value and just beyond it."""

from __future__ import annotations

from typing import Any

import pytest

from sim.errors import ScenarioError
from sim.world.scenario import scenario_of

LEVEL = [[0.0, 0.0], [0.0, 90.0], [0.0, 180.0], [0.0, -90.0]]  # deg, about one axis: no bias along it
ROUND = [*LEVEL, [90.0, 0.0], [-90.0, 0.0], [45.0, 0.0], [45.0, 90.0], [45.0, 180.0]]
PLAIN: dict[str, Any] = {
    "rig": {"tubes": 3, "tube_length_m": 2.0, "tubes_at_start": 2, "depth_at_start_m": 3.0},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "schedule": {"add_s": 60.0, "stop_s": 27.0, "joint_s": 20.0, "blocks": 2},
}


def scenario(changes: dict[str, dict[str, Any]]) -> Any:
    tables = {name: dict(table) for name, table in PLAIN.items()}
    for name, table in changes.items():
        tables[name] = tables.get(name, {}) | table
    return scenario_of(tables)


@pytest.mark.parametrize(
    ("within", "beyond", "words"),
    [
        (
            {"rotation": {"rate_dps": 342.0}},
            {"rotation": {"rate_dps": 342.01}},
            "rotation.rate_dps: expected at most 342",
        ),
        (
            {"rig": {"tubes_at_start": 3}, "schedule": {"blocks": 1}},
            {"rig": {"tubes_at_start": 4}},
            "at most tubes = 3, got 4",
        ),
        ({"rig": {"depth_at_start_m": 4.0}}, {"rig": {"depth_at_start_m": 4.001}}, "at most the 4 m that the tubes"),
        ({"schedule": {"blocks": 2}}, {"schedule": {"blocks": 1}}, "schedule.blocks: expected at least one for each"),
        (
            {"schedule": {"joint_s": 59.99}},
            {"schedule": {"joint_s": 60.0}},
            "schedule.joint_s: expected less than add_s = 60",
        ),
        ({"medium": {"latency_ms": 0.5}}, {"medium": {"latency_ms": 0.49}}, "medium.latency_ms: expected at least 0.5"),
        (
            {"torsion": {"release_after_s": 2.0, "release_s": 3.0}},
            {"torsion": {"release_after_s": 2.0, "release_s": 3.01}},
            "schedule.stop_s: expected at least 27.01 s",
        ),
        (
            {"torsion": {"outer_diameter_m": 0.06, "inner_diameter_m": 0.0599}},
            {"torsion": {"outer_diameter_m": 0.06, "inner_diameter_m": 0.06}},
            "torsion.inner_diameter_m: expected less than",
        ),
        (
            {"node": {"joints": "solved"}},
            {"node": {"joints": "solved", "scheme": "intersection"}},
            "node.joints: expected marks with the scheme intersection",
        ),
        (
            {"rough": {"samples_hz": 400.0, "vibration": {"turning_g": 0.1, "lowest_hz": 20.0, "highest_hz": 200.0}}},
            {"rough": {"samples_hz": 400.0, "vibration": {"turning_g": 0.1, "lowest_hz": 20.0, "highest_hz": 200.1}}},
            "rough.vibration: expected lowest_hz below highest_hz",
        ),
        (
            {"rough": {"samples_hz": 400.0, "vibration": {"resting_g": 0.1, "lowest_hz": 20.0, "highest_hz": 20.1}}},
            {"rough": {"samples_hz": 400.0, "vibration": {"resting_g": 0.1, "lowest_hz": 20.0, "highest_hz": 20.0}}},
            "rough.vibration: expected lowest_hz below highest_hz",
        ),
        (
            {"rough": {"samples_hz": 400.0, "vibration": {"turning_g": 0.0, "lowest_hz": 20.0, "highest_hz": 210.0}}},
            {
                "rough": {
                    "samples_hz": 400.0,
                    "vibration": {"torsional_dps": 0.1, "lowest_hz": 20.0, "highest_hz": 210.0},
                }
            },
            "rough.vibration: expected lowest_hz below highest_hz",
        ),
        (
            {"rough": {}},
            {"rough": {}, "joints": {"head_turn_deg": 1.0}},
            "joints.head_turn_deg: expected no such setting",
        ),
        (
            {"rough": {}},
            {"rough": {}, "encoder": {"edge_times": False}, "medium": {"link": "off"}},
            "encoder.edge_times",
        ),
        ({"rough": {}}, {"rough": {}, "gyroscope": {"instantaneous": True}}, "gyroscope.instantaneous"),
        (
            {"node": {"imus": 2, "imu_noise": [1, 2]}},
            {"node": {"imus": 2, "imu_noise": [1]}},
            "node.imu_noise: expected 2",
        ),
        ({"node": {"imus": 2, "imu_noise": []}}, {"node": {"imus": 1, "imu_noise": [1, 1]}}, "expected 1 factors"),
        (
            {"calibration": {"attitudes_deg": ROUND, "record_s": 22.0, "hold_s": 30.0}},
            {"calibration": {"attitudes_deg": ROUND, "record_s": 22.1, "hold_s": 30.0}},
            "calibration.record_s: expected at most hold_s - 8 s = 22 s",
        ),
        (
            {"calibration": {"attitudes_deg": ROUND}},
            {"calibration": {"attitudes_deg": [*LEVEL, *LEVEL, LEVEL[0]]}},
            "rank 4.*got rank 3",
        ),
        ({"told": {"joint_tube": 3}}, {"told": {"joint_tube": 4}}, "told.joint_tube: expected one of 3 tubes, got 4"),
        (
            {"told": {"lengths_off_m": [0.1, 0.0, 0.0]}},
            {"told": {"lengths_off_m": [0.1, 0.0, 0.0, 0.0]}},
            "told.lengths_off_m: expected at most 3",
        ),
        (
            {"told": {"depth_stuck_s": 5.0, "depth_stuck_after_s": 0.0}},
            {"told": {"depth_stuck_s": 5.0}},
            "depth_stuck_after_s with it",
        ),
        (
            {"path": {"moved": {"after_s": 90.0, "from_m": 1.0, "to_m": 7.0}}},
            {"path": {"moved": {"after_s": 90.0, "from_m": 1.0, "to_m": 7.001}}},
            "path.moved.to_m: expected at most the 7 m",
        ),
        (
            {"path": {"moved": {"after_s": 90.0, "from_m": 1.0, "to_m": 1.01}}},
            {"path": {"moved": {"after_s": 90.0, "from_m": 1.0, "to_m": 1.0}}},
            "path.moved.to_m: expected more than from_m = 1",
        ),
    ],
)
def test_a_limit_is_kept_at_its_value_and_refused_beyond(
    within: dict[str, Any], beyond: dict[str, Any], words: str
) -> None:
    scenario(within)
    with pytest.raises(ScenarioError, match=words):
        scenario(beyond)


@pytest.mark.parametrize(
    ("key", "table"),
    [
        ("medium.delay_ms", {"medium": {"delay_ms": 1.0}}),
        ("medium.dated_by", {"medium": {"dated_by": "arrival"}}),
        ("aiding", {"aiding": {"off_s": 1.0}}),
        ("encoder.edge_times", {"encoder": {"edge_times": False}}),
        ("node.tuning", {"node": {"tuning": {"rate_std": 1.0}}}),
    ],
)
def test_what_a_link_decides_is_refused_beside_one(key: str, table: dict[str, dict[str, Any]]) -> None:
    with pytest.raises(ScenarioError, match=f'{key}: expected medium.link = "off" with it'):
        scenario(table)
    if key != "node.tuning":  # whose names are those of a record
        scenario(table | {"medium": table.get("medium", {}) | {"link": "off"}})


def test_a_disturbance_is_of_the_table_and_of_a_tube_that_is_there() -> None:
    def asked(name: str, **table: Any) -> None:
        scenario({"disturbance": {name: table}})

    asked("force-step", tube=3)
    with pytest.raises(ScenarioError, match=r"disturbance.force-step.tube: expected one of 3 tubes, got 4"):
        asked("force-step", tube=4)
    with pytest.raises(
        ScenarioError, match=r"disturbance.earthquake: no such disturbance has a table; expected one of "
    ):
        asked("earthquake")
    with pytest.raises(ScenarioError, match=r"disturbance.force-step: .*colour"):
        asked("force-step", colour=1)
    asked("calibration-exchanged", tubes=[1, 3])
    with pytest.raises(ScenarioError, match="expected two tubes, got 3 twice"):
        asked("calibration-exchanged", tubes=[3, 3])
    with pytest.raises(ScenarioError, match=r"disturbance.calibration-exchanged.tubes: expected one of 3 tubes, got 4"):
        asked("calibration-exchanged", tubes=[1, 4])
