"""Gyros that initialise, then run: gates, what is kept, drift, walk and sections; and the OWSG set by name."""

import math

import numpy as np
import pytest
from wells import import_welleng

from groundstation.errors import ToolError
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool, parse_toml
from groundstation.survey.tools.owsg import owsg_names
from groundstation.survey.well.error_columns import error_columns, position_covariance
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import EARTH_RATE, Leg, Site, WellSurvey
from groundstation.survey.well.gyro_modes import mode_weights, sections_of
from groundstation.survey.well.methods import Method, station_positions

DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 72.0 * DEG, 3.0 * DEG, 60.0 * DEG)
INCLINATION = np.array([0.0, 10.0, 20.0, 30.0, 10.0, 0.0, 15.0, 25.0, 25.0]) * DEG


def survey(inclination: np.ndarray = INCLINATION, azimuth: float | np.ndarray = 40.0 * DEG) -> WellSurvey:
    md = 30.0 * np.arange(len(inclination))
    azimuths = np.broadcast_to(azimuth, md.shape).copy()
    return WellSurvey(
        md, inclination, azimuths, station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuths)[:, 2]
    )


def azimuth_weight(term: Term, parameters: dict[str, float] | None = None, of: WellSurvey | None = None) -> np.ndarray:
    tool = SurveyTool("g", "g", (term,), parameters or {})
    return mode_weights(Leg(tool), of or survey(), SITE)[0][2]


def test_a_stationary_error_stops_at_its_gate_or_keeps_what_it_was_there() -> None:
    weights = ("0", "0", "Sin(Inc)")
    gone = azimuth_weight(Term("B", 1.0, "deg", PropagationMode.SYSTEMATIC, weights, window=(-math.inf, 17.0 * DEG)))
    kept = azimuth_weight(
        Term("B", 1.0, "deg", PropagationMode.SYSTEMATIC, weights, window=(-math.inf, 17.0 * DEG), kept=True)
    )
    live, gate = np.sin(INCLINATION[1:]), math.sin(17.0 * DEG)
    np.testing.assert_allclose(gone, live * (INCLINATION[1:] <= 17.0 * DEG), atol=1e-15)
    np.testing.assert_allclose(kept, np.where(INCLINATION[1:] <= 17.0 * DEG, live, gate), atol=1e-15)


def test_what_is_kept_has_the_azimuth_with_which_the_hole_passed_the_gate() -> None:
    inclination, azimuth = np.array([0.0, 0.0, 20.0, 30.0, 0.0, 0.0, 20.0]) * DEG, np.array([0.0, 0, 50, 60, 0, 0, 200])
    found = azimuth_weight(
        Term("B", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "AzT"), window=(-math.inf, 17.0 * DEG), kept=True),
        of=survey(inclination, azimuth * DEG),
    )
    # from the vertical the arc runs towards the lower station, whatever azimuth stands at the upper one
    np.testing.assert_allclose(np.mod(found[[1, 2, 5]], math.tau) / DEG, [50.0, 50.0, 200.0], atol=1e-9)


def test_a_survey_that_begins_beyond_the_gate_initialises_at_its_first_station() -> None:
    found = azimuth_weight(
        Term("B", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "Inc"), window=(-1.0, -1.0), kept=True),
        of=survey(np.array([5.0, 9.0, 20.0]) * DEG),
    )
    np.testing.assert_allclose(found, 5.0 * DEG)


def test_drift_and_walk_grow_beyond_their_gate_and_begin_anew() -> None:
    speed, gate = {"Speed": 1800.0}, (17.0 * DEG, math.inf)
    mean = "Sin((Inc + IncPrev) / 2)"
    drift = azimuth_weight(
        Term(
            "D",
            1.0,
            "deg/hr",
            PropagationMode.SYSTEMATIC,
            ("0", "0", f"Previous + (MD - MDPrev) / (Speed * {mean})"),
            window=gate,
        ),
        speed,
    )
    walk = azimuth_weight(
        Term(
            "W",
            1.0,
            "deg/rthr",
            PropagationMode.SECTION,
            ("0", "0", "Sqrt(Previous^2 + (MD - MDPrev) / Speed)"),
            window=gate,
        ),
        speed,
    )
    steps = 30.0 / 1800.0 / np.sin(0.5 * (INCLINATION[1:] + INCLINATION[:-1]))
    np.testing.assert_allclose(drift, [0, steps[1], steps[1] + steps[2], 0, 0, 0, steps[6], steps[6] + steps[7]])
    np.testing.assert_allclose(walk, np.sqrt(30.0 / 1800.0 * np.array([0, 1, 2, 0, 0, 0, 1, 2])))


def test_what_is_random_in_an_initialisation_is_another_error_in_every_section() -> None:
    term = Term("N", 0.01, "rad", PropagationMode.SECTION, ("0", "0", "1"), window=(17.0 * DEG, 17.0 * DEG), kept=True)
    hole = survey()
    assert sections_of(term, hole.inclination).tolist() == [0, 1, 1, 1, 1, 1, 2, 2]
    whole = propagate_errors(hole, [Leg(SurveyTool("g", "g", (term,)))], SITE).cov[-1]
    legs, across = [], np.array([-math.sin(40.0 * DEG), math.cos(40.0 * DEG), 0.0])
    for stations in ((2, 3), (7, 8)):  # by hand: the effect of each section alone
        effect = np.zeros(3)
        for k in stations:
            weight = 30.0 if k < 8 else 15.0
            effect += 0.01 * weight * math.sin(hole.inclination[k]) * across
        legs.append(effect)
    np.testing.assert_allclose(whole, sum(np.outer(e, e) for e in legs), atol=1e-12)


@pytest.mark.parametrize("model", ["GYRO-NS", "GYRO-NS-CT"])
def test_columns_of_errors_are_those_of_the_covariance(model: str) -> None:
    tool = load_tool(model)
    hole = survey()
    columns = error_columns(hole, (Leg(tool),), SITE)
    expected = propagate_errors(hole, [Leg(tool)], SITE, slot_allowance=tool.slot_allowance).cov
    np.testing.assert_allclose(position_covariance(columns)[1:], expected[1:], rtol=1e-9, atol=1e-12)


def test_a_hybrid_of_the_set_is_the_publishers_up_to_its_gate_and_its_drift_beyond() -> None:
    """Beyond the gate welleng goes on measuring azimuth as if the tool stood still; SPE 90408 keeps what it found."""
    md = np.arange(0.0, 1200.0, 30.0)
    inclination, azimuth = np.clip((md - 300.0) / 15.0, 0.0, 45.0), np.where(md > 300.0, 30.0, 0.0)
    welleng = import_welleng()
    header = welleng.survey.SurveyHeader(
        latitude=60, longitude=2, altitude=0, b_total=50_000, dip=72, declination=3, convergence=0, G=9.80665,
        azi_reference="true",
    )  # fmt: skip
    theirs = welleng.survey.Survey(md, inclination, azimuth, header=header, error_model="GYRO-NS-CT").err.errors.errors
    i, a = np.radians(inclination), np.radians(azimuth)
    hole = WellSurvey(md, i, a, station_positions(Method.MINIMUM_CURVATURE, md, i, a)[:, 2])
    tool = load_tool("gyro-ns-ct")
    ours = propagate_errors(hole, [Leg(tool)], SITE, slot_allowance=True).by_source()
    below = int(np.flatnonzero(inclination > 15.0)[0])
    for name in theirs:
        scale = np.trace(theirs[name].cov_NEV, axis1=1, axis2=2)[:, None, None] + 1e-12
        stationary = name.startswith(("GXY-B", "GXY-G4"))
        last = below if stationary else None
        if name == "GXY-RN":  # theirs is reduced below the gate too
            reduced = theirs[name].cov_NEV[below - 1] / 0.4082**2
            np.testing.assert_allclose(ours["GXY-RN"][below - 1], reduced, rtol=1e-3, atol=1e-9)
            continue
        error = np.abs(ours[name] - theirs[name].cov_NEV) / scale
        assert np.max(error[1:last]) < 1e-3, name


@pytest.mark.slow
def test_the_set_has_its_tools_by_name_and_says_what_it_lacks() -> None:
    names = owsg_names()
    assert {"MWD+IFR1+SAG+MS", "MWD+SRGM+AX", "MWD+IFR2+AX+SAG", "GYRO-MWD", "INC-ONLY", "EMS+HRGM+AX"} <= set(names)
    assert len(names) == 100
    for name in names:
        given = {"GZRunningSpeed": 1800.0} if name.startswith("CB_Film_G") else None
        assert load_tool(name, given).name == name
    with pytest.raises(ToolError, match=r"^CB_Film_GSS: .*unknown name GZRunningSpeed"):
        load_tool("CB_Film_GSS")
    with pytest.raises(ToolError, match=r"no such instrument; expected one of gyro-continuous, .* OWSG set"):
        load_tool("MWD+NOTHING")


def test_a_parameter_that_is_given_takes_the_place_of_the_files() -> None:
    slow, fast = (load_tool("GYRO-NS-CT", {"GXYRunningSpeed": speed}) for speed in (900.0, 3600.0))
    hole = survey(np.linspace(16.0, 60.0, 20) * DEG)
    drifts = [propagate_errors(hole, [Leg(tool)], SITE).by_source()["GXY-GD"][-1] for tool in (slow, fast)]
    np.testing.assert_allclose(drifts[0], 16.0 * drifts[1], rtol=1e-12)
    assert load_tool("GYRO-NS").parameters["NoiseReductionFactor"] == 1.0


def test_a_gyro_bias_is_what_the_earths_rotation_makes_of_it() -> None:
    hole = survey(np.full(3, 10.0) * DEG, 90.0 * DEG)
    cov = propagate_errors(hole, [Leg(load_tool("GYRO-NS"))], SITE).by_source()["GXY-G4"][-1]
    azimuth = 0.6 * DEG * math.tan(10.0 * DEG) / (EARTH_RATE * math.cos(60.0 * DEG))
    assert math.sqrt(cov[0, 0]) == pytest.approx(azimuth * 45.0 * math.sin(10.0 * DEG), rel=1e-9)


@pytest.mark.parametrize(
    ("term", "named"),
    [
        ('depth = "1"\nup_to_deg = 17', "a gyro's ranges and recurrences are of angles alone"),
        ('azimuth = "1"\nabove_deg = 20\nup_to_deg = 17', "expected above_deg at most up_to_deg"),
        ('azimuth = "1"\nup_to_deg = "x"', "up_to_deg: expected a finite number, got 'x'"),
        ('azimuth = "Previos + 1"', "unknown name Previos; expected one of MD, .*Previous or a parameter"),
    ],
)
def test_ranges_that_cannot_be_are_refused_by_their_term(term: str, named: str) -> None:
    head = '[tool]\nname = "t"\ntitle = "t"\n[[term]]\nname = "A"\nvalue = 1\nunit = "deg"\nmode = "systematic"\n'
    with pytest.raises(ToolError, match=f"^f.toml: .*term A: .*{named}"):
        parse_toml(head + term, "f.toml")
