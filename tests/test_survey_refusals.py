"""Surveys and walls that contradict themselves, through the command; and the frame that every output names."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from forked_commands import run

OK = "MD (m),Inc,Azi\n0,0,0\n500,30,40\n600,31,41\n"
CLOSE = (  # the same hole, a station every 20 m
    "MD (m),Inc,Azi\n0,0,0\n"
    + "".join(f"{md},{0.06 * md},40\n" for md in range(20, 501, 20))
    + "".join(f"{md},{0.01 * (md - 500) + 30},{0.01 * (md - 500) + 40}\n" for md in range(520, 601, 20))
)
DEEP = "MD (m),Inc,Azi\n500,30,40\n600,31,41\n"
TIE = "md_m = 500\ninclination_deg = 33\nazimuth_deg = 40\nnorth_m = 90\neast_m = 75\ntvd_m = 470\n"
GAP = '[[leg]]\nfrom_m = 0\nto_m = 400\ninstrument = "gyro-continuous"\n[[leg]]\nfrom_m = 550\ninstrument = "relay"\n'
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
        (OK, "--answer-depth-reference", "ground-level", "asked from the ground-level; expected the height"),
        (OK, "--depth-reference-height-m", "5", "given from the collar, so its height is 0; got 5 m"),
        (OK, "--grid-scale-factor", "0", "grid scale factor: expected metres of the grid a metre on the ground"),
        (OK, "--instrument", ROLL, "formula 'Sin(Roll)': unknown name Roll; expected one of MD, MDPrev, TVD, Inc,"),
    ],
)
def test_a_survey_that_contradicts_itself_is_refused_in_one_line(
    tmp_path: Path, record: str, option: str, other: str, named: str
) -> None:
    (tmp_path / "s.csv").write_text(record)
    (tmp_path / "other.toml").write_text(other)
    word = other if "depth-reference" in option or "scale" in option else tmp_path / "other.toml"
    done = run("survey", tmp_path / "s.csv", *([option, word] if option else []))
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
        (HEADS, STRAIGHT, 'answer_depth_reference = "ground-level"', "column A: depth reference: depths are read from"),
        (HEADS, STRAIGHT, "depth_reference_height_m = 1.2", "column A: depth reference: depths are read and given"),
        (HEADS, STRAIGHT, 'tolerance = "0 mm"', "tolerance, by its name"),
        (HEADS.replace("C,", "a,"), STRAIGHT, "", "line 4: column a stands in line 2 already as A; expected names"),
        (
            "column,north_m,east_m\nA,0,0\n",
            STRAIGHT[:25],
            "",
            "expected at least two columns next to each other, got 1",
        ),
        ("column,north_m,east_m,down_m\nA,0,0,\nB,0,0.7,3\nC,0,1.4,\n", STRAIGHT, "", "B begins at 3 m: it opens at"),
        ("column,north_m,east_m\n", STRAIGHT, "", "expected at least two columns next to each other, got none"),
        (HEADS.replace("1.4", "0"), STRAIGHT, "", "columns A and C are one by their design; expected them apart"),
        (
            HEADS,
            STRAIGHT,
            "depth_step_m = 5",
            "depth_step_m: expected at most 2, got 5",
        ),  # what bulges between is unseen
        (HEADS, STRAIGHT, "depth_step_m = 1e-5", "expected at most 100000 planes across the columns, got them 1e-05 m"),
        (
            "column,north_m,east_m,down_m\nA,0,0,\nB,0,0.7,1e9\n",
            STRAIGHT[:50],
            "",
            "down_m: expected a depth or a length of -100000..100000 m, got 1e+09",
        ),
        (
            "column,north_m,east_m,inclination_deg\nA,0,0,181\n",
            STRAIGHT,
            "",
            "column A: inclination_deg: expected an",
        ),
        (HEADS, STRAIGHT, "tight_to_m = 12", "column A ends at 10 m; expected a toe at 12 m"),
        (HEADS, STRAIGHT, "grid_scale_factor = 0", "grid_scale_factor: expected a positive number, got 0"),
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
@pytest.mark.parametrize(
    ("other", "words", "named"),
    [
        ("MD (m),Inc,Azi\n0,0,0\n30,1,0\n30,1,0\n", (), "line 4: expected a measured depth beyond 30 m, got 30 m"),
        (OK, (), "the reference hole runs in the offset hole all along; expected two holes"),
        (OK, ("--offset-radius-m", -1), "-1"),
        (OK, ("--offset-head", 0, "nan", 0), "--offset-head: expected a finite number, got nan"),
        (OK, ("--offset-head", 0, 30, 0, "--dip-deg", "inf"), "--dip-deg: expected a finite number, got inf"),
        (DEEP, (), "begins at 500 m, so nothing says where that is; expected the collar at 0 m first, or --from-m"),
    ],
)
def test_holes_that_have_no_clearance_are_refused_in_one_line(
    tmp_path: Path, other: str, words: tuple[object, ...], named: str
) -> None:
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text(OK)
    two.write_text(other)
    done = run("clearance", one, two, *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert named in done.stderr
    assert words or len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("record", "words", "clear"),
    [
        (CLOSE, (), True),
        (OK, (), False),  # over 500 m without a station a path may leave its arc by more than the 30 m between them
        (OK, ("--curvature-sigma-deg-per-m", 0), True),  # unless it does what the arc does
    ],
)
def test_parallel_holes_keep_clear_all_along_where_stations_tell_their_paths(
    tmp_path: Path, record: str, words: tuple[object, ...], clear: bool
) -> None:
    one = tmp_path / "one.csv"
    one.write_text(record)
    done = run("clearance", one, one, "--offset-head", 0, 30, 0, "--same-instrument", *words, "--json")
    found = json.loads(done.stdout)
    assert (done.returncode, done.stderr, found["clear"]) == (0 if clear else 3, "", clear)
    assert found["nearest"]["distance_m"] == pytest.approx(min(row["distance_m"] for row in found["stations"]), abs=0.5)


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
    grid = wall(tmp_path, square, stations, 'layout = "grid"\nspacing_m = 0.88\ndepth_step_m = 2\n')
    rows = json.loads(run("wall", grid, "--json").stdout)["void_probability"]
    assert [row["depth_m"] for row in rows] == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
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
    people = " ".join(run(*words, *heights).stdout.split())  # a title may take two lines
    assert "grid north, depth from rotary-table, height above DHHN2016" in people
    refused = run(*words, "--height-datum", "DHHN2016")
    assert (refused.returncode, "expected --origin beside it" in refused.stderr) == (2, True)


@pytest.mark.slow
def test_depths_from_the_rotary_table_are_brought_to_the_ground(tmp_path: Path) -> None:
    record, ground = tmp_path / "s.csv", tmp_path / "g.csv"
    record.write_text("MD (m),Inc,Azi\n0,0,0\n6.5,0,0\n100,2,40\n200,5,41\n")
    ground.write_text("MD (m),Inc,Azi\n6.5,0,0\n100,2,40\n200,5,41\n")
    references = ("--depth-reference", "rotary-table", "--answer-depth-reference", "ground-level")
    moved = (*references, "--depth-reference-height-m", 6.5, "--md", 50, "--json")
    whole, brought, begun = (
        json.loads(run("survey", *words).stdout)
        for words in ((record, "--md", 56.5, "--json"), (record, *moved), (ground, *moved))
    )
    for read, answered in zip(whole["stations"], brought["stations"], strict=True):
        assert answered["md_m"] == pytest.approx(read["md_m"] - 6.5)
        assert answered["tvd_m"] == pytest.approx(read["tvd_m"] - 6.5)
        assert answered["north_m"] == read["north_m"]
        assert answered["uncertainty"] == read["uncertainty"]
    assert brought["at"][0]["tvd_m"] == pytest.approx(whole["at"][0]["tvd_m"] - 6.5)
    assert brought["at"][0]["uncertainty"] == whole["at"][0]["uncertainty"]
    assert brought["depth_reference"] == "ground-level"
    assert brought["read_from"] == {"depth_reference": "rotary-table", "height_m": 6.5}
    assert begun["stations"][0]["md_m"] == begun["stations"][0]["tvd_m"] == 0.0
    for one, other in zip(begun["stations"], brought["stations"][1:], strict=True):
        assert [one[key] for key in ("md_m", "north_m", "tvd_m")] == pytest.approx(
            [other[key] for key in ("md_m", "north_m", "tvd_m")]
        )


@pytest.mark.slow
def test_columns_read_from_a_rotary_table_are_judged_from_their_heads(tmp_path: Path) -> None:
    def judged(heads: str, stations: str, more: str) -> dict[str, Any]:
        return json.loads(run("wall", wall(tmp_path, heads, stations, more), "--json").stdout)

    straight = judged(HEADS, STRAIGHT, "")
    references = 'depth_reference = "rotary-table"\nanswer_depth_reference = "ground-level"\n'
    read = "".join(f"{name},{md},0,0\n" for name in "AB" for md in (0, 6.2, 11.2))
    own = HEADS.replace("m\n", "m,depth_reference_height_m\n").replace("0\n", "0,\n").replace("7\n", "7,\n")
    lifted = judged(
        own.replace("1.4\n", "1.4,2\n"),
        read + "C,2,0,0\nC,7,0,0\nC,12,0,0\n",
        references + "depth_reference_height_m = 1.2",
    )
    assert (straight["verdict"], lifted["verdict"]) == ("tight", "tight")
    assert lifted["joints"] == straight["joints"]
    assert lifted["columns"] == straight["columns"]
    short = judged(HEADS, STRAIGHT, references + "depth_reference_height_m = 1.2")  # 10 m of string reach 8.8 m
    assert short["verdict"] == "not tight"
    assert {row["surveyed_to_m"] for row in short["columns"]} == {8.8}
