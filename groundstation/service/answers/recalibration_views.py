"""View of the calibration in the field: how far it has come, and what it found."""

from __future__ import annotations

import math

from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.order_shapes import (
    InclinationRms,
    RecalibrationAnswer,
    RestAttitude,
    SensorModel,
    SolutionFigures,
    TubeCalibration,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.orders.recalibration.recalibration_progress import Attitude, Found, TubeProgress
from telemetry.parameters import ParameterBlock, SensorParameters


@view_of(RecalibrationAnswer)
def answer_recalibration(k: RigModel, _p: Parameters) -> RecalibrationAnswer:
    """Calibration in the field: how far, and what it found."""
    procedure, p = k.recalibration, k.recalibration.progress
    return RecalibrationAnswer(
        state=p.stage.value,
        proposal=p.proposal,
        attitudes=[rest_attitude(attitude, number) for number, attitude in enumerate(p.attitudes, 1)],
        tubes=[
            tube_calibration(tube, procedure.count_records(tube), procedure.block_before(tube))
            for tube in p.tubes.values()
        ],
    )


def rest_attitude(attitude: Attitude, number: int) -> RestAttitude:
    """One attitude, ``number`` from 1."""
    return RestAttitude(
        attitude=number,
        pitch_deg=round(math.degrees(attitude.pitch), 9),
        roll_deg=round(math.degrees(attitude.roll), 9),
        told_at_s=attitude.at,
        left_at_s=attitude.left,
    )


def tube_calibration(tube: TubeProgress, records: int, before: ParameterBlock | None) -> TubeCalibration:
    """One tube; ``records`` at rest so far, ``before`` the block it had if it is known."""
    block, found = tube.block, tube.found
    return TubeCalibration(
        tube=tube.tube,
        phase=tube.phase.value,
        detail=tube.detail,
        records=records,
        asked=len(tube.orders),
        version_before=tube.version_before,
        hash_before=tube.hash_before,
        accelerometer_before=None if before is None else sensor_model(before.accelerometer),
        version=None if block is None else block.version,
        hash_proposed="" if block is None else block.sha256().hex(),
        accelerometer=None if block is None else sensor_model(block.accelerometer),
        uploads=tube.uploads,
        restarted=tube.restarted,
        hash_after_restart=tube.hash_after_restart,
        hash=tube.hash,
        solution=None if found is None else solution_figures(found),
    )


def solution_figures(found: Found) -> SolutionFigures:
    """Figures of a solution."""
    return SolutionFigures(
        residual_rms_mps2=found.residual_rms,
        bias_std_mps2=list(found.bias_std),
        matrix_std=found.matrix_std,
        condition=found.condition,
        inclination_rms_deg=InclinationRms(
            before=math.degrees(found.inclination_before), after=math.degrees(found.inclination_after)
        ),
    )


def sensor_model(sensor: SensorParameters) -> SensorModel:
    """Matrix and bias at the reference temperature."""
    return SensorModel([list(row) for row in sensor.matrix], list(sensor.bias))
