"""Readers of calibration records: turn table, attitudes, static.

Every refusal names the file, the line, what was expected and what came. Limits and references are in the file's own
unit, and ``unit`` (SI per unit of the file) is applied once, when the record is returned.
"""

from __future__ import annotations

import hashlib
import io
import math
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from groundstation.calibration.laboratory_tables import (
    LARGEST,
    LaboratoryTable,
    check_range,
    line_error,
    read_bytes,
    read_table,
)
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
AXES = ("x", "y", "z")
STANDARD_GRAVITY = 9.80665  # m/s^2
DEGREE = math.pi / 180.0
TURN_TABLE_HEADERS = ("axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg", "axis,x_cw,x_acw,y_cw,y_acw,z_cw,z_acw")
ATTITUDES_HEADER = "position,pitch_deg,roll_deg,ax_mps2,ay_mps2,az_mps2"
STATIC_HEADER = "x,y,z"
FEWEST_ATTITUDES = 4  # unknowns of one sensor axis: its bias and a row of the matrix
SHORTEST = 100  # samples of a static record
MOVED = 3.0  # times the noise, the spread of a record that was not at rest
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


@dataclass(frozen=True, slots=True)
class StaticSamples:
    """Samples (n, 3) of a sensor at rest, SI."""

    samples: Array
    sha256: str

    def mean(self) -> Array:
        """Mean (3,)."""
        return np.asarray(self.samples.mean(axis=0))

    def mean_cov(self) -> Array:
        """Covariance (3, 3) of the mean, of samples that are independent."""
        return np.asarray(np.cov(self.samples, rowvar=False) / len(self.samples))


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
    """Mean readings of an accelerometer at preset attitudes; ``limit`` (m/s^2) is the full scale.

    Raises
    ------
    CalibrationError
        When the file is invalid or too short, a reading is saturated or in g, or the angles are in rad.
    """
    table = read_table(path, (ATTITUDES_HEADER,))
    rows = np.array([table.numbers(k, 1) for k in range(len(table.lines))])
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


def read_static(
    path: Path,
    unit: float = 1.0,
    limit: float = LARGEST,
    size: float | None = None,
    noise_std: float | None = None,
    shortest: int = SHORTEST,
) -> StaticSamples:
    """Samples at rest from a CSV (x,y,z) or a ``.npy`` of shape (n, 3), whose lines are its rows counted from 1.

    ``limit`` is the full scale, ``size`` the expected |mean| (9.81 of an accelerometer in m/s^2; None for a gyroscope)
    and ``noise_std`` the noise of one sample; None takes it from the differences of neighbours.

    Raises
    ------
    CalibrationError
        When the file is not such a record, is too short, saturates, moved, or its unit is not that of ``size``.
    """
    if path.suffix == ".npy":
        data = read_bytes(path)
        samples, lines, digest = _load_npy(path.name, data), None, hashlib.sha256(data).hexdigest()
    else:
        table = read_table(path, (STATIC_HEADER,))
        samples = np.array([table.numbers(k, 0) for k in range(len(table.lines))])
        lines, digest = table.lines, table.sha256
    places = np.arange(1, len(samples) + 1) if lines is None else np.array(lines)
    if len(samples) < max(shortest, 2):
        raise line_error(path.name, int(places[-1]), f"at least {shortest} samples", f"{len(samples)}")
    for k in np.flatnonzero(np.any(np.abs(samples) >= limit, axis=1))[:1]:
        check_range(path.name, int(places[k]), list(AXES), samples[k], limit)
    if size is not None:
        _check_unit(path.name, int(places[0]), float(np.linalg.norm(samples.mean(axis=0))), size)
    _check_rest(path.name, places, samples, noise_std)
    return StaticSamples(samples * unit, digest)


def _load_npy(name: str, data: bytes) -> Array:
    try:
        raw = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError, TokenError, BadZipFile) as error:
        raise CalibrationError(f"{name}: expected an array in the NPY format, got {error}") from error
    if not isinstance(raw, np.ndarray) or raw.ndim != 2 or raw.shape[1] != 3 or raw.dtype.kind not in "fiu":
        got = f"{raw.dtype} {raw.shape}" if isinstance(raw, np.ndarray) else "an archive"
        raise CalibrationError(f"{name}: expected numbers of shape (n, 3), got {got}")
    if not len(raw):
        raise line_error(name, 1, "a record", "an array without rows")
    samples = raw.astype(np.float64)
    for row, column in np.argwhere(~np.isfinite(samples))[:1]:
        raise line_error(name, int(row) + 1, f"a finite number in column {AXES[column]}", f"{samples[row, column]}")
    return samples


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


def _check_rest(name: str, places: npt.NDArray[np.int64], samples: Array, noise_std: float | None) -> None:
    """Refuse a record that spreads far beyond its noise; the line is where its mean changes most."""
    spread = samples.std(axis=0)
    # Neighbours of a record at rest differ by sqrt(2) of the noise, whatever the mean does slowly.
    steps = np.sqrt(np.mean(np.diff(samples, axis=0) ** 2, axis=0) / 2.0)
    allowed = MOVED * (steps if noise_std is None else np.full(3, noise_std))
    for axis in np.flatnonzero(spread > allowed)[:1]:
        drift = np.cumsum(samples[:, axis] - samples[:, axis].mean())
        line = int(places[min(int(np.abs(drift).argmax()) + 1, len(samples) - 1)])
        expected = f"a record at rest, {AXES[axis]} spread by at most {allowed[axis]:.3g}"
        raise line_error(name, line, expected, f"{spread[axis]:.3g}: it moved")
