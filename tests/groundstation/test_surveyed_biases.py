"""Biases of accelerometers from surveys: what tool faces tell and what not, and the blocks proposed from them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from memory_rig import Rig
from schemas import check_answer, shown_on

from groundstation.config import SENSOR_BIAS_DEG, GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.answers.answer_table import ANSWERS
from groundstation.service.answers.model import RigModel
from groundstation.service.orders.surveyed_biases import GRAVITY_STD, surveyed_biases
from groundstation.survey.fusion.force_biases import ForceBias
from telemetry.frozen import replace
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement
from telemetry.parameters import ParameterBlock, SensorParameters

Array = npt.NDArray[np.float64]
G = 9.81
DEG = math.pi / 180.0
MILLI_G = 1e-3 * G
NOISE = 0.02 * DEG * G / math.sqrt(32.0)  # m/s^2, of a mean
YAW_STD, JOINT_STD = 0.02 * DEG, 0.05 * DEG
VAR = NOISE**2
COV = ((VAR, 0.0, 0.0), (0.0, VAR, 0.0), (0.0, 0.0, VAR))
STOPS = 6
Placed = tuple[SurveyMeasurement, float]


class Drilled:
    """A hole that leans more and turns with its depth, surveyed by tubes that are off by a bias each."""

    def __init__(self, seed: int, stops: int = STOPS, turn: float | None = None, bias: float = MILLI_G) -> None:
        random = np.random.default_rng(seed)
        self.biases = {tube: bias * random.standard_normal(3) for tube in range(1, stops + 1)}
        self.surveys: list[Placed] = []
        gravity = G + GRAVITY_STD * random.standard_normal()
        marks = JOINT_STD * random.standard_normal(stops + 1)
        faces = random.uniform(0.0, math.tau, stops + 1) if turn is None else turn * np.arange(stops + 1)
        for stop in range(1, stops + 1):
            for tube in range(1, stop + 1):
                station, yaw = stop - tube + 1, float(faces[stop]) + 0.3 * tube
                lean, azimuth = (2.0 + 0.3 * station) * DEG, 10.0 * station * DEG - yaw
                up = np.array([math.sin(lean) * math.cos(azimuth), math.sin(lean) * math.sin(azimuth), -math.cos(lean)])
                force = gravity * up + self.biases[tube] + NOISE * random.standard_normal(3)
                x, y, z = force.tolist()
                off = float(YAW_STD * random.standard_normal() + marks[tube : stop + 1].sum())
                measurement = SurveyMeasurement(
                    tube, stop, 600.0 * stop + tube, station, (ImuMean((x, y, z), COV),), yaw + off,
                    YAW_STD**2, station * JOINT_STD**2, 32, 20.0, NodeFlag.NONE,
                )  # fmt: skip
                self.surveys.append((measurement, 2.0 * station))

    def tell(self, model: RigModel) -> RigModel:
        model.string.tally.restore(list(range(len(self.biases), 0, -1)))
        for measurement, md in self.surveys:
            assert model.placement.place_one(measurement, md) == ""
        return model


def biases_of(model: RigModel) -> dict[int, ForceBias]:
    mixed = model.recalibration.progress.mixed
    return surveyed_biases(model.config, model.hole, model.string.states.newest, mixed).found


def found_by(folder: Path, hole: Drilled, stated_deg: float = SENSOR_BIAS_DEG) -> dict[int, ForceBias]:
    config = GroundConfig(folder=folder, mount_std_deg=0.0, accelerometer_bias_std_deg=stated_deg)
    return biases_of(hole.tell(RigModel.begin(config)))


@pytest.mark.parametrize(("stated_deg", "known_mg"), [(SENSOR_BIAS_DEG, 0.1), (0.002, 1.0)])
def test_any_tool_faces_show_the_biases_as_well_as_stated(tmp_path: Path, stated_deg: float, known_mg: float) -> None:
    """A ground station that was told of small biases takes large ones for a hole that moved, and so knows less."""
    squares, stds = [], []
    for seed in range(40):
        hole = Drilled(seed)
        for tube, one in found_by(tmp_path, hole, stated_deg).items():
            error = one.bias - hole.biases[tube]
            squares.append(float(error @ np.linalg.solve(one.cov, error)) / 3.0)
            stds.append(np.sqrt(np.diagonal(one.cov)))
    assert 0.8 < np.mean(squares) < 1.2
    assert np.sqrt(np.mean(np.array(stds)[:, :2] ** 2)) < known_mg * MILLI_G


def test_the_same_turn_between_all_stops_shows_no_bias(tmp_path: Path) -> None:
    """A spiral of leans is the same record; what cannot be told apart keeps its variance."""
    found = found_by(tmp_path, Drilled(3, turn=1.1))
    assert all(0.2 * MILLI_G < math.sqrt(one.cov[0, 0]) < 1.1 * MILLI_G for one in found.values())


def test_one_tube_by_itself_shows_what_lies_along_gravity_and_little_across(tmp_path: Path) -> None:
    hole = Drilled(4)
    hole.surveys = [placed for placed in hole.surveys if placed[0].tube == 2]
    (one,) = found_by(tmp_path, hole).values()
    across = np.sqrt(np.diagonal(one.cov))[:2] / (SENSOR_BIAS_DEG * DEG * G)
    assert np.all((across > 0.5) & (across < 1.0))  # by the sizes of its forces, which lean
    assert abs(one.bias[2] - hole.biases[2][2]) < 3.0 * math.sqrt(one.cov[2, 2]) < 1.0 * MILLI_G


def test_a_survey_whose_yaw_is_not_believed_says_nothing_of_a_bias(tmp_path: Path) -> None:
    hole = Drilled(5)
    before = found_by(tmp_path, hole)
    wrong, md = hole.surveys[-1]
    forged = replace(wrong, sequence=99, yaw=wrong.yaw + 2.0, station_at=wrong.station_at + 30.0)
    config = GroundConfig(folder=tmp_path, mount_std_deg=0.0, accelerometer_bias_std_deg=SENSOR_BIAS_DEG)
    model = hole.tell(RigModel.begin(config))
    assert model.placement.place_one(replace(forged, flags=NodeFlag.YAW_UNTRUSTED), md) == "survey_untrusted"
    after = biases_of(model)
    assert [one.bias.tolist() for one in after.values()] == [one.bias.tolist() for one in before.values()]


class Surveyed(Rig):
    """A string that has surveyed a hole."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, [3, 2, 1])
        self.run(12.0)
        self.hole = Drilled(8, 3)
        self.hole.tell(self.ground.model)

    def command(self, action: str, **parameters: str) -> dict[str, Any]:
        self.ground.operator.order("recalibrate", {"action": action} | parameters)
        check_answer(self.ground.operator.ask("recalibration"), ANSWERS["recalibration"].fields)
        view: dict[str, Any] = json.loads(json.dumps(shown_on(self.ground.model, "recalibration")))
        return view

    def is_done(self) -> bool:
        return shown_on(self.ground.model, "recalibration")["state"] == "done"


@pytest.mark.slow
def test_blocks_are_proposed_and_go_up_when_they_are_confirmed(tmp_path: Path) -> None:
    rig = Surveyed(tmp_path)
    model = rig.ground.model
    old = SensorParameters(((1.02, 0.0, 0.01), (0.0, 0.98, 0.0), (0.0, 0.0, 1.0)), (0.02, 0.0, -0.01))
    gyroscope = SensorParameters(bias=(1e-3, 0.0, 0.0))
    model.recalibration.blocks.clear()
    rig.upload(ParameterBlock(2, 4, gyroscope, old))
    model.recalibration.progress.mixed.clear()  # as if that had been before the hole
    found = biases_of(model)
    rig.command("begin")
    rig.run(6.0)
    shown = rig.command("surveys")
    rows = {row["tube"]: row for row in shown["tubes"]}
    assert shown["state"] == "solved"
    assert {row["phase"] for row in rows.values()} == {"proposed"}
    expected = np.array(old.bias) + np.array(old.matrix) @ found[2].bias
    assert rows[2]["accelerometer"]["bias_mps2"] == pytest.approx(expected.tolist(), abs=1e-12)
    assert rows[2]["accelerometer"]["matrix"] == [list(row) for row in old.matrix]
    assert rows[1]["solution"]["bias_std_mps2"] == pytest.approx(np.sqrt(np.diagonal(found[1].cov)).tolist())
    rig.run(20.0)
    assert rig.tube(1).tube.parameters.version == 0  # nothing is applied by itself
    rig.command("confirm", proposal=shown["proposal"])
    rig.run(90.0, rig.is_done)
    for tube, row in rows.items():
        used = rig.tube(tube).tube.parameters
        assert used.sha256().hex() == row["hash_proposed"]
        assert used.version == row["version_before"] + 1
    assert rig.tube(2).tube.parameters.gyroscope == gyroscope
    rig.command("begin")
    rig.run(6.0)
    with pytest.raises(SelectorError, match="its block was replaced after its first survey of this hole"):
        rig.command("surveys")


@pytest.mark.slow
def test_what_surveys_cannot_give_is_refused_by_name(tmp_path: Path) -> None:
    rig = Surveyed(tmp_path)
    with pytest.raises(SelectorError, match="expected a calibration that is collecting"):
        rig.command("surveys")
    rig.command("begin", tubes="1")
    rig.run(6.0)
    nodes = rig.ground.model.string.states.newest
    nodes[1] = replace(nodes[1], alignment=(1e-3, 0.0, 1e-5))
    with pytest.raises(SelectorError, match="tube 1: it is aligned, and another block would drop that"):
        rig.command("surveys")
    rig.command("attitude", pitch_deg="0", roll_deg="0", seconds="8")
    with pytest.raises(SelectorError, match="expected no attitudes beside surveys"):
        rig.command("surveys")
