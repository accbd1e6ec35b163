"""Output of a study: its progress, its tables and figures as files, and what is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import show_table, write_table

if TYPE_CHECKING:
    from sim.studies.study import Study


@contextmanager
def progress_bar(total: int, counts: str, *, quiet: bool) -> Iterator[Callable[[], None]]:
    """Bar on stderr; yields the function that moves it on by one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=quiet) as shown:
        task = shown.add_task(counts, total=total)
        yield lambda: shown.advance(task)


def write_study(study: Study, result: dict[str, Any], folder: Path | None) -> None:
    """Write the tables and figures that a study keeps."""
    if folder is None:
        return
    for table in study.tables:
        if table.kept:
            write_table(folder / f"{result['experiment']}{table.suffix}.csv", result[table.rows], table.kept)
    if study.drawn:
        from groundstation.report.style import save_figure

        for name, figure in study.figures(result).items():
            save_figure(figure, folder / f"{name}.svg")


def show_study(study: Study, given: Mapping[str, Any], result: dict[str, Any]) -> None:
    """Print the tables and the verdicts."""
    for table in study.tables:
        if table.shown:
            title = table.title.format(**{**given, **result})
            rows = [row | interval_cell(row) for row in result[table.rows]]
            show_table(title, rows, table.shown, sideways=table.sideways)
    for line in study.verdicts(result):
        click.echo(line)


def interval_cell(row: Mapping[str, Any]) -> dict[str, str]:
    """Both ends of a confidence interval in one cell."""
    return {"interval": f"{row['low']:.3g}-{row['high']:.3g}"} if "low" in row else {}
