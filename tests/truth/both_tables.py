"""The table of the field's disturbances by a second world, beside that of the study: `make truth`."""

from __future__ import annotations

import csv
import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from second_table import ROWS, drill, figures
from third_table import THIRD_ROWS, drill_third

RESULTS = Path(__file__).parents[2] / "docs" / "results"


def main(seeds: int) -> None:
    """Print both tables beside each other."""
    study = {}
    for name in ("field", "field-drawn"):
        with (RESULTS / f"{name}.csv").open() as file:
            study |= {row["case"]: row for row in csv.DictReader(file)}
    print(f"{'':56s}   NEES turning            rest     unflagged %    false faults       surveys %")
    print(f"{seeds} seeds of the second world, then the study{'':16s}" + 5 * "  second   study")
    with ProcessPoolExecutor() as pool:
        for name in (*ROWS, *THIRD_ROWS):
            take = drill if name in ROWS else drill_third
            ours = figures(name, list(pool.map(take, itertools.repeat(name), range(1, seeds + 1))))
            theirs = [float(study[name][key]) for key in ("nees_turning", "nees_rest", "unflagged_percent")]
            theirs.append(sum(float(study[name][key]) for key in ("gyro_step", "gyro_scale", "other_faults")))
            theirs.append(float(study[name]["surveys_percent"]))
            pairs = zip(ours, theirs, strict=True)
            print(f"{name:56s}" + "".join(f"{a:8.3g}{b:8.3g}" for a, b in pairs), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
