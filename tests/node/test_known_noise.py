"""What a node takes of a record at rest: noise and correlation time by ``borechain allan``; the datasheet's scale."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.__main__ import cli
from node.firmware.imu_settings import ImuSettings
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Err, default_config
from node.process.drivers.choice import imu_source
from node.process.tube_process import TubeProcess
from telemetry.errors import LoggerError
from telemetry.parameters import SensorParameters
from telemetry.records.noise_file import read_gyro_noise

pytestmark = pytest.mark.slow
RATE = 20.0
WHITE, BIAS, TAU = 0.004, 0.02, 200.0  # deg/s/sqrt(Hz), deg/s, s


def readings(seconds: float, seed: int) -> np.ndarray:
    """Three axes (n, 3), deg/s, of white noise and a Gauss-Markov bias, exact at every step."""
    from scipy.signal import lfilter  # a second, of everybody who collects the tests

    random, count = np.random.default_rng(seed), round(seconds * RATE)
    keep = math.exp(-1.0 / (RATE * TAU))
    driven = random.standard_normal((count, 3)) * BIAS * math.sqrt(1.0 - keep**2)
    driven[0] = BIAS * random.standard_normal(3)
    wander = lfilter([1.0], [1.0, -keep], driven, axis=0)
    return wander + WHITE * math.sqrt(RATE) * random.standard_normal((count, 3))


def analysed(folder: Path, unit: str, seconds: float = 7200.0) -> Path:
    """File that ``borechain allan --out`` makes of a record in a unit."""
    scale = math.radians(1.0) if unit == "rad/s" else 1.0
    np.save(folder / "rest.npy", readings(seconds, 5) * scale)
    words = [
        "allan",
        str(folder / "rest.npy"),
        "--rate",
        f"{RATE:g}",
        "--gyro",
        unit,
        "--out",
        str(folder / "noise.json"),
    ]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done.output
    return folder / "noise.json"


@pytest.fixture(scope="module")
def noise_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return analysed(tmp_path_factory.mktemp("noise"), "deg/s")


def process_of(folder: Path, settings: TubeSettings) -> TubeProcess:
    """Node whose IMU plays a rest of three minutes and then five of a slow turn."""
    count = round(480.0 * RATE)
    rates = np.radians(readings(480.0, 9))
    rates[round(180.0 * RATE) :, 2] += math.radians(1.0)
    rows = np.column_stack([np.arange(count) / RATE, rates, np.tile([0.0, 0.0, -9.81], (count, 1))])
    rows[:, 4:] += 0.01 * np.random.default_rng(2).standard_normal((count, 3))
    np.save(folder / "imu.npy", rows)
    return TubeProcess(settings, folder / "state", imus=[imu_source(f"replay:{folder / 'imu.npy'}")])


def test_the_file_of_allan_is_read_in_si_whatever_its_unit(noise_file: Path, tmp_path: Path) -> None:
    found = read_gyro_noise(noise_file)
    assert np.degrees(found.white) == pytest.approx(WHITE, rel=0.1)
    again = read_gyro_noise(analysed(tmp_path, "rad/s"))
    for name in ("white", "bias_std", "bias_tau"):
        assert getattr(again, name) == pytest.approx(getattr(found, name), rel=1e-6)
    assert min(found.bias_tau) > 50.0


def test_a_node_s_yaw_grows_uncertain_as_the_sensor_of_the_file_drifts(noise_file: Path, tmp_path: Path) -> None:
    """Against the yaw's variance by the closed form of the process itself; the usual 15.87 s are a third of it."""
    sigmas = {}
    for name, noise in (("file", read_gyro_noise(noise_file)), ("usual", None)):
        known = ImuSettings(gyroscope=SensorParameters(bias=(1e-9, 0.0, 0.0)))
        (tmp_path / name).mkdir()
        process = process_of(tmp_path / name, TubeSettings(1, gyro_noise=noise, imus=(known,)))
        now = 1000.0
        for _ in range(round(479.0 / PERIOD)):
            now += PERIOD
            process.on_cycle([now - PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, -9.81], now)
            process.take_frames(now)
            if now < 1170.0:
                process.state["P"][0, Err.YAW, :] = process.state["P"][0, :, Err.YAW] = 0.0
        sigmas[name] = math.degrees(math.sqrt(process.tube.yaw_var))
    span = 479.0 - 180.0
    drift = BIAS * math.sqrt(2.0 * TAU * (span - TAU * (1.0 - math.exp(-span / TAU))))
    assert 0.5 * drift < sigmas["file"] < 1.5 * drift
    assert sigmas["usual"] < 0.5 * sigmas["file"]


def test_noise_scale_and_stillness_follow_what_is_known(noise_file: Path, tmp_path: Path) -> None:
    noise, usual = read_gyro_noise(noise_file), default_config()[0]
    bare = process_of(tmp_path, TubeSettings(1, gyro_noise=noise)).config[0]
    assert bare["bias_tau"] == pytest.approx(noise.bias_tau)
    assert bare["bias_std"] == pytest.approx(noise.bias_std)
    assert bare["gyro_noise"] == pytest.approx(noise.white)
    assert bare["scale_std"] == pytest.approx(0.015)
    corrected = ImuSettings(gyroscope=SensorParameters(bias=(0.02, 0.0, 0.0)), noise=4.0)
    known = process_of(tmp_path, TubeSettings(1, imus=(corrected,))).config[0]
    assert known["scale_std"] == usual["scale_std"]
    assert np.degrees(known["still_rate"]) == pytest.approx(6.0 * 4.0 * 7.313e-3 / math.sqrt(PERIOD))
    assert TubeProcess(TubeSettings(2), tmp_path / "simulated").config[0]["scale_std"] == usual["scale_std"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda found: "no json", "expected the --out file of borechain allan"),
        (
            lambda found: json.dumps(found | {"unit": "m/s2"}),
            "unit: expected one of the gyroscope, rad/s, .*got 'm/s2'",
        ),
        (lambda found: json.dumps(found | {"axes": {"x": found["axes"]["x"]}}), "with three axes"),
        (lambda found: json.dumps(_with(found, "bias_tau", 0.0)), r"y\.bias_tau: expected a number above 0"),
        (lambda found: json.dumps(_with(found, "white", None)), r"y\.white: expected a number above 0"),
        (lambda found: json.dumps(_with(found, "bias_std", 1e3)), r"y\.bias_std: .*at most 10, got 1000"),
        (lambda found: json.dumps(_with(found, "bias_std", math.nan)), r"y\.bias_std: .* got nan"),
    ],
)
def test_a_file_that_is_no_gyroscope_s_noise_is_named(noise_file: Path, tmp_path: Path, change, says: str) -> None:
    (tmp_path / "noise.json").write_text(change(json.loads(noise_file.read_text())))
    with pytest.raises(LoggerError, match=says):
        read_gyro_noise(tmp_path / "noise.json")
    from forked_commands import run

    done = run("node", "--tube", "1", "--imu", "replay:x.csv", "--gyro-noise", str(tmp_path / "noise.json"))
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    assert "noise.json" in done.stderr


def _with(found: dict, name: str, value: float | None) -> dict:
    found["axes"]["y"]["filter"][name] = value
    return found
