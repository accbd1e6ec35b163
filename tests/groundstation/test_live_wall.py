"""The joints of the hole that is drilled: three holes one after the other, judged as the wall would be afterwards."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import Rig

from borechain.api import wall as judged_wall
from groundstation.config import GroundConfig
from groundstation.errors import SurveyError
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.wall_views import survey_of
from groundstation.survey.wall.wall_columns import ColumnSurvey

pytestmark = pytest.mark.slow

STOPS = 4  # of 2 m
WALL = """
name = "three holes"
radius_m = 0.60
thickness_m = 0.80
length_m = 8.0
heads = "heads.csv"
stations = "stations.csv"
"""
HEADS = "column,north_m,east_m\nH1,0,0\nH2,0,0.75\nH3,0,1.5\n"


class Site:
    """A wall whose stations grow from hole to hole."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "wall.toml"
        self.file.write_text(WALL)
        (folder / "heads.csv").write_text(HEADS)
        self.stations: list[tuple[str, float, float, float]] = []
        self._write()

    def _write(self) -> None:
        with (self.folder / "stations.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["column", "md_m", "inclination_deg", "azimuth_deg"])
            writer.writerows(self.stations)

    def drill(self, hole: str, inclination_deg: float) -> list[dict[str, Any]]:
        """Drill a hole to its end, leaning north; returns what was shown after every stop."""
        bends = {"curvature_std_deg_per_m": 3.0}  # it may lean off at once
        rig = Rig(self.folder / hole, target=8.0, wall=self.file, hole=hole, **bends)
        rig.run(5.0)
        shown = [rig.ask("wall")["wall"]]
        for stop in range(1, STOPS + 1):
            rig.drill(stop, inclination_deg)
            shown.append(rig.ask("wall")["wall"])
        self.keep(hole, rig.ground.model)
        rig.ground.close()
        return shown

    def keep(self, hole: str, model: RigModel) -> None:
        """Put the stations of a finished hole into the wall's file."""
        self.stations = [row for row in self.stations if row[0] != hole] + [(hole, 0.0, 0.0, 0.0)]
        found = survey_of(model)
        rows = zip(found.md, np.degrees(found.inclination), np.degrees(found.azimuth), strict=True)
        self.stations += [(hole, float(md), float(i), float(a)) for md, i, a in rows if md > 0.0]
        self._write()


def joints(shown: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["joint"]: row for row in shown["joints"]}


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path)


def test_a_joint_closes_from_the_top_down_while_the_third_hole_is_drilled(site: Site) -> None:
    site.drill("H1", 0.05)
    site.drill("H2", 0.05)
    shown = site.drill("H3", 0.05)
    rows = [joints(one)["H2-H3"] for one in shown]
    assert [row["state"] for row in rows] == ["missing"] * STOPS + ["surveyed"]
    surveyed = [row["surveyed_percent"] for row in rows]
    assert surveyed == sorted(surveyed)
    assert (surveyed[0], surveyed[-1]) == (0, 100)
    assert [one["verdict"] for one in shown] == ["not_tight"] * STOPS + ["tight"]
    assert rows[0]["probability"] == 1.0 > 0.01 > rows[-1]["probability"]
    assert [hole["hole"] for hole in shown[-1]["holes"]] == ["H3", "H2"]
    assert [hole["drilled_to_m"] for hole in shown[-1]["holes"]] == [8.0, 8.0]


def test_a_hole_that_leans_off_opens_its_joint_and_a_column_is_proposed(site: Site) -> None:
    site.drill("H1", 0.0)
    site.drill("H2", 0.0)
    shown = site.drill("H3", 5.0)
    chances = [joints(one)["H2-H3"]["probability_where_surveyed"] for one in shown[1:]]
    assert chances == sorted(chances)
    assert chances[0] < 0.01 < 0.99 < chances[-1]
    assert shown[-1]["verdict"] == "not_tight"
    assert any("H2-H3" in text for text in shown[-1]["findings"])
    assert [extra["joint"] for extra in shown[-1]["extra_columns"]] == ["H2-H3"]
    assert joints(shown[-1])["H2-H3"]["thickness_m"] < shown[-1]["required_thickness_m"]


def test_the_last_word_is_that_of_the_wall_command(site: Site) -> None:
    site.drill("H1", 0.05)
    site.drill("H3", 0.1)
    live = joints(site.drill("H2", 0.4)[-1])
    assert set(live) == {"H1-H2", "H2-H3"}
    afterwards = judged_wall(site.file)
    for pair, thickness in zip(afterwards.joints.pairs, afterwards.joints.thickness, strict=True):
        names = {afterwards.wall.plans[k].design.name for k in pair}
        row = live["-".join(sorted(names))]
        assert row["thickness_m"] == pytest.approx(float(min(thickness)), abs=2e-4)


def test_without_a_wall_there_is_none(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    assert rig.ask("wall")["wall"] is None
    rig.ground.close()


def test_a_hole_that_is_no_column_of_the_wall_is_refused_by_name(site: Site) -> None:
    with pytest.raises(SurveyError, match="column 'H9' is not among the heads; expected one of H1, H2, H3"):
        RigModel.begin(GroundConfig(folder=site.folder, wall=site.file, hole="H9"))
    with pytest.raises(SurveyError, match="expected a wall file"):
        RigModel.begin(GroundConfig(folder=site.folder, wall=site.folder / "none.toml", hole="H1"))


def test_a_wall_that_contradicts_itself_is_told_and_answers_go_on(site: Site) -> None:
    """A bit above the survey of its own hole: the answer says so, and nothing fails."""
    site.drill("H1", 0.0)
    model = RigModel.begin(GroundConfig(folder=site.folder / "x", wall=site.file, hole="H2"))
    assert model.wall is not None
    bent = ColumnSurvey(np.array([0.0, 2.0, 4.0]), np.array([0.0, 1.5, 1.6]), np.zeros(3))
    broken = model.wall.judged(bent, 4.0)
    assert broken.judgement is None
    assert broken.problem
    json.dumps(broken.problem)
