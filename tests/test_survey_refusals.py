"""Surveys and walls that contradict themselves, through the command; and the frame that every output names."""

import csv
import json
from pathlib import Path

import pytest
from forked_commands import run

OK = "MD (m),Inc,Azi\n0,0,0\n500,30,40\n600,31,41\n"
DEEP = "MD (m),Inc,Azi\n500,30,40\n600,31,41\n"
TIE = "md_m = 500\ninclination_deg = 33\nazimuth_deg = 40\nnorth_m = 90\neast_m = 75\ntvd_m = 470\n"
GAP = '[[leg]]\nfrom_m = 0\nto_m = 400\ninstrument = "mwd-rev5.1"\n[[leg]]\nfrom_m = 550\ninstrument = "relay"\n'
ROLL = (
    '[tool]\nname = "t"\ntitle = "t"\n'
    '[[term]]\nname = "A"\nvalue = 1.0\nunit = "deg"\nmode = "systematic"\nazimuth = "Sin(Roll)"\n'
)
HEADS = "column,north_m,east_m\nA,0,0\nB,0,0.7\nC,0,1.4\n"
STRAIGHT = "".join(f"{name},{md},0,0\n" for name in "ABC" for md in (0, 5, 10))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("record", "option", "other", "named"),
    [
        ("MD (m),Inc,Azi\nft,deg,deg\n0,0,0\n100,1,20\n", "", "", "line 2: ft under a header in m; expected one unit"),
        ("MD,Inc,Azi\n0 m,0,0\n100 ft,1,20\n", "", "", "line 2: MD = '0 m' has a unit of its own"),
        (DEEP, "--tie-on", TIE, "33 and 40 deg at 500 m contradict the first station, 30 and 40 deg"),
        (OK, "--programme", GAP, "the station at 500 m lies in no leg; expected legs without a gap"),
        (OK, "--instrument", ROLL, "formula 'Sin(Roll)': unknown name Roll; expected one of MD, MDPrev, TVD, Inc,"),
    ],
)
def test_a_survey_that_contradicts_itself_is_refused_in_one_line(
    tmp_path: Path, record: str, option: str, other: str, named: str
) -> None:
    (tmp_path / "s.csv").write_text(record)
    (tmp_path / "other.toml").write_text(other)
    done = run("survey", tmp_path / "s.csv", *([option, tmp_path / "other.toml"] if option else []))
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.strip().splitlines()) == 1
    assert named in done.stderr


def wall(folder: Path, heads: str, stations: str, more: str = "") -> Path:
    (folder / "heads.csv").write_text(heads)
    (folder / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + stations)
    path = folder / "wall.toml"
    path.write_text(
        'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 10\nheads = "heads.csv"\nstations = "stations.csv"\n' + more
    )
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("heads", "stations", "more", "named"),
    [
        (HEADS + "A,0,2.1\n", STRAIGHT, "", "line 5: column A stands in line 2 already"),
        (HEADS.replace("0.7", "1.6").replace("1.4", "3.2"), STRAIGHT, "", "the design cannot be met anywhere"),
        (HEADS, STRAIGHT, 'tolerance = "0 mm"', "tolerance, by its name"),
        ("column,north_m,east_m,radius_m\nA,0,0,-1\nB,0,0.7,\n", STRAIGHT, "", "column A: radius_m: expected a number"),
    ],
)
def test_a_wall_that_cannot_be_is_refused_in_one_line(
    tmp_path: Path, heads: str, stations: str, more: str, named: str
) -> None:
    done = run("wall", wall(tmp_path, heads, stations, more))
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.strip().splitlines()) == 1
    assert named in done.stderr


@pytest.mark.slow
def test_columns_that_cross_are_named_with_status_three(tmp_path: Path) -> None:
    lean = "A,0,0,0\nA,5,12,90\nA,10,12,90\nB,0,0,0\nB,5,12,270\nB,10,12,270\nC,0,0,0\nC,10,0,0\n"
    done = run("wall", wall(tmp_path, HEADS, lean), "--json")
    found = json.loads(done.stdout)
    assert (done.returncode, found["verdict"]) == (3, "not tight")
    crossing = [finding for finding in found["findings"] if finding["kind"] == "crossing"]
    assert [finding["what"] for finding in crossing] == ["A-B"]
    assert "have changed sides at" in crossing[0]["text"]


@pytest.mark.slow
def test_a_ring_says_how_it_closed_and_a_grid_how_likely_a_void_is(tmp_path: Path) -> None:
    days = "column,north_m,east_m,drilled_on\nA,0,0,2026-11-18\nB,0,0.7,2026-11-20\nC,0,1.4,2026-11-19\n"
    path = wall(tmp_path, days, STRAIGHT, 'depth_reference = "ground-level"\nheight_datum = "DHHN2016"\n')
    found = json.loads(run("wall", path, "--json").stdout)
    assert [(row["day"], row["open_joints"]) for row in found["closing"]] == [
        ("2026-11-18", 2),
        ("2026-11-19", 2),
        ("2026-11-20", 0),
    ]
    assert found["closing"][-1]["closed_percent"] == 100.0
    assert found["void_probability"] == []
    assert [found[key] for key in ("north", "depth_reference", "height_datum")] == ["site", "ground-level", "DHHN2016"]
    assert "2026-11-20: 100.0 % closed, 0 joints open, widest 0.700 m" in run("wall", path).stdout
    square = "column,north_m,east_m\nA,0,0\nB,0,0.88\nC,0.88,0\nD,0.88,0.88\n"
    stations = STRAIGHT + "D,0,0,0\nD,10,0,0\n"
    grid = wall(tmp_path, square, stations, 'layout = "grid"\nspacing_m = 0.88\ndepth_step_m = 5\n')
    rows = json.loads(run("wall", grid, "--json").stdout)["void_probability"]
    assert [row["depth_m"] for row in rows] == [0.0, 5.0, 10.0]
    assert all(row["probability"] > 0.9 for row in rows)
    assert rows[0]["area_m2"] > 0.0
    assert rows[0]["place_m"] == pytest.approx([0.44, 0.44])


@pytest.mark.slow
def test_every_output_names_its_north_and_what_depths_count_from(tmp_path: Path) -> None:
    record, table, sources, plot = (tmp_path / name for name in ("s.csv", "t.csv", "b.csv", "p.svg"))
    record.write_text(OK)
    words = ("survey", record, "--depth-reference", "rotary-table", "--north", "grid")
    heights = ("--origin", 100, 200, 35, "--height-datum", "DHHN2016")
    found = json.loads(run(*words, *heights, "--out", table, "--by-source", sources, "--plot", plot, "--json").stdout)
    named = {"north": "grid", "depth_reference": "rotary-table", "height_datum": "DHHN2016"}
    assert {key: found[key] for key in named} == named
    for path in (table, sources):
        with path.open() as file:
            assert all({key: row[key] for key in named} == named for row in csv.DictReader(file))
    people = run(*words, *heights).stdout
    assert "grid north, depth from rotary-table, height above DHHN2016" in people
    refused = run(*words, "--height-datum", "DHHN2016")
    assert (refused.returncode, "expected --origin beside it" in refused.stderr) == (2, True)
