"""What a record says of its stations beyond their directions, for instruments that ask: sigmas, counts, times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.null_values import is_null
from groundstation.errors import SurveyError
from groundstation.survey.files.cell_numbers import cell_numbers

Array = npt.NDArray[np.float64]
LARGEST = {"sigma_yaw_deg": 180.0, "sigma_systematic_deg": 180.0, "sigma_force_mps2": 100.0}


def instrument_column(
    path: Path, name: str, cells: Sequence[str], lines: Sequence[int], decimal: str
) -> dict[str, Array]:
    """The column (n,) by its name; nothing where all cells are empty. The collar may be without, and has the next's.

    Raises
    ------
    SurveyError
        Names file, line and column: a sigma that is missing at one station, stands for none or cannot be is no sigma.
    """
    told = [cell.strip() for cell in cells]
    if not any(told):
        return {}
    numbers = cell_numbers(path, lines, name, cells, decimal)
    if not told[0] and len(numbers) > 1:
        numbers[0] = numbers[1]
    for line, cell, number in zip(lines, told, numbers, strict=True):
        if not _is_good(name, number):
            least, most = ("1 or more", "") if name == "measurements" else ("0 or more", _most(name))
            raise SurveyError(f"{path}: line {line}: {name}: expected a number of {least}{most}, got {cell!r}")
    return {name: np.array(numbers, np.float64)}


def _most(name: str) -> str:
    return f" and at most {LARGEST[name]:g}" if name in LARGEST else ""


def _is_good(name: str, number: float | None) -> bool:
    """Whether a column may hold a number; a time counts from anywhere."""
    if number is None or not math.isfinite(number) or is_null(number):
        return False
    low = -math.inf if name == "time_s" else 1.0 if name == "measurements" else 0.0
    return low <= number <= LARGEST.get(name, math.inf)
