"""What a node says and is set to, from numbers that all differ: each is in its place, and in every sum."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_told_figures import AROUND, tube

from node.errors import NodeConfigurationError
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import RigContext
from node.firmware.reporter import NodeReporter
from node.firmware.sensor_config import BARE_SCALE_STD, sensor_config
from node.firmware.tube_settings import MakeUpAngle, TubeSettings, settings_record
from node.kernels.arithmetic.angles import to_binary
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.process.survey_log import PLACES, SurveyLog
from telemetry.messages import NodeFlag, NodeMode
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.records.noise_file import GyroNoise
from telemetry.runtime.disk import MACHINE

DEG = math.pi / 180.0
ANY_YAW = math.pi / math.sqrt(3.0)  # standard deviation of a yaw that may be any, rad
CYCLE = 1.0 / 1.9  # s


def reporter_of(settings: TubeSettings) -> tuple[NodeReporter, Any]:
    nodes = new_node(default_config())
    return NodeReporter(settings, nodes, iter(range(1, 1000)).__next__, restored=False), nodes[0]


def around(hops: int = 2, **change: Any) -> RigContext:
    return RigContext(True, hops, 5000.0, 1e-8, True, **change)


@pytest.mark.parametrize("hops", [0, 1, 2, 9])
def test_an_estimate_has_the_joint_below_and_its_error_beside_that_of_those_above(hops: int) -> None:
    for angle, std, own_var in ((0.4, 0.02, 3e-4), (-3.0, 0.001, 7e-6), (0.0, ANY_YAW, 2.0), (0.1, 0.3, ANY_YAW**2)):
        said, node = reporter_of(TubeSettings(3, lower_joint=MakeUpAngle(angle, std)))
        node["filter"]["systematic_var"], node["filter"]["now_yaw"] = own_var, to_binary(1.25)
        node["filter"]["now_rate"], node["filter"]["cycles"] = -0.07, 17
        found = said.estimate(around(hops))
        assert found.offset == pytest.approx(angle, abs=1e-9)
        assert found.systematic_var == pytest.approx(min(own_var + std**2, ANY_YAW**2))
        assert (found.yaw, found.rate, found.sequence) == (pytest.approx(1.25, abs=1e-8), -0.07, 17)
        assert (found.hops, found.valid_at) == (max(hops, 1), 5000.0)


@pytest.mark.parametrize(
    ("gyro", "force", "flags"),
    [
        (0, 0, NodeFlag.NONE),
        (1, 0, NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED),
        (0, 1, NodeFlag.SENSOR_FAULT),
        (1, 1, NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED),
    ],
)
def test_a_faulty_accelerometer_leaves_the_yaw_its_trust(gyro: int, force: int, flags: NodeFlag) -> None:
    said, node = reporter_of(TubeSettings(3))
    node["guard"]["gyro"]["fault"], node["guard"]["force"]["fault"] = gyro, force
    assert said.sensor_flags == flags
    node["filter"]["mode"] = int(NodeMode.TRACKING)
    report = said.report(100.0, around(), (3, b"12345678"))
    assert report.mode is (NodeMode.FAULT if gyro or force else NodeMode.TRACKING)


@pytest.mark.parametrize(("hops", "is_on_top"), [(0, False), (1, True), (2, False)])
@pytest.mark.parametrize("tube_number", [1, 2, 3])
def test_what_was_not_told_is_said_by_whom_it_concerns(hops: int, is_on_top: bool, tube_number: int) -> None:
    untold = MakeUpAngle(0.0, ANY_YAW)
    said, node = reporter_of(TubeSettings(tube_number, untold, untold))
    node["filter"]["yaw_known"], node["filter"]["last_aided"] = 1, 100.0
    flags = said.flags(around(hops), 100.0)
    assert (NodeFlag.DRIVE_UNTOLD in flags) == is_on_top
    assert (NodeFlag.LOWER_UNTOLD in flags) == (tube_number > 1)  # below the lowest tube is the bit
    assert not MakeUpAngle(0.0, ANY_YAW).is_told
    assert MakeUpAngle(0.0, 0.999 * ANY_YAW).is_told


def test_a_report_has_every_number_of_its_record_in_its_place() -> None:
    said, node = reporter_of(TubeSettings(3, mount_std=0.004))
    state, mount = node["filter"], node["mount"]
    state["static_bias"], state["bias"] = [1e-3, 2e-3, 4e-3], [0.1e-3, 0.5e-3, -0.7e-3]
    state["systematic_var"], state["scale"], state["last_aided"] = 9e-6, 3e-4, 93.0
    mount["axis"][0], mount["std"][0] = [0.6, 0.0, 0.8], [0.002, 0.005]
    node["cycles"], node["overruns"] = 71, 5
    report = said.report(100.0, around(4), (3, b"12345678"))
    assert report.gyro_bias == pytest.approx((1.1e-3, 2.5e-3, 3.3e-3))
    assert report.systematic_var == pytest.approx(9e-6 + 0.004**2)
    assert report.alignment == pytest.approx((math.asin(0.6), 0.0, 0.005))
    assert (report.cycles, report.overruns, report.hops, report.aiding_age) == (71, 5, 4, 7.0)
    assert (report.parameters_version, report.parameters_hash, report.clock_var) == (3, b"12345678", 1e-8)


def test_a_survey_says_for_how_long_the_tube_stood_by_its_own_clock() -> None:
    one = tube()
    one.state["stopped_at"], one.node["revision"]["systematic"] = 940.0, 5e-6
    found = one.reporter.survey(1000.0, AROUND)
    assert (found.settle_time, found.station_at, found.samples) == (60.0, 5000.0, 32)
    revised = one.reporter.revised_survey(1100.0, AROUND)
    assert revised is not None
    assert revised.systematic_var == pytest.approx(5e-6 + one.settings.mount_std**2)


def test_of_a_cluster_every_imu_that_was_in_use_is_told() -> None:
    said, node = reporter_of(TubeSettings(3, imus=tuple(ImuSettings(noise=1.0 + k) for k in range(3))))
    for used in ((1, 1, 1), (1, 0, 1), (0, 0, 1), (0, 0, 0)):
        node["cluster"]["survey_used"][:3] = used
        for k in range(3):
            node["cluster"]["survey_force"][k] = [k + 1.0, 0.0, -9.8]
            node["cluster"]["survey_force_cov"][k] = (k + 1.0) * np.eye(3)
        node["filter"]["survey_force"] = [50.0, 0.0, 0.0]
        told = [mean.force[0] for mean in said.survey(100.0, around()).imus]
        assert told == ([k + 1.0 for k in range(3) if used[k]] or [50.0])


def test_settings_reach_the_kernels_each_in_its_unit() -> None:
    config = default_config()
    imus = (ImuSettings((0.01, 0.02), 2.0), ImuSettings((0.03, -0.04), 0.5))
    made = settings_record(
        TubeSettings(
            3, MakeUpAngle(0.1, 0.02), MakeUpAngle(-0.3, 0.04), unseen_std=0.005, stiffness=700.0, imus=imus,
            aiding_old_after=4.0, state_every=3, torsion="variance", joints="both",
        ),
        config,
    )[0]  # fmt: skip
    told = ("drive_angle", "drive_var", "lower_angle", "lower_var", "unseen_var", "stiffness", "aiding_old_after")
    assert [float(made[name]) for name in told] == pytest.approx([0.1, 4e-4, -0.3, 1.6e-3, 2.5e-5, 700.0, 4.0])
    assert [int(made[name]) for name in ("state_every", "torsion_gate", "joints", "imus")] == [3, 0, 2, 2]
    assert made["place"][:2].tolist() == [[0.01, 0.02], [0.03, -0.04]]
    assert made["noise"][:2].tolist() == [2.0, 0.5]
    assert made["weight"][:2].tolist() == [0.25, 4.0]
    assert float(made["tilt_noise"]) == pytest.approx(0.02 * DEG)
    assert int(settings_record(TubeSettings(3), config)[0]["torsion_gate"]) == 1
    TubeSettings(3, imus=(ImuSettings(),) * 8)
    with pytest.raises(NodeConfigurationError, match=r"imus: expected 1\.\.8"):
        TubeSettings(3, imus=(ImuSettings(),) * 9)


def noise(x: float, y: float, z: float) -> GyroNoise:
    return GyroNoise((x, y, z), (1e-3, 2e-3, 3e-3), (100.0, 200.0, 300.0))


@pytest.mark.parametrize(
    ("white", "factor", "rate"),
    [
        ((1e-6, 2e-6, 3e-6), 1.0, 0.08 * DEG),  # a quiet sensor keeps what is usual
        ((1e-5, 2e-5, 4e-4), 1.0, 6.0 * 4e-4 / math.sqrt(CYCLE)),
        ((9e-4, 2e-4, 4e-4), 1.0, 6.0 * 4.5e-4 / math.sqrt(CYCLE)),  # half of the louder of x and y
        ((2e-4, 9e-4, 4e-4), 3.0, 6.0 * 13.5e-4 / math.sqrt(CYCLE)),
    ],
)
def test_a_louder_sensor_scatters_more_at_rest(white: tuple[float, float, float], factor: float, rate: float) -> None:
    imus = (ImuSettings(noise=0.5 * factor), ImuSettings(noise=factor))
    config = sensor_config(TubeSettings(3, imus=imus, gyro_noise=noise(*white)), ParameterBlock(3, 1))[0]
    assert float(config["still_rate"]) == pytest.approx(rate, rel=1e-6)
    assert config["gyro_noise"].tolist() == pytest.approx(white)
    assert config["bias_std"].tolist() == pytest.approx([1e-3, 2e-3, 3e-3])
    assert np.ravel(config["bias_tau"]).tolist() in ([100.0, 200.0, 300.0], [300.0])


def test_a_gyroscope_that_was_calibrated_nowhere_has_the_scale_of_its_data_sheet() -> None:
    known = SensorParameters(matrix=((1.01, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    own, bare = ImuSettings(gyroscope=known), ImuSettings()
    for imus, block, is_bare in (
        ((bare,), ParameterBlock(3, 1), True),
        ((own,), ParameterBlock(3, 1), False),
        ((own, bare), ParameterBlock(3, 1), True),
        ((bare,), ParameterBlock(3, 1, gyroscope=known), False),
    ):
        config = sensor_config(TubeSettings(3, imus=imus), block)[0]
        assert float(config["scale_std"]) == pytest.approx(BARE_SCALE_STD if is_bare else 1e-3)


class FullNow:
    """The machine's disk, which refuses what is written while it is full."""

    full = False

    def __getattr__(self, name: str) -> Any:
        return getattr(MACHINE, name)

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        if self.full:
            raise OSError(28, "No space left on device")
        MACHINE.write(path, data, offset)


def test_a_survey_that_the_disk_refused_takes_no_place_of_those_that_are_kept(tmp_path: Path) -> None:
    disk: Any = FullNow()
    log = SurveyLog(tmp_path, disk)
    for number in range(1, PLACES + 3):
        disk.full = number in (7, 40)
        log.append_payload(number, bytes([number % 256]))
    kept = [number for number in range(1, PLACES + 3) if number not in (7, 40)]
    assert log.refused == 2
    assert [number for number, _ in log.payloads(0, 1000)] == kept
    log.append_payload(900, b"x")  # the oldest makes way
    assert [number for number, _ in log.payloads(0, 1000)] == [*kept[1:], 900]
