"""From the records of one tube, or its surveys, to the block that is proposed, and what the operator is shown of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from groundstation.calibration.block import Calibration, Provenance, to_json
from groundstation.calibration.field_calibration import Rest, calibrate_accelerometer, inclination_rms
from groundstation.service.orders.blocks import block_of
from groundstation.service.orders.recalibration.recalibration_progress import Found
from groundstation.survey.fusion.force_biases import ForceBias
from telemetry.parameters import ParameterBlock


@dataclass(frozen=True, slots=True)
class Proposal:
    """Block of one tube, the figures of its solution, and the text of its calibration's file."""

    block: ParameterBlock
    found: Found
    calibration: str


def propose_block(rests: Sequence[Rest], before: ParameterBlock, gravity: float, day: str) -> Proposal:
    """Block after ``before``: a new accelerometer, the gyroscope as it was. ``gravity`` in m/s^2.

    Raises
    ------
    CalibrationError
        When the records give no solution.
    """
    result = calibrate_accelerometer(rests, gravity, day)
    made, old = result.calibration, before.accelerometer
    block = replace(block_of(before.tube, before.version + 1, None, made), gyroscope=before.gyroscope)
    bias_std = result.fit.bias_std()
    found = Found(
        residual_rms=result.residual_rms,
        bias_std=(float(bias_std[0]), float(bias_std[1]), float(bias_std[2])),
        matrix_std=float(result.fit.matrix_std().max()),
        condition=result.fit.condition,
        inclination_before=inclination_rms(rests, np.array(old.matrix), np.array(old.bias)),
        inclination_after=inclination_rms(rests, made.matrix, made.bias),
    )
    return Proposal(block, found, to_json(made))


def propose_bias(found: ForceBias, before: ParameterBlock, gravity: float, day: str) -> Proposal:
    """Block after ``before`` with the bias that surveys show, all else as it was. ``gravity`` in m/s^2.

    G = M f + b gave f with a bias of its own, so M times that joins b.
    """
    old = before.accelerometer
    matrix = np.array(old.matrix)
    slopes, bias_slopes = np.array(old.matrix_slopes), np.array(old.bias_slopes)
    bias_std = np.sqrt(np.diagonal(matrix @ found.cov @ matrix.T))
    made = Calibration(
        "accelerometer", matrix, np.array(old.bias) + matrix @ found.bias, slopes, bias_slopes, old.reference,
        Provenance(
            found.digest, day, f"tool faces of {found.looks} surveys", found.residual_rms, np.zeros_like(matrix),
            bias_std, np.zeros_like(slopes), np.zeros_like(bias_slopes),
        ),
    )  # fmt: skip
    block = replace(block_of(before.tube, before.version + 1, None, made), gyroscope=before.gyroscope)
    sizes = np.linalg.eigvalsh(found.cov)
    across = float(np.sum(found.bias[:2] ** 2)), float(np.trace(found.cov[:2, :2]))
    figures = Found(
        residual_rms=found.residual_rms,
        bias_std=(float(bias_std[0]), float(bias_std[1]), float(bias_std[2])),
        matrix_std=0.0,
        condition=math.sqrt(float(sizes[-1] / sizes[0])),
        inclination_before=math.sqrt(0.5 * across[0]) / gravity,
        inclination_after=math.sqrt(0.5 * across[1]) / gravity,
    )
    return Proposal(block, figures, to_json(made))
