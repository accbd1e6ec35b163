"""The whole answer about a wall, every field of the object that is printed and served, and what it is exported as.

The verdict is that of `small_wall.py`, by hand; of the columns all is the closed form of a straight hole.
"""

import math
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_wall import HEAD_STD, HOLES, judgement_of, write_wall

from groundstation.errors import SurveyError
from groundstation.survey.exports.export_request import exported_bytes, site_of_wall
from groundstation.survey.requests.wall_result import largest_spacing, wall_result
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.void_chance import VoidChance
from groundstation.survey.wall.voids import Void
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import Finding, FindingKind, VoidFinding, WallVerdict
from groundstation.survey.well.error_sources import Site


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Wall:
    return read_wall(write_wall(tmp_path_factory.mktemp("wall")))


@pytest.fixture(scope="module")
def answer(wall: Wall) -> dict[str, Any]:
    return wall_result(wall, judgement_of(wall))


def near(value: float) -> Any:
    return pytest.approx(value, rel=1e-9, abs=1e-12)


def joint(name: str, state: str, depth: float, thickness: Any, thin_at: float, chance: float, *offset: float) -> Any:
    """A row, its distance 10 cm more than the thickness at that depth; offset north and east, m, as of the verdict."""
    north, east = offset
    return {
        "joint": name, "state": state, "depth_m": depth, "thickness_m": thickness, "thinnest_at_m": thin_at,
        "probability": chance, "moved_apart_cm": near(100.0 * math.hypot(north, east)),
        "direction_deg": near(math.degrees(math.atan2(east, north)) % 360.0), "tight_from_m": 0.0, "tight_to_m": 4.0,
    }  # fmt: skip


JOINTS = [
    joint("A-B", "surveyed", 4.0, 0.65, 2.0, 0.004, -0.03, 0.05) | {"distance_m": near(0.76)},
    joint("B-C", "unsurveyed", 2.0, 0.54, 2.0, 0.61, -0.02, 0.07) | {"distance_m": near(0.64)},
    joint("C-D", "missing", 2.0, 0.9, 0.0, 1.0, -0.02, 0.11) | {"distance_m": None},
    joint("D-E", "missing", 0.0, None, 0.0, 1.0, -0.01, 0.13) | {"distance_m": None},
    joint("E-F", "surveyed", 2.0, 0.71, 0.0, 0.012, -0.02, 0.17) | {"distance_m": near(0.82)},
]


def extra(top: float, bottom: float, closes: bool, north: float, east: float) -> dict[str, Any]:
    return {
        "northing_m": near(5000.5 + north), "easting_m": near(300.25 + east), "height_m": near(31.4 - top),
        "north_m": near(north), "east_m": near(east), "down_m": near(top), "from_m": top, "to_m": bottom,
        "closes": closes,
    }  # fmt: skip


def test_the_wall_and_its_joints(answer: dict[str, Any]) -> None:
    told = {name: value for name, value in answer.items() if name not in ("columns", "closing", "site")}
    one, other = extra(2.0, 4.0, False, 0.25, 1.35), extra(0.0, 4.0, True, 0.0, 2.7)
    assert told == {
        "wall": "East pit", "verdict": "not tight", "north": "site", "stations_north": "site",
        "depth_reference": "collar", "read_from": {"depth_reference": "collar", "height_m": None},
        "height_datum": "DHHN2016", "coordinates_north": "site", "warnings": [],
        "findings": [
            {
                "kind": "thin", "what": "B-C", "from_m": 2.0, "to_m": 2.0, "probability": None,
                "text": "joint B-C is 0.540 m thick at the least from 2 to 2 m; required 0.55 m",
            },
            {
                "kind": "missing", "what": "D", "from_m": 0.0, "to_m": 4.0, "probability": None,
                "text": "column D is missing from 0 to 4 m",
            },
        ],
        "probability_of_any": 0.0234, "probability_of_any_standard_error": 0.0056, "allowed_probability": 0.01,
        "required_thickness_m": 0.55, "margin": None, "joints": JOINTS, "gaps": 3, "doubtful": 4,
        "worst": JOINTS[2] | {"extra_column": other},
        "extra_columns": [
            JOINTS[1] | {"extra_column": one}, JOINTS[2] | {"extra_column": other}, JOINTS[3] | {"extra_column": other},
        ],
        "largest_spacing": [
            {"depth_m": 0.0, "joint": "D-E", "spacing_m": None}, {"depth_m": 2.0, "joint": "C-D", "spacing_m": None},
            {"depth_m": 4.0, "joint": "C-D", "spacing_m": None},
        ],
        "voids": [], "void_probability": [],
    }  # fmt: skip


def column(name: str, state: str, end: float, surveyed: float, serial: str = "R-17") -> dict[str, Any]:
    inclination, azimuth, _, (nn, _, _, ee, _, _) = HOLES[name]
    lean = math.radians(inclination)
    size, along = surveyed * math.sin(lean), surveyed * math.cos(lean)
    limit = 0.02 + 0.01 * along
    return {
        "column": name, "state": state, "design_length_m": 4.0, "drilled_to_m": end, "surveyed_to_m": surveyed,
        "md_m": surveyed, "instrument": "relay", "serial": serial, "deviation_cm": near(100.0 * size),
        "deviation_percent": near(100.0 * size / along), "direction_deg": near(azimuth),
        "sigma_cm": near(100.0 * math.sqrt(0.5 * (nn + ee) + HEAD_STD**2)),
        "used_percent": near(100.0 * size / limit),
    }  # fmt: skip


def test_every_column(answer: dict[str, Any]) -> None:
    unknown = dict.fromkeys(("deviation_cm", "deviation_percent", "direction_deg", "sigma_cm", "used_percent"))
    bare = {"design_length_m": 4.0, "instrument": "relay", "serial": "R-17", **unknown}
    found = answer["columns"]
    assert found[:3] == [
        column("A", "surveyed to 4 m", 4.0, 4.0), column("B", "surveyed to 4 m", 4.0, 4.0),
        column("C", "surveyed to 2 m, drilled to 4 m", 4.0, 2.0),
    ]  # fmt: skip
    assert found[3] == bare | {
        "column": "D", "state": "not drilled", "drilled_to_m": None, "surveyed_to_m": None, "md_m": None,
    }  # fmt: skip
    assert found[4] == column("E", "surveyed to 4 m", 4.0, 4.0, "R-18")
    assert {name: value for name, value in found[5].items() if name not in ("surveyed_to_m", "md_m")} == bare | {
        "column": "F", "state": "drilled to 4 m, not surveyed", "drilled_to_m": 4.0,
    }  # fmt: skip
    assert not found[5]["md_m"]


def test_how_it_closed(answer: dict[str, Any], wall: Wall) -> None:
    assert [(row["day"], row["drilled"]) for row in answer["closing"]] == [
        ("2026-03-02", ["A", "C"]), ("2026-03-04", ["B"]), ("2026-03-05", ["E", "F"]),
    ]  # fmt: skip
    assert [row["closed_percent"] for row in answer["closing"]] == [0.0, near(40.0), near(60.0)]
    assert [row["open_joints"] for row in answer["closing"]] == [5, 3, 2]
    first, second, third = (row["largest_spacing"] for row in answer["closing"])
    assert first is None
    assert second == third
    assert (second["joint"], second["depth_m"], f"{second['spacing_m']:.3f}") == ("B-C", 4.0, "0.960")


def test_the_site_says_what_was_stated(wall: Wall) -> None:
    site = Site(9.8123, 49123.0, math.radians(66.0), math.radians(2.25), math.radians(51.5))
    stated = {"gravity_mps2": 9.8123, "field_nt": 49123.0}
    file = replace(wall.file, assumed=replace(wall.file.assumed, site=site), stated=stated, height_datum="", grid=None)
    found = wall_result(replace(wall, file=file), judgement_of(wall))
    assert found["site"] == {
        "gravity_mps2": 9.8123, "field_nt": 49123.0, "dip_deg": near(66.0), "declination_deg": near(2.25),
        "latitude_deg": near(51.5),
        "sources": {
            "gravity_mps2": "stated", "field_nt": "stated", "dip_deg": "default", "declination_deg": "default",
            "latitude_deg": "default",
        },
    }  # fmt: skip
    assert (found["height_datum"], found["coordinates_north"]) == (None, None)
    assert "northing_m" not in found["worst"]["extra_column"]


def test_the_margin_of_a_wall_with_a_spacing(wall: Wall) -> None:
    """A column may shift until two circles of 0.6 m make 0.55 m: that far apart they are 2 sqrt(0.6^2 - 0.275^2) m."""
    found = wall_result(replace(wall, file=replace(wall.file, spacing=0.9)), judgement_of(wall))
    shift = 2.0 * math.sqrt(0.6**2 - 0.275**2) - 0.9
    assert found["margin"]["shift_cm"] == near(100.0 * shift)
    assert found["margin"]["deviation_deg"] == pytest.approx(math.degrees(math.atan(shift / 4.0)), rel=1e-3)


def test_voids_and_their_chance(wall: Wall) -> None:
    voids = [
        VoidFinding(2.0, Void((0, 1, 2), 0.0123, (0.1, 0.2), 0.05)),
        VoidFinding(2.0, Void((1, 2, 3), 0.0031, (0.3, 0.4), 0.02)),
    ]
    chance = VoidChance(
        np.array([0.01, 1.0, 0.25]), np.array([1e-3, 2e-3, 3e-3]), [None, (1, 2, 3), (0, 1, 4)],
        np.array([[np.nan, np.nan], [0.5, 0.6], [0.7, 0.8]]),
    )  # fmt: skip
    found = wall_result(wall, replace(judgement_of(wall), voids=voids, void_chance=chance))
    assert found["voids"] == [
        {"depth_m": 2.0, "columns": ["A", "B", "C"], "area_m2": 0.0123, "radius_m": 0.05, "place_m": [0.1, 0.2]},
        {"depth_m": 2.0, "columns": ["B", "C", "D"], "area_m2": 0.0031, "radius_m": 0.02, "place_m": [0.3, 0.4]},
    ]
    assert found["void_probability"] == [
        {"depth_m": 0.0, "area_m2": 0, "probability": 0.01, "standard_error": 1e-3, "columns": [], "place_m": None},
        {
            "depth_m": 2.0, "area_m2": near(0.0154), "probability": 1.0, "standard_error": 2e-3,
            "columns": ["B", "C", "D"], "place_m": [0.5, 0.6],
        },
        {
            "depth_m": 4.0, "area_m2": 0, "probability": 0.25, "standard_error": 3e-3, "columns": ["A", "B", "E"],
            "place_m": [0.7, 0.8],
        },
    ]  # fmt: skip


def test_the_widest_joint_where_all_stand(wall: Wall) -> None:
    joints = judgement_of(wall).joints
    distance = np.array(
        [[0.8, 0.9, 0.7], [0.7, 0.95, np.nan], [0.6, 0.5, np.nan], [0.85, 0.4, np.nan], [0.1, 0.2, np.nan]]
    )
    found = replace(joints, distance=distance, states=np.full((5, 3), ColumnState.SURVEYED, np.int8))
    assert largest_spacing(wall, found) == [
        {"depth_m": 0.0, "joint": "D-E", "spacing_m": 0.85}, {"depth_m": 2.0, "joint": "B-C", "spacing_m": 0.95},
        {"depth_m": 4.0, "joint": "A-B", "spacing_m": 0.7},
    ]  # fmt: skip
    nowhere = replace(found, distance=np.full((5, 3), np.nan))
    assert [row["spacing_m"] for row in largest_spacing(wall, nowhere)] == [None] * 3


def test_what_is_exported_of_a_wall(wall: Wall) -> None:
    site = site_of_wall(wall, judgement_of(wall), date(2026, 11, 20), "EPSG:25833")
    assert (site.name, site.verdict, site.crs, site.remarks, site.day) == (
        "East pit", "not tight", "EPSG:25833", (), "2026-11-20",
    )  # fmt: skip
    assert (site.project, site.client) == ("Station square", "City railways")
    assert [hole.name for hole in site.holes] == ["A", "B", "C", "E"]
    for hole, head in zip(site.holes, (0.0, 0.9, 1.8, 3.6), strict=True):
        inclination, azimuth, last, _ = HOLES[hole.name]
        lean, way = math.radians(inclination), math.radians(azimuth)
        depths = [md for md in (0.0, 2.0, 4.0) if md <= last]
        place = [
            [md * math.sin(lean) * math.cos(way), md * math.sin(lean) * math.sin(way), md * math.cos(lean)]
            for md in depths
        ]
        np.testing.assert_allclose(hole.md, depths)
        np.testing.assert_allclose(hole.inclination_deg, inclination)
        np.testing.assert_allclose(hole.azimuth_deg, azimuth)
        np.testing.assert_allclose(hole.local, place, atol=1e-12)
        assert hole.deviation is not None
        assert hole.covs is not None
        np.testing.assert_allclose(hole.deviation, place[-1][:2], atol=1e-12)
        nn, ne, nd, ee, ed, dd = HOLES[hole.name][3]
        np.testing.assert_allclose(hole.covs[-1], [[nn, ne, nd], [ne, ee, ed], [nd, ed, dd]], atol=1e-15)
        assert (hole.radius, hole.north, hole.magnetic) == (0.65 if hole.name == "C" else 0.6, "site", False)
        axis = [[300.25 + head + east, 5000.5 + north, 31.4 - down] for north, east, down in place]
        np.testing.assert_allclose(hole.axis, axis, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "what", "verdicts"),
    [
        (FindingKind.THIN, "A-B", ["not tight", "not tight", "tight", "tight"]),
        (FindingKind.DOUBTFUL, "C", ["tight", "not proven", "not proven", "tight"]),
        (FindingKind.VOID, "B-C-E", ["tight", "not tight", "not tight", "not tight"]),
        (FindingKind.SYSTEM, "wall", ["not proven"] * 4),
        (FindingKind.UNSURVEYED, "D", ["tight", "tight", "not proven", "not proven"]),
    ],
)
def test_a_column_has_the_verdict_of_what_it_is_part_of(
    wall: Wall, kind: FindingKind, what: str, verdicts: list[str]
) -> None:
    judgement = replace(
        judgement_of(wall), findings=[Finding(kind, what, 0.0, 1.0, "x")], verdict=WallVerdict.NOT_PROVEN
    )
    site = site_of_wall(replace(wall, file=replace(wall.file, grid=None)), judgement, date(2026, 11, 20), "EPSG:1")
    assert [hole.verdict for hole in site.holes] == verdicts
    assert (site.verdict, site.crs) == ("not proven", "")
    east, north, up = site.holes[1].axis[-1].tolist()
    lean, way = math.radians(1.2), math.radians(200.0)
    assert (north, east, up) == (
        near(4.0 * math.sin(lean) * math.cos(way)), near(0.9 + 4.0 * math.sin(lean) * math.sin(way)),
        near(-4.0 * math.cos(lean)),
    )  # fmt: skip


def test_what_can_not_be_exported_is_named(wall: Wall, tmp_path: Path) -> None:
    judgement = judgement_of(wall)
    site = site_of_wall(wall, judgement, date(2026, 11, 20))
    with pytest.raises(
        SurveyError, match=r"^--format: expected one of ags, diggs, dxf, geojson, ifc, las, witsml, got 'x'$"
    ):
        exported_bytes(site, "x")
    with pytest.raises(SurveyError, match=r"^--hole Z: expected one of A, B, C, E$"):
        exported_bytes(site, "geojson", "Z")
    assert b'"B"' in exported_bytes(site, "ags", "B")
    assert b'"A"' not in exported_bytes(site, "ags", "B")
    hole = replace(site.holes[2], axis=site.holes[2].axis * [1.0, math.inf, 1.0])
    with pytest.raises(SurveyError, match=r"^C: its axis has no numbers to export$"):
        exported_bytes(replace(site, holes=(site.holes[0], hole)), "las")
    none = replace(wall, holes=[replace(one, md=one.md[:0]) for one in wall.holes])
    with pytest.raises(SurveyError, match=r"wall\.toml: no column was surveyed; nothing is to be exported$"):
        site_of_wall(none, judgement, date(2026, 11, 20))
