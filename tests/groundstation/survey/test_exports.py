"""Files of other programs: each is accepted by the validator of its format, refused with a defect, and read back."""

import ast
import contextlib
import csv
import dataclasses
import datetime
import functools
import io
import json
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, SimpleNamespace

import numpy as np
import pytest
from _pytest.assertion.rewrite import rewrite_asserts
from forked_commands import run

from borechain import api
from groundstation.entry.quoted_cells import quoted_cell
from groundstation.errors import SurveyError
from groundstation.report.wall_report import column_records
from groundstation.survey.exports.export_hole import ExportHole, ExportSite
from groundstation.survey.exports.export_request import FORMATS, exported_bytes, site_of_wall
from groundstation.survey.files.field_files import read_any

MD = np.array([0.0, 10.0, 20.0, 30.0])
LOCAL = np.array([[0.0, 0.0, 0.0], [-0.04, 0.08, 9.999], [-0.3, 0.4, 19.993], [-0.9, 1.3, 29.94]])
ORIGIN = np.array([33_390_000.1234567, 5_806_123.4567891, 35.25])  # of a grid whose eastings have eight digits


def hole_of(name: str, verdict: str, shift: float) -> ExportHole:
    axis = ORIGIN + LOCAL[:, [1, 0, 2]] * [1.0, 1.0, -1.0] + [0.0, shift, 0.0]
    covs = np.array([np.diag([1e-4, 2e-4, 4e-4]) * k for k in range(4)])
    return ExportHole(
        name, MD, np.array([0.0, 1.0, 3.0, 5.0]), np.array([0.0, 120.0, 125.0, 130.0]), LOCAL, axis, covs, 0.6, verdict,
        "grid", np.array([-0.9, 1.3]),
    )  # fmt: skip


ONE = ExportSite("wall 1", (hole_of("K1", "tight", 0.0),), "tight", "EPSG:5650", ("instrument relay",), "2026-11-27")
TOOL = """
[tool]
name = "probe"
title = "a probe"
kind = "Inertial"

[[term]]
name = "@SUM(1)"
value = 0.01
unit = "deg"
mode = "systematic"
inclination = "1"
"""
TWO = dataclasses.replace(ONE, holes=(ONE.holes[0], hole_of("K2 Süd", "not proven", 0.75)))


def dxf_says(content: bytes) -> list[str]:
    import ezdxf

    found = ezdxf.read(io.StringIO(content.decode())).audit()
    return [error.message for error in (*found.errors, *found.fixes)]


def ifc_says(content: bytes) -> list[str]:
    import ifcopenshell
    import ifcopenshell.validate

    logger = ifcopenshell.validate.json_logger()
    with rules_compiled_once():
        ifcopenshell.validate.validate(ifcopenshell.file.from_string(content.decode()), logger, express_rules=True)
    return [str(statement) for statement in logger.statements]


@contextlib.contextmanager
def rules_compiled_once() -> Iterator[None]:
    """The validator parses and compiles 680 kB of rules at every call: have it take those of the call before."""
    from ifcopenshell.express import rule_executor

    def unparsed(source: str) -> ast.Module:
        tree = ast.Module([], [])
        tree.source = source  # type: ignore[attr-defined]
        return tree

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rule_executor, "ast", SimpleNamespace(parse=unparsed))
        patch.setattr(rule_executor, "compile", lambda tree, name, _: compiled_rules(tree.source, name), raising=False)
        yield


@functools.cache
def compiled_rules(source: str, name: str) -> CodeType:
    """Rules as the validator compiles them."""
    tree = ast.parse(source)
    rewrite_asserts(mod=tree, source=source.encode())
    return compile(tree, name, "exec")


def geojson_says(content: bytes) -> list[str]:
    from geojson_pydantic import FeatureCollection
    from pydantic import ValidationError

    try:
        FeatureCollection(**json.loads(content))
    except ValidationError as error:
        return [str(error)]
    return []


def witsml_says(content: bytes) -> list[str]:
    """Unknown elements, values that are none of their type, and required fields that are missing."""
    from energyml.witsml.v2_1.witsmlv2 import Trajectory
    from xsdata.exceptions import ParserError
    from xsdata.formats.dataclass.parsers import XmlParser
    from xsdata.formats.dataclass.parsers.config import ParserConfig

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = XmlParser(ParserConfig(fail_on_unknown_properties=True)).from_bytes(content, Trajectory)
        except (ParserError, Warning) as error:
            return [str(error)]
    return _missing(found)


def _missing(part: object) -> list[str]:
    out = []
    for field in dataclasses.fields(part):  # type: ignore[arg-type]
        value = getattr(part, field.name)
        if field.metadata.get("required") and value is None:
            out.append(field.name)
        for one in value if isinstance(value, list) else [value]:
            out += _missing(one) if dataclasses.is_dataclass(one) else []
    return out


def diggs_says(content: bytes, folder: Path) -> list[str]:
    from pydiggs import validate

    path = folder / "d.xml"
    path.write_bytes(content)
    report = validate(str(path))
    return [str(finding.message) for finding in report.findings]


def las_says(content: bytes) -> list[str]:
    import lasio

    found = lasio.read(content.decode(), ignore_header_errors=False)
    bad = [curve.mnemonic for curve in found.curves if np.isnan(np.asarray(curve.data, float)).any()]
    return bad + ([] if len(found["DEPT"]) == 4 else ["depths"])


SAYS: dict[str, Callable[..., list[str]]] = {
    "dxf": dxf_says, "ifc": ifc_says, "geojson": geojson_says, "witsml": witsml_says, "las": las_says,
}  # fmt: skip
DEFECTS = {
    "dxf": (b"HOLE-NOT-PROVEN", b"HOLE*NOT|PROVEN"),
    "ifc": (b",0.6,$,$,$)", b",-0.6,$,$,$)"),
    "geojson": (b'"LineString"', b'"Polygon"'),
    "witsml": (b"<witsml:TypeTrajStation>MD INCL and AZI</witsml:TypeTrajStation>", b""),
    "las": (b"20.000000000", b"twenty"),
}


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # a file that a validator leaves open
@pytest.mark.parametrize("form", SAYS)
def test_a_file_is_accepted_by_the_validator_of_its_format_and_refused_with_a_defect(form: str) -> None:
    content = exported_bytes(ONE if form in ("witsml", "las") else TWO, form)
    assert SAYS[form](content) == []
    good, bad = DEFECTS[form]
    assert good in content
    try:
        found = SAYS[form](content.replace(good, bad))
    except Exception as error:  # a validator that cannot even read it
        found = [str(error)]
    assert found


def test_diggs_is_valid_and_refused_with_a_defect(tmp_path: Path) -> None:
    content = exported_bytes(TWO, "diggs")
    assert diggs_says(content, tmp_path) == []
    assert b"tipDeviationNorth -0.9000 m, tipDeviationEast 1.3000 m" in content
    assert diggs_says(content.replace(b"investigationTarget", b"target"), tmp_path)
    local = exported_bytes(dataclasses.replace(TWO, crs=""), "diggs")
    assert b"urn:borechain:local" in local


@pytest.mark.install
def test_ags_breaks_no_rule_and_a_defect_does(tmp_path: Path) -> None:
    """The checker asks for an older `rich` than ours, so it has an environment of its own."""
    python = tmp_path / "ags" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "ags"], check=True)
    install = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile"]
    subprocess.run([*install, "python-ags4>=1.1"], check=True, capture_output=True)
    script = (
        "import json, sys\nfrom python_ags4 import AGS4\nfound = AGS4.check_file(sys.argv[1])\n"
        "print('\\n' + json.dumps([k for k in found if k.startswith('AGS Format Rule')]))"
    )
    content = exported_bytes(TWO, "ags")
    for name, text, broken in (
        ("good", content, False),
        ("bad", content.replace(b'"m","m","deg","deg",""', b'"m","m","deg"'), True),
    ):
        path = tmp_path / f"{name}.ags"
        path.write_bytes(text)
        done = subprocess.run([python, "-c", script, path], check=True, capture_output=True, text=True)
        assert bool(json.loads(done.stdout.splitlines()[-1])) is broken


def test_ags_says_that_its_angles_are_rounded_and_is_read_back(tmp_path: Path) -> None:
    content = exported_bytes(ONE, "ags")
    assert content.count(b"rounded to whole degrees") == 5  # PROJ, TRAN, and each interval
    path = tmp_path / "hole.ags"
    path.write_bytes(content)
    record = read_any(path).record
    np.testing.assert_allclose(record.md, MD[:3])
    np.testing.assert_allclose(np.degrees(record.inclination), [0.0, 1.0, 3.0], atol=1e-9)


def test_coordinates_of_a_drawing_are_read_back_to_a_micrometre() -> None:
    import ezdxf

    drawing = ezdxf.read(io.StringIO(exported_bytes(TWO, "dxf").decode()))
    lines = list(drawing.modelspace().query("POLYLINE"))
    assert [line.dxf.layer for line in lines] == ["HOLE-TIGHT", "HOLE-NOT-PROVEN"]
    for line, hole in zip(lines, TWO.holes, strict=True):
        points = np.array([tuple(vertex.dxf.location) for vertex in line.vertices])
        np.testing.assert_allclose(points, hole.axis, rtol=0.0, atol=1e-6)
    assert len(drawing.modelspace().query("CIRCLE")) == 8


def test_coordinates_of_a_model_are_read_back_to_a_micrometre() -> None:
    import ifcopenshell
    from ifcopenshell.util.placement import get_local_placement

    model = ifcopenshell.file.from_string(exported_bytes(TWO, "ifc").decode())
    piles = model.by_type("IfcPile")
    assert [pile.Name for pile in piles] == ["K1", "K2 Süd"]
    assert [pile.Description for pile in piles] == ["tight", "not proven"]
    for pile, hole in zip(piles, TWO.holes, strict=True):
        (solid,) = pile.Representation.Representations[0].Items
        assert solid.Radius == 0.6
        points = np.array([point.Coordinates for point in solid.Directrix.Points])
        placed = get_local_placement(pile.ObjectPlacement)
        np.testing.assert_allclose(points @ placed[:3, :3].T + placed[:3, 3], hole.axis, rtol=0.0, atol=1e-6)


def test_places_of_a_map_are_read_back_to_a_micrometre_and_need_a_grid() -> None:
    from pyproj import Transformer

    found = json.loads(exported_bytes(TWO, "geojson"))
    back = Transformer.from_crs("EPSG:4326", "EPSG:5650", always_xy=True)
    for feature, hole in zip(found["features"], TWO.holes, strict=True):
        longitude, latitude, height = np.array(feature["geometry"]["coordinates"]).T
        east, north = back.transform(longitude, latitude)
        np.testing.assert_allclose(np.column_stack([east, north, height]), hole.axis, rtol=0.0, atol=1e-6)
        assert feature["properties"]["verdict"] == hole.verdict
    with pytest.raises(SurveyError, match="geojson: expected --grid-crs and --origin"):
        exported_bytes(dataclasses.replace(TWO, crs=""), "geojson")
    with pytest.raises(SurveyError, match="--grid-crs: expected a grid such as EPSG:25833, got 'EPSG:99999'"):
        exported_bytes(dataclasses.replace(TWO, crs="EPSG:99999"), "geojson")
    far = dataclasses.replace(TWO.holes[0], axis=TWO.holes[0].axis * 1e6)
    with pytest.raises(SurveyError, match=r"K1: easting 3.3.*lie outside the grid"):
        exported_bytes(dataclasses.replace(TWO, holes=(far,)), "geojson")


FOUR = """
name = "four"
radius_m = 0.6
thickness_m = 0.8
length_m = 8
heads = "h.csv"
stations = "s.csv"
allowed_probability = 0.5
"""


@pytest.mark.parametrize(
    ("leans_deg", "verdicts"),
    [
        ((9, 0, 0, 0), ("not tight", "not tight", "tight", "tight")),  # the first leans away: its joint is open
        ((0, 0, None, 0), ("tight", "not tight", "not tight")),  # the third is not there: open on both of its sides
        ((0, 0, 0, 0), ("tight",) * 4),
    ],
)
def test_a_column_of_a_wall_has_the_verdict_of_its_joints(
    tmp_path: Path, leans_deg: tuple[int | None, ...], verdicts: tuple[str, ...]
) -> None:
    names = ("K-1", "K-2", "K-3", "K-4")  # as joints are named, by dashes
    (tmp_path / "wall.toml").write_text(FOUR)
    heads = "".join(f"{name},{0.7 * k},0\n" for k, name in enumerate(names))
    (tmp_path / "h.csv").write_text(f"column,north_m,east_m\n{heads}")
    holes = [(name, lean) for name, lean in zip(names, leans_deg, strict=True) if lean is not None]
    rows = "".join(f"{name},{md},{lean},180\n" for name, lean in holes for md in (0, 4, 8))
    (tmp_path / "s.csv").write_text(f"column,md_m,inclination_deg,azimuth_deg\n{rows}")
    judged = api.wall(tmp_path / "wall.toml")
    site = site_of_wall(judged.wall, judged.judgement, datetime.date(2026, 11, 27))
    assert tuple(hole.verdict for hole in site.holes) == verdicts
    records = column_records(judged.wall, judged.judgement)
    assert bool(records[0].actions) == (leans_deg[0] == 9)


@pytest.mark.parametrize("form", ["witsml", "las"])
def test_what_is_written_is_read_by_our_own_reader(tmp_path: Path, form: str) -> None:
    path = tmp_path / f"hole.{form}"
    path.write_bytes(exported_bytes(ONE, form))
    found = read_any(path)
    np.testing.assert_allclose(found.record.md, MD)
    np.testing.assert_allclose(np.degrees(found.record.inclination), ONE.holes[0].inclination_deg, atol=1e-9)
    np.testing.assert_allclose(np.degrees(found.record.azimuth), ONE.holes[0].azimuth_deg, atol=1e-9)
    with pytest.raises(SurveyError, match="expected one hole, got 2; name it by --hole"):
        exported_bytes(TWO, form)
    assert exported_bytes(TWO, form, "K1")
    with pytest.raises(SurveyError, match="--hole K3: expected one of K1, K2 Süd"):
        exported_bytes(TWO, form, "K3")


def test_a_trajectory_has_the_covariance_of_every_station() -> None:
    from energyml.witsml.v2_1.witsmlv2 import Trajectory
    from xsdata.formats.dataclass.parsers import XmlParser

    found = XmlParser().from_bytes(exported_bytes(ONE, "witsml"), Trajectory)
    assert found.azi_ref.value == "grid north"
    for k, station in enumerate(found.trajectory_station):
        assert station.type_survey_tool.value == "gyroscopic MWD"
        assert station.matrix_cov.variance_nn.value == pytest.approx(1e-4 * k)
        assert station.matrix_cov.variance_vert_vert.value == pytest.approx(4e-4 * k)


def test_names_in_ags_are_not_computed_by_a_spreadsheet() -> None:
    """A file of AGS is a table of commas and quotes, and is opened as one."""
    hole = dataclasses.replace(ONE.holes[0], name="=1+1")
    text = exported_bytes(dataclasses.replace(ONE, holes=(hole,), name="@SUM(A1)", client="+1"), "ags").decode()
    cells = {cell for row in csv.reader(io.StringIO(text)) for cell in row}
    assert {"'=1+1", "'@SUM(A1)", "+1"} <= cells  # the last is a number
    assert not {cell for cell in cells if cell.startswith(("=", "@"))}


@pytest.mark.parametrize("text", ["=1+1", "+1+1", "@SUM(A1)", "-2+3", "\t=1", "\r=1", "\n=1"])
def test_text_that_begins_like_a_formula_is_quoted(text: str) -> None:
    assert quoted_cell(text) == f"'{text}"
    assert [quoted_cell(x) for x in ("plain", "-12.5", -12.5, None)] == ["plain", "-12.5", -12.5, None]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_the_command_writes_every_format_and_quotes_what_a_spreadsheet_would_compute(tmp_path: Path) -> None:
    record = tmp_path / "s.csv"
    record.write_text("MD (m),Inc (deg),Azi (deg)\n0,0,0\n10,1,120\n20,3,125\n")
    place = ("--at", "52.4,13.37,35", "--date", "2026-11-27", "--grid-crs", "EPSG:25833")
    grid = ("--origin", 5_806_123.5, 389_000.25, 35, *place)
    for form in FORMATS:
        out = tmp_path / f"hole.{form}"
        done = run("export", "hole", record, "--format", form, "--out", out, "--answer-north", "grid", *grid)
        assert (done.returncode, done.stderr) == (0, "")
        assert out.stat().st_size > 300
    wall = Path(__file__).resolve().parents[3] / "scenarios" / "walls" / "wall-40.toml"
    done = run("export", "wall", wall, "--format", "ifc", "--out", tmp_path / "wall.ifc")
    assert (done.returncode, done.stdout.endswith("bytes\n")) == (0, True)
    assert ifc_says((tmp_path / "wall.ifc").read_bytes()) == []
    refused = run("export", "wall", wall, "--format", "las", "--out", tmp_path / "wall.las")
    assert (refused.returncode, "expected one hole" in refused.stderr) == (2, True)
    table = tmp_path / "t.csv"
    run("survey", record, "--out", table, "--origin", 1, 2, 3, "--height-datum", "=cmd|'/c calc'!A1")
    with table.open() as file:
        assert {row["height_datum"] for row in csv.DictReader(file)} == {"'=cmd|'/c calc'!A1"}
    parts = tmp_path / "parts.csv"
    tool = tmp_path / "tool.toml"
    tool.write_text(TOOL)
    done = run(
        "survey", record, "--by-source", parts, "--instrument", tool, "--origin", 1, 2, 3, "--height-datum", "=1+1"
    )
    assert (done.returncode, done.stderr) == (0, "")
    with parts.open() as file:
        rows = list(csv.DictReader(file))
    assert {row["height_datum"] for row in rows} == {"'=1+1"}
    assert "'@SUM(1)" in {row["source"] for row in rows}
