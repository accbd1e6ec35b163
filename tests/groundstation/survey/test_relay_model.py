"""The error model of our own chain against tubes that feel gravity with drawn errors, at every inclination."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey

DEG = math.pi / 180.0
G, LENGTH, DRAWS = 9.81, 100.0, 20_000
FORCE_STD, YAW_STD = 0.05, 0.3 * DEG  # m/s^2 and rad


def drawn_directions(inclination: float, azimuth: float) -> np.ndarray:
    """Directions (DRAWS, 3) of a tube at rest, resolved from the forces along its axes and its yaw.

    A tube stands by a turn about its axis, its yaw, and then the shortest turn that leans it. So gravity seen from it
    lies against the lean, turned back by the yaw.
    """
    random = np.random.default_rng(round(1e3 * inclination))
    face = random.uniform(0.0, math.tau, DRAWS)
    axis = Rotation.from_rotvec(inclination * np.array([-math.sin(azimuth), math.cos(azimuth), 0.0]))
    body = axis * Rotation.from_euler("z", face[:, None])
    force = body.inv().apply([0.0, 0.0, -G]) + FORCE_STD * random.standard_normal((DRAWS, 3))
    down = -force / np.linalg.norm(force, axis=1)[:, None]
    lean = Rotation.from_euler("z", (face + YAW_STD * random.standard_normal(DRAWS))[:, None]).apply(down)
    return np.asarray(lean * [-1.0, -1.0, 1.0])


@pytest.mark.parametrize("inclination_deg", [0.0, 5.0, 30.0, 60.0, 88.0, 90.0, 120.0, 175.0])
def test_a_hole_errs_as_the_forces_and_yaws_of_its_tubes_do(inclination_deg: float) -> None:
    inclination, azimuth = inclination_deg * DEG, 0.7
    there = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth), 0.0])
    there[2] = math.cos(inclination)
    drawn = 0.5 * LENGTH * (drawn_directions(inclination, azimuth) - there)  # half of the leg turns with its end
    pair = np.ones(2)
    sigmas = {"SigmaForce": FORCE_STD, "SigmaYaw": YAW_STD, "SigmaSystematic": 0.0, "Readings": 1.0}
    record = {name: value * pair for name, value in sigmas.items()}
    survey = WellSurvey(
        np.array([0.0, LENGTH]), inclination * pair, azimuth * pair, np.array([0.0, LENGTH * there[2]]), record
    )
    found = propagate_errors(survey, [Leg(load_tool("relay"))], Site(G)).cov[-1]
    expected = drawn.T @ drawn / DRAWS + 0.002**2 * np.outer(there, there)  # of the tally
    size = float(np.trace(expected))
    across = np.linalg.svd(there[None])[2]  # along the hole, and two ways across
    np.testing.assert_allclose(across @ found @ across.T, across @ expected @ across.T, rtol=0.05, atol=0.01 * size)
    up_and_down = np.array([*(-there[2] * there[:2] / max(np.hypot(*there[:2]), 1e-9)), np.hypot(*there[:2])])
    if inclination_deg >= 5.0:  # up and down it errs as much at every inclination
        assert float(up_and_down @ found @ up_and_down) == pytest.approx((0.5 * LENGTH * FORCE_STD / G) ** 2, rel=0.02)
