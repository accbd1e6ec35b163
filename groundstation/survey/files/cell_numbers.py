"""Numbers of cells that people wrote: decimal commas, thousands, units of their own, and cells that say none."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

from groundstation.entry.null_values import BEYOND, NEVER, null_or_number
from groundstation.errors import SurveyError

DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
THOUSANDS = re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+")
THREE_PLACES = re.compile(r"[+-]?\d{1,3},\d{3}")
OWN_UNIT = re.compile(r"\S+\s*(m|ft|deg|rad|°|'|feet|gon)")


def decimal_sign(path: Path, cells: Sequence[str], separator: str, asked: str | None, option: str = "--decimal") -> str:
    """What stands for the decimal point in a table: ``.``, ``,``, or ``.`` with commas of thousands as ``,.``.

    ``option`` is the name of what may say it, if there is one.

    Raises
    ------
    SurveyError
        When a comma may be either and it is not said which.
    """
    commas, points = [c for c in cells if "," in c], [c for c in cells if "." in c]
    if asked is not None:
        return "," if asked == "comma" else ",."
    if not commas:
        return "."
    whole = [c for c in commas if "." in c]
    if whole and all(THOUSANDS.fullmatch(c) for c in whole):
        rest = [c for c in commas if "." not in c]
        if all(THREE_PLACES.fullmatch(c) for c in rest):
            return ",."
    if points or not all(DECIMAL_COMMA.fullmatch(cell) for cell in commas):
        beside = f" beside {points[0]!r}" if points else ""
        raise SurveyError(
            f"{path}: {commas[0]!r} may be a decimal comma or thousands{beside}; "
            f"expected one sign for decimals and none for thousands{option and f', or {option} comma or point'}"
        )
    if separator == "," or all(THREE_PLACES.fullmatch(cell) for cell in commas):
        raise SurveyError(
            f"{path}: {commas[0]!r} may be thousands or a decimal comma; "
            f"expected decimal points{option and f', or {option}'}"
        )
    return ","


def plain_cell(cell: str, decimal: str) -> str:
    """A cell with a decimal point and no thousands."""
    if decimal == ",":
        return cell.replace(".", "").replace(",", ".")
    return cell.replace(",", "") if decimal == ",." else cell


def cell_numbers(path: Path, lines: Sequence[int], name: str, cells: Sequence[str], decimal: str) -> list[float | None]:
    """Numbers of a column, None where a cell says that there is none.

    Raises
    ------
    SurveyError
        Names line and column of the first cell that is neither.
    """
    if decimal == "." and (plain := _plain_numbers(cells)) is not None:
        return plain
    found: list[float | None] = []
    for number, cell in zip(lines, cells, strict=True):
        text = plain_cell(cell, decimal)
        try:
            found.append(null_or_number(text))
        except ValueError:
            where = f"{path}: line {number}"
            if OWN_UNIT.fullmatch(text) is not None:
                raise SurveyError(
                    f"{where}: {name} = {cell!r} has a unit of its own; expected units in the header alone"
                ) from None
            raise SurveyError(f"{where}: expected numbers, got {name} = {cell!r}") from None
    return found


def _plain_numbers(cells: Sequence[str]) -> list[float | None] | None:
    """Numbers of a column that holds nothing else, in half the time; None where each cell is to be looked at."""
    if "_" in "".join(cells):  # Python would read 1_0 as ten
        return None
    try:
        values = [*map(float, cells)]
    except ValueError:
        return None
    sizes = [*map(abs, values)]
    are_all = math.isfinite(sum(sizes)) and max(sizes, default=0.0) <= BEYOND and NEVER.isdisjoint(values)
    return [*values] if are_all else None
