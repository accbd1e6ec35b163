"""Readers of calibration records: turn table and attitudes.

Every refusal names the file, the line, what was expected and what came. Limits and references are in the file's own
unit, and ``unit`` (SI per unit of the file) is applied once, when the record is returned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.calibration.laboratory_tables import (
    LARGEST,
    LaboratoryTable,
    check_range,
    line_error,
    read_table,
)

Array = npt.NDArray[np.float64]
AXES = ("x", "y", "z")
STANDARD_GRAVITY = 9.80665  # m/s^2
DEGREE = math.pi / 180.0
TURN_TABLE_HEADERS = ("axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg", "axis,x_cw,x_acw,y_cw,y_acw,z_cw,z_acw")
ATTITUDES_HEADER = "position,pitch_deg,roll_deg,ax_mps2,ay_mps2,az_mps2"
ATTITUDES_HEADERS = {
    ATTITUDES_HEADER: 1.0,
    "position,pitch_deg,roll_deg,ax_g,ay_g,az_g": STANDARD_GRAVITY,
}  # SI of its readings
FEWEST_ATTITUDES = 4  # unknowns of one sensor axis: its bias and a row of the matrix
UNIT_TOLERANCE = 0.15  # relative, scale error of a raw sensor and its bias
WRONG_UNITS = (
    (1.0 / STANDARD_GRAVITY, "in g where m/s^2 belongs"),
    (STANDARD_GRAVITY, "in m/s^2 where g belongs"),
    (DEGREE, "in rad where deg belongs"),
    (1.0 / DEGREE, "in deg where rad belongs"),
)
ANGLE_RATIO = 20.0  # well between 1 and 57.3


@dataclass(frozen=True, slots=True)
class TurnTable:
    """Two rotations about each axis: ``positive`` and ``negative`` (3, 3) in SI, row = turned axis, column = sensor's.

    ``reference`` is the true rate (rad/s) or true specific force (m/s^2) of the positive runs; ``sha256`` of the file.
    """

    positive: Array
    negative: Array
    reference: float
    sha256: str


@dataclass(frozen=True, slots=True)
class Attitudes:
    """Mean readings (n, 3) m/s^2 at preset ``pitch`` and ``roll`` (n,) rad."""

    names: tuple[str, ...]
    pitch: Array
    roll: Array
    readings: Array
    sha256: str


def read_turn_table(path: Path, reference: float, unit: float = 1.0, limit: float = LARGEST) -> TurnTable:
    """Turn table of one sensor; ``reference`` > 0, first column of each pair at +reference, ``limit`` the full scale.

    Raises
    ------
    CalibrationError
        When the file is not a turn table, lacks an axis, has a saturated reading, or its unit is not the reference's.
    """
    table = read_table(path, TURN_TABLE_HEADERS)
    rows = {}
    for k, line in enumerate(table.lines):
        axis = table.cells[k][0]
        if axis not in AXES or axis in rows:
            raise line_error(table.name, line, "one row for each turned axis x, y, z", f"{axis!r}")
        rows[axis] = np.array(table.numbers(k, 1))
        check_range(table.name, line, table.header[1:], rows[axis], limit)
        response = float(np.linalg.norm(rows[axis][0::2] - rows[axis][1::2])) / 2.0
        _check_unit(table.name, line, response, reference)
    if missing := [axis for axis in AXES if axis not in rows]:
        last = table.lines[-1]
        raise line_error(table.name, last, f"a row for turned axis {', '.join(missing)}", "the end of the file")
    readings = np.array([rows[axis] for axis in AXES])
    return TurnTable(readings[:, 0::2] * unit, readings[:, 1::2] * unit, reference * unit, table.sha256)


def read_attitudes(path: Path, limit: float = LARGEST) -> Attitudes:
    """Mean readings of an accelerometer at preset attitudes, in m/s^2 or g; ``limit`` (m/s^2) is the full scale.

    Raises
    ------
    CalibrationError
        When the file is invalid or too short, a reading is saturated or in another unit, or the angles are in rad.
    """
    table = read_table(path, tuple(ATTITUDES_HEADERS))
    rows = np.array([table.numbers(k, 1) for k in range(len(table.lines))])
    rows[:, 2:] *= ATTITUDES_HEADERS[",".join(table.header)]
    for line, row in zip(table.lines, rows, strict=True):
        if abs(row[0]) > 90.0 or abs(row[1]) > 180.0:
            raise line_error(
                table.name, line, "|pitch| <= 90 deg and |roll| <= 180 deg", f"{row[0]:.6g} and {row[1]:.6g}"
            )
        check_range(table.name, line, table.header[3:], row[2:], limit)
        _check_unit(table.name, line, float(np.linalg.norm(row[2:])), STANDARD_GRAVITY)
    if len(rows) < FEWEST_ATTITUDES:
        raise line_error(table.name, table.lines[-1], f"at least {FEWEST_ATTITUDES} attitudes", f"{len(rows)}")
    _check_angles(table, rows)
    names = tuple(cells[0] for cells in table.cells)
    return Attitudes(names, rows[:, 0] * DEGREE, rows[:, 1] * DEGREE, rows[:, 2:], table.sha256)


def _check_unit(name: str, line: int, size: float, expected: float) -> None:
    """Refuse a size that is not the expected one, and say which unit would explain it."""
    ratio = size / expected
    if 0.5 <= ratio <= 2.0:
        return
    likely = [text for factor, text in WRONG_UNITS if abs(ratio / factor - 1.0) <= UNIT_TOLERANCE]
    reason = f": it looks {likely[0]}" if likely else ""
    raise line_error(name, line, f"a reading of about {expected:.6g}", f"{size:.6g}{reason}")


def _check_angles(table: LaboratoryTable, rows: Array) -> None:
    """Refuse presets in rad: the readings then turn 57 times as far as the presets say."""
    units = rows[:, 2:] / np.linalg.norm(rows[:, 2:], axis=1, keepdims=True)
    turned = np.degrees(np.arccos(np.clip(units @ units.T, -1.0, 1.0))).max()
    largest = np.abs(rows[:, :2]).max(axis=1)
    preset = 2.0 * largest.max()
    if preset > 0.0 and turned > ANGLE_RATIO * preset:
        raise line_error(
            table.name,
            table.lines[int(largest.argmax())],
            f"presets that explain readings {turned:.3g} deg apart",
            f"at most {largest.max():.4g} deg: the angles look {WRONG_UNITS[2][1]}",
        )
