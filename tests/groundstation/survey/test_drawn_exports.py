"""Drawn holes as files of every format: vertical, level, rising, with names that break files, on six grids."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from schema_order import order_faults
from test_exports import diggs_says, dxf_says, geojson_says, ifc_says, witsml_says

from groundstation.survey.exports.export_hole import ExportHole, ExportSite
from groundstation.survey.exports.export_request import exported_bytes
from groundstation.survey.files.field_files import read_any
from groundstation.survey.well.methods import Method, station_positions

NAMES = (
    'K "2" Süd', "=1+1", "@SUM(A1:A9)", "+K1-2", "K\n1", "a:b", "<&>'", "孔-7", "\U0001f6e0 1", "~A", "K,1;2|3+4",
    "x" * 300, "\x01ctl", "\udc80bad", "a\\b", "%%d", "K1\r\nK2", "\u202eRTL", "o'brien",
)  # fmt: skip
GRIDS = {
    "EPSG:25833": (5_806_123.4567891, 389_000.1234567), "EPSG:5650": (5_806_123.4567891, 33_390_000.1234567),
    "EPSG:31468": (5_400_000.5, 4_468_000.25), "EPSG:27700": (180_000.123456, 530_000.654321),
    "EPSG:2056": (1_200_000.125, 2_600_000.375), "EPSG:28356": (6_250_000.5, 334_000.5),
}  # fmt: skip
SHAPES: dict[str, Callable[[random.Random, int], tuple[list[float], list[float]]]] = {
    "vertical": lambda lot, n: ([0.0] * n, [0.0] * n),
    "level": lambda lot, n: ([90.0] * n, [lot.uniform(0.0, 360.0)] * n),
    "rising": lambda lot, n: ([lot.uniform(91.0, 179.0)] * n, [lot.uniform(0.0, 360.0)] * n),
    "all but vertical": lambda lot, n: ([lot.uniform(0.0, 1e-3) for _ in range(n)], [359.9999999] * n),
    "any": lambda lot, n: ([lot.uniform(0.0, 9.0) for _ in range(n)], [lot.uniform(0.0, 360.0) for _ in range(n)]),
}


def drawn_site(seed: int, most: int = 12) -> ExportSite:
    """One drawn hole on a drawn grid, with drawn names of everything; ``most`` stations."""
    lot = random.Random(seed)
    count = lot.choice([2, 3, most])
    md = np.cumsum([0.0, *(lot.choice([lot.uniform(0.2, 30.0), 0.001, 1.0]) for _ in range(count - 1))])
    inclination, azimuth = (np.array(part) for part in SHAPES[lot.choice(list(SHAPES))](lot, count))
    local = station_positions(Method.MINIMUM_CURVATURE, md, np.radians(inclination), np.radians(azimuth))
    crs = lot.choice(list(GRIDS))
    axis = local[:, [1, 0, 2]] * [1.0, 1.0, -1.0] + [GRIDS[crs][1], GRIDS[crs][0], 35.25]
    root = np.array([[lot.gauss(0.0, 0.02) for _ in range(3)] for _ in range(3)])
    covs = np.array([root @ root.T * k for k in range(count)])
    hole = ExportHole(
        lot.choice(NAMES), md, inclination, azimuth, local, axis, covs, 0.6, "tight", "grid", local[-1, :2],
    )  # fmt: skip
    remarks = tuple("WARNING " + "z" * lot.choice([10, 3000]) for _ in range(lot.choice([0, 1, 3])))
    return ExportSite(lot.choice(NAMES), (hole,), "", crs, remarks, "2026-11-27", lot.choice(NAMES), lot.choice(NAMES))


def dxf_axis(content: bytes, site: ExportSite) -> np.ndarray:
    import ezdxf

    assert dxf_says(content) == []
    (line,) = ezdxf.read(io.StringIO(content.decode())).modelspace().query("POLYLINE")
    return np.array([tuple(vertex.dxf.location) for vertex in line.vertices])


def ifc_axis(content: bytes, site: ExportSite) -> np.ndarray:
    import ifcopenshell
    from ifcopenshell.util.placement import get_local_placement

    (pile,) = ifcopenshell.file.from_string(content.decode()).by_type("IfcPile")
    assert pile.Name == "".join(letter if letter.isprintable() else " " for letter in site.holes[0].name)[:255]
    (solid,) = pile.Representation.Representations[0].Items
    placed = get_local_placement(pile.ObjectPlacement)
    return np.array([point.Coordinates for point in solid.Directrix.Points]) @ placed[:3, :3].T + placed[:3, 3]


def geojson_axis(content: bytes, site: ExportSite) -> np.ndarray:
    from pyproj import Transformer

    assert geojson_says(content) == []
    longitude, latitude, height = np.array(json.loads(content)["features"][0]["geometry"]["coordinates"]).T
    east, north = Transformer.from_crs("EPSG:4326", site.crs, always_xy=True).transform(longitude, latitude)
    return np.column_stack([east, north, height])


def diggs_axis(content: bytes, site: ExportSite, folder: Path) -> np.ndarray:
    from lxml import etree

    assert diggs_says(content, folder) == []
    (line,) = etree.fromstring(content).iter("{http://diggsml.org/schemas/3}centerLine")
    return np.array(line.findtext(".//{http://www.opengis.net/gml/3.2}posList").split(), float).reshape(-1, 3)


@pytest.mark.parametrize(("form", "seeds"), [("dxf", range(6)), ("geojson", range(12)), ("ifc", range(12))])
def test_axes_are_valid_and_read_back_to_a_micrometre(form: str, seeds: range) -> None:
    axis_of = {"dxf": dxf_axis, "geojson": geojson_axis, "ifc": ifc_axis}[form]
    for seed in seeds:
        site = drawn_site(seed)
        np.testing.assert_allclose(axis_of(exported_bytes(site, form), site), site.holes[0].axis, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("seed", range(2))
def test_a_document_of_diggs_is_valid_and_read_back_to_a_micrometre(tmp_path: Path, seed: int) -> None:
    site = drawn_site(seed)
    found = diggs_axis(exported_bytes(site, "diggs"), site, tmp_path)
    np.testing.assert_allclose(found, site.holes[0].axis, rtol=0.0, atol=1e-6)


@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # a file that a validator leaves open
@pytest.mark.parametrize("seed", range(100, 130))
def test_many_drawn_holes_are_valid_in_every_format_and_read_back(tmp_path: Path, seed: int) -> None:
    """One in ten has 2000 stations."""
    site = drawn_site(seed, 2000 if seed % 10 == 0 else 60)
    assert ifc_says(exported_bytes(site, "ifc")) == []
    for form, axis_of in (("dxf", dxf_axis), ("geojson", geojson_axis), ("ifc", ifc_axis)):
        np.testing.assert_allclose(axis_of(exported_bytes(site, form), site), site.holes[0].axis, rtol=0.0, atol=1e-6)
    found = diggs_axis(exported_bytes(site, "diggs"), site, tmp_path)
    np.testing.assert_allclose(found, site.holes[0].axis, rtol=0.0, atol=1e-6)
    test_trajectories_and_logs_are_read_back_by_our_own_reader(tmp_path, seed)


@pytest.mark.parametrize("seed", range(8))
def test_trajectories_and_logs_are_read_back_by_our_own_reader(tmp_path: Path, seed: int) -> None:
    """Directions and depths to 1e-6; a log its positions too; the order and lengths are those of the schema."""
    import lasio

    site = drawn_site(seed)
    (hole,) = site.holes
    for form in ("witsml", "las"):
        path = tmp_path / f"hole.{form}"
        path.write_bytes(exported_bytes(site, form))
        record = read_any(path).record
        np.testing.assert_allclose(record.md, hole.md, rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(np.degrees(record.inclination), hole.inclination_deg, rtol=0.0, atol=1e-6)
    log = lasio.read((tmp_path / "hole.las").read_text(), ignore_header_errors=False)
    found = np.column_stack([log["NORTH"], log["EAST"], log["TVD"]])
    np.testing.assert_allclose(found, hole.local, rtol=0.0, atol=1e-6)
    content = (tmp_path / "hole.witsml").read_bytes()
    assert [*witsml_says(content), *order_faults(content)] == []


def test_a_trajectory_out_of_the_schemas_order_and_a_text_too_long_are_noticed() -> None:
    content = exported_bytes(drawn_site(1), "witsml")
    bore = content[content.index(b"<witsml:Wellbore>") : content.index(b"</witsml:Wellbore>") + 18]
    early = content.replace(bore, b"").replace(b"<witsml:TrajectoryStation", bore + b"<witsml:TrajectoryStation", 1)
    assert [fault.partition(":")[0] for fault in order_faults(early)] == ["Trajectory"]
    long = content.replace(b"</eml:Originator>", b"x" * 70 + b"</eml:Originator>")
    assert order_faults(long) == ["Originator: 79 letters, at most 64"]


def test_a_file_of_ags_has_heads_and_depths_to_a_micrometre_and_rising_holes(tmp_path: Path) -> None:
    for seed in range(8):
        site = drawn_site(seed)
        (hole,) = site.holes
        content = exported_bytes(site, "ags")
        rows = list(csv.reader(io.StringIO(content.decode(), newline="")))
        (at,) = [k for k, row in enumerate(rows) if row[:2] == ["GROUP", "LOCA"]]
        content.decode("utf-8").encode("latin-1")  # the letters of the format, and none else
        east, north, height = (float(rows[at + 4][k]) for k in (3, 4, 6))
        np.testing.assert_allclose([east, north, height], hole.axis[0], rtol=0.0, atol=1e-6)
        path = tmp_path / "hole.ags"
        path.write_bytes(content)
        if len(hole.md) < 3:
            continue  # the last station begins no interval, and one is no survey
        record = read_any(path).record
        np.testing.assert_allclose(record.md, hole.md[:-1], rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(np.degrees(record.inclination), hole.inclination_deg[:-1], rtol=0.0, atol=0.5)


def test_two_walls_of_one_name_of_hole_share_no_identifier() -> None:
    """Models and trajectories of two sites are put together: what is another thing has another identifier."""
    site = drawn_site(2)
    other = dataclasses.replace(site, name=f"{site.name} 2")
    for form, mark in (("ifc", b"IFCPILE('"), ("witsml", b'uuid="')):
        keys = [exported_bytes(one, form).split(mark)[1][:22] for one in (site, other)]
        assert keys[0] != keys[1]
    assert exported_bytes(site, "ifc") == exported_bytes(site, "ifc")
