"""Options of a node as its settings, each number another one; a temperature beyond its range, moment by moment."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner

from node.errors import NodeConfigurationError
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.firmware.kernel_choice import LOOPS, added_loop, float64_loop, kernel_of
from node.firmware.torque import TorqueSettings
from node.firmware.tube_settings import UNTOLD, MakeUpAngle, TubeSettings
from node.kernels.filter.resets import BX
from node.kernels.record.filter_record import STATE, Scheme
from node.process import node_host
from node.process.cluster_options import ClusterRequest
from node.process.drivers.choice import encoder_source, imu_source
from node.process.drivers.gpio_encoder import GpioEncoder
from node.process.drivers.iio_imu import IioImu
from node.process.drivers.mpu_imu import MpuImu
from node.process.drivers.vn100 import Vn100
from node.process.encoder_command import encoder
from node.process.temperature_range import TemperatureRange
from node.process.tube_options import TubeRequest, tube_options
from telemetry.messages import BASE, ENCODER, Severity, Side
from telemetry.parameters import SensorParameters
from telemetry.runtime.process_options import EndsRequest, PlaceRequest

SEEN: dict[str, Any] = {}


@click.command()
@tube_options
def told(request: TubeRequest, ends: EndsRequest, place: PlaceRequest) -> None:
    """Keep what the options say."""
    SEEN.update(settings=request.to_settings(), ends=ends, place=place, request=request)


def settings(*words: str) -> TubeSettings:
    result = CliRunner().invoke(told, ["--tube", "3", *words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found: TubeSettings = SEEN["settings"]
    return found


def test_what_is_not_told_is_as_usual() -> None:
    degree = math.pi / 180.0
    assert settings() == TubeSettings(
        tube=3,
        drive_joint=UNTOLD,
        lower_joint=UNTOLD,
        mount_std=0.05 * degree,
        kernel="float64",
        scheme=Scheme.FORWARD,
        stiffness=math.inf,
        torsion="gate",
        joints="marks",
        imus=(ImuSettings(),),
        gyro_noise=None,
    )
    assert SEEN["ends"] == EndsRequest("stepper", None, None, None, None)


def test_each_option_is_its_setting() -> None:
    degree = math.pi / 180.0
    found = settings(
        "--drive-joint-deg", "10", "--lower-joint-deg", "-20", "--joint-std-deg", "0.5", "--mount-std-deg", "0.25",
        "--stiffness-nm", "1234", "--torsion", "variance", "--joints", "both", "--clock", "own", "--above", "base",
        "--below", "2", "--upper", "can:can0", "--lower", "can:can1", "--imu", "iio:a", "--imu", "vn100:b",
        "--imu-noise", "2", "--imu-noise", "3", "--imu-offset-mm", "11", "-12", "--imu-offset-mm", "13", "14",
    )  # fmt: skip
    assert found.drive_joint == MakeUpAngle(10.0 * degree, 0.5 * degree)
    assert found.lower_joint == MakeUpAngle(-20.0 * degree, 0.5 * degree)
    assert (found.mount_std, found.stiffness, found.torsion, found.joints) == (
        0.25 * degree,
        1234.0,
        "variance",
        "both",
    )
    assert [imu.noise for imu in found.imus] == [2.0, 3.0]
    assert [place for imu in found.imus for place in imu.offset] == pytest.approx([0.011, -0.012, 0.013, 0.014])
    assert SEEN["request"].imus.sources == ("iio:a", "vn100:b")
    assert SEEN["ends"] == EndsRequest("own", BASE, 2, "can:can0", "can:can1")
    assert settings("--lower-joint-deg", "5").drive_joint == UNTOLD
    assert settings("--drive-joint-deg", "5").lower_joint == UNTOLD
    assert settings("--kernel", "fixed", "--scheme", "estimate").scheme is Scheme.ESTIMATE
    assert settings("--scheme", "intersection").kernel == "float64"


def test_options_of_different_counts_are_refused_with_each_count() -> None:
    request = ClusterRequest(("a", "b"), (1.0,), (), (), ())
    with pytest.raises(NodeConfigurationError, match="got --imu 2 times, --imu-noise 1 times"):
        request.to_settings()
    assert ClusterRequest((), (), (), (), ()).to_settings() == (ImuSettings(),)


@pytest.mark.parametrize(
    ("words", "torque"),
    [
        ((), TorqueSettings(0.0, 0.01)),
        (("--torque-nm", "500"), TorqueSettings(500.0, 0.01)),
        (("--trapped-fraction", "0.2"), TorqueSettings(0.0, 0.2)),
        (("--torque-nm", "0.5", "--trapped-fraction", "0.25"), TorqueSettings(0.5, 0.25)),
    ],
)
def test_an_encoder_knows_the_torque_that_it_is_told(
    words: tuple[str, ...], torque: TorqueSettings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "c.csv").write_text("")
    asked: list[Any] = []
    monkeypatch.setattr(node_host, "run_encoder", lambda *words: asked.append(words))  # which would join a router
    own = ("--clock", "own", "--counter", f"replay:{tmp_path / 'c.csv'}", "--above", "base", "--below", "4")
    result = CliRunner().invoke(encoder, [*words, *own, "--folder", "here", "--rig", "r"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    ((place, source, own_time, knows),) = asked
    assert (place.rig, place.folder, knows) == ("r", Path("here"), torque)
    assert type(source).__name__ == "ReplayEncoder"
    assert own_time.neighbours == {Side.UPPER: BASE, Side.LOWER: 4}
    asked.clear()
    assert CliRunner().invoke(encoder, [], catch_exceptions=False).exit_code == 0
    assert asked[0][1:3] == (None, None)
    refused = CliRunner().invoke(encoder, ["--clock", "own"], catch_exceptions=False)
    assert "--clock own: expected --counter with it" in refused.output
    refused = CliRunner().invoke(encoder, [*own[:-2], "--below", "encoder"])
    assert f"two others than {['base', 'encoder'][ENCODER != BASE]} itself" in refused.output


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("iio:icm42688", IioImu), ("vn100:/dev/ttyS1", Vn100), ("mpu6500:1", MpuImu), ("mpu6500:255:0x69", MpuImu),
        ("mpu6050:0:0x68", MpuImu), ("mpu6500:0:105", MpuImu),
    ],
)  # fmt: skip
def test_an_imu_is_opened_by_its_name(text: str, kind: type) -> None:
    assert isinstance(imu_source(text), kind)


@pytest.mark.parametrize(
    "text",
    [
        "iio:", "vn100:", "replay:", "timed:", "mpu6500:256", "mpu6500:-1", "mpu6500:1:0x67", "mpu6500:1:0x6a",
        "mpu6500:x", "mpu6500:1:y", "mpu6500:", "wii:1", "",
    ],
)  # fmt: skip
def test_another_name_of_an_imu_is_refused_with_all_forms(text: str) -> None:
    with pytest.raises(NodeConfigurationError, match=r"imu: expected replay:FILE, timed:FILE, iio:NAME.*got '"):
        imu_source(text)


@pytest.mark.parametrize(
    "text", ["counter:", "replay:", "timed:", "gpio:", "gpio:chip0:4", "gpio:chip0:4,4", "gpio:chip0:1,2,1", "x:1"]
)
def test_another_name_of_a_counter_is_refused_with_all_forms(text: str) -> None:
    with pytest.raises(
        NodeConfigurationError, match=r"counter: expected replay:FILE, timed:FILE, counter:/dev/counterN"
    ):
        encoder_source(text)


@pytest.mark.parametrize("text", ["gpio:chip0:4,5", "gpio:gpiochip0:4,5,6", "gpio:/dev/gpiochip0:4,5"])
def test_lines_are_those_that_are_named(text: str) -> None:
    assert isinstance(encoder_source(text), GpioEncoder)


def test_a_loop_is_there_only_meanwhile_and_under_a_name_of_its_own() -> None:
    made: list[Any] = []

    def make(integers: Any) -> Any:
        made.append(integers)
        return float64_loop()

    memory = np.arange(3.0)
    with added_loop("own", make):
        assert kernel_of("own", memory) == float64_loop()
        with pytest.raises(
            NodeConfigurationError, match="expected another name than float64, fixed, chip, library, own, got own"
        ):
            added_loop("own", make).__enter__()
    assert made[0] is memory
    assert "own" not in LOOPS
    for name in ("float64", "fixed", "chip"):
        with pytest.raises(NodeConfigurationError):
            added_loop(name, make).__enter__()


def warm(celsius: float) -> ImuReading:
    return ImuReading(0.0, 0.5, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8), celsius)


def test_a_bias_is_doubted_by_what_was_measured_nowhere_and_wanders_as_before_when_it_is_back() -> None:
    """One IMU, b = s1 (T - 20) + s2 (T - 20)^2 of its own on each axis, measured from 10 to 40 C."""
    slopes = ((1e-4, 2e-4, -3e-4), (1e-6, 0.0, 2e-6), (0.0, 0.0, 0.0))
    imu = ImuSettings(gyroscope=SensorParameters(bias_slopes=slopes, reference=20.0), corrected_within=(10.0, 40.0))
    said: list[tuple[Severity, str, dict[str, Any]]] = []
    watch = TemperatureRange(lambda *words: said.append(words), (imu,))
    state: Any = np.zeros(1, STATE)[0]
    config = {"bias_std": np.array([1e-4, 2e-3, 1e-4])}

    def polynomial(t: float, k: int) -> float:
        return slopes[0][k] * (t - 20.0) + slopes[1][k] * (t - 20.0) ** 2

    for celsius in (40.0, 10.0, 25.0, math.nan):
        watch.look(warm(celsius), state, config)
    assert not said
    watch.look(warm(45.0), state, config)
    added = [abs(polynomial(45.0, k) - polynomial(40.0, k)) for k in range(3)]
    variances = [state["P"][BX + k, BX + k] for k in range(3)]
    assert variances == pytest.approx([one**2 for one in added], rel=1e-6)
    assert config["bias_std"].tolist() == pytest.approx([added[0], 2e-3, added[2]])  # y wanders more anyhow
    watch.look(warm(43.0), state, config)  # less far beyond: doubted once, and not less
    assert [state["P"][BX + k, BX + k] for k in range(3)] == variances
    watch.look(warm(50.0), state, config)
    further = [abs(polynomial(50.0, k) - polynomial(40.0, k)) for k in range(3)]
    assert [state["P"][BX + k, BX + k] for k in range(3)] == pytest.approx([one**2 for one in further], rel=1e-6)
    watch.look(warm(39.6), state, config)
    assert config["bias_std"].tolist() == [1e-4, 2e-3, 1e-4]
    assert [name for _, name, _ in said] == ["temperature_beyond"]
    watch.look(warm(39.5), state, config)
    assert said[-1] == (Severity.WARNING, "temperature_within", {})
    assert said[0][2] == {"temperature_c": 45.0, "low_c": 10.0, "high_c": 40.0}
    watch.look(warm(5.0), state, config)
    assert said[-1][1:] == ("temperature_beyond", {"temperature_c": 5.0, "low_c": 10.0, "high_c": 40.0})
    config["bias_std"][0] = 7.0  # something else has widened it since
    watch.look(warm(20.0), state, config)
    assert config["bias_std"].tolist() == [7.0, 2e-3, 1e-4]


def test_only_a_range_of_one_s_own_is_watched() -> None:
    plain, ranged = ImuSettings(), ImuSettings(corrected_within=(-math.inf, 40.0))
    assert not TemperatureRange(lambda *_: None, (plain, plain)).watched
    assert TemperatureRange(lambda *_: None, (plain, ranged)).watched
    assert TemperatureRange(lambda *_: None, (ranged, plain)).watched
