"""Entry point: the table of commands, loaded on use; ``python -m borechain`` is the same."""

from __future__ import annotations

import importlib
import sys
from importlib.util import find_spec

import click

from borechain import __version__

COMMANDS = {
    "rig": ("borechain.cli.rig.rig_command", "rig", "Drill a scenario with one real process a tube."),
    "demo": ("borechain.cli.rig.demo", "demo", "Drill a hole with its page in a browser, for a first look."),
    "gauntlet": ("borechain.cli.gauntlet.gauntlet", "gauntlet", "Drill under faults drawn from one integer."),
    "scenario": ("borechain.cli.scenario.scenario_command", "group", "List and show the scenarios of the program."),
    "node": ("node.process.tube_command", "node", "Run the node of one tube."),
    "encoder": ("node.process.encoder_command", "encoder", "Run the encoder node on the drive head."),
    "board": ("node.process.board_command", "board", "Check the board that this runs on."),
    "medium": ("borechain.cli.rig.medium", "medium", "Run world, joints and clock of a scenario."),
    "ground": ("groundstation.command", "ground", "Run the ground station."),
    "router": (
        "borechain.cli.rig.router",
        "router",
        "Run the zenoh router of a rig whose processes are started one by one.",
    ),
    "pki": ("borechain.cli.pki.pki", "pki", "Make, revoke and change the keys of a rig."),
    "query": ("borechain.cli.ground.query", "query", "Ask a running ground station."),
    "watch": ("borechain.cli.ground.query", "watch", "Follow what a running ground station publishes."),
    "crew": ("borechain.cli.ground.crew", "crew", "Show a running rig to its crew, on a screen of 80 x 24."),
    "check": ("borechain.cli.ground.check_command", "check", "Say whether a rig is ready to drill."),
    "record": (
        "borechain.cli.ground.record_command",
        "record",
        "Record what a rig takes in and says into a file (MCAP).",
    ),
    "replay": ("borechain.cli.ground.record_command", "replay", "Give a recording to a ground station again."),
    "merge": ("borechain.cli.ground.merge_command", "merge", "Merge the databases of two ground stations of one rig."),
    "calibrate": (
        "borechain.cli.calibrate.calibrate",
        "calibrate",
        "Calibrate sensors from laboratory records.",
    ),
    "allan": ("borechain.cli.calibrate.allan_command", "allan", "Noise of a sensor from a static record."),
    "survey": ("borechain.cli.survey.survey", "survey", "Trajectory and region of uncertainty of a record."),
    "clearance": ("borechain.cli.survey.clearance_command", "clearance", "Clearance between two holes."),
    "wall": (
        "borechain.cli.survey.wall_command",
        "wall",
        "Judge a wall: overlap, thickness, probability of a gap.",
    ),
    "export": ("borechain.cli.export.export_command", "export", "Write a hole or a wall as a file of other programs."),
    "link": ("borechain.cli.link.link", "link", "Between tubes: radio through soil and pipe, load of a CAN bus."),
    "firmware": ("borechain.cli.firmware.firmware", "firmware", "The step of a node in C, for a chip."),
    "bench": ("borechain.cli.bench.bench", "bench", "Measure speed side by side with other libraries."),
    "campaign": (
        "borechain.cli.campaign.campaign",
        "campaign",
        "Run a scenario thousands of times and judge the filter.",
    ),
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
        from telemetry.runtime.one_thread import one_thread_each

        one_thread_each()  # before the library of matrices is loaded
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
      borechain rig wellbore-1 --speed max --seed 1
      borechain query 'borechain/*/ground/trajectory?md=4..12'
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the job could not be done here, 2 wrong arguments or input."""
    try:
        from telemetry.runtime.command_line import run_command
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "telemetry":
            raise
        found = find_spec("telemetry")
        sys.exit(f"borechain: expected the package telemetry of borechain, got {found.origin if found else 'none'}")
    run_command(cli, "borechain", arguments)


if __name__ == "__main__":
    main()
