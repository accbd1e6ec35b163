"""Plans as files and settings, and a hole that is judged against one."""

import math
from pathlib import Path

import numpy as np
import pytest
from forked_commands import run
from hand_fed import FOLLOWED, Rig
from schemas import shown_on
from string_passes import knowing, survey

from groundstation.config import GroundConfig, checked_config
from groundstation.errors import ConfigurationError, SurveyError
from groundstation.plan_settings import LegSettings, PlanSettings, plan_warnings, read_plan
from sim.rig.ground_settings import ground_settings
from sim.world.scenario import scenario_of
from sim.world.world import World

LEGS = """
inclination_deg = 0.0
azimuth_deg = 30.0
tolerance = "50 mm + 1:100"

[[leg]]
from_m = 0.0
length_m = 4.0

[[leg]]
from_m = 4.0
to_inclination_deg = 10.0
build_deg_per_m = 2.0

[[leg]]
length_m = 6.0
"""


def test_legs_of_a_file_are_the_plan_that_they_say(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(LEGS)
    found = read_plan(path)
    plan = found.to_plan()
    assert plan.length == pytest.approx(4.0 + 5.0 + 6.0)
    bend, radius = math.radians(10.0), 5.0 / math.radians(10.0)
    out = radius * (1.0 - math.cos(bend)) + 6.0 * math.sin(bend)
    down = 4.0 + radius * math.sin(bend) + 6.0 * math.cos(bend)
    north, east = out * math.cos(math.radians(30.0)), out * math.sin(math.radians(30.0))
    np.testing.assert_allclose(plan.positions[-1], [north, east, down], atol=1e-9)
    config = GroundConfig(folder=tmp_path, plan=found)
    assert config.design.length == pytest.approx(15.0)
    assert config.design.end.limit == pytest.approx(0.05 + 0.15)
    assert GroundConfig(**config.model_dump(mode="json")).design.end.limit == config.design.end.limit


def test_stations_of_a_file_are_joined_by_arcs(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("md_m,inclination_deg,azimuth_deg\n0,0,0\n10,0,0\n40,60,0\n")
    plan = read_plan(path).to_plan()
    radius = 30.0 / math.radians(60.0)
    expected = [radius * 0.5, 0.0, 10.0 + radius * math.sin(math.radians(60.0))]
    np.testing.assert_allclose(plan.positions[-1], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LEGS.replace("from_m = 4.0", "from_m = 5.0"), r"leg 2: expected from_m = 4, got 5: a gap of 1 m"),
        (LEGS.replace("from_m = 4.0", "from_m = 3.0"), r"leg 2: expected from_m = 4, got 3: it overlaps"),
        (LEGS.replace("length_m = 6.0", "length_m = 0.0"), "leg 3: expected a length above 0 m, got 0 m"),
        (LEGS.replace("length_m = 6.0", ""), "leg 3: expected length_m, or a rate and a direction to reach"),
        (
            LEGS.replace("build_deg_per_m = 2.0", "build_deg_per_m = -2.0"),
            "build_deg_per_m that leads from 0 to 10 deg",
        ),
        (LEGS.replace("to_inclination_deg = 10.0", "to_inclination_deg = 190.0"), "leg.2.to_inclination_deg"),
        (LEGS.replace("to_inclination_deg = 10.0", "length_m = 200.0"), "leg 2: it turns back: 400 deg in one leg"),
        (LEGS.replace("50 mm + 1:100", "0 cm"), "tolerance, by its name or as a sum"),
        (LEGS.replace("length_m = 6.0", "depth_m = 6.0"), "leg.3.depth_m"),
        ("inclination_deg = 1.0", "plan: expected at least one leg"),
        ("[[leg", "not TOML"),
    ],
)
def test_a_file_that_is_no_plan_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(text)
    with pytest.raises(SurveyError, match=message) as refused:
        read_plan(path)
    assert str(refused.value).startswith(str(path))
    assert "\n" not in str(refused.value)


def test_stations_with_a_gap_or_a_missing_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("md_m,inclination_deg,azimuth_deg\n5,0,0\n10,0,0\n")
    with pytest.raises(SurveyError, match="it begins at 5 m"):
        read_plan(path)
    for name in ("none.toml", "none.csv"):
        with pytest.raises(SurveyError, match=name):
            read_plan(tmp_path / name)


STATIONS = ((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (40.0, 60.0, 0.0))


FORMS = {
    "a.csv": b"\xef\xbb\xbfMD (ft);Azi (deg);Inc (deg)\r\n0;0;0\r\n"
    b"32.808398950131235;0;0\r\n131.23359580052494;0;60\r\n",
    "b.txt": "pit wall\n# MD\tINCL\tAZIM\nm\tgon\tgon\n0\t0\t0\n10\t0\t-999.25\n40\t66.6666666666667\t0\n".encode(
        "utf-16"
    ),
    "c.las": b"~V\nVERS. 2.0:\nWRAP. NO:\n~W\nNULL. -999.25:\n~C\nDEPT.M:\nDEVI.DEG:\nAZIM.DEG:\n"
    b"~A\n0 0 0\n10 0 0\n40 60 0\n",
}


@pytest.mark.parametrize("name", FORMS)
def test_a_plan_is_read_like_any_survey(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(FORMS[name])
    np.testing.assert_allclose(read_plan(path).stations, STATIONS, atol=1e-9)
    assert plan_warnings(read_plan(path)) == ()  # 2 deg a metre


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,0,0\n10,-999.25,0\n40,60,0\n", "a plan has a value at every station; line 3: inclination_deg = '-999.25'"),
        ("0,0,0\n10,5,9999\n40,60,0\n", "a plan has a value at every station; line 3: azimuth_deg = '9999'"),
        ("0,0,0\n10,5,\n40,60,0\n", "a plan has a value at every station"),
        ("0,0,0\n10,5,1005\n", "line 3: azimuth_deg: expected an azimuth of -720..720 deg, got 1005"),
        ("0,0,0\n10,nan,0\n", "line 3: expected a finite inclination_deg, got nan"),
    ],
)
def test_a_plan_with_a_value_that_is_none_is_refused(tmp_path: Path, rows: str, message: str) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("md_m,inclination_deg,azimuth_deg\n" + rows)
    with pytest.raises(SurveyError) as refused:
        read_plan(path)
    assert message in str(refused.value)
    path.write_text("md_m,a_cm,b_cm\n0,0,0\n2,1,1\n")
    with pytest.raises(SurveyError, match="expected stations with inclination and azimuth, got displacements"):
        read_plan(path)


@pytest.mark.parametrize("typed", ["12.3", "123"])
def test_a_plan_that_no_string_follows_is_a_warning(tmp_path: Path, typed: str) -> None:
    """A decimal point that was forgotten bends the design by 111 deg in 30 m."""
    path = tmp_path / "plan.csv"
    path.write_text(f"md_m,inclination_deg,azimuth_deg\n0,12,90\n30,12,90\n60,{typed},90\n90,12.4,90\n")
    told = [warning.text for warning in plan_warnings(read_plan(path))]
    word = "the plan: its design bends by 3.7 deg a metre at 30 m; expected at most 3 deg a metre"
    assert told == ([] if typed == "12.3" else [word])


def test_settings_that_are_no_plan_are_refused_where_they_enter(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="plan"):
        checked_config(folder=tmp_path, plan={"leg": [{"length_m": "far"}]})
    both = PlanSettings(leg=(LegSettings(length_m=1.0),), stations=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    with pytest.raises(SurveyError, match="legs or stations, got both"):
        both.to_plan()


def test_a_hole_drilled_on_its_plan_does_not_deviate_and_one_beside_it_does(tmp_path: Path) -> None:
    """Vertical for 4 m, then a build of 2 deg/m towards azimuth 30 deg: stations every metre, each on the curve."""
    legs = (LegSettings(length_m=4.0), LegSettings(length_m=10.0, build_deg_per_m=2.0))
    plan = PlanSettings(azimuth_deg=30.0, leg=legs)

    def column(inclination_more: float) -> dict:
        placed = [
            (survey(1, md, 1, max(md - 4.0, 0.0) * 2.0 + inclination_more, 30.0), float(md)) for md in range(1, 13)
        ]
        folder = tmp_path / f"{inclination_more}"
        return shown_on(knowing(folder, placed, 1, plan=plan, **FOLLOWED), "column")

    on, beside = column(0.0), column(1.0)
    for row in on["stations"]:
        assert row["deviation_cm"] == pytest.approx(0.0, abs=0.2)
        assert row["along_m"] == pytest.approx(row["md_m"], abs=1e-3)
    assert on["design"]["course_m"][-1] == pytest.approx([14.0, *config_end(plan)], abs=1e-3)
    last = beside["stations"][-1]
    assert last["deviation_cm"] == pytest.approx(100.0 * 11.5 * math.radians(1.0), rel=0.02)
    assert last["direction_deg"] == pytest.approx(30.0, abs=0.5)


def config_end(plan: PlanSettings) -> list[float]:
    """Place of the end of a plan."""
    return [float(x) for x in plan.to_plan().positions[-1]]


def test_a_rig_tells_the_plan_and_its_verdict(tmp_path: Path) -> None:
    rig = Rig(
        tmp_path,
        **FOLLOWED,
        plan=PlanSettings(leg=(LegSettings(length_m=2.0), LegSettings(length_m=8.0, to_inclination_deg=12.0))),
    )
    rig.run(5.0)
    rig.drill(1, 0.0)
    rig.drill(2, 3.0)
    shown = rig.ask("column")
    assert shown["design"]["target_m"] == 10.0
    assert len(shown["design"]["course_m"]) == 51
    assert shown["stations"][-1]["deviation_cm"] < 1.0
    assert rig.ask("verdict")["target_m"] == 10.0
    rig.ground.close()


def test_legs_of_a_scenario_are_the_plan_of_its_ground_station(tmp_path: Path) -> None:
    legs = [{"length_m": 2.0}, {"to_inclination_deg": 6.0, "to_azimuth_deg": 90.0, "length_m": 4.0}]
    tables = {
        "rig": {"tubes": 2, "tube_length_m": 3.0},
        "path": {"spiral": {"inclination_deg": 1.0, "turn_deg": 0.0}},
        "design": {"azimuth_deg": 90.0, "leg": legs},
    }
    config = GroundConfig(folder=tmp_path, **ground_settings(World(scenario_of(tables), 1)))
    radius = 4.0 / math.radians(6.0)
    east = radius * (1.0 - math.cos(math.radians(6.0)))
    down = 2.0 + radius * math.sin(math.radians(6.0))
    np.testing.assert_allclose(config.design.end.point, [0.0, east, down], atol=1e-9)


def test_the_command_refuses_a_plan_that_is_none_in_a_line(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text("[[leg]]\nlength_m = 0.0\n")
    done = run("ground", "--folder", tmp_path / "ground", "--plan", path)
    assert (done.returncode, done.stdout) == (2, "")
    lines = done.stderr.strip().splitlines()
    assert lines == [f"{lines[0].partition(' ')[0]} {path}: plan: leg 1: expected a length above 0 m, got 0 m"]
