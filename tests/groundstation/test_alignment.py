"""An alignment ordered from the surface, and clusters of several IMUs as the ground station sees them."""

import math
from pathlib import Path

import numpy as np
import pytest
from memory_rig import NOISELESS, Rig
from schemas import shown_on

from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.service.hole.resolving import force_vars
from groundstation.service.orders.order_book import SentOrder
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import combine_imus
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import RigContext
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.process.tube_process import TubeProcess
from telemetry.messages import ImuMean, NodeFlag, NodeMode, Stand, SurveyMeasurement

G = 9.81
PITCH = 0.6 * DEG


class Bored(Rig):
    """Tubes whose sensors lean by PITCH, in a bore of 2 degrees, that turn as told."""

    angle = 0.0
    spin = 0.0

    def cycle(self) -> None:
        middle = self.angle + 0.5 * self.spin * PERIOD
        self.angle += self.spin * PERIOD
        lean = 2.0 * DEG
        force = G * np.array([math.sin(lean) * math.cos(middle), -math.sin(lean) * math.sin(middle), -math.cos(lean)])
        c, s = math.cos(PITCH), math.sin(PITCH)
        frame = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        for tube in self.rate:
            self.rate[tube] = frame @ np.array([0.0, 0.0, self.spin])
            self.force[tube] = frame @ force
        super().cycle()

    def ordered(self, **arguments: float | str) -> SentOrder:
        return self.order(1, "align", **arguments)


@pytest.mark.slow
def test_an_alignment_is_ordered_followed_and_shown_at_the_surface(tmp_path: Path) -> None:
    rig = Bored(tmp_path, [2, 1])
    rig.run(12.0)
    assert rig.ordered().detail == "the static bias is not known yet"
    rig.run(50.0)
    assert shown_on(rig.ground.model, "nodes/1")["alignment"] is None
    reply = rig.ordered(method="circle", turns=1.0)
    assert (reply.done, reply.values) == (True, {"method": "circle", "turns": 1.0})
    rig.spin = 10.0 * DEG
    rig.run(10.0)
    assert rig.ground.model.string.states.newest[1].mode is NodeMode.ALIGNMENT
    assert rig.ground.model.string.states.newest[2].mode is NodeMode.TRACKING
    assert rig.ordered().detail == "an alignment is under way"
    rig.run(35.0)
    rig.spin = 0.0
    rig.run(8.0)
    assert [code for code in rig.codes(1) if code.startswith("align")] == [
        "alignment_begun", "alignment_turning", "aligned",
    ]  # fmt: skip
    pitch, roll, _ = rig.ground.model.string.states.newest[1].alignment
    assert (pitch, roll) == pytest.approx((PITCH, 0.0), abs=1e-5)
    assert rig.ground.model.string.states.newest[1].mode is NodeMode.STILL


def test_two_imus_of_a_process_arrive_as_two_means(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    settings = TubeSettings(1, limits=NOISELESS, imus=(ImuSettings(), ImuSettings(noise=2.0)))
    process = TubeProcess(settings, tmp_path)
    surveys: list[SurveyMeasurement] = []
    submit = process.endpoint.mail.submit

    def keep(message: object, now: float) -> None:
        surveys.extend([message] if isinstance(message, SurveyMeasurement) else [])
        submit(message, now)  # type: ignore[arg-type]

    process.endpoint.mail.submit = keep  # type: ignore[method-assign, assignment]
    process.tube.take_survey()
    process._context = lambda now: RigContext(True, 1, now, 1e-8, True)  # type: ignore[method-assign]
    now = 1000.0
    for _ in range(120):
        now += PERIOD
        rows = [[*(1e-4 * random.standard_normal(3)), *([0.3, 0.0, -9.8] + 0.003 * k * random.standard_normal(3))]
                for k in (1.0, 2.0)]  # fmt: skip
        process.on_cycle([now - PERIOD, *[[float(x) for x in row] for row in rows]], now)
    assert len(surveys) == 1
    assert len(surveys[0].imus) == 2


def test_the_ground_station_weighs_all_imus_of_a_survey() -> None:
    model = RigModel.begin(GroundConfig(folder=Path(), tube_length=2.0, weighting=Weighting.BAYES))
    assert model.string.depths.add_stand(Stand(model.string.time.epoch, 999.0, 1001.0, 2.0))
    lean, variances = 2.0 * DEG, (1e-8, 3e-8)
    imus = tuple(
        ImuMean((G * math.sin(angle), 0.0, -G * math.cos(angle)), ((v, 0.0, 0.0), (0.0, v, 0.0), (0.0, 0.0, v)))
        for angle, v in zip((lean, lean + 4e-4 / G), variances, strict=True)
    )
    survey = SurveyMeasurement(1, 1, 1000.0, 1, imus, 0.0, 1e-9, 1e-9, 32, 20.0, NodeFlag.NONE)
    assert model.placement.place_one(survey, 2.0) == ""
    row = shown_on(model, "stations")["stations"][0]
    assert row["inclination_deg"] * DEG == pytest.approx(lean + 1e-4 / G, abs=1e-9)
    assert row["sigma_force_mps2"] ** 2 == pytest.approx(0.75e-8)
    covs = np.array([imu.force_cov for imu in imus])
    _, cov = combine_imus(np.array([imu.force for imu in imus]), covs)
    assert force_vars(covs[None])[0] == pytest.approx(np.trace(cov) / 3.0)
