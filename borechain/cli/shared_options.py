"""Options that several commands of this package share."""

from __future__ import annotations

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from telemetry.runtime.command_line import check_installed


class ScenarioPath(click.Path):
    """A scenario: the name of one that comes with the program, or a file; completed from both."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Names that begin like the word, then files."""
        from sim.world.shipped import shipped_names

        names = [CompletionItem(name) for name in shipped_names() if name.startswith(incomplete)]
        return [*names, *super().shell_complete(ctx, param, incomplete)]


scenario_argument = click.argument("scenario", type=ScenarioPath())
FAULT_HELP = (
    "Fault to inject: kill-node:3@600 kills the node of tube 3 after 600 s, kill-node:3@600+20 for 20 s; "
    "encoder or base in place of the number kills the encoder or the ground station. Repeatable."
)


def check_tables(context: click.Context, _parameter: click.Parameter, as_json: bool) -> bool:
    """Refuse a job before it begins whose tables for people could not be printed here."""
    if not as_json and not context.resilient_parsing:
        check_installed("rich")
    return as_json


json_option = click.option(
    "--json",
    "as_json",
    is_flag=True,
    callback=check_tables,
    help="Print one JSON object on stdout, and nothing else there.",
)


def parse_speed(_context: click.Context, _parameter: click.Parameter, value: str) -> float:
    """``max`` or a factor of real time."""
    if value == "max":
        return float("inf")
    try:
        speed = float(value)
    except ValueError:
        raise click.BadParameter(f"expected max or a number, got {value}") from None
    if not 0.0 < speed <= 1000.0:
        raise click.BadParameter(f"expected max or a factor in (0, 1000], got {value}")
    return speed


speed_option = click.option(
    "--speed",
    default="max",
    show_default=True,
    callback=parse_speed,
    metavar="max|X",
    help="As fast as possible, or X times real time.",
)
fault_option = click.option("--fault", "faults", multiple=True, help=FAULT_HELP)
seed_option = click.option(
    "--seed",
    type=click.IntRange(0, 2**31 - 1),
    default=1,
    show_default=True,
    help="Seed of every random error; the same seed gives the same result.",
)
