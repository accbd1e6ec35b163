"""One table of disturbances: what a row does to a rig it does to a campaign, or a campaign refuses it by name."""

import functools
import math
from typing import Any

import numpy as np
import pytest
from campaign_readings import keys_of_file, read_campaign

from node.kernels.record.node_record import A_YAW, BEHIND, LATE, LATE_STD, READING, SPLIT, TEMPERATURE
from sim.campaign.chunk import Campaign
from sim.errors import ScenarioError
from sim.string.direct_string import DirectString
from sim.string.drawn_string import DrawnString
from sim.string.head_measurements import measure_head
from sim.studies.scenarios import Tables, change_sections
from sim.world.disturbance.chain import lane_starts
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.disturbance.records import make_tubes
from sim.world.disturbance.row import OneImu
from sim.world.disturbance.sensor_reading import constants_of
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
