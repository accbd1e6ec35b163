"""The stations of a wall's columns as a table, with what their instruments know of every station.

Every refusal names file, line, column, what was expected and what came.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning
from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.files.column_tables import read_table_columns
from groundstation.survey.wall.column_plans import ColumnPlan, ColumnSurvey
from groundstation.survey.well.analysis import RECORD_COLUMNS
from groundstation.survey.well.reference_frames import SAME_DEPTH

Array = npt.NDArray[np.float64]
COVARIANCE = ("cov_nn_m2", "cov_ne_m2", "cov_nd_m2", "cov_ee_m2", "cov_ed_m2", "cov_dd_m2")
PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # of these in a covariance
ROUNDED = 1e-6  # of a trace, to which a covariance may be rounded in a file


def read_holes(path: Path, plans: Sequence[ColumnPlan], heights: list[float], north: str) -> list[ColumnSurvey]:
    """Stations of every column in the order of ``plans``; none of one that was not surveyed.

    Depths of a column are brought to its head by ``heights`` (m), how far what they count from lies above it. A station
    at 0 m there tells the direction at the head, for between the two the string is straight. Further columns, those of
    ``RECORD_COLUMNS``, go with the stations where the instrument asks for them; those of ``COVARIANCE`` say how well
    each station is known, and no instrument is asked then. Azimuths count from ``north``.

    Raises
    ------
    SurveyError
        Names file, line and column.
    """
    needed = ("column", "md_m", "inclination_deg", "azimuth_deg")
    table, lines = read_table_columns(path, needed, texts=("column", *RECORD_COLUMNS, *COVARIANCE), north=north)
    table, lines, missing = _without_missing(table, lines, needed[1:])
    names = [plan.design.name for plan in plans]
    index = {name: k for k, name in enumerate(names)}
    owner = np.array([index.get(name, -1) for name in table["column"].tolist()], np.intp)
    unknown = np.flatnonzero(owner < 0)
    if len(unknown):
        k = int(unknown[0])
        name = str(table["column"][k])
        near = [other for other in names if other.casefold() == name.casefold()]
        hint = f"; {near[0]} is" if near else ""
        raise SurveyError(f"{path}: line {lines[k]}: column {name} is not among the heads{hint}")
    order = np.argsort(owner, kind="stable")
    owner, md, inc, azi = owner[order], *(table[name][order] for name in needed[1:])
    line = np.array(lines, np.intp)[order]
    _check_values(path, line, md, inc, azi)
    counts = np.bincount(owner, minlength=len(names))
    single = np.flatnonzero(counts == 1)
    if len(single):
        raise SurveyError(f"{path}: column {names[single[0]]}: expected at least two stations, got 1")
    starts = np.concatenate([[0], np.cumsum(counts)])
    lift = np.array(heights)[owner]
    at_reference = (np.arange(len(md)) == starts[owner]) & (md == 0.0) & (lift > 0.0)
    md = np.where(at_reference | (np.abs(md - lift) < SAME_DEPTH), 0.0, md - lift)
    _check_depths(path, names, owner, line, md, starts[:-1][counts > 0])
    cells = {name: table[name][order] for name in (*RECORD_COLUMNS, *COVARIANCE) if name in table}
    parts = [slice(a, b) for a, b in pairwise(starts)]
    return [
        ColumnSurvey(
            md[part],
            np.radians(inc[part]),
            np.radians(azi[part]),
            *_told(path, plan, line[part], {name: values[part].tolist() for name, values in cells.items()}),
            tuple(warning for warning in missing if warning.what == plan.design.name),
            _times(cells["time_s"][part].tolist() if "time_s" in cells else []),
        )
        for plan, part in zip(plans, parts, strict=True)
    ]


def _without_missing(
    table: dict[str, Array], lines: list[int], numbers: tuple[str, ...]
) -> tuple[dict[str, Array], list[int], list[EntryWarning]]:
    """Rows whose depth and angles are there, and a warning for every other one; a vertical one needs no azimuth."""
    md, inclination, azimuth = (table[name] for name in numbers)
    table = table | {numbers[2]: np.where(np.isnan(azimuth) & (inclination == 0.0), 0.0, azimuth)}
    gone = np.isnan([table[name] for name in numbers])
    warnings = []
    for k in np.flatnonzero(gone.any(axis=0)).tolist():
        name, title = str(table["column"][k]), numbers[int(np.argmax(gone[:, k]))]
        at = None if np.isnan(md[k]) else float(md[k])
        where = "" if at is None else f" at {at:g} m"
        text = f"column {name}, line {lines[k]}: {title} stands for no value: the station{where} is left out"
        warnings.append(EntryWarning("missing", name, text, at, at))
    kept = np.flatnonzero(~gone.any(axis=0))
    return {name: values[kept] for name, values in table.items()}, [lines[k] for k in kept], warnings


def _times(cells: list[str]) -> tuple[str, str] | None:
    """First and last time of a column's surveys, as they are told."""
    told = [cell for cell in cells if cell]
    return (told[0], told[-1]) if told else None


def _told(
    path: Path, plan: ColumnPlan, line: npt.NDArray[np.intp], cells: dict[str, list[str]]
) -> tuple[dict[str, Array], Array | None]:
    """What a table says of the stations of one column beyond their directions: for an instrument, or covariances."""
    covs = _covariances(path, plan, line, {name: texts for name, texts in cells.items() if name in COVARIANCE})
    if covs is None:
        return _record(path, plan, line, {n: texts for n, texts in cells.items() if n in RECORD_COLUMNS}), None
    for name, texts in cells.items():
        if name.startswith("sigma_") and any(texts):
            raise SurveyError(
                f"{path}: line {line[0]}: column {plan.design.name}: {name}: the covariances of its stations stand "
                "there already; leave one of them out"
            )
    return {}, covs


def _covariances(path: Path, plan: ColumnPlan, line: npt.NDArray[np.intp], cells: dict[str, list[str]]) -> Array | None:
    """Covariances (n, 3, 3) of one column's stations against its head, m^2; None where none are told."""
    if not any(any(texts) for texts in cells.values()):
        return None
    where = f"{path}: line {line[0]}: column {plan.design.name}"
    if missing := [name for name in COVARIANCE if name not in cells]:
        raise SurveyError(f"{where}: expected {', '.join(COVARIANCE)} together, {missing[0]} is missing")
    covs = np.zeros((len(line), 3, 3))
    for name, (a, b) in zip(COVARIANCE, PLACES, strict=True):
        for k, text in enumerate(cells[name]):
            try:
                covs[k, a, b] = covs[k, b, a] = float(text) if text or k else 0.0
            except ValueError:
                covs[k, a, b] = math.nan
    for k, cov in enumerate(covs):
        if not np.all(np.isfinite(cov)) or np.linalg.eigvalsh(cov)[0] < -ROUNDED * np.trace(cov):
            values = ", ".join(cells[name][k] for name in COVARIANCE)
            at = f"{path}: line {line[k]}: column {plan.design.name}"
            raise SurveyError(f"{at}: expected the covariance of a station, got {values}")
    return covs


def _record(path: Path, plan: ColumnPlan, line: npt.NDArray[np.intp], cells: dict[str, list[str]]) -> dict[str, Array]:
    """What else the instrument of one column asks for at its stations, by its variable; the head may be without."""
    found: dict[str, Array] = {}
    for name, texts in cells.items():
        variable, unit = RECORD_COLUMNS[name]
        if not any(texts):
            continue
        where = f"{path}: line {line[0]}: column {plan.design.name}: {name}"
        if not plan.tool.asks_for(variable):
            if name.startswith("sigma_"):
                raise SurveyError(f"{where}: the instrument {plan.tool.name} has no use for it; leave it out")
            continue
        values = [_station_value(path, int(line[k]), plan, name, text) for k, text in enumerate(texts) if text or k]
        found[variable] = unit * np.array(values if len(values) == len(texts) else [values[0], *values])
    return found


def _station_value(path: Path, line: int, plan: ColumnPlan, name: str, text: str) -> float:
    """One number of a station that is not negative."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0 or (name == "measurements" and value < 1.0):
        least = "of 1 or more" if name == "measurements" else "that is not negative"
        raise SurveyError(
            f"{path}: line {line}: column {plan.design.name}: {name}: expected a number {least}, got {text!r}"
        )
    return value


def _check_depths(
    path: Path,
    names: list[str],
    owner: npt.NDArray[np.intp],
    line: npt.NDArray[np.intp],
    md: Array,
    starts: npt.NDArray[np.intp],
) -> None:
    same = np.ones(len(md), bool)
    same[starts] = False
    back = np.flatnonzero(same[1:] & ~(np.diff(md) > 0.0)) + 1
    if len(back):
        k = int(back[0])
        raise SurveyError(
            f"{path}: line {line[k]}: column {names[owner[k]]}: "
            f"expected a depth beyond {md[k - 1]:g} m, got {md[k]:g} m"
        )
    off = starts[md[starts] != 0.0]
    if len(off):
        k = int(off[0])
        raise SurveyError(
            f"{path}: line {line[k]}: column {names[owner[k]]}: "
            f"expected the head first, got a station {md[k]:g} m below it"
        )


def _check_values(
    path: Path, line: npt.NDArray[np.intp], md: Array, inclination_deg: Array, azimuth_deg: Array
) -> None:
    turned = np.flatnonzero(np.abs(azimuth_deg) > RANGES["azimuth_deg"].high)
    if len(turned):
        RANGES["azimuth_deg"].check(f"{path}: line {line[turned[0]]}: azimuth_deg", float(azimuth_deg[turned[0]]))
    for name, values, good in (
        ("a finite md_m", md, np.isfinite(md)),
        ("an inclination of 0..180 deg", inclination_deg, (inclination_deg >= 0.0) & (inclination_deg <= 180.0)),
        ("a finite azimuth_deg", azimuth_deg, np.isfinite(azimuth_deg)),
    ):
        wrong = np.flatnonzero(~good)
        if len(wrong):
            raise SurveyError(f"{path}: line {line[wrong[0]]}: expected {name}, got {values[wrong[0]]:g}")
