"""Records of sensors against presets, and what accuracy and precision they show, each alone and together.

A record has one reading a row, several at each preset, or the mean and the standard deviation of each preset, as
published tables have them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.calibration.accuracy import (
    Characteristic,
    combined_accuracy,
    relative_error,
    sensor_characteristic,
)
from groundstation.calibration.laboratory_tables import line_error, read_table
from telemetry.errors import CalibrationError

UNITS = ("deg", "dps", "mps2", "g")
READINGS, MEANS = "preset_{0},reading_{0}", "preset_{0},mean_{0},std_{0}"
HEADERS = {form.format(unit): unit for unit in UNITS for form in (READINGS, MEANS)}


def read_characteristic(path: Path) -> tuple[Characteristic, str]:
    """Characteristic of one sensor in the unit of its record, and that unit.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    table = read_table(path, tuple(HEADERS))
    unit = HEADERS[",".join(table.header)]
    rows = np.array([table.numbers(k, 0) for k in range(len(table.lines))])
    for line, row in zip(table.lines, rows, strict=True):
        if row[0] == 0.0:
            raise line_error(table.name, line, "a preset other than 0, for a relative error", "0")
    if len(table.header) == 2:
        presets = np.array(list(dict.fromkeys(rows[:, 0].tolist())))
        try:
            return sensor_characteristic(presets, [rows[rows[:, 0] == preset, 1] for preset in presets]), unit
        except CalibrationError as error:
            raise CalibrationError(f"{table.name}: {error}") from None
    for k, line in enumerate(table.lines):
        if rows[k, 2] <= 0.0:
            raise line_error(table.name, line, "a standard deviation above 0", f"{rows[k, 2]:g}")
        if rows[k, 0] in rows[:k, 0]:
            raise line_error(table.name, line, "one row for each preset", f"{rows[k, 0]:g} again")
    preset, mean, std = rows.T
    return Characteristic(preset, mean, std, relative_error(preset, mean)), unit


def answer_accuracy(paths: Sequence[Path]) -> dict[str, Any]:
    """Accuracy (relative error, %) and precision (standard deviation) of every sensor, and of all as one.

    Raises
    ------
    CalibrationError
        When a record cannot be used, two are in different units, or a sensor does not scatter.
    """
    found = [read_characteristic(path) for path in paths]
    units = sorted({unit for _, unit in found})
    if len(units) != 1:
        raise CalibrationError(f"accuracy: expected sensors in one unit, got {' and '.join(units)}")
    overall = [one.overall() for one, _ in found]
    together = combined_accuracy(*overall)
    sensors = [
        {
            "file": str(path),
            "presets": [
                {"preset": p, "mean": m, "std": s, "error_percent": e}
                for p, m, s, e in zip(*(a.tolist() for a in (one.preset, one.mean, one.std, one.error)), strict=True)
            ],
            "error_percent": whole.error,
            "std": whole.std,
        }
        for path, (one, _), whole in zip(paths, found, overall, strict=True)
    ]
    return {"unit": units[0], "sensors": sensors, "error_percent": together.error, "std": together.std}
