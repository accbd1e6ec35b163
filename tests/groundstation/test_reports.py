"""Reports of columns and walls: what they say, from which inputs, and that the same records give the same bytes."""

import hashlib
import json
import math
from datetime import date
from pathlib import Path

import pytest
from forked_commands import run

from groundstation.report.column_report import ColumnRecord, column_report
from groundstation.report.document import Document, Origin, ReportSection, report_pages, report_pdf
from groundstation.report.wall_report import column_records, site_of, wall_report
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import Judgement

DAY = date(2026, 11, 20)
WALL = """name = "North pit wall"
radius_m = 0.6
thickness_m = 0.6
spacing_m = 0.9
head_sigma_m = 0.01
tolerance = "50 mm + 1:100"
heads = "heads.csv"
stations = "stations.csv"
length_m = 24
serial = "R-17"
calibration = "R-17/2026-031"
project = "Station square, lot 3"
client = "City railways"
north = "grid"
northing_m = 5807120.5
easting_m = 372045.25
height_m = 31.4
"""
ENDS = {"P06": 18, "P10": 12, "P15": 0}  # short, not surveyed below, not drilled
LEANING = "P03"


def write_wall(folder: Path) -> Path:
    heads, stations = ["column,north_m,east_m,state,calibration"], ["column,md_m,inclination_deg,azimuth_deg"]
    for k in range(20):
        name = f"P{k + 1:02d}"
        state = {"P10": "drilled", "P15": "not-drilled"}.get(name, "")
        heads.append(f"{name},0,{0.9 * k:.2f},{state},{'R-17/2026-040' if name == 'P20' else ''}")
        lean = 0.75 if name == LEANING else 0.03
        if name not in ENDS or ENDS[name]:
            depths = range(0, ENDS.get(name, 24) + 1, 2)
            stations += [f"{name},{md},{0.0 if md == 0 else lean:g},{95 + 3 * k}" for md in depths]
    (folder / "heads.csv").write_text("\n".join(heads) + "\n")
    (folder / "stations.csv").write_text("\n".join(stations) + "\n")
    (folder / "wall.toml").write_text(WALL)
    return folder / "wall.toml"


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Wall, Judgement]:
    wall = read_wall(write_wall(tmp_path_factory.mktemp("wall")))
    return wall, judge_wall(wall)


def origin_of(wall: Wall) -> Origin:
    return Origin(DAY, "1.2.3", [("SHA-256 of wall.toml", hashlib.sha256(wall.file.path.read_bytes()).hexdigest())])


def section(document: Document, title: str) -> ReportSection:
    return next(s for s in document.sections if s.title.startswith(title))


@pytest.mark.slow
def test_the_report_of_a_wall_says_what_is_wrong_and_what_to_do(judged: tuple[Wall, Judgement]) -> None:
    wall, judgement = judged
    document = wall_report(wall, judgement, origin_of(wall))
    assert (document.verdict, document.good) == ("The wall is NOT TIGHT", False)
    reasons = " ".join(section(document, "Reasons").words)
    for named in (
        "P06 is missing from 18.5",
        "P10 is not surveyed from 12.5",
        "P15 is missing from 0",
        "Joint P02-P03 ",
    ):
        assert named in reasons
    done = section(document, "What is to be done").words
    # one column stands for both joints of the one that is missing, in the site's coordinates
    assert (
        "A column at north 0.000 m, east 12.600 m (N 5807120.500 m, E 372057.850 m) "
        "from 0 to 24 m closes joints P14-P15 and P15-P16." in done
    )
    columns = section(document, "Columns")
    assert [columns.rows[k][0] for k in columns.marked] == ["P03", "P06", "P10", "P15"]
    leaning = columns.rows[2]
    # 24 m less half the first leg, which begins vertical, at 0.75 deg
    assert float(leaning[5]) == pytest.approx(1e3 * 23.0 * math.sin(math.radians(0.75)), abs=0.2)
    assert leaning[7:] == ("290.0", "104%", "24")
    instruments = section(document, "Instruments").rows
    assert ("relay", "R-17", "R-17/2026-040", "P20") in instruments
    assert ("relay", "R-17", "R-17/2026-031", "P01 to P14, P16 to P19") in instruments  # P15 was not surveyed
    facts = dict(document.facts)
    assert facts["Azimuths and coordinates"] == "grid north"
    assert facts["Tolerance"] == "50 mm + 1:100: 50 mm at the head and 1 % of the length"
    assert facts["To be tight"] == "0 to 24 m"
    assert facts["Site coordinates"].startswith("N 5807120.500 m, E 372045.250 m, height 31.400 m")


def record(judged: tuple[Wall, Judgement], name: str) -> ColumnRecord:
    return next(r for r in column_records(*judged) if r.design.name == name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("P01", "Column P01 is within tolerance: "),
        ("P03", "Column P03 is out of tolerance: 104% of it at 24 m"),
        ("P06", "Column P06 is within tolerance to 18 m; design length 24 m (surveyed to 18 m)"),
        ("P10", "Column P10 is within tolerance to 12 m; design length 24 m (surveyed to 12 m, drilled to 24 m)"),
        ("P15", "Column P15: not drilled"),
    ],
)
def test_a_column_is_called_good_only_where_it_is_known_to_its_toe(
    judged: tuple[Wall, Judgement], name: str, verdict: str
) -> None:
    document = column_report(record(judged, name), site_of(judged[0]), origin_of(judged[0]))
    assert document.verdict.startswith(verdict)
    assert document.good == (name == "P01")


def test_the_report_of_a_grid_tells_its_voids_and_how_it_closed(tmp_path: Path) -> None:
    """Columns of 0.6 m in a square of 0.9 m leave a hole of 3.6 cm in its middle, wherever they are drilled true."""
    heads, stations = ["column,north_m,east_m,drilled_on"], ["column,md_m,inclination_deg,azimuth_deg"]
    for day, (name, north, east) in enumerate((("A", 0.0, 0.0), ("B", 0.0, 0.9), ("C", 0.9, 0.0), ("D", 0.9, 0.9)), 16):
        heads.append(f"{name},{north},{east},2026-11-{day}")
        stations += [f"{name},{md},0,0" for md in (0, 2, 4)]
    (tmp_path / "heads.csv").write_text("\n".join(heads) + "\n")
    (tmp_path / "stations.csv").write_text("\n".join(stations) + "\n")
    (tmp_path / "wall.toml").write_text(
        'radius_m = 0.6\nthickness_m = 0.5\nspacing_m = 0.9\nlength_m = 4\ndepth_step_m = 2\nlayout = "grid"\n'
        'heads = "heads.csv"\nstations = "stations.csv"\n'
    )
    wall = read_wall(tmp_path / "wall.toml")
    document = wall_report(wall, judge_wall(wall), origin_of(wall))
    voids = section(document, "Voids between the columns")
    assert [row[0] for row in voids.rows] == ["0", "2", "4"]
    assert len(voids.marked) == 3
    assert all(float(row[1]) > 0.0 and float(row[2]) > 0.5 for row in voids.rows)
    closed = section(document, "How it closed")
    assert [row[:2] for row in closed.rows] == [(f"2026-11-{16 + k}", name) for k, name in enumerate("ABCD")]
    assert [row[4] for row in closed.rows] == ["–", "0.900", "0.900", "0.900"]
    shares = [float(row[2]) for row in closed.rows]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], closed.rows[-1][3]) == (0.0, 100.0, "0")


def test_the_report_of_a_column_gives_every_station_in_site_coordinates(judged: tuple[Wall, Judgement]) -> None:
    document = column_report(record(judged, LEANING), site_of(judged[0]), origin_of(judged[0]))
    built = section(document, "As built")
    assert len(built.rows) == 13
    assert built.columns[3:6] == ("N m", "E m", "height m")
    assert built.rows[0][3:6] == ("5807120.500", "372047.050", "31.400")
    assert built.marked == [11, 12]
    assert float(built.rows[-1][4]) > 372047.34
    assert dict(section(document, "Instrument").facts)["Calibration"] == "R-17/2026-031"
    assert "A column at" in " ".join(section(document, "What is to be done").words)


@pytest.mark.slow
def test_the_same_records_give_the_same_bytes_on_as_many_pages(judged: tuple[Wall, Judgement]) -> None:
    wall, judgement = judged
    whole = wall_report(wall, judgement, origin_of(wall))
    one, again = report_pdf(whole), report_pdf(wall_report(wall, judgement, origin_of(wall)))
    assert one.startswith(b"%PDF-")
    assert one == again
    assert len(report_pages(whole, 20.0)) == 3
    missing = column_report(record(judged, "P15"), site_of(wall), origin_of(wall))
    assert len(report_pages(missing, 20.0)) == 1


def test_names_that_look_like_markup_are_set_as_they_are() -> None:
    nasty = '#panic(1) *a* $x$ @ref <b> \\ "'
    document = Document(
        "k", nasty, nasty, nasty, True, [(nasty, nasty)], [ReportSection(nasty, [nasty])], Origin(DAY, "1", [])
    )
    assert report_pdf(document).startswith(b"%PDF-")


@pytest.mark.slow
def test_the_command_writes_both_reports(tmp_path: Path) -> None:
    wall = write_wall(tmp_path)
    words = ("wall", wall, "--date", "2026-11-20", "--json", "--report")
    done = run(*words, tmp_path / "wall.pdf")
    assert done.returncode == 3, done.stderr
    assert json.loads(done.stdout)["verdict"] == "not tight"
    assert (tmp_path / "wall.pdf").read_bytes().startswith(b"%PDF-")
    assert run(*words, tmp_path / "P03.pdf", "--column", "P03").returncode == 3
    assert (tmp_path / "P03.pdf").stat().st_size > 10_000
    unknown = run(*words, tmp_path / "no.pdf", "--column", "P99")
    assert unknown.returncode == 2
    assert "--column: expected one of P01, " in unknown.stderr
    assert not (tmp_path / "no.pdf").exists()


def test_an_origin_that_is_not_whole_is_refused(tmp_path: Path) -> None:
    path = write_wall(tmp_path)
    path.write_text(WALL.replace("height_m = 31.4\n", ""))
    done = run("wall", path)
    assert done.returncode == 2
    assert "expected northing_m, easting_m, height_m together, got northing_m, easting_m" in done.stderr
