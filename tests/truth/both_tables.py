"""The table of the field's disturbances by a second world, beside that of the study: `make truth`."""

from __future__ import annotations

import csv
import itertools
import math
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from second_table import ROWS, drill, figures
from third_table import THIRD_ROWS, drill_third

RESULTS = Path(__file__).parents[2] / "docs" / "results"
TABLES = ("field", "field-drawn")
FIGURES = ("nees_turning", "nees_rest", "unflagged_percent")
FAULTS = ("gyro_step", "gyro_scale", "other_faults")


def read_study(results: Path) -> dict[str, dict[str, str]]:
    """Rows of the study's tables by their names; of a table that is not there none."""
    study: dict[str, dict[str, str]] = {}
    for path in (results / f"{name}.csv" for name in TABLES):
        if path.exists():
            with path.open() as file:
                study |= {row["case"]: row for row in csv.DictReader(file)}
    return study


def study_figures(row: Mapping[str, str]) -> list[float]:
    """As ``second_table.figures``; NaN for what a table that is older than the row does not have."""

    def figure(key: str) -> float:
        return float(row.get(key) or math.nan)

    return [*map(figure, FIGURES), sum(map(figure, FAULTS)), figure("surveys_percent")]


def main(seeds: int) -> None:
    """Print both tables beside each other."""
    study = read_study(RESULTS)
    print(f"{'':56s}   NEES turning            rest     unflagged %    false faults       surveys %")
    print(f"{seeds} seeds of the second world, then the study{'':16s}" + 5 * "  second   study")
    with ProcessPoolExecutor() as pool:
        for name in (*ROWS, *THIRD_ROWS):
            take = drill if name in ROWS else drill_third
            ours = figures(name, list(pool.map(take, itertools.repeat(name), range(1, seeds + 1))))
            pairs = zip(ours, study_figures(study.get(name, {})), strict=True)
            print(f"{name:56s}" + "".join(f"{a:8.3g}{b:8.3g}" for a, b in pairs), flush=True)
    missing = [name for name in (*ROWS, *THIRD_ROWS) if name not in study]
    if missing:
        print(f"{len(missing)} rows are not in the study's tables: `borechain experiment field` makes them anew")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
