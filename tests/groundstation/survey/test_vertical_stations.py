"""A vertical station has no azimuth: whatever a file says there moves no covariance, of any tool, by either way."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.survey.tools.instruments import SurveyTool, load_tool, shipped_tool_names
from groundstation.survey.tools.owsg import owsg_names
from groundstation.survey.well.compiled_model import CompiledModel
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions

NEEDS = {"CB_Film_GMS", "CB_Film_GMS_Fl", "CB_Film_GSS", "CB_Film_GSS_Fl"}  # a running speed of their own
NAMES = (*shipped_tool_names(), *owsg_names())
# as many kinds of weights as there are: the codes of one family differ in magnitudes alone
KINDS = (
    *shipped_tool_names(), "MWD+IFR2+SAG+MS_Fl", "EMS+HRGM", "BLIND", "INC-ONLY", "DIPMETER", "CB_Film_GSS",
    "CB_Film_MMS", "GYRO-NS-CT", "GYRO-MWD_Fl", "UNKNOWN", "FINDS",
)  # fmt: skip
LEANING_ONE_WAY = ("ipst-rqh", "mpu6500", "stim300", "vectornav-100t", "rst-inclinometer")
azimuths = st.floats(-math.tau, 2.0 * math.tau)


@cache
def tool_of(name: str) -> SurveyTool:
    return load_tool(name, {"GZRunningSpeed": 1800.0} if name in NEEDS else None)


def covariance(name: str, inclination: list[float], azimuth: list[float]) -> np.ndarray:
    md = 10.0 * np.arange(len(inclination))
    inc, azi = np.array(inclination), np.array(azimuth)
    tvd = station_positions(Method.MINIMUM_CURVATURE, md, inc, azi)[:, 2]
    tool = tool_of(name)
    return propagate_errors(WellSurvey(md, inc, azi, tvd), [Leg(tool)], Site(), slot_allowance=tool.slot_allowance).cov


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=8)
@given(meaningless=st.lists(azimuths, min_size=4, max_size=4), lean=st.floats(0.0, 0.9), way=azimuths)
def test_the_azimuth_of_a_vertical_station_moves_no_covariance(
    name: str, meaningless: list[float], lean: float, way: float
) -> None:
    lean = min(lean, 0.99 * tool_of(name).inclination_range[1])
    inclination = [0.0, 0.0, 0.0, lean, 0.0]
    found = covariance(name, inclination, [*meaningless[:3], way, meaningless[3]])
    plain = covariance(name, inclination, [0.0, 0.0, 0.0, way, 0.0])
    if lean > 2e-6:
        np.testing.assert_array_equal(found, plain)
    else:
        np.testing.assert_allclose(found, plain, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["mwd-rev5.1", "relay"])
@settings(max_examples=30)
@given(meaningless=st.lists(azimuths, min_size=3, max_size=3), way=azimuths)
def test_nor_does_it_in_the_compiled_loop(name: str, meaningless: list[float], way: float) -> None:
    md, inc = 10.0 * np.arange(4), np.array([0.0, 0.0, 0.0, 0.4])
    model = compiled(name)
    _, found = model.run(Method.MINIMUM_CURVATURE, md, inc, np.array([*meaningless, way]), Site())
    _, plain = model.run(Method.MINIMUM_CURVATURE, md, inc, np.array([0.0, 0.0, 0.0, way]), Site())
    np.testing.assert_allclose(found, plain, rtol=1e-12, atol=1e-24)
    np.testing.assert_allclose(found, covariance(name, inc.tolist(), [*meaningless, way]), rtol=1e-9, atol=1e-15)


@cache
def compiled(name: str) -> CompiledModel:
    return CompiledModel(tool_of(name))


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("way", [1.1, 4.4])
def test_the_covariance_of_a_hole_that_leans_by_a_tenth_of_a_degree_does_not_jump(name: str, way: float) -> None:
    """Companions fade to nothing at 0.1 deg: on either side of it a hole is known as well as on the other."""
    covs = [covariance(name, [0.0, *[math.radians(lean)] * 3], [way] * 4)[-1] for lean in (0.0999, 0.1, 0.1001)]
    for cov in covs:
        np.testing.assert_allclose(cov, covs[1], atol=5e-3 * np.trace(covs[1]))


@pytest.mark.parametrize("name", [name for name in shipped_tool_names() if not name.startswith("mwd")])
@pytest.mark.parametrize("way", [1.1, 4.4])
def test_from_vertical_on_it_grows_in_small_steps_whichever_way_the_hole_goes(name: str, way: float) -> None:
    leans = np.radians(np.linspace(0.0, 0.01, 9))
    covs = np.array([covariance(name, [0.0, *[lean] * 3], [way] * 4)[-1] for lean in leans])
    assert np.max(np.abs(np.diff(covs, axis=0))) < 0.02 * np.trace(covs[0])


@pytest.mark.parametrize("name", LEANING_ONE_WAY)
def test_a_vertical_hole_is_no_better_known_in_one_direction_than_in_another(name: str) -> None:
    cov = covariance(name, [0.0] * 4, [0.3, 1.0, 2.0, 3.0])[-1]
    assert cov[0, 0] == pytest.approx(cov[1, 1], rel=1e-9)
    assert cov[0, 1] == pytest.approx(0.0, abs=1e-9 * cov[0, 0])
    tool = tool_of(name)
    # x and y accelerometers that err alike: (bias / g)^2 of the lean, times 25 m: the last station has half of its leg
    lean = sum(
        term.sigma**2 / (9.81**2 if "GField" in term.weights[1] else 1.0)
        for term in tool.terms
        if term.name in ("ABXY", "MIS") or (term.name == "ASF" and "Sin" not in term.weights[1])
    )
    assert math.sqrt(cov[1, 1]) == pytest.approx(25.0 * math.sqrt(lean), rel=1e-9)
