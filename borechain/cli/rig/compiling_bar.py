"""What a user sees while the kernels of a rig are compiled: a bar on a terminal, a line elsewhere."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

from borechain.cli.notices import print_notice

HOW_LONG = "once for this version, some twenty seconds on two cores; in integers some minutes"


def compile_for_rig(scenario: Path, chips: str = "") -> None:
    """Compile what a rig of ``scenario`` needs where it is lacking, and show how far it is."""
    from borechain.drilling.compile_ahead import compile_ahead
    from sim.world.scenario import load_scenario

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the rig itself says them
        kernel = "fixed" if chips else load_scenario(scenario).file.node.kernel
    compile_ahead(kernel, compiling_bar if sys.stderr.isatty() else compiling_line)


@contextlib.contextmanager
def compiling_line(count: int) -> Iterator[Callable[[int], None]]:
    """A line as it begins and one as it ends; ``count`` functions are compiled, about."""
    print_notice(f"compiling about {count} functions for this machine: {HOW_LONG}")
    done = [0]
    yield lambda so_far: done.__setitem__(0, so_far)
    print_notice(f"{done[0]} functions are compiled")


@contextlib.contextmanager
def compiling_bar(count: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr of ``count`` functions, about."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    shown = TextColumn("compiling kernels, once for this version"), BarColumn(), TimeElapsedColumn()
    with Progress(*shown, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=count)
        yield lambda so_far: bar.update(task, completed=so_far, total=max(count, so_far + 1))
