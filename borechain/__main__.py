"""Entry point: the group of sub-commands, loaded on use, and the last line of defence against tracebacks."""

from __future__ import annotations

import importlib
import sys
from typing import Any

import click

from borechain import __version__

COMMANDS = {
    "rig": ("borechain.cli.rig.rig", "rig", "Drill a scenario with one real process a tube."),
    "node": ("borechain.cli.node.node", "node", "Run the node of one tube."),
    "encoder": ("borechain.cli.node.encoder", "encoder", "Run the encoder node on the drive head."),
    "medium": ("borechain.cli.rig.medium", "medium", "Run world, joints and clock of a scenario."),
    "ground": ("borechain.cli.ground.ground", "ground", "Run the ground station."),
    "router": ("borechain.cli.rig.router", "router", "Be the zenoh router of a rig whose processes start one by one."),
    "query": ("borechain.cli.ground.query", "query", "Ask a running ground station."),
    "watch": ("borechain.cli.ground.query", "watch", "Follow what a running ground station publishes."),
    "calibrate": (
        "borechain.cli.calibrate.calibrate",
        "calibrate",
        "Calibrate sensors from laboratory records.",
    ),
    "allan": ("borechain.cli.calibrate.allan", "allan", "Say from a static record what noise a sensor has."),
    "survey": ("borechain.cli.survey.survey", "survey", "Trajectory and region of uncertainty of a record."),
    "wall": (
        "borechain.cli.survey.wall",
        "wall",
        "Judge a wall: overlap, thickness, probability of a gap.",
    ),
    "bench": ("borechain.cli.bench.bench", "bench", "Measure speed side by side with other libraries."),
    "experiment": ("borechain.cli.experiment.experiment", "experiment", "Rerun a published experiment beside ours."),
}


class LazyGroup(click.Group):
    """Imports a sub-command when it is called, so that help and errors start at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the table."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Load one sub-command."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        module, attribute, _ = COMMANDS[cmd_name]
        command: click.Command = getattr(importlib.import_module(module), attribute)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the sub-commands without importing them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, _, text) in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def cli() -> None:
    """Sensor nodes of a drill string, their simulator and their ground station.

    \b
    Examples:
      borechain rig scenarios/wellbore-1.toml --speed max --seed 1
      borechain query 'borechain/*/ground/trajectory?md=4..12'
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the job failed, 2 wrong arguments or input."""
    try:
        result: Any = cli.main(args=arguments, prog_name="borechain", standalone_mode=False)
        sys.exit(result if isinstance(result, int) else 0)
    except click.exceptions.Exit as exit_:
        sys.exit(exit_.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("borechain: interrupted", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
