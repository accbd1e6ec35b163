"""Tables of experiments: as CSV files that land whole, and for people."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borechain.cli.whole_files import write_whole

if TYPE_CHECKING:
    from rich.console import Console

Columns = Sequence[tuple[str, str]]  # key of a row, heading
PAPER = 400  # characters
CASE_COLUMNS: Columns = (("case", "case"), ("published", "published"), ("ours", "ours"), ("unit", "unit"))


def write_table(path: Path, rows: list[dict[str, Any]], columns: Columns) -> None:
    """Keep a table as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([key for key, _ in columns])
    writer.writerows([[cell_text(row[key]) for key, _ in columns] for row in rows])
    write_whole(path, text.getvalue())


def show_table(title: str, rows: list[dict[str, Any]], columns: Columns, *, sideways: bool = False) -> None:
    """Print a table, ``sideways`` where it is wider than long."""
    from rich.table import Table

    table, names = Table(title=title), [heading for _, heading in columns]
    lines = [names, *([cell_text(row[key]) for key, _ in columns] for row in rows)]
    head, *body = zip(*lines, strict=True) if sideways else lines
    for k, heading in enumerate(head):
        table.add_column(heading, justify="left" if sideways and k == 0 else "right", overflow="fold")
    for line in body:
        table.add_row(*line)
    table_console().print(table)


def table_console(least: int = 0) -> Console:
    """What tables are printed on: the terminal, ``least`` columns wide or more; paper, where there is none.

    Nothing in brackets is a style, for names of files, holes and attitudes may have them.
    """
    from rich.console import Console

    width = max(Console().width, least) if sys.stdout.isatty() else PAPER
    return Console(width=width, markup=False, emoji=False)


def cell_text(value: Any) -> str:
    """Four significant digits for numbers, nothing for nothing."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def show_warnings(paper: Console, rows: list[dict[str, Any]]) -> None:
    """Print warnings of what was read, one a line."""
    for row in rows:
        paper.print(f"WARNING ({row['kind']}): {row['text']}")
