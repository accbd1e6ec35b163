"""From the records of one tube to the block that is proposed for it, and what the operator is shown of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from groundstation.calibration.block import to_json
from groundstation.calibration.field import Rest, inclination_rms, solve
from groundstation.service.blocks import block_of
from groundstation.service.recalibration.progress import Found
from telemetry.parameters import ParameterBlock


@dataclass(frozen=True, slots=True)
class Proposal:
    """Block of one tube, the figures of its solution, and the text of its calibration's file."""

    block: ParameterBlock
    found: Found
    calibration: str


def propose(rests: Sequence[Rest], before: ParameterBlock, gravity: float, day: str) -> Proposal:
    """Block after ``before``: a new accelerometer, the gyroscope as it was. ``gravity`` in m/s^2.

    Raises
    ------
    CalibrationError
        When the records give no solution.
    """
    result = solve(rests, gravity, day)
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
