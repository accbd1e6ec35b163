"""What a calibration has to say, once for the terminal and the certificate: facts, tables, warnings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class SheetTable:
    """Heading, names of the columns and rows of finished text; the first column names the row."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class Sheet:
    """One calibration result: ``facts`` by name, tables and warnings."""

    title: str
    facts: Sequence[tuple[str, str]]
    tables: Sequence[SheetTable]
    warnings: Sequence[str] = ()


def column_texts(values: Sequence[float] | npt.NDArray[np.float64], digits: int = 3) -> list[str]:
    """Numbers of one column with equal decimals, ``digits`` significant ones of the largest."""
    largest = max((abs(value) for value in values), default=0.0)
    decimals = max(digits - 1 - math.floor(math.log10(largest)), 0) if largest > 0.0 else digits
    return [f"{value + 0.0:.{decimals}f}".replace("-", "\N{MINUS SIGN}") for value in np.round(values, decimals)]


def number_text(value: float, digits: int = 6) -> str:
    """A number with ``digits`` significant digits, trailing zeros kept, and a true minus sign."""
    return f"{value:#.{digits}g}".removesuffix(".").replace("-", "\N{MINUS SIGN}")
