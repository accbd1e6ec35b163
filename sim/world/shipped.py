"""Scenarios that come with the program, by name: ``wellbore-1`` instead of a path."""

from __future__ import annotations

import itertools
from pathlib import Path

from sim.errors import ScenarioError
from sim.world.parsing import read_toml, spelling_hint

# a wheel holds them inside this package; a checkout at its top, where people look for them
FOLDERS = (Path(__file__).parents[1] / "scenarios", Path(__file__).parents[2] / "scenarios")


def shipped_folder() -> Path:
    """Folder of the scenarios, records and walls that come with the program.

    Raises
    ------
    ScenarioError
        When the installation has lost it.
    """
    for folder in FOLDERS:
        if folder.is_dir():
            return folder
    raise ScenarioError(f"expected the scenarios of borechain in {FOLDERS[0]}, which is missing; install it again")


def shipped_names() -> list[str]:
    """Names of the scenarios, sorted."""
    return sorted(path.stem for path in shipped_folder().glob("*.toml"))


def scenario_title(file: Path) -> str:
    """First sentence of the comment at the head of a scenario file, empty without one."""
    comment = itertools.takewhile(lambda line: line.startswith("#"), file.read_text(encoding="utf-8").splitlines())
    return " ".join(line.lstrip("# ") for line in comment).partition(". ")[0].rstrip(".")


def find_scenario(given: Path) -> Path:
    """File of a scenario that was given as a path, or by the name of one that comes with the program.

    Raises
    ------
    ScenarioError
        When it is neither; the message says which names there are.
    """
    if given.is_file() or given.suffix or len(given.parts) > 1:
        return given
    names = shipped_names()
    if given.name in names:
        return shipped_folder() / f"{given.name}.toml"
    raise ScenarioError(f"{given}: expected a scenario file or a name; {spelling_hint(given.name, names)}")


def files_of(scenario: Path) -> list[Path]:
    """A scenario's file, then the file of its hole's path where it has one.

    Raises
    ------
    ScenarioError
        When the scenario cannot be read.
    """
    section = read_toml(scenario).get("path", {})
    names = [section[key] for key in ("displacements", "stations") if key in section]
    return [scenario, *(scenario.parent / name for name in names)]
