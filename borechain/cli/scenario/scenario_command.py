"""``borechain scenario``: the scenarios that come with the program."""

from __future__ import annotations

import json
from pathlib import Path

import click

from borechain.cli.faults import EnvironmentFault, plain_faults
from borechain.cli.shared_options import scenario_argument
from borechain.cli.whole_files import write_whole


@click.group("scenario")
def group() -> None:
    """List and show the scenarios that come with the program.

    A command that takes a scenario takes its name or a path of your own.

    \b
    Examples:
      borechain scenario list
      borechain scenario show wellbore-1
      borechain scenario copy wellbore-1 my-rigs
    """


@group.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@plain_faults
def list_(as_json: bool) -> None:
    """Name every scenario, with what its file says of itself."""
    from sim.world.shipped import scenario_title, shipped_folder, shipped_names

    titles = {name: scenario_title(shipped_folder() / f"{name}.toml") for name in shipped_names()}
    if as_json:
        click.echo(json.dumps({"scenarios": titles, "folder": str(shipped_folder())}))
        return
    for name, text in titles.items():
        click.echo(f"{name:20} {text}")


@group.command()
@scenario_argument
@plain_faults
def show(scenario: Path) -> None:
    """Print the file of a scenario."""
    from sim.world.shipped import find_scenario

    click.echo(find_scenario(scenario).read_text(encoding="utf-8"), nl=False)


@group.command()
@scenario_argument
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@plain_faults
def copy(scenario: Path, folder: Path) -> None:
    """Copy a scenario with the path of its hole to FOLDER, to be changed there; nothing is overwritten."""
    from sim.world.shipped import files_of, find_scenario

    files = files_of(find_scenario(scenario))
    taken = [folder / file.name for file in files if (folder / file.name).exists()]
    if taken:
        raise EnvironmentFault(f"{taken[0]}: already there; choose another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for file in files:
        write_whole(folder / file.name, file.read_text(encoding="utf-8"))
        click.echo(folder / file.name)
