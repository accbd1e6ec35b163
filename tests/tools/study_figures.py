"""One figure of each column of every study's short run: no term, draw or unit behind a printed table moves unseen.

They say that nothing has changed, not that it is right: that the studies' own tests do, and the published figures
beside ours in each table. Where a study is to say otherwise, ``python tests/tools/study_figures.py NAME ...`` writes
its figures anew from the result of its short run, and the change is read beside its table in ``docs/results``.
"""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

FIGURES = Path(__file__).parents[1] / "data" / "studies" / "figures.json"
APART = 1e-6  # of the sum of all sizes; last bits of floats differ between families of processors
ROUNDING = 1e-11  # of a difference that is 0 but for rounding
TIMES = ("time_over_other", "time_over_other_alone", "milliseconds")  # of a machine, and no figure
Figure = list[Any]  # words of a column, or the sum by weights that differ and that of the sizes


def figures_of(result: dict[str, Any]) -> dict[str, Figure]:
    """Figure of each column of each table of a study's result, and of each number beside them."""
    return {name: figure_of(values) for name, values in _columns(result) if not name.endswith(TIMES)}


def figure_of(values: list[Any]) -> Figure:
    """Words as they are; of numbers their sum by weights that differ, so that no two may be exchanged, and the size."""
    if any(isinstance(value, str) for value in values):
        return [" ".join(map(str, values))]
    numbers = np.array([math.nan if value is None else float(value) for value in values])
    numbers = np.where(np.isfinite(numbers), numbers, 17.0)
    weights = 1.0 + 0.5 * np.cos(0.7 * np.arange(1.0, len(numbers) + 1.0))
    return [float(numbers @ weights), float(np.abs(numbers).sum())]


def apart(found: dict[str, Figure], kept: dict[str, Figure]) -> dict[str, tuple[Figure | None, Figure | None]]:
    """What is not as it was: found and kept of each such column."""
    return {
        name: (found.get(name), kept.get(name))
        for name in [*kept, *(one for one in found if one not in kept)]
        if not _are_equal(found.get(name), kept.get(name))
    }


def _are_equal(found: Figure | None, kept: Figure | None) -> bool:
    if found is None or kept is None or len(found) != len(kept):
        return False
    return found == kept if len(kept) == 1 else abs(found[0] - kept[0]) <= max(APART * kept[1], ROUNDING)


def _columns(result: Any, path: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Columns of tables, numbers of lists and single ones, each by its path."""
    if isinstance(result, dict):
        for key, value in result.items():
            yield from _columns(value, f"{path}.{key}".lstrip("."))
    elif isinstance(result, list) and result and all(isinstance(row, dict) for row in result):
        for key in dict.fromkeys(key for row in result for key in row):
            values = [row.get(key) for row in result]
            flat = [one for value in values for one in (value if isinstance(value, list) else [value])]
            yield f"{path}.{key}", flat
    elif isinstance(result, list):
        yield path, [str(one) if isinstance(one, list | dict) else one for one in result]
    else:
        yield path, [result]


def run_short(name: str) -> dict[str, Any]:
    """Result of the short run of a study."""
    from click.testing import CliRunner

    from borechain.cli.experiment.experiment import experiment
    from borechain.studies.rig_study_table import all_studies

    words = [name, *shlex.split(all_studies()[name].short), "--json"]
    result: dict[str, Any] = json.loads(CliRunner().invoke(experiment, words, catch_exceptions=False).stdout)
    return result


if __name__ == "__main__":
    kept = json.loads(FIGURES.read_text()) if FIGURES.exists() else {}
    for study in sys.argv[1:]:
        kept[study] = figures_of(run_short(study))
    FIGURES.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n", encoding="utf-8")
