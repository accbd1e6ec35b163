"""What a study is: how it is named, asked for, run, shown, kept and drawn. `sim.studies.study_table` lists them all.

A study lives in a package of its own:

``run``     ``run_study(..., step) -> result`` takes what the study takes, by name, and calls ``step`` after each of
            the ``count_steps(...)`` it announced; ``verdict_lines(result) -> lines``, where there is a verdict. The
            result is a dict of plain values for JSON with ``experiment`` (the name its files get) and ``cases`` (rows
            of the main table); ``traces`` holds arrays for figures and is neither printed nor kept.
``figure``  ``draw_figures(result) -> {file name without suffix: figure}``, where there is something to draw.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

Columns = tuple[tuple[str, str], ...]  # key of a row, heading
Result = dict[str, Any]
MODULES = "sim.studies"
ARRAYS = "traces"  # of a result: arrays that only figures need


@dataclass(frozen=True, slots=True)
class Option:
    """Option of a study: a whole number of ``least``..``most``, or one of ``choices``."""

    name: str
    default: int | str | None
    least: int = 0
    most: int = 0
    choices: tuple[str, ...] = ()
    help: str = ""


@dataclass(frozen=True, slots=True)
class ResultTable:
    """Rows of a result: under which key, what of them is kept and shown.

    ``kept`` and ``shown`` are columns; none of either and the table is not kept or not shown. ``suffix`` is of its
    file, after the name of the experiment. ``title`` may name what the study took and found in braces. ``sideways``
    is shown with a line a column, where it is wider than long.
    """

    title: str
    kept: Columns = ()
    shown: Columns = ()
    rows: str = "cases"
    suffix: str = ""
    sideways: bool = False


@dataclass(frozen=True, slots=True)
class Study:
    """One line of the table of studies.

    ``module`` is its package; ``fixed`` are arguments of its run that belong to its name; ``counts`` says what its
    progress counts; ``full`` holds the arguments of each run of ``make study``, ``short`` those of the test.
    """

    name: str
    help: str
    module: str
    tables: tuple[ResultTable, ...]
    takes: tuple[Option, ...] = ()
    fixed: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    counts: str = "runs"
    drawn: bool = True
    full: tuple[str, ...] = ("",)
    short: str = ""

    def run(self, given: Mapping[str, Any], step: Callable[[], None]) -> Result:
        """Run the study with the options ``given``."""
        result: Result = self._of("run", "run_study")(**self.fixed, **given, step=step)
        return result

    def steps(self, given: Mapping[str, Any]) -> int:
        """Number of calls of ``step``."""
        count: int = self._of("run", "count_steps")(**self.fixed, **given)
        return count

    def told(self, result: Result) -> Result:
        """Return the part of a result that goes into JSON."""
        return {key: value for key, value in result.items() if key != ARRAYS}

    def verdicts(self, result: Result) -> list[str]:
        """Lines below the tables."""
        module = importlib.import_module(f"{self.module}.run")
        lines: list[str] = module.verdict_lines(result) if hasattr(module, "verdict_lines") else []
        return lines

    def figures(self, result: Result) -> dict[str, Any]:
        """Figures by the name of their file."""
        found: dict[str, Any] = self._of("figure", "draw_figures")(result) if self.drawn else {}
        return found

    def _of(self, module: str, function: str) -> Callable[..., Any]:
        chosen: Callable[..., Any] = getattr(importlib.import_module(f"{self.module}.{module}"), function)
        return chosen
