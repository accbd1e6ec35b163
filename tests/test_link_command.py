"""``borechain link`` as its user meets it: tables, plots, warnings and refusals in one line."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from borechain.cli.link.link import link
from borechain.cli.rig.rig_command import rig

SCENARIOS = Path(__file__).parents[1] / "scenarios"


def ask(*words: str) -> Result:
    return CliRunner().invoke(link, list(words))


def test_soil_answers_by_water_and_distance() -> None:
    done = ask("soil", "--sand", "0.05", "--clay", "0.47", "--water", "0.1", "--water", "0.4", "--json")
    assert done.exit_code == 0, done.output
    links = json.loads(done.stdout)["links"]
    assert [(row["water_percent"], row["distance_m"]) for row in links] == [
        (water, distance) for water in (10.0, 40.0) for distance in (0.1, 0.2, 0.3)
    ]
    powers = [row["received_dbm"] for row in links]
    assert powers[:3] == sorted(powers[:3], reverse=True)
    assert powers[0] > powers[3]
    assert all(row["margin_db"] == pytest.approx(row["received_dbm"] + 103.0) for row in links)


def test_antennas_and_threshold_move_the_margin_by_their_decibels() -> None:
    words = ("soil", "--water", "0.4", "--distance-m", "0.3", "--json")
    plain, poor = (json.loads(ask(*words, *more).stdout)["links"][0] for more in ((), ("--gain-dbi", "-25")))
    assert plain["margin_db"] - poor["margin_db"] == pytest.approx(50.0)
    assert poor["packet_error_rate"] > plain["packet_error_rate"]


def test_pipe_answers_by_mode() -> None:
    done = ask("pipe", "--grade", "X52 seamless", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["carbon_percent"] == 0.31
    assert [row["mode"] for row in found["links"]] == ["TE11", "TM01", "TE21"]
    for row in found["links"]:
        assert row["attenuation_db_per_m"] * row["reach_m"] == pytest.approx(110.0)


def test_a_mode_that_does_not_propagate_has_neither_attenuation_nor_reach() -> None:
    rows = json.loads(ask("pipe", "--frequency-ghz", "3.5", "--json").stdout)["links"]
    assert [row["reach_m"] is None for row in rows] == [False, True, True]


@pytest.mark.slow
@pytest.mark.parametrize("words", [("soil",), ("soil", "--map"), ("pipe",), ("pipe", "--radius-cm", "5")])
def test_tables_and_plots(words: tuple[str, ...], tmp_path: Path) -> None:
    place = tmp_path / "link.svg"
    done = ask(*words, "--plot", str(place))
    assert done.exit_code == 0, done.output
    assert place.read_text().startswith("<?xml")
    assert ("margin_db" if words[0] == "soil" else "cut_off_ghz") in done.stdout


def test_water_beyond_the_pores_warns_once_and_answers() -> None:
    done = ask("soil", "--water", "0.8", "--json")
    assert done.exit_code == 0
    assert len(json.loads(done.stdout)["links"]) == 3
    (line,) = done.stderr.splitlines()
    assert line.startswith("Warning: water: a soil of this density holds at most 44 % by volume")


def test_a_scenario_in_a_ground_of_too_much_water_warns_in_a_line_before_it_is_drilled(tmp_path: Path) -> None:
    text = (SCENARIOS / "wellbore-1-wet-clay.toml").read_text().replace("water = 0.40", "water = 0.80")
    (tmp_path / "flooded.toml").write_text(text)
    (tmp_path / "wellbore-1-path.csv").write_text((SCENARIOS / "wellbore-1-path.csv").read_text())
    within_a_file = tmp_path / "flooded.toml" / "run"  # a folder that is refused where it is to be made
    done = CliRunner().invoke(rig, [str(tmp_path / "flooded.toml"), "--inline", "--json", "--out", str(within_a_file)])
    assert done.exit_code == 1
    warned, refused = done.stderr.splitlines()
    assert warned.startswith("Warning: water: a soil of this density holds at most 44 % by volume")
    assert f"output folder {within_a_file}: Not a directory" in refused


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("soil --frequency-mhz 2400", "frequency: expected 0.3..1.3 GHz, got 2.4"),
        ("soil --sand 0.8 --clay 0.4", "sand and clay: expected fractions of at most 1 together, got 1.2"),
        ("soil --distance-m -1", "distance: expected more than 0 m, got -1"),
        ("soil --water nan", "water: expected 0..1, got nan"),
        ("soil --density -1", "bulk density: expected 0.5..2.6 g/cm^3, got -1"),
        ("soil --plot link.txt", "expected a name that ends in .svg, .png, .pdf"),
        ("pipe --frequency-ghz 2.4", "expected more than 2.928 GHz, the cut-off of TE11 in this pipe, got 2.4"),
        ("pipe --radius-cm -3", "radius: expected 0.01..1000 cm, got -3"),
        ("pipe --carbon-percent 2", "carbon: expected 0.06..1.22 %, got 2"),
        ("pipe --temperature-c -5", "temperature: expected 20..400 C, got -5"),
        ("pipe --budget-db 0", "budget: expected more than 0 dB, got 0"),
        ("pipe --grade X99", "grade: expected one of A25, A seamless"),
        ("pipe --grade A25 --carbon-percent 0.2", "--grade: expected either a grade or --carbon-percent, got both"),
    ],
)
def test_what_lies_outside_a_model_is_one_line_with_its_range(words: str, named: str) -> None:
    done = ask(*words.split())
    assert done.exit_code == 2
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert named in line
