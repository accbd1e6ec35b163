"""A running rig exported: every format, from the page and from the terminal, holds the stations that it answers."""

import csv
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from forked_commands import run
from hand_fed import Rig
from page_client import PASSWORD, PageClient, free_port
from served import Served, serving
from test_exports import diggs_says, dxf_says, geojson_says, ifc_says, witsml_says
from three_holes import write_three_holes

from groundstation.gateway.page.exports import ENDINGS, EXPORTED, MEDIA
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import hash_of
from groundstation.survey.exports.export_request import FORMATS
from groundstation.survey.files.field_files import read_any

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),  # files that validators leave open
]
LEANS = (0.4, 0.9, 1.7, 2.2)  # deg, at 2, 4, 6, 8 m
COLLAR = (5_806_123.456, 389_000.125, 35.5)
PLACE = f"origin={','.join(map(str, COLLAR))}&grid_crs=EPSG:25833"
NORTH = """
north = "grid"
northing_m = 5806000.0
easting_m = 389000.0
height_m = 35.0
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Served, PageClient]]:
    """A hole of four stops, whose page listens beyond this machine, so that reading needs a role."""
    rig, port = Rig(tmp_path_factory.mktemp("ground"), target=20.0), free_port()
    rig.yaw = 0.7
    rig.run(5.0)
    for stop, lean in enumerate(LEANS, 1):
        rig.drill(stop, lean)
    passwords = {"driller": hash_of(PASSWORD), "operator": hash_of("another long word")}
    with serving(rig, PageSettings("0.0.0.0", port, passwords=passwords)) as served:
        yield served, PageClient(port)


@pytest.fixture
def page(served: tuple[Served, PageClient]) -> PageClient:
    """Signed in to read alone."""
    page = PageClient(served[1].port)
    assert page.sign_in("operator", "another long word").status == 200
    return page


def axis_of(form: str, content: bytes) -> np.ndarray:
    """Easting, northing, height of a file by its own library."""
    if form == "dxf":
        import ezdxf

        (line,) = ezdxf.read(io.StringIO(content.decode())).modelspace().query("POLYLINE")
        return np.array([tuple(vertex.dxf.location) for vertex in line.vertices])
    if form == "geojson":
        from pyproj import Transformer

        (feature,) = json.loads(content)["features"]
        longitude, latitude, height = np.array(feature["geometry"]["coordinates"]).T
        back = Transformer.from_crs("EPSG:4326", "EPSG:25833", always_xy=True).transform(longitude, latitude)
        return np.column_stack([*back, height])
    import ifcopenshell
    from ifcopenshell.util.placement import get_local_placement

    (pile,) = ifcopenshell.file.from_string(content.decode()).by_type("IfcPile")
    placed = get_local_placement(pile.ObjectPlacement)
    line = pile.Representation.Representations[0].Items[0].Directrix
    return np.array([point.Coordinates for point in line.Points]) @ placed[:3, :3].T + placed[:3, 3]


@pytest.mark.parametrize("form", FORMATS)
def test_the_page_and_the_terminal_write_one_file(
    served: tuple[Served, PageClient], page: PageClient, tmp_path: Path, form: str
) -> None:
    answer = page.get(f"/api/exports/hole.{form}?{PLACE}")
    assert (answer.status, answer.headers["content-type"].partition(";")[0]) == (200, MEDIA[form])
    name = f'attachment; filename="rig-1-hole.{ENDINGS.get(form, form)}"'
    assert answer.headers["content-disposition"] == name
    out = tmp_path / "hole"
    words = ("--endpoint", served[0].endpoint, "--origin", *COLLAR, "--grid-crs", "EPSG:25833")
    done = run("export", "live", "--format", form, "--out", out, *words)
    assert (done.returncode, done.stderr) == (0, "")
    ours, theirs = (without_stamps(form, content) for content in (out.read_bytes(), answer.body))
    assert ours == theirs


def without_stamps(form: str, content: bytes) -> list[str]:
    """Lines of a file but for those in which a drawing says when and under which number it was written."""
    if form != "dxf":
        return content.decode().splitlines()
    return [repr(row.tolist()) for row in axis_of(form, content)]


@pytest.mark.parametrize("form", ["dxf", "geojson", "ifc"])
def test_coordinates_are_those_of_the_stations(page: PageClient, form: str) -> None:
    rows = csv.DictReader(page.get("/api/tables/trajectory.csv").body.decode().splitlines())
    local = np.array([[float(row[name]) for name in ("east_m", "north_m", "tvd_m")] for row in rows])
    assert local.shape == (1 + len(LEANS), 3)
    assert np.ptp(local[:, 0]) > 0.02
    assert np.ptp(local[:, 1]) > 0.02
    content = page.get(f"/api/exports/hole.{form}?{PLACE}").body
    expected = np.array([COLLAR[1], COLLAR[0], COLLAR[2]]) + local * [1.0, 1.0, -1.0]
    np.testing.assert_allclose(axis_of(form, content), expected, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("form", ["las", "witsml"])
def test_directions_are_those_of_the_stations(page: PageClient, tmp_path: Path, form: str) -> None:
    points = page.get("/api/trajectory").content["points"]
    path = tmp_path / f"hole.{form}"
    path.write_bytes(page.get(f"/api/exports/hole.{form}").body)
    record = read_any(path).record
    np.testing.assert_allclose(record.md, [point["md_m"] for point in points], atol=1e-6)
    np.testing.assert_allclose(np.degrees(record.inclination), [p["inclination_deg"] for p in points], atol=1e-8)
    below = slice(1, None)
    turned = np.degrees(record.azimuth[below]) - [p["azimuth_deg"] for p in points[below]]
    np.testing.assert_allclose((turned + 180.0) % 360.0 - 180.0, 0.0, atol=1e-8)


def test_covariances_are_those_that_clients_are_answered(page: PageClient) -> None:
    from energyml.witsml.v2_1.witsmlv2 import Trajectory
    from xsdata.formats.dataclass.parsers import XmlParser

    points = page.get("/api/trajectory").content["points"]
    found = XmlParser().from_bytes(page.get("/api/exports/hole.witsml").body, Trajectory)
    for point, station in zip(points, found.trajectory_station, strict=True):
        matrix = station.matrix_cov
        assert matrix.variance_nn.value == point["covariance_m2"][0][0]
        assert matrix.variance_ne.value == point["covariance_m2"][0][1]
        assert matrix.variance_evert.value == point["covariance_m2"][1][2]


def test_the_deviation_is_that_of_the_deepest_station(page: PageClient) -> None:
    """The hole is designed vertical: its toe deviates by where the last of its places lies."""
    *_, last = csv.DictReader(page.get("/api/tables/trajectory.csv").body.decode().splitlines())
    text = page.get(f"/api/exports/hole.diggs?{PLACE}").body.decode()
    found = re.search(r"tipDeviationNorth (\S+) m, tipDeviationEast (\S+) m", text)
    assert found
    assert abs(float(last["north_m"])) + abs(float(last["east_m"])) > 0.05
    for told, name in zip(found.groups(), ("north_m", "east_m"), strict=True):
        assert float(told) == pytest.approx(float(last[name]), abs=2e-3)


def test_every_validator_accepts_a_live_file(page: PageClient, tmp_path: Path) -> None:
    says = {"dxf": dxf_says, "geojson": geojson_says, "ifc": ifc_says, "witsml": witsml_says}
    for form, check in says.items():
        assert check(page.get(f"/api/exports/hole.{form}?{PLACE}").body) == []
    assert diggs_says(page.get(f"/api/exports/hole.diggs?{PLACE}").body, tmp_path) == []


def test_who_may_not_read_may_not_export(served: tuple[Served, PageClient]) -> None:
    stranger = PageClient(served[1].port)
    for what in EXPORTED:
        refused = stranger.get(f"/api/exports/{what}.dxf")
        assert (refused.status, "sign in to read" in refused.content["error"]) == (401, True)
    assert stranger.sign_in().status == 200
    assert stranger.get("/api/exports/hole.dxf").status == 200


@pytest.mark.parametrize(
    ("address", "status", "words"),
    [
        ("string.dxf", 404, "export: expected hole or wall, got 'string'"),
        ("hole.dwg", 404, "export: expected a format of ags, diggs, dxf, geojson, ifc, las, witsml, got 'dwg'"),
        ("wall.dxf", 404, "this rig has no wall; see --wall and --hole"),
        ("hole.geojson", 409, "geojson: expected --grid-crs and --origin"),
        ("hole.dxf?grid_crs=EPSG:25833", 409, "--grid-crs: expected --origin NORTHING EASTING HEIGHT"),
        ("hole.dxf?origin=1,2", 409, "--origin: expected NORTHING,EASTING,HEIGHT in m, got '1,2'"),
        ("hole.dxf?origin=1,nan,2", 409, "--origin: expected a coordinate of -1e+08..1e+08 m, got nan"),
        ("hole.dxf?depth=3", 400, "parameter depth: expected one of origin, grid_crs"),
        (f"hole.geojson?{PLACE.replace('25833', '99999')}", 409, "EPSG:99999"),
    ],
)
def test_what_cannot_be_exported_is_told_in_a_line(page: PageClient, address: str, status: int, words: str) -> None:
    refused = page.get(f"/api/exports/{address}")
    assert (refused.status, words in refused.content["error"]) == (status, True), refused.content


def test_the_document_of_the_page_names_every_export(page: PageClient) -> None:
    paths = page.get("/api/openapi.json").content["paths"]
    named = {path.removeprefix("/api/exports/") for path in paths if path.startswith("/api/exports/")}
    assert named == {f"{what}.{form}" for what in EXPORTED for form in FORMATS}
    for name in named:
        told = paths[f"/api/exports/{name}"]["get"]["responses"]["200"]["content"]
        assert list(told) == [MEDIA[name.rpartition(".")[2]]]


def test_a_hole_without_a_station_is_refused(tmp_path: Path) -> None:
    rig, port = Rig(tmp_path, target=20.0), free_port()
    with serving(rig, PageSettings("127.0.0.1", port)):
        refused = PageClient(port).get("/api/exports/hole.dxf")
        assert (refused.status, "no station below the collar yet" in refused.content["error"]) == (409, True)


def test_a_rig_of_a_wall_exports_the_wall_and_its_hole_where_they_stand(tmp_path: Path) -> None:
    import ezdxf

    wall = write_three_holes(tmp_path, NORTH)
    rig, port = Rig(tmp_path / "ground", target=8.0, wall=wall, hole="H2"), free_port()
    rig.run(5.0)
    for stop in (1, 2):
        rig.drill(stop, 0.3)
    with serving(rig, PageSettings("127.0.0.1", port)):
        page = PageClient(port)
        answer = page.get("/api/exports/wall.dxf")
        assert answer.headers["content-disposition"] == 'attachment; filename="H2-wall.dxf"'
        lines = list(ezdxf.read(io.StringIO(answer.body.decode())).modelspace().query("POLYLINE"))
        heads = sorted(tuple(line.vertices[0].dxf.location)[:2] for line in lines)
        np.testing.assert_allclose(heads, [[389_000.0, 5_806_000.0 + n] for n in (0.0, 0.75, 1.5)], atol=1e-6)
        assert {line.dxf.layer for line in lines} == {"HOLE-NOT-TIGHT"}  # the middle one is not drilled to its end
        hole = axis_of("dxf", page.get("/api/exports/hole.dxf").body)
        points = page.get("/api/trajectory").content["points"]
        stands = [[389_000.0 + p["east_m"], 5_806_000.75 + p["north_m"], 35.0 - p["tvd_m"]] for p in points]
        np.testing.assert_allclose(hole, stands, rtol=0.0, atol=1e-6)
        refused = page.get("/api/exports/hole.dxf?origin=1,2,3")
        assert (refused.status, "the wall's file says where" in refused.content["error"]) == (409, True)
