"""Surveys, clearances, their figures and their files read back whole, each option in use and each number another.

Places stand beside an integral along the tangents, regions beside sums over stations; the error models themselves are
compared with the workbooks of their authors in `test_error_model.py` and `test_published_surveys.py`.
"""

from __future__ import annotations

import datetime
import itertools
import json
import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from read_back import check, drawing, leaves, write_anew
from same_well import FORMATS

from groundstation.errors import SurveyError
from groundstation.report.plots import draw_survey, survey_figure
from groundstation.survey.exports.export_request import exported_bytes, site_of_survey
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.survey_records import DisplacementRule
from groundstation.survey.requests.clearance_answer import answer_clearance
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.survey_answer import SurveyAnswer, answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from groundstation.survey.wall.column_deviation import ColumnDesign, parse_tolerance
from groundstation.survey.well.methods import Method

DATA = Path(__file__).parents[2] / "data" / "survey"
DAY = datetime.date(2026, 11, 20)
# md, inclination, azimuth (deg): from vertical past the horizontal, with a turn back and unequal legs
WELL = (
    (0.0, 0.0, 0.0), (11.0, 1.5, 20.0), (29.0, 6.0, 35.0), (60.5, 18.0, 62.0), (88.0, 33.5, 81.0),
    (121.0, 52.0, 74.0), (149.5, 71.0, 55.0), (180.0, 93.0, 41.0),
)  # fmt: skip
SITE = SiteFigures(9.8123, 49_230.0, 66.5, 3.25, 52.4)
TURNED = FrameRequest(
    "magnetic", "true", north_of_site_deg=11.0, convergence_deg=1.75, declination_deg=3.25, origin=(5e3, 300.25, 31.5),
    grid_scale_factor=0.9996, depth_reference="rotary-table", answer_depth_reference="collar",
    depth_reference_height_m=3.5, height_datum="DHHN2016",
)  # fmt: skip
ONE_GRID = FrameRequest("grid", "grid", convergence_deg=1.75, origin=(5_806_123.5, 389_000.25, 35.0))


def table(rows: Iterable[Iterable[float]] = WELL, head: str = "md_m,inclination_deg,azimuth_deg") -> str:
    return head + "\n" + "".join(",".join(f"{value:.10g}" for value in row) + "\n" for row in rows)


def put(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def relay(folder: Path) -> SurveyRequest:
    """The relay's own table, with a time and the sigma of yaw and forces of every station."""
    rows = [(*row, 900.0 * k, 0.2 + 0.03 * k, 0.004 + 0.001 * k) for k, row in enumerate(WELL)]
    head = "md_m,inclination_deg,azimuth_deg,time_s,yaw_sigma_deg,force_sigma_mps2"
    return SurveyRequest(put(folder, "relay.csv", table(rows, head)), sigma=2.0, md=(0.0, 40.0, 179.0), site=SITE)


def programme(folder: Path) -> SurveyRequest:
    """Two instruments one below the other, from a station that is tied on with its covariance."""
    legs = put(
        folder,
        "legs.toml",
        '[[leg]]\nfrom_m = 5.0\nto_m = 88.0\ninstrument = "mwd-rev5.1"\n'
        '[[leg]]\nfrom_m = 88.0\ninstrument = "stim300"\n',
    )
    tie = put(
        folder,
        "tie.toml",
        "md_m = 5.0\ninclination_deg = 0.75\nazimuth_deg = 15.0\nnorth_m = 0.04\neast_m = -0.03\ntvd_m = 4.99\n"
        "covariance_m2 = [[1e-3, 2e-4, 1e-4], [2e-4, 2e-3, -3e-4], [1e-4, -3e-4, 4e-3]]\n",
    )
    return SurveyRequest(
        put(folder, "part.csv", table(WELL[1:])), programme=legs, tie_on=tie, site=SITE, section_azimuth_deg=250.0
    )


def lateral(folder: Path, rule: str) -> SurveyRequest:
    rows = [(3.0 * k, 1.1 * k * k, -1.5 * k) for k in range(6)]
    text = table(rows, "md_m,a_cm,b_cm")
    return SurveyRequest(put(folder, "lateral.csv", text), displacement_rule=rule, azimuth_error_deg=0.7)


def plain(folder: Path, **asked: Any) -> SurveyRequest:
    return SurveyRequest(put(folder, "well.csv", table()), site=SITE, **asked)


SURVEYS: dict[str, Callable[[Path], SurveyRequest]] = {
    "relay": relay,
    "magnetic": lambda folder: plain(
        folder, instrument="mwd-rev5.1", sigma=2.5, md=(5.5, 100.0), frame=TURNED, section_azimuth_deg=70.0
    ),
    "magnetic-4": lambda folder: plain(folder, instrument="mwd-rev4", frame=ONE_GRID),
    "gyro": lambda folder: plain(folder, instrument=str(DATA / "spe90408-model-4.toml"), azimuth_error_deg=None),
    "gyro-continuous": lambda folder: plain(folder, instrument="gyro-continuous"),
    "sensor": lambda folder: plain(folder, instrument="vectornav-100t"),
    "azimuth": lambda folder: plain(folder, azimuth_error_deg=1.25, sigma=3.0),
    "programme": programme,
    "place": lambda folder: SurveyRequest(
        put(folder, "well.csv", table()), instrument="mwd-rev5.1",
        site=SiteFigures(at="52.4,13.37,35", date="2026-11-27", grid_crs="EPSG:25833"),
        frame=FrameRequest("true", "grid", origin=(5_806_123.5, 389_000.25, 35.0)),
    ),
    **{f"lateral-{rule.value}": lambda folder, name=rule.value: lateral(folder, name) for rule in DisplacementRule},
    "from-collar": lambda folder: SurveyRequest(put(folder, "well.csv", table(WELL[2:])), from_collar=True),
    **{
        f"method-{method.value}": lambda folder, name=method.value: plain(folder, method=name)
        for method in Method if method is not Method.MINIMUM_CURVATURE
    },
}  # fmt: skip


def answered(folder: Path, name: str) -> SurveyAnswer:
    return answer_survey(SURVEYS[name](folder))


def told_survey(folder: Path, name: str) -> Iterator[str]:
    """Answer, instrument as a file, and the figure."""
    found = answered(folder, name)
    yield from masked(leaves(found.result), folder)
    yield from masked(drawing(draw_survey(found)), folder)


def masked(lines: Iterable[str], folder: Path) -> Iterator[str]:
    return (line.replace(str(folder), "FOLDER").replace(str(DATA), "DATA") for line in lines)


FILES = ("ags", "diggs", "dxf", "geojson", "ifc", "las", "witsml")


def told_file(folder: Path, form: str) -> Iterator[str]:
    """A survey as a file of another program, line by line; of a drawing what is in it, since it numbers its parts."""
    frame = FrameRequest("grid", "grid", convergence_deg=1.75, origin=(5_806_123.5, 389_000.25, 35.0))
    site = SiteFigures(9.8123, 49_230.0, 66.5, 3.25, 52.4, "52.4,13.37,35", "2026-11-27", "EPSG:25833")
    request = SurveyRequest(put(folder, "well.csv", table()), instrument="mwd-rev5.1", frame=frame, site=site)
    content = exported_bytes(site_of_survey(answer_survey(request), "Süd 1", DAY), form).decode()
    if form == "dxf":
        yield from drawn_parts(content)
    elif form == "geojson":
        yield from leaves(json.loads(content))
    else:
        yield from masked(content.replace(">", ">\n").replace("\r\n", "\n").splitlines(), folder)


def drawn_parts(content: str) -> Iterator[str]:
    import io

    import ezdxf

    drawing_ = ezdxf.read(io.StringIO(content))
    yield f"units {drawing_.units}"
    for layer in drawing_.layers:
        yield f"layer {layer.dxf.name} {layer.color}"
    for part in drawing_.modelspace():
        places = [tuple(vertex.dxf.location) for vertex in part.vertices] if part.dxftype() == "POLYLINE" else []
        text = part.dxf.text if part.dxftype() == "TEXT" else ""
        yield from leaves({"places": places}, f"{part.dxftype()} {part.dxf.layer} {text}")


def pair(folder: Path) -> tuple[Path, Path]:
    """Two wells that lean towards each other, of unequal stations."""
    one = [(10.0 * k, 0.6 * k, 20.0 + 3.0 * k) for k in range(7)]
    two = [(8.0 * k, 0.9 * k, 205.0 - 4.0 * k) for k in range(9)]
    return put(folder, "one.csv", table(one)), put(folder, "two.csv", table(two))


CLEARANCES: dict[str, dict[str, Any]] = {
    "apart": {"offset_head": (6.5, 1.25, 0.4), "radius_m": 0.3, "offset_radius_m": 0.45},
    "one-instrument": {
        "offset_head": (6.5, 1.25, 0.4), "instrument": "mwd-rev5.1", "same_instrument": True, "site": SITE, "k": 2.5,
        "sigma_ahead_m": 0.25, "margin_m": 0.1,
    },
    "two-instruments": {
        "offset_head": (-4.0, 3.0, 0.0), "instrument": "stim300", "offset_instrument": "mwd-rev5.1", "site": SITE,
        "curvature_sigma_deg_per_m": 0.3, "curvature_length_m": 4.0,
    },
}  # fmt: skip


def told_clearance(folder: Path, name: str) -> Iterator[str]:
    yield from masked(leaves(answer_clearance(ClearanceRequest(*pair(folder), **CLEARANCES[name]))), folder)


def told_sidetrack(folder: Path) -> Iterator[str]:
    """The second leaves the first at 30 m."""
    one = [(10.0 * k, 0.6 * k, 20.0 + 3.0 * k) for k in range(7)]
    two = [*one[:4], *((30.0 + 7.0 * k, 1.8 + 1.1 * k, 29.0 - 15.0 * k) for k in range(1, 5))]
    files = put(folder, "one.csv", table(one)), put(folder, "two.csv", table(two))
    yield from masked(leaves(answer_clearance(ClearanceRequest(*files, radius_m=0.1, from_m=30.0))), folder)


def told_reading(folder: Path, name: str) -> Iterator[str]:
    """What a reader makes of a file, and what it says of it."""
    (folder / name).write_bytes(FORMATS[name]())
    yield from masked(leaves(read_any(folder / name)), folder)


def told_designed(folder: Path) -> Iterator[str]:
    """A hole beside a bent design whose tolerance it leaves."""
    del folder
    design = ColumnDesign(
        "K7", (0.1, -0.2, 0.3), math.radians(4.0), math.radians(65.0), 12.0, 0.4, parse_tolerance("30 mm + 1:150")
    )
    md = np.array([0.0, 4.0, 8.0, 12.0])
    places = np.array([[0.1, -0.2, 0.3], [0.2, 0.1, 4.2], [0.45, 0.35, 8.1], [0.6, 0.9, 12.0]])
    root = np.array([[0.02, 0.0, 0.0], [0.01, 0.03, 0.0], [0.005, -0.004, 0.04]])
    covs = np.array([k * k * root @ root.T / 9.0 for k in range(4)])
    yield from drawing(survey_figure(md, places, covs, 0.9, "a hole $1", design))
    many = np.linspace(0.0, 60.0, 131)
    way = np.column_stack([0.01 * many**2, 0.002 * many**2, many])
    grown = many[:, None, None] ** 2 * root @ root.T
    yield from drawing(survey_figure(many, way, grown, 0.5, "many"))


def makers() -> dict[str, Callable[[Path], Iterable[str]]]:
    made: dict[str, Callable[[Path], Iterable[str]]] = {}
    for name in SURVEYS:
        made[f"survey-{name}"] = lambda folder, name=name: told_survey(folder, name)
    for name in FILES:
        made[f"file-{name}"] = lambda folder, name=name: told_file(folder, name)
    for name in CLEARANCES:
        made[f"clearance-{name}"] = lambda folder, name=name: told_clearance(folder, name)
    for name in FORMATS:
        made[f"read-{name}"] = lambda folder, name=name: told_reading(folder, name)
    return made | {"clearance-sidetrack": told_sidetrack, "figure-designed": told_designed}


MADE = makers()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", MADE)
def test_what_is_made_is_as_approved(tmp_path: Path, name: str) -> None:
    check(name, MADE[name](tmp_path))


def direction(inclination_deg: float, azimuth_deg: float) -> np.ndarray:
    i, a = math.radians(inclination_deg), math.radians(azimuth_deg)
    return np.array([math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i)])


def test_stations_are_the_integral_along_the_arcs(tmp_path: Path) -> None:
    """Tangents turn evenly from one station to the next; their integral by Simpson's rule is the place."""
    stations = answered(tmp_path, "azimuth").result["stations"]
    place = np.zeros(3)
    for k, ((md0, *a), (md1, *b)) in enumerate(itertools.pairwise(WELL), 1):
        t0, t1 = direction(*a), direction(*b)
        bend = math.acos(float(t0 @ t1))
        share = np.linspace(0.0, 1.0, 201)[:, None]
        along = (np.sin((1.0 - share) * bend) * t0 + np.sin(share * bend) * t1) / math.sin(bend)
        weights = np.array([1.0, *([4.0, 2.0] * 99), 4.0, 1.0]) / 600.0
        place = place + (md1 - md0) * (weights @ along)
        got = [stations[k][key] for key in ("north_m", "east_m", "tvd_m")]
        np.testing.assert_allclose(got, place, atol=1e-8)
        assert stations[k]["dogleg_severity_deg_per_30m"] == pytest.approx(math.degrees(bend) * 30.0 / (md1 - md0))
        assert stations[k]["closure_m"] == pytest.approx(math.hypot(*place[:2]))


def test_an_azimuth_error_that_is_shared_moves_a_hole_square_to_its_way(tmp_path: Path) -> None:
    """An error of 1.25 deg turns every place about the vertical through the collar; the answer has three sigma."""
    last = answered(tmp_path, "azimuth").result["stations"][-1]
    north, east, turn = last["north_m"], last["east_m"], math.radians(1.25)
    assert last["uncertainty"]["north_m"] == pytest.approx(3.0 * turn * abs(east), rel=0.02)
    assert last["uncertainty"]["east_m"] == pytest.approx(3.0 * turn * abs(north), rel=0.02)


def test_a_frame_turns_azimuths_and_shifts_depths(tmp_path: Path) -> None:
    """From magnetic to true north 3.25 deg, from the table to the collar 3.5 m."""
    rows = answered(tmp_path, "magnetic").result["stations"]
    for row, (md, inclination, azimuth) in zip(rows[1:], WELL[-len(rows) + 1 :], strict=True):
        assert row["inclination_deg"] == pytest.approx(inclination)
        assert (row["azimuth_deg"] - azimuth - 3.25 + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-9)
        assert row["md_m"] == pytest.approx(md - 3.5)


def test_half_an_ellipse_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"plot: expected \(n,\), \(n, 3\) and \(n, 3, 3\) with n >= 2"):
        survey_figure(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3, 3)), 0.9, "one")


if __name__ == "__main__":
    write_anew(MADE)
