"""The commands of ``python -m node``: ``node`` is meant where none is named, as ``python -m node --tube 3``."""

from __future__ import annotations

import click

from node.process.board_command import board
from node.process.encoder_command import encoder
from node.process.tube_command import node

DEFAULT = "node"


class DefaultGroup(click.Group):
    """A group that takes options without a command for those of its default command."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Command of the words; the default one, when the first is an option."""
        return super().resolve_command(ctx, [DEFAULT, *args] if args[0].startswith("-") else args)


@click.group(
    cls=DefaultGroup,
    context_settings={
        "help_option_names": ["-h", "--help"],
        "ignore_unknown_options": True,
        "allow_interspersed_args": False,
    },
)
def commands() -> None:
    """Run one node of the string on its board.

    \b
    Examples:
      python -m node --tube 1 --clock own --imu mpu6500:1 --above 2 --folder state/tube-1
      python -m node encoder --clock own --counter timed:counter.npy --above base --below 2
      python -m node node --help
    """


commands.add_command(board)
commands.add_command(node)
commands.add_command(encoder)
