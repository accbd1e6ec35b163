"""Regions of uncertainty: the printed examples, an independent library, and hand-worked wells."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wells import (
    DEG,
    MWD,
    SITE,
    WELLS,
    angle_term,
    hand_well,
    import_welleng,
    largest_difference,
    random_well,
    survey_of,
    tool_of,
    well_of,
)

from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool, shipped_tool_names
from groundstation.survey.well.error_propagation import Uncertainty, propagate_errors
from groundstation.survey.well.error_sources import RECORD, Leg, Site, WellSurvey


def test_the_accelerometer_example_has_its_printed_digits() -> None:
    tool = tool_of(
        Term("XY", 1.712168e-3, "m/s2", PropagationMode.SYSTEMATIC, ("0", "Cos(Inc) / GField", "0")),
        Term("Z", 1.494e-7, "m/s2", PropagationMode.SYSTEMATIC, ("0", "Sin(Inc) / GField", "0")),
    )
    survey = survey_of(np.array([0.0, 3.0]), np.full(2, 5.0 * DEG), np.full(2, 30.0 * DEG))
    cov = propagate_errors(survey, [Leg(tool)], Site(gravity=9.81)).cov[1]
    north, east, down = np.sqrt(np.diag(cov))
    assert (round(north, 6), round(east, 7), round(down, 8)) == (0.000225, 0.0001299, 0.00002273)
    assert cov[0, 1] == pytest.approx(north * east)
    assert cov[0, 2] == pytest.approx(-north * down)


def test_the_gyro_example_has_its_printed_digits() -> None:
    tool = tool_of(Term("GD", 0.01, "deg/s", PropagationMode.SYSTEMATIC, ("0", "0", "Time")))
    angles = np.full(2, 5.0 * DEG), np.full(2, 30.0 * DEG)
    md = np.array([0.0, 3.0])
    survey = WellSurvey(md, *angles, md, {"Time": np.array([0.0, 100.0])})
    north, east, down = np.sqrt(np.diag(propagate_errors(survey, [Leg(tool)], SITE).cov[1]))
    # the print took the sine of the error of one degree, which the model, linear, does not
    bent = math.sin(1.0 * DEG) / (1.0 * DEG)
    assert (round(north * bent, 8), round(east * bent, 7), down) == (0.00114081, 0.0019759, 0.0)
    np.testing.assert_allclose([north, east], [0.00114081, 0.0019759], rtol=8e-5)


def test_a_survey_without_times_takes_a_hundred_seconds_for_a_rod_of_two_metres() -> None:
    tool = tool_of(Term("GD", 1e-4, "rad", PropagationMode.SYSTEMATIC, ("0", "0", "Time")))
    angles = np.full(2, 90.0 * DEG), np.zeros(2)
    md = np.array([0.0, 2.0])
    assert propagate_errors(WellSurvey(md, *angles, md), [Leg(tool)], SITE).cov[1, 1, 1] == pytest.approx(
        (1e-4 * 100.0) ** 2
    )


@pytest.mark.slow
def test_every_source_of_the_mwd_model_agrees_with_the_independent_library() -> None:
    rng = np.random.default_rng(10)
    welleng = import_welleng()
    header = welleng.survey.SurveyHeader(
        latitude=60, longitude=2, altitude=0, b_total=50_000, dip=72, declination=3, convergence=0, G=9.80665,
        azi_reference="true",
    )  # fmt: skip
    for _ in range(WELLS):
        md, inclination, azimuth = random_well(rng)
        azimuth = np.where(inclination > 0.0, azimuth, 0.0)  # the library takes errors along one that means nothing
        errors = welleng.survey.Survey(md, inclination, azimuth, header=header, error_model="ISCWSA MWD Rev5.11").err
        ours = propagate_errors(survey_of(md, inclination * DEG, azimuth * DEG), [Leg(MWD)], SITE, slot_allowance=True)
        by_source = ours.by_source()
        assert set(by_source) == set(errors.errors.errors)
        assert len(by_source) == 35
        for name, cov in by_source.items():
            assert largest_difference(cov, errors.errors.errors[name].cov_NEV) < 1e-3, name
        assert largest_difference(ours.cov, errors.errors.cov_NEVs) < 1e-3


@pytest.mark.parametrize("name", shipped_tool_names())
@pytest.mark.parametrize("slot_allowance", [False, True])
def test_the_sources_add_up_to_the_whole(name: str, slot_allowance: bool) -> None:
    survey = well_of(11, 40, steepest=29.0 * DEG)
    survey = WellSurvey(survey.md, survey.inclination, survey.azimuth, survey.tvd, {"SigmaYaw": np.full(40, 0.01)})
    tool = load_tool(name)
    found = propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=slot_allowance)
    by_source = found.by_source()
    assert list(by_source) == [term.name for term in tool.terms]
    np.testing.assert_allclose(sum(by_source.values())[1:], found.cov[1:], rtol=1e-10, atol=1e-15)  # type: ignore[index]


def test_the_sources_of_several_legs_add_up_to_the_whole() -> None:
    survey = well_of(12, 30, steepest=29.0 * DEG)
    legs = [Leg(MWD), Leg(load_tool("rst-inclinometer"), 9), Leg(MWD, 17), Leg(load_tool("stim300"), 29)]
    found = propagate_errors(survey, legs, SITE)
    np.testing.assert_allclose(sum(found.by_source().values())[1:], found.cov[1:], rtol=1e-10, atol=1e-15)  # type: ignore[index]


@pytest.mark.parametrize(
    ("mode", "expected"),
    # e_1 = 5 + 5, then + 5, and e*_k = 5: the print's sums by hand
    [
        (PropagationMode.RANDOM, [25.0, 100.0 + 25.0, 200.0 + 25.0]),
        (PropagationMode.SYSTEMATIC, [25.0, (10.0 + 5.0) ** 2, (20.0 + 5.0) ** 2]),
        (PropagationMode.WELL, [25.0, 225.0, 625.0]),
        (PropagationMode.GLOBAL, [25.0, 225.0, 625.0]),
    ],
)
def test_a_hand_worked_well_has_its_variances_by_mode(mode: PropagationMode, expected: list[float]) -> None:
    cov = propagate_errors(hand_well(4), [Leg(tool_of(angle_term("A", 0.01, mode, "1")))], SITE).cov
    np.testing.assert_allclose(cov[1:, 0, 0], 1e-4 * np.array(expected))
    np.testing.assert_allclose(cov[:, 1:, 1:], 0.0, atol=1e-30)
    assert np.all(cov[0] == 0.0)


@pytest.mark.parametrize(
    ("mode", "expected"),
    [(PropagationMode.RANDOM, [100.0, 225.0 + 25.0]), (PropagationMode.SYSTEMATIC, [100.0, (15.0 + 5.0) ** 2])],
)
def test_the_slot_allowance_gives_the_first_station_the_whole_first_leg(
    mode: PropagationMode, expected: list[float]
) -> None:
    tool = tool_of(angle_term("A", 0.01, mode, "1"))
    cov = propagate_errors(hand_well(), [Leg(tool)], SITE, slot_allowance=True).cov
    np.testing.assert_allclose(cov[1:, 0, 0], 1e-4 * np.array(expected))


def test_a_hand_worked_well_has_its_variances_of_depth() -> None:
    survey = hand_well()
    read = propagate_errors(
        survey, [Leg(tool_of(Term("D", 0.2, "m", PropagationMode.RANDOM, ("1", "0", "0"))))], SITE
    ).cov
    np.testing.assert_allclose(read[:, 2, 2], 0.04)
    scale = propagate_errors(
        survey, [Leg(tool_of(Term("D", 1e-3, "-", PropagationMode.SYSTEMATIC, ("MD", "0", "0"))))], SITE
    ).cov
    np.testing.assert_allclose(scale[:, 2, 2], [0.0, 1e-4, 4e-4])
    np.testing.assert_allclose(read[:, :2, :2], 0.0, atol=1e-30)


def test_a_well_that_begins_below_the_datum_has_no_error_there() -> None:
    md = np.array([5.0, 15.0])
    survey = WellSurvey(md, np.zeros(2), np.zeros(2), md)
    cov = propagate_errors(
        survey, [Leg(tool_of(Term("D", 0.2, "m", PropagationMode.RANDOM, ("1", "0", "0"))))], SITE
    ).cov
    np.testing.assert_allclose(cov[:, 2, 2], [0.0, 0.04])


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        # station 1 in the first leg, 2 and 3 in the second
        (PropagationMode.RANDOM, [25.0, 125.0, 225.0]),
        (PropagationMode.SYSTEMATIC, [25.0, 100.0 + 25.0, 100.0 + 225.0]),
        (PropagationMode.WELL, [25.0, 225.0, 625.0]),
        (PropagationMode.GLOBAL, [25.0, 225.0, 625.0]),
    ],
)
def test_a_new_leg_begins_a_new_systematic_error_and_no_other(mode: PropagationMode, expected: list[float]) -> None:
    tool = tool_of(angle_term("A", 0.01, mode, "1"))
    cov = propagate_errors(hand_well(4), [Leg(tool), Leg(tool, 2)], SITE).cov
    np.testing.assert_allclose(cov[1:, 0, 0], 1e-4 * np.array(expected))


def test_errors_of_the_well_go_on_in_another_tool_by_their_name() -> None:
    one = tool_of(angle_term("A", 0.01, PropagationMode.WELL, "1"), angle_term("B", 0.02, PropagationMode.WELL, "1"))
    other = tool_of(angle_term("A", 0.03, PropagationMode.WELL, "1"), angle_term("C", 0.01, PropagationMode.WELL, "1"))
    cov = propagate_errors(hand_well(), [Leg(one), Leg(other, 2)], SITE).cov[2, 0, 0]
    assert cov == pytest.approx((10 * 0.01 + 5 * 0.03) ** 2 + (10 * 0.02) ** 2 + (5 * 0.01) ** 2)


@pytest.mark.parametrize("cuts", [[1, 2], [1, 10, 11, 25], [1, 29]])
def test_two_legs_of_one_tool_are_one_where_nothing_is_systematic(cuts: list[int]) -> None:
    kept = tuple(term for term in MWD.terms if term.mode is not PropagationMode.SYSTEMATIC)
    tool = MWD.with_terms(kept)
    survey = well_of(13, 30)
    whole = propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=True)
    parts = propagate_errors(survey, [Leg(tool, first) for first in cuts], SITE, slot_allowance=True)
    np.testing.assert_allclose(parts.cov, whole.cov, rtol=1e-11, atol=1e-15)
    for name, cov in whole.by_source().items():
        np.testing.assert_allclose(parts.by_source()[name], cov, rtol=1e-11, atol=1e-15)


@pytest.mark.parametrize("cut", [2, 7, 19])
def test_the_legs_of_a_systematic_error_add_as_two_errors(cut: int) -> None:
    survey = well_of(14, 20)
    term = Term("A", 0.01, "rad", PropagationMode.SYSTEMATIC, ("0", "Cos(AzT)", "1"))
    upper = tool_of(Term("A", 0.01, "rad", PropagationMode.WELL, ("0", "Cos(AzT)", "1")))
    lower = tool_of(Term("B", 0.01, "rad", PropagationMode.WELL, ("0", "Cos(AzT)", "1")))
    legs = propagate_errors(survey, [Leg(tool_of(term)), Leg(tool_of(term), cut)], SITE)
    apart = propagate_errors(survey, [Leg(upper), Leg(lower, cut)], SITE)
    np.testing.assert_allclose(legs.cov, apart.cov, rtol=1e-12, atol=1e-18)


def least_share(found: Uncertainty) -> float:
    """Smallest eigenvalue of any station's covariance against its trace."""
    traces = np.trace(found.cov, axis1=-2, axis2=-1)
    return float(np.min(np.linalg.eigvalsh(found.cov)[..., 0] / np.where(traces > 0.0, traces, 1.0)))


@given(st.integers(0, 10_000), st.sampled_from(shipped_tool_names()), st.integers(2, 30), st.booleans())
def test_every_covariance_is_one(seed: int, name: str, count: int, allowance: bool) -> None:
    survey = well_of(seed, count, steepest=29.0 * DEG)
    found = propagate_errors(survey, [Leg(load_tool(name))], SITE, slot_allowance=allowance)
    assert np.all(np.isfinite(found.cov))
    np.testing.assert_array_equal(found.cov, np.swapaxes(found.cov, -1, -2))
    assert least_share(found) >= -1e-12


@pytest.mark.slow
@given(st.integers(0, 10_000), st.floats(-7.0, 7.0))
def test_turning_a_hole_turns_the_region_of_a_tool_that_knows_no_north(seed: int, angle: float) -> None:
    survey = well_of(seed, 12, first=1.0 * DEG)
    turned = WellSurvey(survey.md, survey.inclination, survey.azimuth + angle, survey.tvd)
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for name in ("stim300", "gyro-continuous", "relay"):
        before, after = (propagate_errors(one, [Leg(load_tool(name))], SITE).cov for one in (survey, turned))
        np.testing.assert_allclose(after, turn @ before @ turn.T, rtol=1e-7, atol=1e-12 * float(before.max()))


@pytest.mark.parametrize("azimuth_deg", [0.0, 77.0])
def test_a_vertical_hole_has_the_singular_weights_of_its_tool(azimuth_deg: float) -> None:
    md = 10.0 * np.arange(4)
    survey = WellSurvey(md, np.zeros(4), np.full(4, azimuth_deg * DEG), md)
    by_source = propagate_errors(survey, [Leg(MWD)], SITE).by_source()
    # misalignment: north and east by 0.3 deg a leg of 10 m, random
    sigma = 0.3 * DEG
    for name, axis in (("XYM3E", 0), ("XYM4E", 1)):
        np.testing.assert_allclose(by_source[name][1:, axis, axis], sigma**2 * np.array([25.0, 125.0, 225.0]))
        assert np.count_nonzero(np.abs(by_source[name][3]) > 1e-30) == 1
    # accelerometer bias across the tool face: along (-sin A, cos A), and a vertical hole has no azimuth but 0
    along = np.array([0.0, 1.0, 0.0])
    expected = (0.004 / SITE.gravity * 25.0) ** 2 * np.outer(along, along)
    np.testing.assert_allclose(by_source["ABXY-TI2S"][3], expected, atol=1e-15)
    for name in ("DECR", "AMIL", "MBZ", "XYM2", "SAGE"):
        np.testing.assert_allclose(by_source[name], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", shipped_tool_names())
def test_from_vertical_to_nearly_vertical_the_region_goes_on(name: str) -> None:
    md = 10.0 * np.arange(5)
    tool = load_tool(name)
    regions = []
    for inclination in (0.0, 1e-7, 1.7e-6, 1.8e-6, 1e-5):
        survey = WellSurvey(md, np.full(5, inclination), np.full(5, 0.5), md, {"SigmaForce": np.full(5, 0.01)})
        regions.append(propagate_errors(survey, [Leg(tool)], SITE).cov)
    assert tool.terms
    for cov in regions[1:]:
        np.testing.assert_allclose(cov, regions[0], rtol=2e-2, atol=2e-3 * float(np.max(regions[0])))


NAMED: list[tuple[str, Callable[[WellSurvey], np.ndarray]]] = [
    ("MD", lambda s: s.md[1:]),
    ("MDPrev", lambda s: s.md[:-1]),
    ("TVD", lambda s: s.tvd[1:]),
    ("Inc", lambda s: s.inclination[1:]),
    ("IncPrev", lambda s: s.inclination[:-1]),
    ("AzT", lambda s: s.azimuth[1:]),
    ("Az", lambda s: s.azimuth[1:]),
    ("AzTPrev", lambda s: s.azimuth[:-1]),
    ("AzM", lambda s: s.azimuth[1:] - 3.0 * DEG),
    ("AzMPrev", lambda s: s.azimuth[:-1] - 3.0 * DEG),
    ("GField", lambda s: np.full(len(s.md) - 1, 9.80665)),
    ("BField", lambda s: np.full(len(s.md) - 1, 50_000.0)),
    ("Dip", lambda s: np.full(len(s.md) - 1, 72.0 * DEG)),
    ("Latitude", lambda s: np.full(len(s.md) - 1, 60.0 * DEG)),
    ("EarthRate", lambda s: np.full(len(s.md) - 1, 7.292115e-5 * 3600.0)),
    ("Time", lambda s: s.record["Time"][1:]),
    ("TimePrev", lambda s: s.record["Time"][:-1]),
    ("SigmaYaw", lambda s: s.record["SigmaYaw"][1:]),
    ("SigmaSystematic", lambda s: np.full(len(s.md) - 1, RECORD["SigmaSystematic"])),
    ("SigmaForce", lambda s: np.full(len(s.md) - 1, RECORD["SigmaForce"])),
    ("Readings", lambda s: np.ones(len(s.md) - 1)),
    ("Speed", lambda s: np.full(len(s.md) - 1, 5.0)),
]


@pytest.mark.parametrize(("name", "expected"), NAMED, ids=[name for name, _ in NAMED])
def test_a_formula_sees_the_variables_of_its_station(name: str, expected: Callable[[WellSurvey], np.ndarray]) -> None:
    survey = well_of(24, 8, first=3.0 * DEG)
    record = {"Time": np.linspace(5.0, 900.0, 8), "SigmaYaw": np.linspace(0.01, 0.02, 8)}
    survey = WellSurvey(survey.md, survey.inclination, survey.azimuth, survey.tvd, record)
    tool = SurveyTool(
        "mine", "", (Term("A", 1e-6, "m", PropagationMode.RANDOM, position=("0", "0", name)),), {"Speed": 5.0}
    )
    cov = propagate_errors(survey, [Leg(tool)], SITE).cov
    effects = 1e-6 * expected(survey)
    np.testing.assert_allclose(cov[1:, 2, 2], np.cumsum(effects**2), rtol=1e-7, atol=1e-30)
