"""A cluster of IMUs: fused by inverse variance, robust against one that fails, each with its own mean in a survey."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from groundstation.survey.fusion.resolve import combine_imus
from node.errors import NodeConfigurationError
from node.firmware.alignment_orders import tube_rotation
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import Kernel, TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import Err, default_config
from node.kernels.record.node_record import new_node
from node.kernels.record.sensor_record import MAX_IMUS
from node.kernels.sensors.cluster import fuse_readings
from node.kernels.sensors.cluster_watch import DISAGREEING, HEALTHY
from node.process.drivers.replay_drivers import ReplayImu
from node.process.reading import reading_of
from node.process.tube_command import node as command
from node.process.tube_process import TubeProcess
from telemetry.messages import Event, NodeFlag, Severity, SurveyMeasurement
from telemetry.parameters import SensorParameters

G = 9.81
LEAN = 2.0 * DEG
SPIN = 20.0 * DEG
BIASES = np.array([[0.3, -0.2, 0.25], [-0.4, 0.1, -0.3], [0.1, 0.2, -0.1]]) * DEG
SIDEWAYS = np.array([-0.03, 0.0, 0.0])


class Clustered:
    """A tube with several IMUs, each with a bias and noise of its own, turned as told; what it reads may be spoilt."""

    def __init__(
        self,
        noises: tuple[float, ...] = (1.0, 1.0),
        kernel: Kernel = "float64",
        tilts: tuple[tuple[float, float], ...] = (),
        biases: np.ndarray = BIASES,
    ) -> None:
        self.noises, self.biases = np.array(noises), biases
        self.random = np.random.default_rng(3)
        self.config = default_config()
        imus = tuple(ImuSettings(noise=noise) for noise in noises)
        self.settings = TubeSettings(1, state_every=1, kernel=kernel, imus=imus)
        numbers = iter(range(10**9)).__next__
        self.tube = Tube(
            self.settings, self.config, new_node(self.config), numbers, restored=False
        )  # fmt: skip
        self.frames = [np.eye(3)] * len(noises)
        for k, (pitch, roll) in enumerate(tilts):
            axis = np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])
            self.frames[k] = tube_rotation(axis).T
        self.angle, self.now = 0.4, 1000.0
        self.spoilt: dict[int, object] = {}  # IMU from 0: rates and forces added, a reading instead, or the last one
        self.last: list[list[float]] = []
        self.events: list[Event] = []
        self.surveys: list[SurveyMeasurement] = []
        self.flags = NodeFlag.NONE

    def rows(self, rate: float) -> list[list[float]]:
        middle = self.angle + 0.5 * rate * PERIOD
        down = np.array([-math.sin(LEAN) * math.cos(middle), math.sin(LEAN) * math.sin(middle), math.cos(LEAN)])
        self.angle += rate * PERIOD
        rows = []
        for k, noise in enumerate(self.noises):
            gyro = self.frames[k] @ [0.0, 0.0, rate] + self.biases[k] + noise * 2e-4 * self.random.standard_normal(3)
            felt = self.frames[k] @ (-G * down) + noise * 0.02 * DEG * G * self.random.standard_normal(3)
            spoilt = self.spoilt.get(k, np.zeros(6))
            row = np.concatenate([gyro, felt])
            if isinstance(spoilt, np.ndarray):
                rows.append((row + spoilt).tolist())
            else:
                rows.append(spoilt if isinstance(spoilt, list) else self.last[k])
        self.last = rows
        return rows

    def cycles(self, count: int, rate: float = 0.0) -> "Clustered":
        for _ in range(count):
            first, *others = [
                ImuReading(self.now, self.now + PERIOD, (r[0], r[1], r[2]), (r[3], r[4], r[5])) for r in self.rows(rate)
            ]
            self.now += PERIOD
            reading = ImuReading(first.start, first.end, first.rate, first.force, others=tuple(others))
            around = RigContext(True, 1, self.now, 1e-8, True)
            for said in self.tube.on_cycle(reading, around):
                if isinstance(said, Event):
                    self.events.append(said)
                elif isinstance(said, SurveyMeasurement):
                    self.surveys.append(said)
            self.flags |= self.tube.flags(around, self.now)
        return self

    def told(self) -> list[tuple[str, object, object]]:
        return [
            (e.code, e.arguments["imu"], e.arguments.get("reason")) for e in self.events if e.code.startswith("imu_")
        ]


finite = st.floats(-100.0, 100.0)


@given(st.integers(1, MAX_IMUS), st.data())
@pytest.mark.slow
def test_the_fused_reading_is_the_mean_by_inverse_variance(count: int, data: st.DataObject) -> None:
    readings = data.draw(arrays(np.float64, (count, 6), elements=finite))
    weights = data.draw(arrays(np.float64, count, elements=st.one_of(st.just(0.0), st.floats(0.01, 100.0))))
    fused = np.empty(6)
    if not weights.any():
        weights[0] = 1.0
    fuse_readings(readings, weights, fused)
    np.testing.assert_allclose(fused, weights @ readings / weights.sum(), atol=1e-9)
    spoilt = np.where(weights[:, None] > 0.0, readings, np.nan)
    again = np.empty(6)
    fuse_readings(spoilt, weights, again)
    np.testing.assert_array_equal(again, fused)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noises", "factor"),
    [
        pytest.param((1.0, 1.0), math.sqrt(0.5), marks=pytest.mark.statistical),
        ((1.0, 2.0), math.sqrt(0.8)),
        ((1.0, 1.0, 1.0, 1.0), 0.5),
    ],
)
def test_the_noise_falls_with_the_root_of_the_number(noises: tuple[float, ...], factor: float) -> None:
    """4000 cycles of three axes: the deviation of a standard deviation is 0.65 %."""
    alone, together = (Clustered(n, biases=np.zeros((4, 3))).cycles(130) for n in ((1.0,), noises))
    deviations = []
    for one in (alone, together):
        readings = []
        for _ in range(4000):
            one.cycles(1)
            raw = one.tube.raw
            assert raw is not None
            readings.append([*raw.rate, *raw.force])
        deviations.append(np.array(readings).std(axis=0))
    for sensor in (slice(0, 3), slice(3, 6)):
        found = np.sqrt(np.mean(deviations[1][sensor] ** 2) / np.mean(deviations[0][sensor] ** 2))
        assert found == pytest.approx(factor, rel=0.04)
    for name in ("gyro_noise", "bias_std", "force_std"):
        np.testing.assert_allclose(together.tube.config[name], factor * default_config()[0][name])


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_a_survey_has_the_mean_and_covariance_of_each_imu(kernel: Kernel) -> None:
    clustered = Clustered((1.0, 3.0), kernel).cycles(110).cycles(20, SPIN).cycles(60)
    survey = clustered.surveys[-1]
    assert len(survey.imus) == 2
    first, second = (np.array(imu.force_cov) for imu in survey.imus)
    assert 3.0 < np.trace(second) / np.trace(first) < 27.0
    assert np.trace(first) / 3.0 == pytest.approx((0.02 * DEG * G) ** 2 / 32.0, rel=0.5)
    mean, cov = combine_imus(
        np.array([imu.force for imu in survey.imus]), np.array([imu.force_cov for imu in survey.imus])
    )
    assert np.trace(cov) < np.trace(first)
    inclination = math.atan2(math.hypot(mean[0], mean[1]), -mean[2])
    assert math.degrees(inclination) == pytest.approx(2.0, abs=0.02)


@pytest.mark.slow
def test_two_imus_halve_the_variance_of_a_survey() -> None:
    """60 stops: the ratio of two variances of 120 numbers each has a standard error of 18 %."""
    errors: dict[int, list[float]] = {1: [], 2: []}
    for count, found in errors.items():
        clustered = Clustered((1.0,) * count).cycles(110)
        for _ in range(60):
            clustered.tube.take_survey()
            clustered.cycles(40)
            imus = clustered.surveys[-1].imus
            forces, covs = np.array([m.force for m in imus]), np.array([m.force_cov for m in imus])
            mean = combine_imus(forces, covs)[0]
            heading = clustered.angle
            truth = G * math.sin(LEAN) * np.array([math.cos(heading), -math.sin(heading)])
            found.extend((mean[:2] - truth).tolist())
    ratio = float(np.mean(np.square(errors[2])) / np.mean(np.square(errors[1])))
    assert 0.3 < ratio < 0.8


FAULTS = {
    "dead": ([math.nan] * 6, "bad_sample", 1),
    "saturated": ([0.0, 0.0, 500.0 * DEG, 0.1, 0.2, -9.8], "gyro_saturated", 1),
    "stuck": ("stuck", "gyro_stuck", 4),
    "off by 3 deg/s": (np.array([0.0, 0.0, 3.0 * DEG, 0.0, 0.0, 0.0]), "disagrees", DISAGREEING),
    "off by 1.5 m/s2": (np.array([0.0, 0.0, 0.0, 1.5, 0.0, 0.0]), "disagrees", DISAGREEING),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("rate", [0.0, SPIN])
def test_a_faulty_imu_is_left_out_by_name_and_comes_back(fault: str, count: int, which: int, rate: float) -> None:
    spoilt, reason, within = FAULTS[fault]
    clustered = Clustered((1.0,) * count).cycles(150).cycles(10, rate)
    assert clustered.told() == []
    clustered.spoilt[which] = spoilt
    clustered.cycles(within, rate)
    assert clustered.told() == [("imu_excluded", which + 1, reason)]
    assert [e.severity for e in clustered.events if e.code == "imu_excluded"] == [Severity.ERROR]
    clustered.cycles(30, rate)
    clustered.spoilt.clear()
    clustered.cycles(HEALTHY - 1, rate)
    assert len(clustered.told()) == 1
    clustered.cycles(2, rate)
    assert clustered.told()[1:] == [("imu_back", which + 1, None)]
    assert NodeFlag.SENSOR_FAULT not in clustered.flags
    rates = [e.code for e in clustered.events if e.code.startswith("gyro")]
    assert rates == []


def test_the_bias_that_the_node_knows_stays_whoever_is_left_out() -> None:
    clustered = Clustered().cycles(400)
    before = float(clustered.tube.state["now_rate"])
    clustered.spoilt[1] = [math.nan] * 6
    clustered.cycles(3)
    assert abs(BIASES[0, 2] - BIASES[1, 2]) / 2.0 > 0.2 * DEG  # what the mean would step by
    assert abs(float(clustered.tube.state["now_rate"]) - before) < 0.05 * DEG
    assert "started" not in [e.code for e in clustered.events]
    alone = default_config()[0]["gyro_noise"]
    np.testing.assert_allclose(clustered.tube.config["gyro_noise"], alone)


def test_a_change_of_the_members_opens_the_bias() -> None:
    clustered = Clustered().cycles(400)
    before = float(clustered.tube.state["P"][Err.BIAS_Z, Err.BIAS_Z])
    clustered.spoilt[0] = [math.nan] * 6
    clustered.cycles(1)
    sigma = float(default_config()[0]["bias_std"][2])
    assert float(clustered.tube.state["P"][Err.BIAS_Z, Err.BIAS_Z]) > before
    assert float(clustered.tube.state["P"][Err.BIAS_Z, Err.BIAS_Z]) < before + 0.6 * sigma**2


def test_without_any_imu_the_node_says_bad_sample_and_goes_on() -> None:
    clustered = Clustered().cycles(150)
    clustered.spoilt = {0: [math.nan] * 6, 1: [math.nan] * 6}
    clustered.cycles(5)
    codes = [e.code for e in clustered.events]
    assert "bad_sample" in codes
    assert codes.count("imu_excluded") == 2
    assert np.isfinite(clustered.tube.yaw)
    clustered.spoilt.clear()
    clustered.cycles(40)
    assert [e.code for e in clustered.events].count("imu_back") == 2


def test_an_imu_left_out_of_a_stop_is_not_in_its_survey() -> None:
    clustered = Clustered().cycles(150).cycles(10, SPIN).cycles(20)
    clustered.spoilt[1] = [math.nan] * 6
    clustered.cycles(2)
    clustered.spoilt.clear()
    clustered.cycles(30)
    assert len(clustered.surveys) == 1
    assert len(clustered.surveys[0].imus) == 1


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_every_imu_is_aligned_by_itself(kernel: Kernel) -> None:
    tilts = ((0.8 * DEG, -0.5 * DEG), (-0.6 * DEG, 0.4 * DEG))
    clustered = Clustered(kernel=kernel, tilts=tilts).cycles(150)
    assert clustered.tube.align("circle", 2.0) == ""
    clustered.cycles(220, 7.0 * DEG).cycles(60)
    found = [e.arguments for e in clustered.events if e.code == "aligned"]
    assert [f["imu"] for f in found] == [1, 2]
    for f, tilt in zip(found, tilts, strict=True):
        assert (f["pitch_deg"], f["roll_deg"]) == pytest.approx(np.degrees(tilt), abs=0.01)
    forces = np.array([imu.force for imu in clustered.surveys[-1].imus])
    assert np.abs(forces[0] - forces[1]).max() < 0.01
    assert clustered.told() == []


@pytest.mark.parametrize("count", [1, 2])
def test_an_imu_that_sits_the_other_way_round_is_corrected_by_itself(count: int) -> None:
    turned = SensorParameters(matrix=((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))
    clustered = Clustered((1.0,) * count)
    imus = [ImuSettings()] * (count - 1) + [ImuSettings(gyroscope=turned, accelerometer=turned)]
    clustered.tube = Tube(
        replace(clustered.settings, imus=tuple(imus)), clustered.config, new_node(clustered.config),
        iter(range(10**9)).__next__, restored=False,
    )  # fmt: skip
    clustered.frames[-1] = np.diag([-1.0, -1.0, 1.0])
    clustered.cycles(110).cycles(20, SPIN).cycles(60)
    means = [np.array(imu.force) for imu in clustered.surveys[-1].imus]
    assert len(means) == count
    heading = clustered.angle
    truth = G * np.array([math.sin(LEAN) * math.cos(heading), -math.sin(LEAN) * math.sin(heading), -math.cos(LEAN)])
    for mean in means:
        np.testing.assert_allclose(mean, truth, atol=0.005)
    raw = clustered.tube.raw
    assert raw is not None
    np.testing.assert_allclose(raw.force, truth, atol=0.02)  # what a static record and a block of the tube see
    assert clustered.told() == []


@pytest.mark.parametrize("sensor", ["gyroscope", "accelerometer"])
@pytest.mark.parametrize("matrix", [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), ((math.nan,) * 3,) * 3])
def test_a_correction_that_cannot_be_is_refused_by_name(sensor: str, matrix: tuple) -> None:
    with pytest.raises(NodeConfigurationError, match=sensor):
        ImuSettings(**{sensor: SensorParameters(matrix=matrix)})


def test_the_offsets_survive_the_power(tmp_path: Path) -> None:
    settings = TubeSettings(1, imus=(ImuSettings(), ImuSettings(noise=2.0)))
    clustered = Clustered((1.0, 2.0))
    process = TubeProcess(settings, tmp_path)
    for _ in range(150):
        start, clustered.now = clustered.now, clustered.now + PERIOD
        process.on_cycle([start, *clustered.rows(0.0)], clustered.now)
    process._save()
    again = TubeProcess(settings, tmp_path)
    kept = again.nodes[0]["mount"]["rate_offset"]
    np.testing.assert_array_equal(kept, process.nodes[0]["mount"]["rate_offset"])
    assert kept[0] - kept[1] == pytest.approx(BIASES[0] - BIASES[1], abs=0.01 * DEG)


def test_a_cycle_on_the_wire_brings_one_imu_or_several() -> None:
    one = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    plain = reading_of([10.0, *one], 10.5)
    assert (plain.rate, plain.force, plain.others) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), ())
    both = reading_of([10.0, one, [*one[::-1], 31.0]], 10.5)
    assert (both.rate, both.force) == (plain.rate, plain.force)
    assert (both.others[0].rate, both.others[0].temperature) == ((6.0, 5.0, 4.0), 31.0)
    half = reading_of([10.0, one, [1.0, "x"]], 10.5)
    assert half.rate == plain.rate
    assert math.isnan(half.others[0].rate[0])


@pytest.mark.parametrize("data", [None, [], 7, "cycle", [10.0], [10.0, []], [10.0, None], ["x", 1, 2, 3, 4, 5, 6]])
def test_what_is_no_cycle_is_a_reading_of_no_numbers(data: object) -> None:
    reading = reading_of(data, 10.5)
    assert math.isnan(reading.rate[0])
    assert reading.end == 10.5


def test_sources_of_a_board_are_fused_and_one_that_ends_is_told_by_its_number(tmp_path: Path) -> None:
    clustered = Clustered()
    rows = np.array([[k, *np.ravel(clustered.rows(0.0))] for k in range(40)])
    for imu, columns, count in ((1, slice(1, 7), 40), (2, slice(7, 13), 25)):
        np.save(tmp_path / f"{imu}.npy", np.column_stack([rows[:count, 0], rows[:count, columns]]))
    sources = [ReplayImu(tmp_path / f"{imu}.npy") for imu in (1, 2)]
    settings = TubeSettings(3, imus=clustered.settings.imus)
    process = TubeProcess(settings, tmp_path / "node", imus=sources)
    told: list[tuple[str, object]] = []
    process._send_event = lambda _, code, arguments: told.append((code, arguments.get("imu")))  # type: ignore[method-assign]
    for imu in process._imus:
        imu._alarm._say = process._send_event
    for k in range(30):
        process.on_cycle(None, 1000.0 + (k + 1) * PERIOD)
        raw = process.tube.raw
        assert raw is not None
        wanted = 0.5 * (rows[k, 1:7] + rows[k, 7:13])
        if k < 25:
            np.testing.assert_allclose([*raw.rate, *raw.force], wanted, atol=1e-12)
    assert told == [("sensor_failed", 2)]
    assert process.nodes[0]["cluster"]["used"][:2].tolist() == [1, 0]
    with pytest.raises(NodeConfigurationError, match="2 sources"):
        TubeProcess(settings, tmp_path / "other", imus=sources[:1])


def test_settings_of_a_cluster_that_cannot_be_are_refused_by_name() -> None:
    with pytest.raises(NodeConfigurationError, match="imus"):
        TubeSettings(1, imus=())
    with pytest.raises(NodeConfigurationError, match="imus"):
        TubeSettings(1, imus=(ImuSettings(),) * (MAX_IMUS + 1))


@pytest.mark.parametrize(
    "options",
    [
        ["--imu", "replay:a", "--imu", "replay:b", "--imu-noise", "1"],
        ["--imu-noise", "1", "--imu-noise", "0"],
        ["--imu-offset-mm", "2000", "0"],
        ["--imu", "replay:a", "--imu", "gps:b"],
        ["--imu", "replay:a", "--imu-gyroscope", "no-such-imu.json"],
    ],
)
def test_options_of_a_cluster_that_cannot_be_are_one_line_and_exit_2(options: list[str], tmp_path: Path) -> None:
    result = CliRunner().invoke(command, ["--tube", "1", "--folder", str(tmp_path), *options])
    assert result.exit_code == 2
    assert "imu" in result.stderr
    assert "Traceback" not in result.output
