"""``borechain bench``: speed beside other libraries, measured in one run."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import click

from borechain.faults import EnvironmentFault, InputFault, plain_faults

FOLDER = Path(__file__).parents[1] / "benchmarks"


def benches() -> list[str]:
    """Names of the benchmarks in the repository."""
    return sorted(path.stem for path in FOLDER.glob("*.py"))


@click.command()
@click.argument("name", required=False)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else on stdout.")
@plain_faults
def bench(name: str | None, as_json: bool) -> None:
    """Run the benchmark NAME, or list them. The peers are development dependencies; ``make test`` installs them.

    \b
    Example:
      borechain bench survey
    """
    if not benches():
        raise EnvironmentFault(f"{FOLDER}: no benchmarks here; run from a checkout of the repository")
    if name is None:
        click.echo("\n".join(benches()))
        return
    if name not in benches():
        raise InputFault(f"expected one of {', '.join(benches())}, got {name!r}")
    spec = importlib.util.spec_from_file_location(f"benchmarks_{name}", FOLDER / f"{name}.py")
    if spec is None or spec.loader is None:
        raise EnvironmentFault(f"{FOLDER / name}.py cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        result = module.run()
    except ModuleNotFoundError as error:
        raise EnvironmentFault(f"bench {name} needs {error.name}; install the development dependencies") from error
    if as_json:
        click.echo(json.dumps(result))
    else:
        show(result)


def show(result: dict[str, Any]) -> None:
    """Table for people."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"bench {result['bench']}")
    for heading in ("what", "ours", "peer", "times faster"):
        table.add_column(heading, justify="right")
    for what, row in result["ratios"].items():
        ratio = row["ratio"]
        table.add_row(what, seconds(row["ours"]), seconds(row["peer"]), "" if ratio is None else f"{ratio:.1f}")
    Console().print(table)


def seconds(value: float | None) -> str:
    """A time with its unit."""
    if value is None:
        return ""
    if value < 1e-3:
        return f"{1e6 * value:.1f} us"
    return f"{1e3 * value:.2f} ms" if value < 1.0 else f"{value:.2f} s"
