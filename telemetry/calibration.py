"""The result of a calibration as a file: what is applied to a sensor's readings, and where it comes from.

The laboratory and the ground station write it; the ground station and a node with several IMUs read it.

A block is whole or it is not: it is checked when it is made, its hash covers every number of it, and its file is
replaced in one step. The hash is what a node reports of the block it holds.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
from dataclasses import dataclass, fields
from datetime import date
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from telemetry.bounded_bytes import bounded_text
from telemetry.errors import CalibrationError
from telemetry.messages import Matrix3, Vector3
from telemetry.parameters import POWERS, SensorParameters

Array = npt.NDArray[np.float64]
FORMAT = 1
SENSORS = ("accelerometer", "gyroscope", "magnetometer")
DIGEST = re.compile(r"[0-9a-f]{64}")
SINGULAR = 1e6  # condition beyond which the axes of a sensor are not three
COUNT = -1  # in a shape: as many powers as were fitted


@dataclass(frozen=True, slots=True, eq=False)
class Provenance:
    """Origin of a block; the standard errors are shaped like the parameters they belong to.

    ``input_sha256`` of the record, ``day`` in ISO 8601, ``design`` in words, ``residual_rms`` in the readings' unit.
    """

    input_sha256: str
    day: str
    design: str
    residual_rms: float
    matrix_std: Array
    bias_std: Array
    matrix_slopes_std: Array
    bias_slopes_std: Array

    def __post_init__(self) -> None:
        _expect(bool(DIGEST.fullmatch(_text(self, "input_sha256"))), "input_sha256", "64 hex digits", self.input_sha256)
        _expect(_is_day(_text(self, "day")), "day", "a day as 2024-05-31", self.day)
        _expect(bool(_text(self, "design").strip()), "design", "words", self.design)
        for name, shape in SHAPES.items():
            std = _freeze(self, f"{name}_std", shape)
            _expect(bool(np.all(std >= 0.0)), f"{name}_std", "standard errors of 0 or more", std.tolist())
        rms = _freeze(self, "residual_rms", ())
        _expect(float(rms) >= 0.0, "residual_rms", "0 or more", float(rms))
        object.__setattr__(self, "residual_rms", float(rms))


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Parameters of G = M(T) w + b(T), SI.

    ``matrix`` (3, 3) and ``bias`` (3,) hold at ``reference`` (C); ``matrix_slopes`` (q, 3, 3), ``bias_slopes`` (p, 3)
    are the coefficients of the first and higher powers of (T - reference), none where the temperature is not modelled.
    ``valid`` (C): the lowest and the highest temperature at which they were measured, where that is known.
    """

    sensor: str
    matrix: Array
    bias: Array
    matrix_slopes: Array
    bias_slopes: Array
    reference: float
    provenance: Provenance
    valid: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        _expect(_text(self, "sensor") in SENSORS, "sensor", f"one of {', '.join(SENSORS)}", self.sensor)
        for name, shape in SHAPES.items():
            value = _freeze(self, name, shape)
            std = getattr(self.provenance, f"{name}_std")
            _expect(std.shape == value.shape, f"{name}_std", f"the shape {value.shape}", std.shape)
        check_invertible(self.matrix)
        object.__setattr__(self, "reference", float(_freeze(self, "reference", ())))
        if self.valid is not None:
            low, high = _freeze(self, "valid", (2,)).tolist()
            _expect(low < high, "valid", "a temperature and a higher one", f"{low:g} and {high:g} C")
            object.__setattr__(self, "valid", (low, high))

    def canonical(self) -> bytes:
        """Bytes that are equal exactly when the blocks are: sorted keys, no spaces, shortest decimals of each float."""
        return json.dumps(_plain(self), sort_keys=True, separators=(",", ":"), allow_nan=False).encode()

    def sha256(self) -> str:
        """Hash of the canonical bytes, 64 hex digits."""
        return hashlib.sha256(self.canonical()).hexdigest()


SHAPES: dict[str, tuple[int, ...]] = {
    "matrix": (3, 3),
    "bias": (3,),
    "matrix_slopes": (COUNT, 3, 3),
    "bias_slopes": (COUNT, 3),
}


def to_json(calibration: Calibration) -> str:
    """Readable text of a block with its hash."""
    whole = {"format": FORMAT, "sha256": calibration.sha256(), "calibration": _plain(calibration)}
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"


def from_json(text: str) -> Calibration:
    """Block of a text.

    Raises
    ------
    CalibrationError
        When the text is not JSON, lacks or adds a key, holds an invalid value, or was changed after it was written.
    """
    try:
        whole = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise CalibrationError(f"calibration: expected JSON of finite numbers, got {error}") from error
    _check_keys(whole, "calibration file", {"format", "sha256", "calibration"})
    _expect(whole["format"] == FORMAT, "format", str(FORMAT), whole["format"])
    content = whole["calibration"]
    known = {field.name for field in fields(Calibration)}
    has_range = isinstance(content, dict) and "valid" in content
    _check_keys(content, "calibration", known if has_range else known - {"valid"})
    _check_keys(content["provenance"], "provenance", {field.name for field in fields(Provenance)})
    calibration = Calibration(**content | {"provenance": Provenance(**content["provenance"])})
    _expect(whole["sha256"] == calibration.sha256(), "sha256", calibration.sha256(), whole["sha256"])
    return calibration


def write_calibration(path: Path, calibration: Calibration) -> None:
    """Replace the file of a block in one step; a reader, or a loss of power, sees the old one or the new one.

    Raises
    ------
    CalibrationError
        When it cannot be written; the old file is then untouched.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        with draft.open("w", encoding="utf-8") as file:
            file.write(to_json(calibration))
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise CalibrationError(f"{path}: expected a place to write to, got {error.strerror}") from error


def read_calibration(path: Path) -> Calibration:
    """Block of a file.

    Raises
    ------
    CalibrationError
        When the file cannot be read or holds no block.
    """
    try:
        text = bounded_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise CalibrationError(f"{path}: expected a calibration, got {error}") from error
    try:
        return from_json(text)
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from error


def check_invertible(matrix: Array) -> None:
    """Refuse a matrix that cannot be inverted.

    Raises
    ------
    CalibrationError
        When an entry is not finite or the axes are not independent.
    """
    if not np.all(np.isfinite(matrix)) or not np.linalg.cond(matrix) < SINGULAR:
        raise CalibrationError(f"matrix: expected three independent sensor axes, got {matrix.tolist()}")


def sensor_parameters(calibration: Calibration) -> SensorParameters:
    """Return the parameters that a node applies of a calibration.

    Raises
    ------
    CalibrationError
        When it follows the temperature to a higher power than a node does.
    """
    for name in ("matrix_slopes", "bias_slopes"):
        if (powers := len(getattr(calibration, name))) > POWERS:
            raise CalibrationError(f"{name}: expected at most {POWERS} powers of the temperature, got {powers}")
    matrices = np.zeros((POWERS, 3, 3))
    biases = np.zeros((POWERS, 3))
    matrices[: len(calibration.matrix_slopes)] = calibration.matrix_slopes
    biases[: len(calibration.bias_slopes)] = calibration.bias_slopes
    return SensorParameters(
        matrix=_matrix(calibration.matrix),
        bias=_vector(calibration.bias),
        matrix_slopes=(_matrix(matrices[0]), _matrix(matrices[1]), _matrix(matrices[2])),
        bias_slopes=_matrix(biases),
        reference=calibration.reference,
    )


def _expect(holds: bool, name: str, expected: str, got: object) -> None:
    if not holds:
        raise CalibrationError(f"{name}: expected {expected}, got {got}")


def _text(owner: object, name: str) -> str:
    value = getattr(owner, name)
    _expect(isinstance(value, str), name, "text", value)
    return str(value)


def _is_day(text: str) -> bool:
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def _freeze(owner: object, name: str, shape: tuple[int, ...]) -> Array:
    """Replace a field by its own read-only copy of the given shape, without negative zeros, which would hash apart."""
    given = getattr(owner, name)
    try:
        raw = np.asarray(given)
        value = np.asarray(raw.astype(np.float64) + 0.0)
    except (ValueError, TypeError, OverflowError) as error:
        raise CalibrationError(f"{name}: expected numbers, got {given}") from error
    if shape[:1] == (COUNT,) and value.size == 0:
        value = value.reshape(0, *shape[1:])
    fits = value.ndim == len(shape) and all(want in (COUNT, has) for want, has in zip(shape, value.shape, strict=True))
    _expect(fits, name, f"the shape {shape}".replace(str(COUNT), "n"), value.shape)
    _expect(raw.dtype.kind in "fiu" and bool(np.all(np.isfinite(value))), name, "finite numbers", given)
    value.setflags(write=False)
    object.__setattr__(owner, name, value)
    return value


def _plain(owner: Calibration | Provenance) -> dict[str, Any]:
    """Return a block as a JSON object."""
    plain: dict[str, Any] = {}
    for field in fields(owner):
        value = getattr(owner, field.name)
        if value is None:  # a block without it has the hash that it had before there was such a field
            continue
        if isinstance(value, np.ndarray):
            value = value.tolist()
        plain[field.name] = _plain(value) if isinstance(value, Provenance) else value
    return plain


def _check_keys(value: Any, name: str, keys: set[str]) -> None:
    _expect(isinstance(value, dict), name, "an object", value)
    missing, unknown = sorted(keys - set(value)), sorted(set(value) - keys)
    _expect(not missing and not unknown, name, f"the keys {sorted(keys)}", f"missing {missing}, unknown {unknown}")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(name)


def _vector(values: Array) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])


def _matrix(rows: Array) -> Matrix3:
    return _vector(rows[0]), _vector(rows[1]), _vector(rows[2])
