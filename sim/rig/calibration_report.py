"""What a calibration in the field was good for: the surveys after it, under the new block and the one before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.calibration.field_calibration import force_inclination
from groundstation.calibration.turntable import correct_readings
from sim.rig.report import root_mean_square
from sim.world.world import World


def calibration_result(view: dict[str, Any], measurements: Sequence[dict[str, Any]], world: World) -> dict[str, Any]:
    """Part ``calibration_result`` of a rig's result; ``view`` is the ground station's ``recalibration``.

    ``after`` is the inclination error of every survey below the collar; ``before`` that of the same surveys, each mean
    force led back to the reading, G = M f + b, and corrected by the block that the tube had before.
    """
    tubes = {row["tube"]: row for row in view["tubes"]}
    before, after = [], []
    for m in (m for m in measurements if m["md_m"] > 0.0):
        truth = world.truth_station(m["md_m"])["inclination_deg"]
        after.append(m["inclination_deg"] - truth)
        before.append(_inclination_before(tubes.get(m["tube"]), m) - truth)
    return {
        "state": view["state"],
        "inclination_rms_deg": {"before": root_mean_square(before), "after": root_mean_square(after)},
        "tubes": [_tube(row) for row in tubes.values()],
    }


def _inclination_before(row: dict[str, Any] | None, measurement: dict[str, Any]) -> float:
    """Inclination (deg) of a survey as the block before would have had it."""
    if row is None or row["phase"] != "done" or row["accelerometer_before"] is None:
        return float(measurement["inclination_deg"])
    new, old = row["accelerometer"], row["accelerometer_before"]
    force = np.mean(np.array(measurement["forces_mps2"]), axis=0)
    reading = np.array(new["matrix"]) @ force + np.array(new["bias_mps2"])
    corrected = correct_readings(reading[np.newaxis], np.array(old["matrix"]), np.array(old["bias_mps2"]))
    return math.degrees(float(force_inclination(corrected)[0]))


def _tube(row: dict[str, Any]) -> dict[str, Any]:
    solution = row["solution"] or {}
    return {
        "tube": row["tube"],
        "phase": row["phase"],
        "detail": row["detail"],
        "records": row["records"],
        "hash_before": row["hash_before"],
        "hash": row["hash"],
        "hash_proposed": row["hash_proposed"],
        "version": row["version"],
        "residual_rms": solution.get("residual_rms_mps2"),
        "restarted": row["restarted"],
        "hash_after_restart": row["hash_after_restart"],
        "uploads": row["uploads"],
    }
