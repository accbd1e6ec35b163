"""Clearance of two holes: the published scenarios, what they share, and geometry by hand."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool
from groundstation.survey.well.clearance import ClearanceHole, Rule, clearance_between
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey

DATA = Path(__file__).parents[2] / "data" / "survey"
DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 70.0 * DEG, 0.0, 60.0 * DEG)
RADII = {"reference": 0.4572}
REV_4 = load_tool(str(DATA / "mwd-rev4.toml"))


def published(name: str) -> tuple[ClearanceHole, np.ndarray]:
    """A well of the standard set and the separation factors printed for it."""
    with (DATA / "iscwsa_clearance_wells.csv").open() as file:
        rows = [row for row in csv.DictReader(x for x in file if not x.startswith("#")) if row["well"] == name]
    keys = ("md", "inclination_deg", "azimuth_deg", "north", "east", "tvd")
    table = np.array([[float(row[key]) for key in keys] for row in rows if row["md"]])
    md, inclination, azimuth = table[:, 0], table[:, 1] * DEG, table[:, 2] * DEG
    hole = ClearanceHole(
        WellSurvey(md, inclination, azimuth, table[:, 5]), table[:, 3:], (Leg(REV_4),), RADII.get(name, 0.3048)
    )
    return hole, np.array([float(row["sf"]) for row in rows if row["sf"]])


@pytest.mark.parametrize("name", ["01", "05", "06", "07"])
def test_separation_factors_are_those_of_the_standard_set(name: str) -> None:
    reference, _ = published("reference")
    offset, expected = published(name)
    found = clearance_between(reference, offset, SITE)
    assert len(expected) == len(found.factor) == 100
    np.testing.assert_allclose(found.independent_factor, expected, rtol=3e-3)


def straight(
    north: float, length: float = 100.0, azimuth: float = 0.0, serial: str = "", steep: float = 0.0
) -> ClearanceHole:
    """Hole that leans by ``steep``, with an azimuth error of 1 deg that one instrument makes."""
    tool = SurveyTool("t", "t", (Term("A", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "1")),))
    md = np.linspace(0.0, length, 11)
    i, a = np.full(11, steep), np.full(11, azimuth)
    step = np.array([math.sin(steep) * math.cos(azimuth), math.sin(steep) * math.sin(azimuth), math.cos(steep)])
    places = np.array([north, 0.0, 0.0]) + md[:, None] * step
    return ClearanceHole(WellSurvey(md, i, a, places[:, 2]), places, (Leg(tool),), 0.5, serial)


def test_parallel_holes_of_one_instrument_err_alike_and_of_two_do_not() -> None:
    steep = 30.0 * DEG
    alike, apart = (
        clearance_between(straight(0.0, steep=steep, azimuth=1.5708, serial="7"), other, SITE)
        for other in (
            straight(5.0, steep=steep, azimuth=1.5708, serial="7"),
            straight(5.0, steep=steep, azimuth=1.5708, serial="8"),
        )
    )
    np.testing.assert_allclose(alike.distance, 5.0, atol=1e-4)
    np.testing.assert_allclose(alike.sigma, 0.0, atol=1e-6)
    one = 1.0 * DEG * math.sin(steep) * 95.0  # the first direction is known, half a leg of 10 m
    assert apart.sigma[-1] == pytest.approx(math.sqrt(2.0) * one, rel=1e-3)
    assert apart.factor[-1] == pytest.approx((5.0 - 1.0 - 0.3) / (3.5 * math.hypot(apart.sigma[-1], 0.5)))
    assert alike.independent_factor[-1] == pytest.approx(apart.factor[-1])


def test_holes_against_each_other_err_against_each_other() -> None:
    steep = 30.0 * DEG
    east, west = (
        straight(0.0, steep=steep, azimuth=1.5708, serial="7"),
        straight(5.0, steep=steep, azimuth=-1.5708, serial="7"),
    )
    found = clearance_between(east, west, SITE, Rule(margin=0.0))
    assert np.all(found.factor <= found.independent_factor + 1e-12)


def test_the_nearest_point_lies_between_stations() -> None:
    crossing = straight(3.0, steep=math.pi / 2, length=100.0, azimuth=math.pi)  # horizontal, towards the south
    found = clearance_between(straight(0.0), crossing, SITE)
    np.testing.assert_allclose(found.distance, np.linspace(0.0, 100.0, 11), atol=1e-6)
    np.testing.assert_allclose(found.offset_md, 3.0, atol=1e-6)


def test_a_negative_radius_is_refused() -> None:
    hole = straight(0.0)
    with pytest.raises(SurveyError, match="expected a radius of the hole of 0 m or more, got -1 m"):
        clearance_between(hole, ClearanceHole(hole.survey, hole.positions, hole.legs, -1.0), SITE)
