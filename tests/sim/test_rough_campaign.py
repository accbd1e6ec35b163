"""Campaigns of a rough world: its readings, its encoder and its vibration, and nodes that err alike."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from node_by_node import measure_by_firmware

from node.kernels.record.filter_record import PARTS
from node.kernels.record.node_record import BEHIND, LATE, LATE_STD, READING, SPLIT, TEMPERATURE
from sim.campaign.chunk import Campaign
from sim.errors import ScenarioError
from sim.string.direct_string import DirectString
from sim.string.drawn_string import frames_of
from sim.string.head_measurements import row_of_aiding
from sim.string.rough_head import measured_in_field
from sim.studies.epochs import epochs_of
from sim.studies.scenarios import Tables, change_sections
from sim.studies.worlds.run import rough_world
from sim.world.disturbance import fifo
from sim.world.disturbance.frame_layout import FINER
from sim.world.disturbance.frame_sums import FrameField
from sim.world.disturbance.frame_vibration import Vibration
from sim.world.disturbance.low_pass import low_passed
from sim.world.disturbance.records import make_shared, make_tubes
from sim.world.disturbance.row import OneImu
from sim.world.disturbance.sensor_reading import DRAWN, read_frames
from sim.world.disturbance.vibration import band_noise
from sim.world.disturbance.white_noise import add_part_noise
from sim.world.scenario import Scenario, load_scenario, scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow
STRING: Tables = {
    "rig": {"tubes": 2, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}},
    "schedule": {"add_s": 30.0, "joint_s": 20.0, "stop_s": 32.0, "finish_s": 5.0},
    "rotation": {"turns": 5.0},
    "accelerometer": {"bias_std_deg": 0.002},
    "medium": {"link": "off"},
    "clocks": {"joint_std_ms": 5.0, "wander_std_ms": 0.0},
}
# a reading that is the same bit for bit again and again is taken for one of a sensor that hangs
QUIET = {
    "gyroscope": {"noise_dps_rthz": (1e-6,) * 3, "bias_std_dps": (0.0,) * 3, "resolution_dps": 0.0},
    "accelerometer": {"noise_deg": 1e-5},
}


def field_of(**sections: dict[str, Any]) -> Scenario:
    """The rough world of the studies upon the string, with other values of some keys."""
    return scenario_of(dict(change_sections(rough_world(STRING), **sections)))


def without_noise(scenario: Scenario) -> Scenario:
    """The same without what is drawn from cycle to cycle: noise, vibration, readings of the encoder that are off."""
    file = scenario.file
    assert file.rough is not None
    still = file.rough.model_copy(
        update={
            "vibration": file.rough.vibration.model_copy(update={"turning_g": 0.0, "torsional_dps": 0.0}),
            "encoder": file.rough.encoder.model_copy(update={"outliers": 0.0}),
        }
    )
    quiet = {name: getattr(file, name).model_copy(update=values) for name, values in QUIET.items()}
    return Scenario(file.model_copy(update={"rough": still, **quiet}), scenario.hole, scenario.faults)


@pytest.fixture
def alike(monkeypatch: pytest.MonkeyPatch) -> Callable[[FrameField], None]:
    """Have the frames of a world's FIFOs come when those of a campaign's run do, to which half a place is nothing."""

    def follow(field: FrameField) -> None:
        def frame_times(imu: OneImu, t: np.ndarray) -> np.ndarray:
            front, own = field.front_end[0], field.fifos[imu.tube - 1]
            first = front["first"] + front["frame"] * (own["row"] + own["share"]) / FINER
            return np.arange(first, t[-1], front["frame"])

        monkeypatch.setattr(fifo, "frame_times", frame_times)

    return follow


@pytest.mark.parametrize("name", ["straight", "rough"])
def test_without_noise_every_sensor_reads_what_it_reads_in_the_rough_world(
    name: str, alike: Callable[[FrameField], None]
) -> None:
    """To less than the noise of a reading, 2e-4 rad/s and 3e-3 m/s^2, and mostly to less than a tenth of that.

    Between two phases of the frames, 5 ms apart, a step by s bends by s (2 pi 20 Hz)^2 behind the filter, and a
    straight line misses an eighth of that times the square of 5 ms: 0.05 s in one frame of the 27 of a reading, or of
    the three of an eighth. The head stops dead from 2 deg/s, and the circle about the axis begins and ends in steps.
    """
    drawn = load_scenario(Path("rough")) if name == "rough" else field_of(gyroscope={"misalignment_std_deg": 0.3})
    scenario = without_noise(drawn)
    world, made = World(scenario, 5), Campaign(scenario)
    assert made.string.rough is not None
    run, shared = made.string.rough.run(world), make_shared(scenario.file)[0]
    reading, drawn_numbers = np.zeros((1, READING)), np.zeros(DRAWN)
    alike(run.field)
    tubes = make_tubes(scenario.file, 5, frames_of(world))
    for tube in range(1, scenario.tubes + 1):
        found = world.sensors.rough_cycles(tube)
        rows = np.zeros((world.cycles, READING))
        for cycle in range(world.cycles):
            end = float(world.ends[cycle] + world.phase(tube))
            read_frames(shared, tubes[tube - 1], False, run.field, drawn_numbers, reading, end, cycle, tube - 1)
            rows[cycle] = reading[0]
        off = np.abs(rows[:, :6] - found.readings)
        assert off[:, :3].max() < 1e-4
        assert off[:, 3:].max() < 1e-3
        assert np.quantile(off[:, :3], 0.98) < 1e-5
        assert np.quantile(off[:, 3:], 0.98) < 1e-4
        told = np.isfinite(found.parts[:, 0]) if found.parts is not None else np.zeros(world.cycles, bool)
        assert np.array_equal(told, rows[:, SPLIT] == 1.0)
        assert told[1:].mean() > 0.9
        assert found.parts is not None
        parts = np.abs(rows[told, BEHIND:] - found.parts[told])
        assert parts.max() < 1e-3
        assert np.quantile(parts, 0.98) < 1e-4
        for column, values in ((LATE, found.late), (LATE_STD, found.late_std), (TEMPERATURE, found.temperature)):
            assert np.allclose(rows[:, column], values, rtol=0.0, atol=1e-9), column


def test_without_noise_the_nodes_err_as_those_of_a_rig_of_the_same_seed(alike: Callable[[FrameField], None]) -> None:
    """To 0.002 deg in the median; a node that decides otherwise by a hair is still within half a sigma."""
    scenario = without_noise(field_of(rig={"tubes": 3}, aiding={"on_s": 20.0, "off_s": 30.0}))
    made, apart = Campaign(scenario), []
    assert made.string.rough is not None
    for seed in (1, 2, 3):
        alike(made.string.rough.run(World(scenario, seed)).field)
        rig = DirectString(World(scenario, seed)).drill()
        surveys, epochs = made.run(seed)
        at = np.searchsorted(rig.ends, surveys["at"], side="right") - 1
        assert sorted((s.cycle, s.tube) for s in rig.surveys) == sorted(zip(at.tolist(), surveys["tube"], strict=True))
        cycle = np.searchsorted(rig.ends, epochs["at"], side="right") - 1
        place = made.string.schedule.powered[cycle] - epochs["hop"]
        sigma = np.sqrt(rig.total_var[cycle, place])
        assert np.all(np.abs(epochs["yaw_error"] - rig.total_error[cycle, place]) < 0.5 * sigma)
        apart += (epochs["yaw_error"] - rig.total_error[cycle, place]).tolist()
    assert np.degrees(np.median(np.abs(apart))) < 2e-3


def test_noise_of_the_parts_of_a_window_is_that_of_its_frames() -> None:
    """Of 20 000 draws a covariance is known within 1 % of the largest variance; twice that is allowed."""
    random, borders = np.random.default_rng(1), np.array([5.0, 5.4, 8.7, 12.1, 15.4, 18.8, 22.1, 25.4, 28.8, 31.0])
    frames = np.arange(5, 31)
    shares = [np.clip(np.minimum(b, frames + 1.0) - np.maximum(a, frames), 0.0, 1.0) for a, b in pairwise(borders)]
    noises = np.zeros((20_000, PARTS + 1))
    for noise in noises:
        add_part_noise(noise, borders, PARTS + 1, 2.0, random.standard_normal(), random.standard_normal(2 * PARTS))
    wanted = 4.0 * np.array(shares) @ np.array(shares).T
    assert np.allclose(np.cov(noises.T), wanted, rtol=0.0, atol=0.02 * wanted.max())


def test_the_encoder_measures_what_it_measures_in_the_rough_world() -> None:
    scenario = without_noise(field_of())
    world, rough_of = World(scenario, 3), scenario.file.rough
    assert rough_of is not None
    said = np.array([row_of_aiding(aiding) for aiding in measure_by_firmware(world)])
    moved = world.rough_run.moved
    assert np.array_equal(measured_in_field(world, rough_of.encoder, moved.t, moved.head), said)
    made = Campaign(scenario)
    assert made.string.rough is not None
    assert np.allclose(
        made.string.rough.run(world).measured, said, rtol=0.0, atol=1e-9
    )  # of a head that starts at 0, turned


def test_frames_of_a_vibration_have_the_spectrum_of_the_worlds() -> None:
    section = field_of().file.rough
    from scipy.signal import welch

    assert section is not None
    frame, hertz, random = 1.0 / (50.0 * 1.01), section.samples_hz, np.random.default_rng(1)
    vibration = section.vibration
    whole = band_noise(random, 1 << 20, hertz, vibration.lowest_hz, vibration.highest_hz)
    at = np.arange(0.0, len(whole) / hertz - 1.0, frame)
    passed = low_passed(whole[:, None], section.sensor.low_pass_hz, hertz)[:, 0]
    of_world = 9.80665 * vibration.turning_g * np.interp(at, np.arange(len(whole)) / hertz, passed)
    drawn = np.diff(Vibration(section, frame, 1 << 16).drawn(random)[1])
    spectra = [welch(values, 1.0 / frame, nperseg=64)[1][1:-1] for values in (drawn, of_world)]
    assert np.allclose(spectra[0], spectra[1], rtol=0.15)  # a thousand of each: 5 % of the two, three times that
    turned = np.cumsum(band_noise(random, 1 << 20, hertz, vibration.lowest_hz, vibration.highest_hz)) / hertz
    std = np.radians(vibration.torsional_dps) * turned.std()
    assert Vibration(section, frame, 1 << 16).angle_std == pytest.approx(std, rel=0.02)


def test_errors_are_distributed_as_those_of_the_string_of_the_studies() -> None:
    from scipy.stats import ks_2samp

    scenario = field_of()
    epochs = Campaign(scenario).chunk(101, 220).epochs
    normed = epochs["yaw_error"] / np.sqrt(epochs["yaw_var"] + epochs["systematic_var"])
    of_string: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(1, 13):
        string = DirectString(World(scenario, seed))
        run = string.drill()
        for cycle, turning in zip(*epochs_of(string.world), strict=True):
            known = np.isfinite(run.yaw[cycle])
            of_string[turning] += (run.total_error / np.sqrt(run.total_var))[cycle, known].tolist()
    for turning, found in of_string.items():
        assert ks_2samp(normed[epochs["turning"] == turning], found).pvalue > 0.01, turning


def test_a_run_depends_on_its_seed_alone() -> None:
    scenario = field_of()
    alone, among = Campaign(scenario).chunk(7, 7), Campaign(scenario).chunk(5, 8)
    for name, values in alone.epochs.items():
        assert np.array_equal(values, among.epochs[name][among.epochs["run"] == 7]), name
    assert len(np.unique(among.epochs["yaw_error"])) == len(among.epochs["yaw_error"])


@pytest.mark.parametrize(
    ("sections", "key"),
    [
        ({"rough": {"latitude_deg": 50.0}}, "rough.latitude_deg"),
        ({"rough": {"drive": {"stop_spread_deg": 10.0}}}, "rough.drive.stop_spread_deg"),
        ({"rough": {"string": {"transport": "parallel"}}}, "rough.string.transport"),
        ({"rough": {"encoder": {"jump_deg": 1.0}}}, "rough.encoder.jump_deg"),
        ({"rough": {"vibration": {"resting_g": 0.1}}}, "rough.vibration.resting_g"),
        ({"rough": {"vibration": {"turning_g": 2.0}}}, "rough.sensor.force_range_g"),
        ({"gyroscope": {"range_dps": 70.0}}, "gyroscope.range_dps"),
        ({"rough": {"sensor": {"frames_hz": 0.0}}}, "rough.sensor.frames_hz"),
        ({"rough": {"sensor": {"frames_hz": 50.0, "low_pass_hz": 0.0}}}, "rough.sensor.low_pass_hz"),
        ({"rough": {"sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0, "jitter_ms": 1.0}}}, "rough.sensor.jitter_ms"),
        (
            {"rough": {"sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0, "scale_asymmetry": 1e-3}}},
            "rough.sensor.scale_asymm",
        ),
        (
            {"rough": {"sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0, "rectification_dps_per_g2": 0.1}}},
            "rough.sensor.rectification_dps_per_g2",
        ),
    ],
)
def test_what_a_campaign_cannot_express_names_the_rig(sections: dict[str, Any], key: str) -> None:
    with pytest.raises(ScenarioError, match=rf"{key}.*borechain rig"):
        Campaign(field_of(**sections))
