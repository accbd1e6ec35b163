"""Surveys, legs and tools of which no region of uncertainty can be told."""

import math

import numpy as np
import pytest
from wells import DEG, MWD, SITE, angle_term, hand_well, tool_of, well_of

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, WellSurvey
from groundstation.survey.well.leg_errors import covariance_at


@pytest.mark.parametrize("md", [-0.001, 30.001, math.nan, math.inf])
def test_a_depth_outside_the_survey_is_refused(md: float) -> None:
    found = propagate_errors(hand_well(4), [Leg(MWD)], SITE)
    with pytest.raises(SurveyError, match=r"expected a depth of 0\.\.30 m, got"):
        covariance_at(found, md)


@pytest.mark.parametrize("inclination", [0.0, 1e-40, 1e-13])
def test_a_weight_without_a_value_is_refused_by_its_term(inclination: float) -> None:
    tool = tool_of(
        angle_term("A", 0.01, PropagationMode.RANDOM, "1"),
        angle_term("B", 0.01, PropagationMode.SYSTEMATIC, "0", "1 / Sin(Inc)^3"),
    )
    md = 10.0 * np.arange(3)
    survey = WellSurvey(md, np.full(3, inclination), np.ones(3), md)
    with pytest.raises(ToolError, match="mine: term B: its weight has no value at a station; give singular weights"):
        propagate_errors(survey, [Leg(tool)], SITE)


@pytest.mark.parametrize("tool", [MWD, load_tool("gyro-continuous"), load_tool("relay")], ids=lambda tool: tool.name)
def test_without_singular_weights_a_vertical_hole_has_their_limit_or_is_refused(tool: SurveyTool) -> None:
    bare = tool.with_terms(
        tuple(
            Term(t.name, t.value, t.unit, t.mode, t.weights, None, t.position) if t.singular else t for t in tool.terms
        )
    )
    survey = hand_well()
    survey = WellSurvey(survey.md, survey.inclination, np.full(3, 0.4), survey.tvd, {"SigmaForce": np.full(3, 0.01)})
    try:
        cov = propagate_errors(survey, [Leg(bare)], SITE).cov
    except ToolError:
        return
    np.testing.assert_allclose(cov, propagate_errors(survey, [Leg(tool)], SITE).cov, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (("0", "1 / (MD - 10)", "0"), "term A"),
        (("Sqrt(-MD)", "0", "0"), "term A"),
        (("0", "0", "1/(TVD-TVD)"), "term A"),
    ],
)
@pytest.mark.parametrize("mode", PropagationMode)
def test_a_division_by_zero_is_refused_in_every_mode(
    weights: tuple[str, str, str], message: str, mode: PropagationMode
) -> None:
    survey = well_of(21, 4)
    survey = WellSurvey(np.array([0.0, 10.0, 20.0, 30.0]), survey.inclination, survey.azimuth, survey.tvd)
    with pytest.raises(ToolError, match=message):
        propagate_errors(survey, [Leg(tool_of(Term("A", 1.0, "rad", mode, weights)))], SITE)


def test_a_tool_outside_its_inclinations_is_refused() -> None:
    tool = load_tool("rst-inclinometer")
    survey = well_of(22, 10, steepest=30.5 * DEG)
    message = r"rst-inclinometer: made for inclinations of 0\.\.30 deg, the survey has 30\.5 deg; choose another"
    with pytest.raises(ToolError, match=message):
        propagate_errors(survey, [Leg(tool)], SITE)
    with pytest.raises(ToolError, match=message):
        propagate_errors(survey, [Leg(MWD), Leg(tool, 8)], SITE)
    assert propagate_errors(survey, [Leg(tool), Leg(MWD, 9)], SITE).cov.shape == (10, 3, 3)
    steep = well_of(22, 10, steepest=30.0 * DEG)
    assert propagate_errors(steep, [Leg(tool)], SITE).cov.shape == (10, 3, 3)


def test_a_tool_for_steep_holes_is_refused_in_a_flat_one() -> None:
    tool = tool_of(angle_term("A", 0.01, PropagationMode.RANDOM, "1"), inclination_range=(20.0 * DEG, 90.0 * DEG))
    survey = well_of(23, 5, steepest=10.0 * DEG, first=5.0 * DEG)
    with pytest.raises(ToolError, match=r"mine: made for inclinations of 20\.\.90 deg"):
        propagate_errors(survey, [Leg(tool)], SITE)


@pytest.mark.parametrize("firsts", [[], [0], [2], [1, 1], [1, 3, 2], [1, 4], [1, -1]])
def test_legs_that_do_not_fit_the_survey_are_refused(firsts: list[int]) -> None:
    with pytest.raises(SurveyError, match="legs: expected to begin at station 1 and at growing stations of the survey"):
        propagate_errors(hand_well(4), [Leg(MWD, first) for first in firsts], SITE)
