"""What every experiment shares: its options, its progress, its table as a file and on the screen."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from borechain.cli.faults import plain_faults
from borechain.cli.options import json_option
from borechain.cli.tables import Columns, show_table, write_table

Run = Callable[[int, Callable[[], None]], dict[str, Any]]
Draw = Callable[[Path, dict[str, Any]], None]
COLUMNS: Columns = tuple(
    (name, name) for name in ("case", "quantity", "published", "ours", "low", "high", "unit", "to_reach", "reached")
)
seeds_option = click.option("--seeds", type=click.IntRange(2, 10_000), default=40, show_default=True)
out_option = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for the table and plots."
)


def options(command: Callable[..., None]) -> Callable[..., None]:
    """Seeds, folder and form of the output."""
    return seeds_option(out_option(json_option(plain_faults(command))))


def conduct(run: Run, seeds: int, batches: int, *, as_json: bool) -> dict[str, Any]:
    """Run an experiment under a progress bar."""
    with bar(seeds * batches, quiet=as_json) as step:
        return run(seeds, step)


@contextmanager
def bar(total: int, *, quiet: bool, what: str = "runs") -> Iterator[Callable[[], None]]:
    """Bar on stderr; yields the function that moves it on by one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=quiet) as shown:
        task = shown.add_task(what, total=total)
        yield lambda: shown.advance(task)


def keep(folder: Path | None, result: dict[str, Any], columns: Columns, draw: Draw | None = None) -> None:
    """Keep table and plots under the experiment's name."""
    if folder is None:
        return
    write_table(folder / f"{result['experiment']}.csv", result["cases"], columns)
    if draw is not None:
        draw(folder, result)


def tell(result: dict[str, Any], columns: Columns, title: str, *, as_json: bool, sideways: bool = False) -> None:
    """Print the result: JSON for scripts, the table for people, ``sideways`` where it is wider than long."""
    if as_json:
        click.echo(json.dumps({key: value for key, value in result.items() if key != "traces"}))
        return
    intervals = [{"interval": f"{r['low']:.3g}-{r['high']:.3g}"} if "low" in r else {} for r in result["cases"]]
    rows = [r | i for r, i in zip(result["cases"], intervals, strict=True)]
    show_table(title, rows, columns, sideways=sideways)


def yes(good: bool) -> str:
    """A verdict in a word."""
    return "yes" if good else "no"
