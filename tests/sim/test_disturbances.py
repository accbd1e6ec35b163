"""One table of disturbances: what a row does to a rig it does to a campaign, or a campaign refuses it by name."""

import ast
import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from node.kernels.record.node_record import A_YAW, BEHIND, LATE, LATE_STD, READING, SPLIT, TEMPERATURE
from sim.campaign.chunk import Campaign
from sim.errors import ScenarioError
from sim.string.allowlist import UNUSED, is_expressed, refused_keys
from sim.string.direct_string import DirectString
from sim.string.drawn_string import DrawnString
from sim.string.head_measurements import measure_head
from sim.studies.scenarios import Tables, change_sections
from sim.world.disturbance.chain import lane_starts
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.disturbance.lanes import draw_further, draw_numbers
from sim.world.disturbance.records import make_tubes
from sim.world.disturbance.row import OneImu
from sim.world.disturbance.sensor_reading import constants_of, read_frames, read_sensors
from sim.world.scenario import Scenario, scenario_of
from sim.world.scenario_file import ScenarioFile
from sim.world.world import World

pytestmark = pytest.mark.slow

SEED = 3
STRING: Tables = {
    "rig": {"tubes": 1, "tubes_at_start": 1, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}},
    "schedule": {"add_s": 60.0, "stop_s": 32.0, "finish_s": 5.0},
    "rotation": {"turns": 10.0},
    "gyroscope": {
        "noise_dps_rthz": (1e-9,) * 3,
        "bias_std_dps": (0.0,) * 3,
        "constant_bias_dps": (0.0,) * 3,
        "constant_bias_std_dps": 0.0,
        "scale_factor_std": 0.0,
        "resolution_dps": 0.0,
    },
    "accelerometer": {"noise_deg": 1e-9, "bias_std_deg": 0.0, "vibration_mps2": 0.0},
    "medium": {"link": "off"},
}
PLAIN: Tables = STRING
FIELD = {"vibration": {"highest_hz": 200.0}, "sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0}}
ROUGH: Tables = change_sections(STRING, rough={"samples_hz": 500.0, **FIELD})


def rough_with(**tables: dict[str, Any]) -> Tables:
    """The rough string with other values of keys of some tables below ``rough``."""
    return change_sections(ROUGH, rough={name: FIELD[name] | values for name, values in tables.items()})


def sensor(**values: float) -> Tables:
    return rough_with(sensor=values)


def gyroscope(**values: Any) -> Tables:
    return change_sections(PLAIN, gyroscope=values)


def disturbed(name: str, **values: Any) -> Tables:
    return change_sections(PLAIN, disturbance={name: values})


# each row of the table on, above a string on which it is off; what is drawn cycle by cycle is alike by distribution
EXACT: dict[str, Tables] = {
    "pull-across": sensor(g_sensitivity_dps_per_g=1.0),
    "low-pass": sensor(low_pass_hz=5.0),
    "frames": sensor(crystal=0.05),
    "warm-up": sensor(warm_up_dps=10.0, warm_up_c=10.0, warm_up_s=60.0),
    "gyroscope": gyroscope(
        constant_bias_dps=(1.0, 2.0, 3.0), constant_bias_std_dps=0.1, scale_factor_std=0.05, misalignment_std_deg=1.0
    ),
    "pull-along": gyroscope(g_sensitivity_dps_per_g=0.5),
    "steps": gyroscope(resolution_dps=0.7),
    "range": gyroscope(range_dps=50.0),
    "force-bias": change_sections(PLAIN, accelerometer={"bias_std_deg": 1.0}),
    "mount-tilt": change_sections(PLAIN, joints={"mount_tilt_std_deg": 1.0}),
    "play": disturbed("play", sigma_deg=0.5, bow_deg=0.5),
    "mount-slip": disturbed("mount-slip", after_s=70.0, pitch_deg=2.0, roll_deg=-3.0, turn_deg=10.0),
    "force-step": disturbed("force-step", after_s=80.0, step_mg=(1.0, -2.0, 3.0), creep_mg_per_s=(0.1, 0.2, -0.3)),
    "calibration-exchanged": change_sections(
        disturbed("calibration-exchanged", raw_mg=20.0), rig={"tubes": 2, "tubes_at_start": 2}
    ),
    "axes-exchanged": disturbed("axes-exchanged", after_s=80.0),
}
DRAWN_ANEW: dict[str, tuple[Tables, ...]] = {
    "torsional-vibration": (rough_with(vibration={"torsional_dps": 5.0}),),
    "vibration": (rough_with(vibration={"turning_g": 0.5}),),
    "wander": (
        gyroscope(bias_std_dps=(0.1, 0.2, 0.3), bias_tau_s=0.8),
        change_sections(ROUGH, gyroscope={"bias_std_dps": (0.1, 0.2, 0.3), "bias_tau_s": 0.8}),
    ),
    "white-noise": (
        gyroscope(noise_dps_rthz=(0.1, 0.2, 0.3)),
        change_sections(ROUGH, gyroscope={"noise_dps_rthz": (0.1, 0.2, 0.3)}),
    ),
    "force-noise": (
        change_sections(PLAIN, accelerometer={"noise_deg": 0.1, "vibration_mps2": 0.5}),
        change_sections(ROUGH, accelerometer={"noise_deg": 0.1}),
    ),
}
REFUSED: dict[str, Tables] = {
    "earth-rate": change_sections(ROUGH, rough={"latitude_deg": 50.0}),
    "rectification": rough_with(vibration={"turning_g": 0.5}, sensor={"rectification_dps_per_g2": 1.0}),
    "asymmetry": sensor(scale_asymmetry=0.01),
    "clipped-rates": change_sections(ROUGH, gyroscope={"range_dps": 60.0}),
    "clipped-forces": sensor(force_range_g=0.9),
    "jitter": sensor(jitter_ms=10.0),
    "single-samples": gyroscope(instantaneous=True),
    "bias-step": gyroscope(bias_step_dps=1.0),
    "slow-twist": change_sections(ROUGH, disturbance={"slow-twist": {"twist_deg": 2.0}}),
    "joint-slips": change_sections(ROUGH, disturbance={"joint-slips": {"slip_deg": 2.0}}),
    "whirl": change_sections(ROUGH, disturbance={"whirl": {"lean_deg": 1.0, "force_g": 0.1}}),
    "drift": change_sections(PLAIN, drift={"accelerometer_bias_std_mps2": 0.1}),
    "eighths": gyroscope(increments=True),
}
# rows that change no reading of an IMU, but what the encoder counts, or which cycles are run
OFF_THE_IMU: dict[str, Tables] = {
    "counter-stands": change_sections(ROUGH, disturbance={"counter-stands": {"after_s": 70.0, "stands_s": 3.0}}),
    "counts-lost": change_sections(ROUGH, disturbance={"counts-lost": {"above_dps": 50.0, "share": 0.01}}),
    "lost-cycles": disturbed("lost-cycles", after_s=70.0, cycles=3),
}


def rig_rows(scenario: Scenario, seed: int) -> np.ndarray:
    """What the only tube of a rig reads, (cycles, READING)."""
    world = World(scenario, seed)
    rows = np.zeros((world.cycles, READING))
    rows[:, :6] = world.sensors.samples(1)
    if scenario.file.rough is not None:
        found = world.sensors.rough_cycles(1)
        rows[:, LATE], rows[:, LATE_STD], rows[:, TEMPERATURE] = found.late, found.late_std, found.temperature
    if (parts := world.sensors.parts(1)) is not None:
        rows[:, BEHIND:], rows[:, SPLIT] = np.nan_to_num(parts), np.isfinite(parts[:, 0])
    return rows


def read_campaign(string: DrawnString, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """What the encoder of a campaign measures, and what its tubes read, (tubes, cycles, READING).

    The tubes read as if they were in the string from the first cycle on.
    """
    world = World(string.scenario, seed)
    (schedule, run), drawn, reading = string.redraw(world), string.new_readings(world), np.zeros((1, READING))
    draws, numbers, shared = (drawn.counter, drawn.key, drawn.words), drawn.numbers, drawn.shared[0]
    rows = np.zeros((len(drawn.tubes), world.cycles, READING))
    for (tube, cycle), end in np.ndenumerate(schedule.ends + schedule.later[:, None]):
        place, own, is_first = (cycle, tube), drawn.tubes[tube], cycle == 0
        draw_numbers(*draws, numbers, *place)
        if run is None:
            read_sensors(shared, own, is_first, *drawn.felt, numbers, reading, end, *place)
        else:
            draw_further(*draws, run.field.desk.drawn, *place)
            read_frames(shared, own, is_first, run.field, numbers, reading, end, *place)
        rows[tube, cycle] = reading[0]
    return schedule.measured, rows


@functools.cache
def quiet_rows(*, is_rough: bool) -> np.ndarray:
    """What the only tube of a rig reads with every row of the table off."""
    return rig_rows(scenario_of(dict(ROUGH if is_rough else PLAIN)), SEED)


def test_every_row_of_the_table_is_tried_once() -> None:
    assert sorted(row.name for row in TABLE) == sorted([*EXACT, *DRAWN_ANEW, *REFUSED, *OFF_THE_IMU])


@pytest.mark.parametrize("name", [row.name for row in TABLE if row.name not in OFF_THE_IMU])
def test_a_row_that_is_on_changes_what_a_rig_reads(name: str) -> None:
    tables = EXACT.get(name) or REFUSED.get(name) or DRAWN_ANEW[name][0]
    before, after = quiet_rows(is_rough="rough" in tables), rig_rows(scenario_of(dict(tables)), SEED)
    assert np.abs(after - before).max() > 5e-5  # the earth's rate is 7.3e-5 rad/s


@pytest.mark.parametrize("name", ["counter-stands", "counts-lost"])
def test_a_row_of_the_disc_changes_what_the_encoder_measures(name: str) -> None:
    """The counter that stands misses 3 s of 71 deg/s; the slow one a hundredth of what it turns above 50 deg/s."""
    clean, off = (measure_head(World(scenario_of(dict(tables)), SEED)) for tables in (ROUGH, OFF_THE_IMU[name]))
    missed = np.degrees(np.mod(clean[-1, A_YAW] - off[-1, A_YAW], math.tau))
    turned, slow = 10.0 * 360.0, 2.0 * 50.0**2 / 35.0 / 2.0  # deg; on the two ramps, below 50 deg/s
    expected = 3.0 * 71.0 if name == "counter-stands" else 0.01 * (turned - slow)
    assert missed == pytest.approx(expected % 360.0, abs=0.5)


def test_cycles_that_are_lost_are_run_by_no_node() -> None:
    world = World(scenario_of(dict(OFF_THE_IMU["lost-cycles"])), SEED)
    string = DirectString(world)
    run = string.drill()
    missing = np.flatnonzero(np.isnan(run.yaw[:, 0]))
    assert missing.tolist() == [k for k in range(world.cycles) if world.ends[k] - world.begin >= 70.0][:3]
    assert string.nodes[0]["cycles"] == world.cycles - 3


@pytest.mark.parametrize("name", [*REFUSED, "counter-stands", "counts-lost"])
def test_a_row_without_a_form_for_campaigns_is_refused_by_its_key(name: str) -> None:
    scenario = scenario_of(dict({**REFUSED, **OFF_THE_IMU}[name]))
    row = next(row for row in TABLE if row.name == name)
    with pytest.raises(
        ScenarioError, match=r"a campaign cannot express it; borechain rig runs such a scenario"
    ) as said:
        Campaign(scenario)
    assert row.owns(str(said.value).split(":")[0])


@pytest.mark.parametrize("name", EXACT)
def test_a_row_without_noise_reads_in_a_campaign_what_it_reads_in_a_rig(name: str) -> None:
    """In a rough world frames come up to half a place of ``PLACES``, 0.3 ms, from where they come in a rig."""
    scenario = scenario_of(dict(EXACT[name]))
    apart = np.abs(read_campaign(DrawnString(scenario), SEED)[1][0] - rig_rows(scenario, SEED))
    if scenario.file.rough is None:
        assert apart[:, :6].max() < 1e-8
        return
    assert np.quantile(apart[:, :3], 0.95) < 1e-4
    assert np.quantile(apart[:, 3:6], 0.95) < 2e-3
    assert apart[:, TEMPERATURE].max() < 1e-9
    assert apart[:, LATE].max() < 1e-3
    assert apart[:, LATE_STD].max() < 1e-4
    assert apart[:, SPLIT].mean() < 0.02
    assert np.quantile(apart[apart[:, SPLIT] == 0.0, BEHIND:], 0.9) < 2e-4


@pytest.mark.parametrize(
    ("name", "which"), [(name, k) for name, all_of in DRAWN_ANEW.items() for k in range(len(all_of))]
)
def test_what_is_drawn_anew_is_distributed_as_in_a_rig(name: str, which: int) -> None:
    scenario = scenario_of(dict(DRAWN_ANEW[name][which]))
    string = DrawnString(scenario)
    pairs = [(read_campaign(string, seed)[1][0, :, :6], rig_rows(scenario, seed)[:, :6]) for seed in range(1, 7)]
    turning = np.abs(World(scenario, 1).motion.drive(World(scenario, 1).ends - 1.0)[1]) > 1.2
    still = ~turning & ~np.roll(turning, 8) & ~np.roll(turning, -8)
    for phase in (turning & np.roll(turning, 4) & np.roll(turning, -4), still):
        for axis in range(6):
            ours, theirs = (np.array([rows[phase, axis] for rows in side]) for side in zip(*pairs, strict=True))
            assert alike(ours - theirs.mean(axis=1, keepdims=True), theirs - theirs.mean(axis=1, keepdims=True)), axis


def alike(ours: np.ndarray, theirs: np.ndarray) -> bool:
    """Whether rows (runs, n) have one mean, spread and correlation from cycle to cycle, by their number.

    Means and correlations are known within 1 / sqrt(n) of each sample, spreads within that over sqrt(2), and the
    samples of what wanders here count for a third; 5 sigma of two samples are allowed.
    """
    allowed = 5.0 * np.sqrt(2.0 * 3.0 / ours.size)
    spread, other = ours.std(), theirs.std()
    if max(spread, other) < 1e-5:
        return True
    follows = [np.mean(rows[:, 1:] * rows[:, :-1]) / rows.var() for rows in (ours, theirs)]
    return bool(
        abs(ours.mean()) < allowed * other
        and abs(np.log(spread / other)) < allowed
        and abs(follows[0] - follows[1]) < allowed
    )


@pytest.mark.parametrize("tables", [PLAIN, ROUGH], ids=["plain", "rough"])
def test_what_is_constant_of_a_tube_is_what_a_rig_draws_to_the_last_bit(tables: Tables) -> None:
    on = change_sections(
        tables, gyroscope={"constant_bias_std_dps": 0.1, "scale_factor_std": 0.05, "misalignment_std_deg": 1.0}
    )
    file = scenario_of(dict(change_sections(on, accelerometer={"bias_std_deg": 1.0}))).file
    tube, drawn = make_tubes(file, SEED, np.zeros(2))[1], constants_of(OneImu(file, SEED, 2))
    np.testing.assert_array_equal(tube["rate_bias"], drawn["gyroscope"].bias)
    np.testing.assert_array_equal(tube["gains"][:, :3], drawn["gyroscope"].matrix)
    np.testing.assert_array_equal(tube["force_bias"], drawn["force-bias"])


def test_rows_have_names_keys_and_lanes_of_their_own() -> None:
    names, starts = [row.name for row in TABLE], list(lane_starts(TABLE).values())
    assert len(set(names)) == len(names)
    assert len(set(starts)) == len(starts)
    known = {key for key, _ in keys_of_file(ScenarioFile)}
    for row in TABLE:
        assert set(row.keys) <= known, row.name


# --- every key of a scenario

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


def section_in(annotation: Any) -> type[BaseModel] | None:
    """The table that a field of a scenario is, or may be; of a list of tables none."""
    if isinstance(annotation, type):
        kinds: tuple[Any, ...] = (annotation,)
    else:
        kinds = () if get_origin(annotation) is tuple else get_args(annotation)
    found = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]
    return found[0] if found else None


def keys_of_file(model: type[BaseModel], within: str = "") -> Iterator[tuple[str, Any]]:
    """Keys of a scenario and their defaults, and the names of tables that may be absent."""
    for name, field in model.model_fields.items():
        key, usual = within + name, field.get_default(call_default_factory=True)
        section = section_in(field.annotation)
        if section is None:
            yield key, (usual, field)
            continue
        if usual is None:
            yield key, (None, field)
        yield from keys_of_file(section, f"{key}.")


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
