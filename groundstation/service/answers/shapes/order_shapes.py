"""Answers about what was ordered: the orders, and how far the calibration in the field has come."""

from __future__ import annotations

from typing import Annotated, Any

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.string_shapes import Tube
from groundstation.service.orders.order_book import OrderState
from groundstation.service.orders.recalibration.recalibration_progress import RecalibrationStage, TubePhase


@answer_class
class Order:
    """An order and what became of it."""

    order: Annotated[int, "number, never used twice"]
    at_s: Annotated[float | None, "rig time at which it was accepted"]
    ordered_utc: Annotated[str, "the same in UTC"]
    by: Annotated[str, "who ordered"]
    tube: Annotated[int | None, "null for an order to the ground station"]
    command: Annotated[str, "name"]
    action: Annotated[str, "step of a command that has several"]
    arguments: Annotated[dict[str, Any], "as they were ordered"]
    state: Annotated[str, "how far it is", OneOf(*OrderState)]
    done: Annotated[bool | None, "whether it was obeyed; null before the answer"]
    detail: Annotated[str, "why it was refused, or what happens now"]
    values: Annotated[dict[str, Any], "of the reply, see the table of commands"]


@answer_class
class OrdersAnswer:
    """The newest orders, the oldest of them first."""

    orders: list[Order]


@answer_class
class RestAttitude:
    """One attitude at which the tubes rest."""

    attitude: Annotated[int, "number, from 1"]
    pitch_deg: Annotated[float, "of the tubes' axis"]
    roll_deg: Annotated[float, "about the tubes' axis"]
    told_at_s: Annotated[float, "rig time at which it was entered"]
    left_at_s: Annotated[float | None, "rig time; null while the tubes are there"]


@answer_class
class SensorModel:
    """What corrects the readings of a sensor."""

    matrix: Annotated[list[list[float]], "row = sensor axis"]
    bias_mps2: Annotated[list[float], "at the reference temperature"]


@answer_class
class InclinationRms:
    """Error of the inclination before and after a calibration."""

    before: Annotated[float, "over the attitudes"]
    after: Annotated[float, "over the attitudes"]


@answer_class
class SolutionFigures:
    """How well a calibration fits its records."""

    residual_rms_mps2: Annotated[float, "of the fit"]
    bias_std_mps2: Annotated[list[float], "standard deviation, x y z"]
    matrix_std: Annotated[float, "largest of the nine"]
    condition: Annotated[float, "of the fit"]
    inclination_rms_deg: InclinationRms


@answer_class
class TubeCalibration:
    """Calibration in the field of one tube."""

    tube: Tube
    phase: Annotated[str, "how far it is", OneOf(*TubePhase)]
    detail: Annotated[str, "why it is refused, or what is missing"]
    records: Annotated[int, "at rest so far"]
    asked: Annotated[int, "records asked for"]
    version_before: Annotated[int | None, "of the block in use at the beginning"]
    hash_before: Annotated[str, "of that block"]
    accelerometer_before: SensorModel | None
    version: Annotated[int | None, "of the proposed block"]
    hash_proposed: Annotated[str, "of the proposed block"]
    accelerometer: SensorModel | None
    uploads: Annotated[int, "begun"]
    restarted: Annotated[bool, "while the block was on its way"]
    hash_after_restart: Annotated[str, "of the block in use then"]
    hash: Annotated[str, "that the tube reported at the end"]
    solution: SolutionFigures | None


@answer_class
class RecalibrationAnswer:
    """Calibration in the field: how far, and what it found."""

    state: Annotated[str, "how far it is", OneOf(*RecalibrationStage)]
    proposal: Annotated[str, "hash to confirm"]
    attitudes: list[RestAttitude]
    tubes: list[TubeCalibration]
