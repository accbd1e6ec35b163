"""``borechain bench``: speed beside other libraries, measured in one run, and a string in real time."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import json
from pathlib import Path
from typing import Any, cast

import click

from borechain.cli.console_tables import table_console
from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults
from borechain.cli.shared_options import json_option

FOLDER = Path(__file__).parents[3] / "benchmarks"
OWN = {
    "realtime": "realtime",
    "page": "load",
    "day": "load",
    "learn": "load",
    "doors": "load",
    "killed": "load",
    "hour": "hour_command",
}  # and the module of each


def bench_names() -> list[str]:
    """Names of the benchmarks: those of the repository, and those of the package."""
    return sorted([*(path.stem for path in FOLDER.glob("*.py")), *OWN])


class Benches(click.Group):
    """Every benchmark as a command, imported when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in order."""
        del ctx
        return bench_names()

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        """One of them.

        Raises
        ------
        InputFault
            When there is none of that name.
        """
        del ctx
        if cmd_name not in OWN and not FOLDER.is_dir():
            raise EnvironmentFault(f"bench {cmd_name}: the benchmarks beside other libraries are in the repository")
        if cmd_name not in bench_names():
            raise InputFault(f"expected one of {', '.join(bench_names())}, got {cmd_name!r}")
        if cmd_name in OWN:
            module = importlib.import_module(f"borechain.cli.bench.{OWN[cmd_name]}")
            return cast("click.Command", getattr(module, cmd_name))
        return side_by_side(cmd_name)


@click.group(cls=Benches, invoke_without_command=True)
@click.pass_context
def bench(context: click.Context) -> None:
    """Run the benchmark NAME, or list them.

    Those beside other libraries are in the repository, and the libraries in the extra dev; ``make test`` installs it.

    \b
    Examples:
      borechain bench survey
      borechain bench realtime --nodes 50 --seconds 120
      borechain bench page
      borechain bench day --hours 24
      borechain bench learn
      borechain bench doors
      borechain bench killed --times 200
      borechain bench hour
    """
    if context.invoked_subcommand is None:
        click.echo("\n".join(bench_names()))
        if not FOLDER.is_dir():
            click.echo("the benchmarks beside other libraries are in the repository, not here", err=True)


def side_by_side(name: str) -> click.Command:
    """The command of one file of the folder."""

    @click.command(name, help=subject_of(FOLDER / f"{name}.py"))
    @json_option
    @plain_faults
    def command(as_json: bool) -> None:
        spec = importlib.util.spec_from_file_location(f"benchmarks_{name}", FOLDER / f"{name}.py")
        if spec is None or spec.loader is None:
            raise EnvironmentFault(f"{FOLDER / name}.py cannot be loaded")
        module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
            result = module.run()
        except ModuleNotFoundError as error:
            raise EnvironmentFault(
                f"bench {name} needs {error.name}; install the development dependencies: pip install 'borechain[dev]'"
            ) from error
        if as_json:
            click.echo(json.dumps(result))
        else:
            show_ratios(result)

    return command


def subject_of(file: Path) -> str:
    """What a benchmark measures: the first line of its docstring."""
    return (ast.get_docstring(ast.parse(file.read_text())) or "").partition("\n")[0]


def show_ratios(result: dict[str, Any]) -> None:
    """Table for people."""
    from rich.table import Table

    table = Table(title=f"bench {result['bench']}")
    for heading in ("what", "ours", "peer", "times faster"):
        table.add_column(heading, justify="right")
    for what, row in result["ratios"].items():
        ratio = row["ratio"]
        table.add_row(
            what, duration_text(row["ours"]), duration_text(row["peer"]), "" if ratio is None else f"{ratio:.3g}"
        )
    table_console().print(table)


def duration_text(value: float | None) -> str:
    """A time with its unit."""
    if value is None:
        return ""
    if value < 1e-3:
        return f"{1e6 * value:.1f} us"
    return f"{1e3 * value:.2f} ms" if value < 1.0 else f"{value:.2f} s"
