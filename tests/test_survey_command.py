"""``borechain survey`` and ``borechain wall`` as their user meets them."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from forked_commands import run

ROOT = Path(__file__).parents[1]
POTSDAM = ROOT / "scenarios" / "wellbore-1-path.csv"
WALL = ROOT / "scenarios" / "walls" / "wall-40.toml"
SITE = ("--field-nt", 50_000, "--dip-deg", 70, "--declination-deg", 0)


def answer(*words: object, status: int = 0) -> dict:
    done = run(*words, "--json")
    assert done.returncode == status, done.stderr
    assert len(done.stdout.splitlines()) == 1
    return json.loads(done.stdout)


def refused(*words: object) -> str:
    done = run(*words)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    return done.stderr


def test_the_published_record_comes_out_as_printed() -> None:
    found = answer("survey", POTSDAM, "--displacement-rule", "thesis")["stations"]
    printed = [
        (0.08, 248.20), (0.32, 243.43), (0.61, 249.44), (0.89, 255.96), (1.32, 257.47),
        (1.72, 253.07), (2.35, 250.46), (2.78, 252.03), (3.00, 257.62), (3.41, 260.34),
    ]  # fmt: skip
    assert len(found) == 11
    for row, (inclination, azimuth) in zip(found[1:], printed, strict=True):
        assert row["inclination_deg"] == pytest.approx(inclination, abs=0.00501)
        assert row["azimuth_deg"] == pytest.approx(azimuth, abs=0.00501)
        assert set(row["uncertainty"]) >= {"north_m", "east_m", "tvd_m", "covariance_m2"}


def test_sigma_scales_the_region_and_leaves_the_covariance() -> None:
    one, two = (answer("survey", POTSDAM, "--sigma", s)["stations"][-1]["uncertainty"] for s in (1, 2))
    assert two["north_m"] == pytest.approx(2.0 * one["north_m"])
    assert two["covariance_m2"] == one["covariance_m2"]


def test_a_held_azimuth_replaces_the_gyro(tmp_path: Path) -> None:
    raw = answer("survey", POTSDAM, "--instrument", "vectornav-100t")
    held = answer("survey", POTSDAM, "--instrument", "vectornav-100t", "--azimuth-error-deg", "0.25")
    assert {row["source"] for row in raw["sources"]} - {row["source"] for row in held["sources"]} == {"GD", "GRW"}
    assert held["stations"][-1]["uncertainty"]["major_m"] < raw["stations"][-1]["uncertainty"]["major_m"]


@pytest.mark.slow
def test_files_of_a_survey_land_whole(tmp_path: Path) -> None:
    table, plot, tool = tmp_path / "a" / "t.csv", tmp_path / "p.svg", tmp_path / "tool.json"
    answer(
        "survey", POTSDAM, "--instrument", "mwd-rev5.1", *SITE, "--out", table, "--plot", plot, "--export-tool", tool
    )
    assert len(table.read_text().splitlines()) == 12
    assert plot.read_text().startswith("<?xml")
    again = answer("survey", POTSDAM, "--instrument", tool, *SITE)
    first = answer("survey", POTSDAM, "--instrument", "mwd-rev5.1", *SITE)
    one, two = (f["stations"][-1]["uncertainty"]["covariance_m2"] for f in (first, again))
    np.testing.assert_allclose(two, one, rtol=1e-9, atol=1e-15)
    assert not list(tmp_path.rglob("*.new"))


def test_depths_between_stations_and_a_collar_that_is_left_out(tmp_path: Path) -> None:
    record = tmp_path / "s.csv"
    record.write_text("md_m,inclination_deg,azimuth_deg\n2,0,0\n4,0,0\n")
    found = answer("survey", record, "--from-collar", "--md", "3")
    assert [row["md_m"] for row in found["stations"]] == [0.0, 2.0, 4.0]
    assert found["at"][0]["tvd_m"] == pytest.approx(3.0)


DEEP = "md_m,inclination_deg,azimuth_deg\n500,30,40\n530,32,44\n560,35,50\n"


def test_a_tool_of_the_owsg_set_and_its_sources_at_every_station(tmp_path: Path) -> None:
    file = tmp_path / "sources.csv"
    well = ROOT / "tests" / "data" / "survey" / "iscwsa_well_3.csv"
    words = (well, "--method", "minimum-curvature", "--instrument", "CB_Film_GSS", "--latitude-deg", -40)
    assert "unknown name GZRunningSpeed" in refused("survey", *words)
    assert "expected NAME=VALUE with a number, got 'GZ'" in refused("survey", *words, "--parameter", "GZ")
    shallow = tmp_path / "shallow.csv"
    shallow.write_text("".join(line + "\n" for line in well.read_text().splitlines()[:60]))
    found = answer(
        "survey", shallow, *words[1:], "--parameter", "GZRunningSpeed=1800", "--by-source", file, "--sigma", 2
    )
    rows = [line.split(",") for line in file.read_text().splitlines()]
    assert rows[0][:4] == ["md_m", "source", "nn_m2", "ee_m2"]
    last = found["stations"][-1]
    total = sum(float(row[2]) for row in rows[1:] if float(row[0]) == last["md_m"])
    assert total == pytest.approx(last["uncertainty"]["covariance_m2"][0][0])
    hla = np.array(last["uncertainty"]["covariance_hla_m2"])
    assert np.trace(hla) == pytest.approx(np.trace(last["uncertainty"]["covariance_m2"]))
    # due north at 50 deg: lateral is east, highside and along share north and down
    assert hla[1, 1] == pytest.approx(last["uncertainty"]["covariance_m2"][1][1])
    assert last["uncertainty"]["lateral_m"] == pytest.approx(2.0 * np.sqrt(hla[1, 1]))
    assert "MWD+IFR1+SAG+MS" in run("survey", "--tools").stdout


def test_two_holes_that_come_near_end_with_status_three(tmp_path: Path) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    head = "MD (m),Inc,Azi\n0,0,0\n"
    one.write_text(head + "".join(f"{md},{min(2 * md / 15, 2)},90\n" for md in range(5, 31, 5)))
    other.write_text(head + "".join(f"{md},0,0\n" for md in range(5, 31, 5)))
    words = ("clearance", one, other, "--offset-head", 0, 1.4, 0, "--radius-m", 0.1, "--offset-radius-m", 0.1)
    bare = ("--sigma-ahead-m", 0.02, "--margin-m", 0.0)
    far = answer(*words, *bare)
    near = answer(*words, status=3)
    assert (far["clear"], near["clear"]) == (True, False)
    assert near["least"]["md_m"] == 30.0
    assert near["least"]["distance_m"] == pytest.approx(0.616, abs=0.01)
    assert "TOO NEAR: least factor" in run(*words).stdout
    # the same holes with stations 15 m apart: the arcs keep as far, but what the paths do between them is not known
    one.write_text(head + "15,2,90\n30,2,90\n")
    other.write_text(head + "15,0,0\n30,0,0\n")
    sparse, arcs = answer(*words, *bare, status=3), answer(*words, *bare, "--curvature-sigma-deg-per-m", 0)
    assert (sparse["clear"], arcs["clear"]) == (False, True)
    assert sparse["least"]["distance_m"] == pytest.approx(far["least"]["distance_m"], abs=1e-3)


@pytest.mark.parametrize("course", [30, 100])
def test_two_holes_that_cross_between_stations_end_with_status_three(tmp_path: Path, course: int) -> None:
    one, other = tmp_path / "one.csv", tmp_path / "other.csv"
    mds = [course * k for k in range(5)]
    one.write_text("MD (m),Inc,Azi\n" + "".join(f"{md},0,0\n" for md in mds))
    other.write_text("MD (m),Inc,Azi\n" + "".join(f"{md},90,270\n" for md in mds))
    head = (
        "--offset-head",
        0,
        2.4 * course,
        1.6 * course,
    )  # 2.4 courses east, 1.6 down: it runs back through the first
    words = ("clearance", one, other, *head, "--radius-m", 0.1, "--offset-radius-m", 0.1)
    found = answer(*words, status=3)
    assert min(row["distance_m"] for row in found["stations"]) > 0.3 * course
    for place in (found["least"], found["nearest"]):
        expected = (1.6 * course, 2.4 * course, 0.0)
        assert (place["md_m"], place["offset_md_m"], place["distance_m"]) == pytest.approx(expected, abs=1e-6)
    assert f"0.00 m apart at {1.6 * course:.2f} m, {2.4 * course:.2f} m of the other hole" in run(*words).stdout


def test_a_sidetrack_is_compared_from_where_it_leaves_its_hole(tmp_path: Path) -> None:
    one, other, whole = (tmp_path / name for name in ("one.csv", "other.csv", "whole.csv"))
    one.write_text("MD (m),Inc,Azi\n0,0,0\n30,5,0\n60,10,0\n90,10,0\n120,10,0\n")
    other.write_text("MD (m),Inc,Azi\n60,10,0\n90,20,90\n120,40,90\n")
    whole.write_text("MD (m),Inc,Azi\n0,0,0\n30,5,0\n60,10,0\n90,20,90\n120,40,90\n")
    words = ("--instrument", "mwd-rev4", "--from-m", 60, *SITE)
    begins, cut = (answer("clearance", one, path, *words, status=3) for path in (other, whole))
    assert begins["from_m"] == 60.0
    assert [row["md_m"] for row in begins["stations"]] == [60.0, 90.0, 120.0]
    assert begins["stations"][0]["distance_m"] == pytest.approx(0.0, abs=1e-9)
    assert begins["stations"][0]["sigma_m"] == 0.0  # what erred above, both have alike
    for a, b in zip(begins["stations"], cut["stations"], strict=True):
        assert a == pytest.approx(b, abs=1e-9)
    assert "begins at 60 m, so nothing says where that is" in refused("clearance", one, other)
    assert "--from-m 45: expected a station there" in refused("clearance", one, whole, "--from-m", 45)
    assert "--from-m 90: expected one that begins there, it begins at 60 m" in refused(
        "clearance", one, other, "--from-m", 90
    )
    far = refused("clearance", one, whole, "--from-m", 60, "--offset-head", 3, 0, 0)
    assert "the two lie 3.00 m apart there; expected one hole down to that depth" in far


def test_a_file_that_begins_at_500_m_needs_its_beginning(tmp_path: Path) -> None:
    record, tie = tmp_path / "s.csv", tmp_path / "tie.toml"
    record.write_text(DEEP)
    assert "the record begins at 500 m" in refused("survey", record)
    tie.write_text(
        "md_m = 500\ninclination_deg = 30\nazimuth_deg = 40\n"
        "north_m = 90\neast_m = 75\ntvd_m = 470\nsigma_m = [1, 1, 2]\n"
    )
    found = answer("survey", record, "--tie-on", tie)
    first, last = found["stations"][0], found["stations"][-1]
    assert (first["md_m"], first["north_m"], first["tvd_m"]) == (500.0, 90.0, 470.0)
    assert last["uncertainty"]["tvd_m"] >= 2.0
    assert "expected --from-collar or --tie-on, got both" in refused("survey", record, "--tie-on", tie, "--from-collar")


def test_stations_are_read_from_standard_input() -> None:
    command = [sys.executable, "-m", "borechain", "survey", "-", "--json"]
    text = "MD (ft);Inc (deg);Azi (deg)\n0;0;0\n100;1,5;20\n"
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["read_as"].startswith("read as: MD ft, inclination deg, azimuth deg; separated by ';', decimal comma")
    assert found["stations"][1]["md_m"] == pytest.approx(30.48)


def test_every_number_of_an_answer_is_in_the_north_it_names(tmp_path: Path) -> None:
    site = answer("survey", POTSDAM)
    true = answer(
        "survey",
        POTSDAM,
        "--north-of-site-deg",
        "10",
        "--answer-north",
        "true",
        "--convergence-deg",
        "0",
        "--origin",
        "100",
        "200",
        "35",
    )
    assert (site["north"], true["north"]) == ("site", "true")
    a, b = site["stations"][-1], true["stations"][-1]
    c, s = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    place = turn @ [a["north_m"], a["east_m"], a["tvd_m"]]
    np.testing.assert_allclose([b["north_m"], b["east_m"], b["tvd_m"]], place, atol=1e-9)
    assert b["azimuth_deg"] == pytest.approx(a["azimuth_deg"] + 10.0)
    assert true["closure_azimuth_deg"] == pytest.approx(site["closure_azimuth_deg"] + 10.0)
    covs = [np.array(row["uncertainty"]["covariance_m2"]) for row in (a, b)]
    np.testing.assert_allclose(covs[1], turn @ covs[0] @ turn.T, rtol=1e-9, atol=1e-15)
    assert (b["northing_m"], b["height_m"]) == pytest.approx((100.0 + b["north_m"], 35.0 - b["tvd_m"]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("md_m,inclination_deg,azimuth_deg\n0,0,0\n4,1,0\n2,1,0\n", "line 4: expected a measured depth beyond 4 m"),
        ("md_m,inclination_deg,azimuth_deg\n0,0,0\n4,1,0\n4,1,0\n", "line 4: expected a measured depth beyond 4 m"),
        ("md_m,inclination_deg,azimuth_deg\n0,0,0\n4,nan,0\n", "line 3: expected a finite inclination_deg, got nan"),
        (
            "md_m,inclination_deg,azimuth_deg\n0,0,0\n4,190,0\n",
            "line 3: expected an inclination of 0..180 deg, got 190",
        ),
        (
            "md_m,tilt,heading\n0,0,0\n4,1,0\n",
            "expected the columns md_m, a_cm, b_cm or md_m, inclination_deg, azimuth_deg",
        ),
        ("md_m,a_mm,b_mm\n0,0,0\n2,1,0\n", "a_mm is in another unit, expected a_cm"),
        ("md_m,inclination_deg,azimuth_deg\n0,0,0\n", "expected at least two stations"),
        ("", "the file is empty"),
        ("md_m,a_cm,b_cm\n0,0,0\n2,300,0\n", "line 3: a displacement of 3 m over 2 m cannot be"),
        ("md_m,a_cm,b_cm\n0,0,0\n2,x,0\n", "line 3: expected numbers, got a_cm = 'x'"),
    ],
)
def test_a_record_that_cannot_be_is_refused_with_its_line(tmp_path: Path, content: str, named: str) -> None:
    record = tmp_path / "record.csv"
    record.write_text(content)
    message = refused("survey", record)
    assert str(record) in message
    assert named in message


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ('azimuth = "Sine(Inc)"', "term A: formula 'Sine(Inc)': unknown function sine"),
        ('colour = "1"', "term A: colour: unknown key"),
        ('inclination = "1 / Sin(Inc)"', "term A: its weight has no value at a station; give singular weights"),
    ],
)
def test_a_tool_that_cannot_be_used_is_refused_with_its_term(tmp_path: Path, change: str, named: str) -> None:
    tool = tmp_path / "tool.toml"
    tool.write_text(
        '[tool]\nname = "t"\ntitle = "t"\n[[term]]\nname = "A"\nvalue = 1.0\nunit = "deg"\nmode = "systematic"\n'
        + change
    )
    record = tmp_path / "vertical.csv"
    record.write_text("md_m,inclination_deg,azimuth_deg\n0,0,0\n10,0,0\n20,0,0\n")
    assert named in refused("survey", record, "--instrument", tool, *SITE)


@pytest.mark.slow
def test_unknown_instruments_depths_and_plots_are_refused(tmp_path: Path) -> None:
    assert "expected one of gyro-continuous" in refused("survey", POTSDAM, "--instrument", "sextant")
    assert "expected a depth of 0..20 m" in refused("survey", POTSDAM, "--md", "25")
    assert "No such file" in refused("survey", tmp_path / "none.csv")
    assert ".svg" in refused("survey", POTSDAM, "--plot", tmp_path / "plot.docx")


@pytest.mark.slow
def test_the_wall_names_its_gap_and_how_to_close_it(tmp_path: Path) -> None:
    found = answer("wall", WALL, "--plot", tmp_path / "wall.png", status=3)
    assert len(found["joints"]) == 39
    assert found["verdict"] == "not tight"
    assert [(f["kind"], f["what"]) for f in found["findings"]] == [("thin", "K020-K021")]
    assert found["probability_of_any"] == pytest.approx(1.0)
    assert [(row["joint"], row["extra_column"]["closes"]) for row in found["extra_columns"]] == [("K020-K021", True)]
    assert all(row["state"] == "surveyed to 30 m" for row in found["columns"])
    worst = found["worst"]
    assert worst["joint"] == "K020-K021"
    assert worst["thickness_m"] < 0.8
    assert worst["probability"] > 0.99
    assert worst["depth_m"] == pytest.approx(30.0, abs=0.1)
    assert worst["extra_column"]["closes"] is True
    assert (tmp_path / "wall.png").read_bytes().startswith(b"\x89PNG")
    people = run("wall", WALL)
    assert people.returncode == 3
    assert "worst joint K020-K021" in people.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("radius_m = 0.60", "radius_m = -1", "radius_m: expected a positive number"),
        ("radius_m = 0.60", "radius_m = 0.3", "expected a thickness below the diameter"),
        ("thickness_m", "thickness_cm", "thickness_cm: unknown key"),
        ('tolerance = "en-12716"', 'tolerance = "none"', "expected one of en-12716"),
        ('tolerance = "en-12716"', 'layout = "circle"', "layout: expected one of line, shaft, grid"),
        ('instrument = "relay"', 'instrument = "compass"', "no such instrument"),
        ('heads = "wall-40-heads.csv"', 'heads = "none.csv"', "none.csv: No such file"),
        ("name =", "name", "not TOML"),
    ],
)
def test_a_wall_file_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, named: str) -> None:
    assert named in refused("wall", changed(tmp_path, WALL.name, old, new))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "old", "new", "named"),
    [
        (
            "wall-40-stations.csv",
            "K001,2.00,",
            "K001,0.00,",
            "line 4: column K001: expected a depth beyond 0 m, got 0 m",
        ),
        ("wall-40-stations.csv", "K001,2.00,", "K099,2.00,", "line 4: column K099 is not among the heads"),
        ("wall-40-stations.csv", "K001,2.00,0", "K001,2.00,95", "column K001: at 2 m the hole runs more than 80 deg"),
        ("wall-40-stations.csv", "K001,2.00,0", "K001,2.00,195", "line 4: expected an inclination of 0..180 deg"),
        ("wall-40-stations.csv", "K001,2.00,", "K001,nan,", "line 4: expected a finite md_m"),
        ("wall-40-heads.csv", "K002,0,", "K001,0,", "line 3: column K001 stands in line 2 already"),
        ("wall-40-heads.csv", "K002,0,", "K002,inf,", "line 3: expected finite north_m and east_m"),
        ("wall-40-heads.csv", "K002,", "K900,", "column K002 is not among the heads"),
    ],
)
def test_columns_that_cannot_be_are_refused_with_their_line(
    tmp_path: Path, name: str, old: str, new: str, named: str
) -> None:
    changed(tmp_path, name, old, new)
    assert named in refused("wall", tmp_path / WALL.name)


@pytest.mark.slow
def test_a_wall_of_what_is_not_known_names_each_column_and_ends_with_status_three(tmp_path: Path) -> None:
    """One column short, one missing from the surveys, one unsurveyed below 10 m, one not drilled."""
    (tmp_path / "heads.csv").write_text(
        "column,north_m,east_m,state\n"
        + "".join(f"C{k},0,{0.75 * (k - 1)},{ {7: 'drilled', 9: 'not-drilled'}.get(k, '') }\n" for k in range(1, 11))
    )
    depth = {3: 15, 7: 10} | dict.fromkeys((1, 2, 4, 6, 8, 10), 20)
    rows = [f"C{k},{md},0,0\n" for k, end in sorted(depth.items()) for md in range(0, end + 1, 5)]
    (tmp_path / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + "".join(rows))
    wall = tmp_path / "wall.toml"
    wall.write_text(
        'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 20\nheads = "heads.csv"\nstations = "stations.csv"\n'
    )
    found = answer("wall", wall, "--plot", tmp_path / "wall.png", status=3)
    assert found["verdict"] == "not tight"
    assert {(f["kind"], f["what"], f["to_m"]) for f in found["findings"] if f["kind"] in ("missing", "unsurveyed")} == {
        ("missing", "C3", 20.0),
        ("missing", "C5", 20.0),
        ("unsurveyed", "C7", 20.0),
        ("missing", "C9", 20.0),
    }
    assert found["probability_of_any"] == 1.0
    assert {row["column"]: row["state"] for row in found["columns"] if int(row["column"][1:]) % 2} == {
        "C1": "surveyed to 20 m",
        "C3": "surveyed to 15 m",
        "C5": "no record",
        "C7": "surveyed to 10 m, drilled to 20 m",
        "C9": "not drilled",
    }
    people = run("wall", wall)
    assert people.returncode == 3
    assert all(f"column C{k} " in people.stdout for k in (3, 5, 7, 9))


def test_an_instrument_that_errs_only_down_is_a_singular_covariance(tmp_path: Path) -> None:
    (tmp_path / "tape.toml").write_text(
        '[tool]\nname = "tape"\ntitle = "t"\n'
        '[[term]]\nname = "A"\nvalue = 0.01\nunit = "m"\nmode = "random"\ndepth = "1"\n'
    )
    wall = changed(tmp_path, WALL.name, 'instrument = "relay"', f'instrument = "{tmp_path / "tape.toml"}"')
    assert "station 1, north and east: the covariance is singular" in refused("wall", wall)


def test_what_a_wall_file_names_lies_beside_it(tmp_path: Path) -> None:
    text = (ROOT / "groundstation" / "survey" / "tools" / "models" / "relay.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace('name = "relay"', 'name = "mine"'))
    wall = changed(tmp_path, WALL.name, 'instrument = "relay"', 'instrument = "mine.toml"')
    assert {row["instrument"] for row in answer("wall", wall, status=3)["columns"]} == {"mine"}


def test_the_bench_lists_itself_and_refuses_others() -> None:
    assert "survey" in run("bench").stdout.splitlines()
    assert "expected one of" in refused("bench", "horses")


def changed(folder: Path, name: str, old: str, new: str) -> Path:
    """The shipped wall in a folder of its own, with one thing changed."""
    for path in WALL.parent.glob("wall-40*"):
        if not (folder / path.name).exists():
            (folder / path.name).write_text(path.read_text())
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))
    return folder / name
