"""``borechain experiment``: every study of the table as a command, and the commands about all."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.experiment.laboratory_records import records
from borechain.cli.experiment.study_output import progress_bar, show_study, write_study
from borechain.cli.faults import plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.whole_files import make_folder

if TYPE_CHECKING:
    from sim.studies.study import Option, Study

RESULTS = "docs/results"
out_option = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for the table and plots."
)


@plain_faults
def load_studies() -> dict[str, Study]:
    """The tables, loaded when a command asks for them."""
    from borechain.studies.rig_study_table import all_studies

    return all_studies()


class Studies(click.Group):
    """A command for every study, beside those of the group itself."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in order."""
        return sorted([*super().list_commands(ctx), *load_studies()])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """One of them."""
        found = super().get_command(ctx, cmd_name)
        if found is None and cmd_name in load_studies():
            return command_of(load_studies()[cmd_name])
        return found


@click.group(cls=Studies)
def experiment() -> None:
    """Rerun a published experiment beside ours.

    \b
    Examples:
      borechain experiment list
      borechain experiment relay --hops 10 --seeds 40
    """


experiment.add_command(records)


@experiment.command("list")
@click.pass_context
def list_(context: click.Context) -> None:
    """Name every experiment."""
    group = experiment
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if command is not None and name not in ABOUT_ALL:
            text = (command.help or "").partition(".")[0].strip()
            click.echo(f"{name:24} {' '.join(text.split())}")


@experiment.command("all")
@click.option("--short", is_flag=True, help="With few seeds, to see that all of them work.")
@out_option
@click.pass_context
@plain_faults
def all_(context: click.Context, short: bool, out: Path | None) -> None:
    """Run every study of the table as the committed results have it: most of an hour on two cores.

    \b
    Example:
      borechain experiment all --out docs/results
    """
    from sim.studies.pool import one_pool

    folder = [] if out is None else ["--out", str(out)]
    with one_pool():
        for study in load_studies().values():
            for words in (study.short,) if short else study.full:
                click.echo(f"borechain experiment {study.name} {words}".rstrip(), err=True)
                command_of(study).main([*shlex.split(words), *folder], standalone_mode=False, parent=context)


ABOUT_ALL = ("all", "list")


def command_of(study: Study) -> click.Command:
    """The command of one study: what it takes, its folder and the form of its output."""

    @plain_faults
    def run(out: Path | None, as_json: bool, **given: Any) -> None:
        if out is not None:
            make_folder(out)
        with progress_bar(study.steps(given), study.counts, quiet=as_json) as step:
            result = study.run(given, step)
        write_study(study, result, out)
        if as_json:
            click.echo(json.dumps(study.told(result)))
        else:
            show_study(study, given, result)

    command: Callable[..., None] = json_option(out_option(run))
    for option in reversed(study.takes):
        command = option_of(option)(command)
    lines = [f"  borechain experiment {study.name} {words}".rstrip() + f" --out {RESULTS}" for words in study.full]
    heading = "Example:" if len(lines) == 1 else "Examples:"
    return click.command(study.name, help="\n".join([study.help, "", "\b", heading, *lines]))(command)


def option_of(option: Option) -> Callable[..., Any]:
    """Something a study takes, as an option of its command."""
    kind = click.Choice(option.choices) if option.choices else click.IntRange(option.least, option.most)
    return click.option(
        f"--{option.name}", type=kind, default=option.default, show_default=True, help=option.help or None
    )
