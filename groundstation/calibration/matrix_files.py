"""Reader of a matrix that is known beforehand, of an earlier calibration or of the mounting."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.calibration import block
from telemetry.bounded_bytes import bounded_text
from telemetry.errors import CalibrationError
from telemetry.toml_tables import parse_toml_tables

Array = npt.NDArray[np.float64]


def read_matrix(path: Path, unit: float = 1.0) -> Array:
    """Matrix (3, 3) of a block's JSON file, times ``unit``, or of a TOML file with ``matrix``; nan is not known.

    In TOML the key may stand alone or under ``[accelerometer]``, and is taken as it is.

    Raises
    ------
    CalibrationError
        When the file holds no such matrix.
    """
    if path.suffix == ".json":
        return np.asarray(block.read_calibration(path).matrix * unit)
    try:
        content = parse_toml_tables(bounded_text(path))
    except OSError as error:
        raise CalibrationError(f"{path.name}: expected a file to read, got {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CalibrationError(f"{path.name}: expected TOML, got {error}") from error
    given = content.get("accelerometer", content)
    rows = given.get("matrix") if isinstance(given, dict) else None
    try:
        matrix = np.array(rows, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        matrix = np.zeros(0)
    if matrix.shape != (3, 3) or np.any(np.isinf(matrix)):
        raise CalibrationError(f"{path.name}: matrix: expected three rows of three numbers, got {rows}")
    return matrix
