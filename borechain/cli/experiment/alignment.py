"""``borechain experiment alignment``: two estimators of an IMU's mount side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from borechain.cli.experiment.output import COLUMNS, conduct, keep, options, tell
from borechain.cli.tables import Columns

WRITTEN: Columns = tuple(column for column in COLUMNS if column[0] not in ("to_reach", "reached"))
SHOWN: Columns = (
    ("case", "case"),
    ("quantity", "quantity"),
    ("published", "published"),
    ("ours", "ours, rms"),
    ("interval", "95 %"),
    ("unit", "unit"),
)


@click.command()
@options
def alignment(seeds: int, out: Path | None, as_json: bool) -> None:
    """Mount of an IMU from two slow turns: a circle fit beside (max + min) / 2, and the survey after.

    \b
    Example:
      borechain experiment alignment --seeds 200 --out docs/results
    """
    from sim.studies.alignment import batches, run

    result = conduct(run, seeds, batches(), as_json=as_json)
    keep(out, result, WRITTEN, draw)
    tell(result, SHOWN, f"Alignment, {seeds} seeds", as_json=as_json)


def draw(folder: Path, result: dict[str, Any]) -> None:
    """Error of both methods over inclination, noise and turns."""
    from groundstation.report.plots_node import alignment_figure
    from groundstation.report.style import save
    from sim.studies.alignment import NAMES, PUBLISHED_DEG, SWEEPS

    panels = {
        SWEEPS[name][0]: {NAMES[m]: [(p["x"], *p[m]) for p in points] for m in NAMES}
        for name, points in result["sweeps"].items()
    }
    published = {NAMES[m]: deg for m, deg in PUBLISHED_DEG.items()}
    figure = alignment_figure(panels, published, f"Alignment, {result['seeds']} seeds")
    save(figure, folder / "alignment.svg")
