"""A region that grows station by station against the one of the whole survey."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.errors import GroundError, SurveyError, ToolError
from groundstation.survey.error_model import propagate
from groundstation.survey.error_sources import Leg, Site, Survey
from groundstation.survey.formulas import VARIABLES
from groundstation.survey.instruments import Mode, Term, Tool, load_tool, shipped
from groundstation.survey.methods import Method, positions
from groundstation.survey.running_error import RunningUncertainty

DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 72.0 * DEG, 3.0 * DEG, 60.0 * DEG)
TOOLS = {name: load_tool(name) for name in shipped()}
RECORD = ("SigmaYaw", "SigmaSystematic", "SigmaForce", "Readings", "Time")

STATIONS = st.lists(
    st.tuples(
        st.floats(0.2, 30.0),
        st.one_of(st.just(0.0), st.floats(0.0, 1e-5), st.floats(1e-3, 0.5)),
        st.floats(-7.0, 7.0),
    ),
    min_size=2,
    max_size=12,
)


def survey_of(rows: list[tuple[float, float, float]], seed: int | None) -> Survey:
    lengths, inclination, azimuth = np.array(rows).T
    md = np.cumsum(lengths) - lengths[0]
    record = {}
    if seed is not None:
        rng = np.random.default_rng(seed)
        count = len(md)
        record = {
            "SigmaYaw": rng.uniform(0.0, 0.02, count),
            "SigmaSystematic": rng.uniform(0.0, 0.02, count),
            "SigmaForce": rng.uniform(0.0, 0.01, count),
            "Readings": rng.integers(1, 30, count).astype(float),
            "Time": np.cumsum(rng.uniform(1.0, 100.0, count)),
        }
    return Survey(md, inclination, azimuth, positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)[:, 2], record)


def begun(tool: Tool, survey: Survey, *, slot_allowance: bool = False) -> RunningUncertainty:
    first = (float(column[0]) for column in (survey.md, survey.inclination, survey.azimuth))
    return RunningUncertainty(tool, SITE, *first, slot_allowance=slot_allowance)


def append(running: RunningUncertainty, survey: Survey, k: int) -> np.ndarray:
    row = (float(column[k]) for column in (survey.md, survey.inclination, survey.azimuth, survey.tvd))
    return running.append(*row, {name: float(values[k]) for name, values in survey.record.items()})


@pytest.mark.slow
@settings(max_examples=40)
@pytest.mark.parametrize("name", shipped())
@given(rows=STATIONS, seed=st.none() | st.integers(0, 1000), allowance=st.booleans())
def test_every_appended_covariance_is_that_of_the_whole_survey(
    name: str, rows: list[tuple[float, float, float]], seed: int | None, allowance: bool
) -> None:
    survey = survey_of(rows, seed)
    whole = propagate(survey, [Leg(TOOLS[name])], SITE, slot_allowance=allowance).cov
    running = begun(TOOLS[name], survey, slot_allowance=allowance)
    for k in range(1, len(rows)):
        cov = append(running, survey, k)
        np.testing.assert_allclose(cov, whole[k], rtol=0.0, atol=1e-12 * float(np.trace(whole[k])))


@pytest.mark.parametrize("name", shipped())
def test_a_long_hole_stays_with_the_whole_survey(name: str) -> None:
    rng = np.random.default_rng(50)
    rows = [(float(a), float(b), float(c)) for a, b, c in rng.uniform([0.5, 0.0, 0.0], [3.0, 0.5, 6.0], (300, 3))]
    survey = survey_of(rows, 3)
    whole = propagate(survey, [Leg(TOOLS[name])], SITE, slot_allowance=True).cov
    running = begun(TOOLS[name], survey, slot_allowance=True)
    for k in range(1, len(rows)):
        cov = append(running, survey, k)
        np.testing.assert_allclose(cov, whole[k], rtol=0.0, atol=1e-12 * float(np.trace(whole[k])))


@pytest.mark.parametrize("mode", Mode)
def test_a_hand_worked_well_has_its_variances(mode: Mode) -> None:
    tool = Tool("mine", "", (Term("A", 0.01, "rad", mode, ("0", "1", "0")),))
    running = RunningUncertainty(tool, SITE, 0.0, 0.0, 0.0)
    got = [running.append(md, 0.0, 0.0, md)[0, 0] for md in (10.0, 20.0, 30.0)]
    expected = [25.0, 125.0, 225.0] if mode is Mode.RANDOM else [25.0, 225.0, 625.0]
    np.testing.assert_allclose(got, 1e-4 * np.array(expected))


@pytest.mark.parametrize("name", [name for name in VARIABLES if name not in ("TimePrev", "Previous")])
def test_a_formula_sees_the_same_variables_as_in_the_whole_survey(name: str) -> None:
    survey = survey_of([(5.0, 0.1, 1.0), (5.0, 0.2, 1.1), (7.0, 0.3, 6.2), (9.0, 0.5, 1.0)], 7)
    tool = Tool("mine", "", (Term("A", 1e-3, "m", Mode.RANDOM, (name, name, name), position=(name, "0", name)),))
    whole = propagate(survey, [Leg(tool)], SITE).cov
    running = begun(tool, survey)
    for k in (1, 2, 3):
        np.testing.assert_allclose(append(running, survey, k), whole[k], rtol=1e-10, atol=1e-18)


def test_a_station_knows_the_time_of_the_one_before() -> None:
    tool = Tool("mine", "", (Term("A", 1e-3, "m", Mode.RANDOM, position=("Time - TimePrev", "0", "0")),))
    running = RunningUncertainty(tool, SITE, 0.0, 0.1, 1.0)
    for md, time in ((2.0, 30.0), (4.0, 70.0)):
        cov = running.append(md, 0.1, 1.0, md, {"Time": time})
    assert cov[0, 0] == pytest.approx(1e-6 * (30.0**2 + 40.0**2))


def test_terms_in_any_order_give_the_same() -> None:
    tool = TOOLS["mwd-rev5.1"]
    survey = survey_of([(5.0, 0.0, 1.0), (5.0, 0.1, 1.1), (7.0, 0.2, 1.3), (9.0, 0.5, 1.0)], None)
    one, other = begun(tool, survey), begun(tool.with_terms(tool.terms[::-1]), survey)
    for k in range(1, 4):
        np.testing.assert_allclose(append(one, survey, k), append(other, survey, k), rtol=1e-12, atol=1e-15)


def test_what_was_returned_does_not_change_when_more_is_appended() -> None:
    survey = survey_of([(5.0, 0.01, 1.0)] * 4, None)
    running = begun(TOOLS["mwd-rev5.1"], survey)
    first = append(running, survey, 1)
    kept = first.copy()
    append(running, survey, 2)
    np.testing.assert_array_equal(first, kept)
    first[...] = 1e9
    assert float(np.max(append(running, survey, 3))) < 1e6


BAD = [
    pytest.param((10.0, 0.1, 1.0, 10.0), id="no deeper"),
    pytest.param((3.0, 0.1, 1.0, 3.0), id="shallower"),
    pytest.param((math.nan, 0.1, 1.0, 3.0), id="no depth"),
    pytest.param((math.inf, 0.1, 1.0, 3.0), id="an infinite depth"),
    pytest.param((20.0, math.nan, 1.0, 20.0), id="no inclination"),
    pytest.param((20.0, 0.1, math.nan, 20.0), id="no azimuth"),
    pytest.param((20.0, 0.1, math.inf, 20.0), id="an infinite azimuth"),
    pytest.param((20.0, 0.1, 1.0, math.nan), id="no vertical depth"),
    pytest.param((20.0, 0.1, 1.0, math.inf), id="an infinite vertical depth"),
]


@pytest.mark.slow
@pytest.mark.parametrize("station", BAD)
@pytest.mark.parametrize("before", [0, 1, 2])
def test_a_refused_station_leaves_everything_as_it_was(station: tuple[float, float, float, float], before: int) -> None:
    good = [(8.0, 0.0, 0.5, 8.0), (10.0, 0.05, 1.0, 10.0)]
    running, twin = (RunningUncertainty(TOOLS["mwd-rev5.1"], SITE, 5.0, 0.0, 0.0) for _ in range(2))
    for row in good[:before]:
        running.append(*row)
        twin.append(*row)
    bad = station if before == 2 or station[0] != 10.0 else (5.0, *station[1:])
    with pytest.raises(GroundError):
        running.append(*bad)
    for row in ((30.0, 0.2, 1.2, 30.0), (35.0, 0.3, 1.3, 34.0)):
        np.testing.assert_array_equal(running.append(*row), twin.append(*row))


def test_a_depth_that_does_not_grow_is_named() -> None:
    running = RunningUncertainty(TOOLS["relay"], SITE, 0.0, 0.0, 0.0)
    running.append(2.0, 0.1, 1.0, 2.0)
    with pytest.raises(SurveyError, match="uncertainty: expected a depth beyond 2 m, got 1 m"):
        running.append(1.0, 0.1, 1.0, 1.0)


@pytest.mark.parametrize(
    "weights",
    [
        pytest.param(("0", "1 / (MD - 20)", "0"), id="a division by zero"),
        pytest.param(("0", "0", "Sqrt(15 - MD)"), id="the root of a negative number"),
        pytest.param(("0", "(15 - MD)^0.5", "0"), id="a broken power of a negative number"),
        pytest.param(("0", "(MD - 11.5)^400", "0"), id="a power beyond any number"),
        pytest.param(("0", "Step(MD - 15) * 1e300 * 1e300", "0"), id="an infinite weight"),
        pytest.param(("1 / (MD - 20)", "0", "0"), id="a division by zero in the depth"),
        pytest.param(("(15 - MD)^0.5", "0", "0"), id="a broken power in the depth"),
        pytest.param(("Step(MD - 15) * 1e300 * 1e300", "0", "0"), id="an infinite weight of the depth"),
    ],
)
@pytest.mark.parametrize("mode", [Mode.RANDOM, Mode.SYSTEMATIC])
@pytest.mark.parametrize("before", [0, 1])
def test_a_weight_without_a_value_is_refused_and_nothing_was_appended(
    weights: tuple[str, str, str], mode: Mode, before: int
) -> None:
    terms = (Term("A", 1.0, "-", mode, weights), Term("B", 0.01, "rad", Mode.SYSTEMATIC, ("0", "1", "0")))
    running, twin = (RunningUncertainty(Tool("mine", "", terms), SITE, 0.0, 0.1, 1.0) for _ in range(2))
    for one in (running, twin)[: 2 * before]:
        one.append(11.0, 0.1, 1.0, 11.0)
    with pytest.raises(ToolError, match="mine: a weight has no value at 20 m"):
        running.append(20.0, 0.1, 1.0, 20.0)
    np.testing.assert_array_equal(running.append(12.0, 0.1, 1.0, 12.0), twin.append(12.0, 0.1, 1.0, 12.0))


@pytest.mark.parametrize("name", ["mwd-rev5.1", "gyro-continuous", "relay"])
def test_without_singular_weights_a_vertical_hole_has_their_limit_or_is_refused(name: str) -> None:
    terms = tuple(Term(t.name, t.value, t.unit, t.mode, t.weights, None, t.position) for t in TOOLS[name].terms)
    running = RunningUncertainty(TOOLS[name].with_terms(terms), SITE, 0.0, 0.0, 0.0)
    twin = RunningUncertainty(TOOLS[name], SITE, 0.0, 0.0, 0.0)
    try:
        cov = running.append(2.0, 0.0, 0.4, 2.0, {"SigmaForce": 0.01})
    except ToolError:
        return
    expected = twin.append(2.0, 0.0, 0.4, 2.0, {"SigmaForce": 0.01})
    np.testing.assert_allclose(cov, expected, rtol=1e-9, atol=1e-12)


def test_a_tool_outside_its_inclinations_is_refused_as_for_the_whole_survey() -> None:
    running, twin = (RunningUncertainty(TOOLS["rst-inclinometer"], SITE, 0.0, 0.0, 0.0) for _ in range(2))
    with pytest.raises(ToolError, match=r"rst-inclinometer: made for inclinations of 0\.\.30 deg"):
        running.append(2.0, 31.0 * DEG, 0.0, 2.0)
    row = (4.0, 29.0 * DEG, 0.0, 3.9)
    np.testing.assert_array_equal(running.append(*row), twin.append(*row))


@pytest.mark.slow
@given(STATIONS, st.sampled_from(shipped()))
def test_a_region_only_needs_what_its_tool_asks_of_the_record(
    rows: list[tuple[float, float, float]], name: str
) -> None:
    survey = survey_of(rows, 1)
    asked = {r for r in RECORD if any(r in formula for term in TOOLS[name].terms for formula in term.formulas)}
    full, sparse = begun(TOOLS[name], survey), begun(TOOLS[name], survey)
    for k in range(1, len(rows)):
        row = (float(column[k]) for column in (survey.md, survey.inclination, survey.azimuth, survey.tvd))
        got = sparse.append(*row, {r: float(survey.record[r][k]) for r in asked})
        np.testing.assert_array_equal(append(full, survey, k), got)
