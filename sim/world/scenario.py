"""A scenario, read and checked: the tables of its file, the hole and the faults."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from sim.errors import ScenarioError
from sim.node_kills import KillNode, parse_fault
from sim.world.borehole import Borehole, read_displacements, read_stations
from sim.world.drawn_hole import draw_hole
from sim.world.parsing import read_toml, validate_tables
from sim.world.path_section import PathSection
from sim.world.scenario_checks import check_scenario
from sim.world.scenario_file import VERSION, ScenarioFile
from sim.world.shipped import find_scenario


class Scenario:
    """A validated scenario: its file's tables, the hole and the faults."""

    def __init__(self, file: ScenarioFile, hole: Borehole, faults: tuple[KillNode, ...]) -> None:
        self.file = file
        self.hole = hole
        self.faults = faults
        self.tubes = file.rig.tubes
        self.tube_length = file.rig.tube_length_m
        self.medium = file.medium

    def aided_like(self, other: Scenario) -> Scenario:
        """The same under the aiding of another."""
        file = self.file.model_copy(update={"aiding": other.file.aiding})
        return Scenario(file, self.hole, self.faults)

    def drilling(self, name: str) -> Scenario:
        """The same with a hole of its site.

        Raises
        ------
        ScenarioError
            When the site has none of that name.
        """
        holes = {} if self.file.site is None else {hole.name: hole for hole in self.file.site.holes}
        if name not in holes:
            raise ScenarioError(f"hole {name}: expected one of {', '.join(holes) or 'none, the scenario has no site'}")
        lean = math.radians(holes[name].inclination_deg), math.radians(holes[name].azimuth_deg)
        return Scenario(self.file, Borehole.straight(*lean, max(self.file.depth, 1.0)), self.faults)


def scenario_of(tables: dict[str, Any], faults: tuple[str, ...] = ()) -> Scenario:
    """A scenario of its tables, without a file; its path is ``straight`` or absolute.

    Raises
    ------
    ScenarioError
        As ``load_scenario``.
    """
    where = Path("scenario")
    return _checked(where, validate_tables(where, tables, ScenarioFile, VERSION), faults)


def load_scenario(path: Path, faults: tuple[str, ...] = ()) -> Scenario:
    """Read and check a scenario: a file, or the name of one that comes with the program.

    ``faults`` from the command line join those of the file.

    Raises
    ------
    ScenarioError
        One line: the file, the key or line, what was expected and what came.
    """
    path = find_scenario(path)
    return _checked(path, validate_tables(path, read_toml(path), ScenarioFile, VERSION), faults)


def _checked(path: Path, file: ScenarioFile, faults: tuple[str, ...]) -> Scenario:
    check_scenario(path, file)
    hole = _hole(path, file.path, file.depth)
    if hole.length + 1e-9 < file.depth:
        raise ScenarioError(
            f"{path}: rig.tubes: {file.rig.tubes} tubes of {file.rig.tube_length_m:g} m need a path of {file.depth:g} "
            f"m, it ends at {hole.length:g} m; drill fewer tubes or extend the path"
        )
    try:
        own = tuple(parse_fault(text, file.rig.tubes) for text in file.faults)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: faults: {error}") from error
    return Scenario(file, hole, own + tuple(parse_fault(text, file.rig.tubes) for text in faults))


def _hole(path: Path, section: PathSection, length: float) -> Borehole:
    files = [name for name in (section.displacements, section.stations) if name is not None]
    made = [one for one in (section.straight, section.spiral, section.drawn) if one is not None]
    given = len(files) + len(made)
    if given != 1:
        raise ScenarioError(
            f"{path}: path: expected exactly one of displacements, stations, straight, spiral and drawn, got {given}"
        )
    if section.spiral is not None:
        spiral = section.spiral
        turned = (spiral.inclination_deg, spiral.azimuth_deg, spiral.turn_deg, spiral.build_deg)
        inclination, azimuth, turn, build = map(math.radians, turned)
        return Borehole.spiral(inclination, azimuth, turn, max(length, 1.0), build)
    if section.straight is not None:
        straight = section.straight
        end = max(length, 1.0)
        return Borehole.straight(math.radians(straight.inclination_deg), math.radians(straight.azimuth_deg), end)
    if section.drawn is not None:
        return draw_hole(section.drawn, max(length, 1.0))
    source = path.parent / files[0]
    reader = read_displacements if section.displacements is not None else read_stations
    return Borehole(*reader(source), where=str(source))
