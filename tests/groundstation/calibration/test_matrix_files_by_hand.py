"""A matrix that is known beforehand: from TOML as it is, from a block in its unit; one entry at a time is wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.calibration.matrix_files import read_matrix
from telemetry.errors import CalibrationError

ROWS = [[1.0, 0.2, 0.3], [0.4, 5.0, 0.6], [0.7, 0.8, 9.0]]


def written(folder: Path, rows: object, head: str = "") -> Path:
    path = folder / "m.toml"
    path.write_text(f"{head}matrix = {rows}\n")
    return path


@pytest.mark.parametrize("head", ["", "[accelerometer]\n"])
def test_a_matrix_stands_alone_or_under_its_sensor(tmp_path: Path, head: str) -> None:
    assert read_matrix(written(tmp_path, ROWS, head), 9.80665).tolist() == ROWS
    unknown = read_matrix(written(tmp_path, str(ROWS).replace("0.2", "nan"), head))
    assert np.isnan(unknown).tolist() == [[False, True, False], [False] * 3, [False] * 3]


@pytest.mark.parametrize("place", [(i, j) for i in range(3) for j in range(3)])
@pytest.mark.parametrize("value", [math.inf, -math.inf])
def test_one_infinite_entry_is_refused(tmp_path: Path, place: tuple[int, int], value: float) -> None:
    rows = [list(row) for row in ROWS]
    rows[place[0]][place[1]] = value
    with pytest.raises(CalibrationError, match=r"m\.toml: matrix: expected three rows of three numbers"):
        read_matrix(written(tmp_path, rows))


@pytest.mark.parametrize("rows", [[[1.0, 2.0]], [1.0, 2.0, 3.0], "'x'", [*ROWS, ROWS[0]], [["a", 1.0, 2.0], *ROWS[1:]]])
def test_another_shape_is_refused(tmp_path: Path, rows: object) -> None:
    with pytest.raises(CalibrationError, match="expected three rows of three numbers"):
        read_matrix(written(tmp_path, rows))
    with pytest.raises(CalibrationError, match=r"m\.toml: expected TOML"):
        read_matrix(written(tmp_path, "[1,"))
    with pytest.raises(CalibrationError, match=r"none\.toml: expected a file to read"):
        read_matrix(tmp_path / "none.toml")
