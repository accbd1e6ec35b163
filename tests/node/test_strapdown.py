"""Integration of the rates against closed-form motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node.kernels.filter.float64.strapdown import rotate_down, yaw_rate


def lean(inclination: float, azimuth: float) -> np.ndarray:
    """Smallest rotation that takes the vertical to the tube axis (Rodrigues)."""
    axis = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(inclination) * skew + (1 - math.cos(inclination)) * skew @ skew


def attitude(t: float, spin: float, i0: float, di: float, a0: float, da: float) -> np.ndarray:
    psi = spin * t
    turn = np.array([[math.cos(psi), -math.sin(psi), 0], [math.sin(psi), math.cos(psi), 0], [0, 0, 1.0]])
    return lean(i0 + di * t, a0 + da * t) @ turn


def body_rate(t: float, *motion: float) -> np.ndarray:
    h = 1e-5
    r = attitude(t, *motion)
    skew = r.T @ (attitude(t + h, *motion) - attitude(t - h, *motion)) / (2 * h)
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


@settings(max_examples=20)
@given(
    spin=st.floats(-1.3, 1.3),
    i0=st.floats(0.01, 2.9),
    di=st.floats(-0.005, 0.005),
    a0=st.floats(0.0, 6.28),
    da=st.floats(-0.1, 0.1),
)
@pytest.mark.slow
def test_any_motion_of_the_axis_is_followed(spin: float, i0: float, di: float, a0: float, da: float) -> None:
    motion = (spin, i0, di, a0, da)
    steps, dt = 500, 0.004
    down = attitude(0.0, *motion).T @ np.array([0.0, 0.0, 1.0])
    yaw = 0.0
    for k in range(steps):
        w = body_rate((k + 0.5) * dt, *motion)
        rotate_down(down, *w, 0.5 * dt)
        yaw += yaw_rate(down, *w) * dt
        rotate_down(down, *w, 0.5 * dt)
    expected = attitude(steps * dt, *motion).T @ np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(down, expected, atol=2e-5)
    assert yaw == pytest.approx(spin * steps * dt, abs=3e-5)


def test_the_spin_of_one_cycle_is_exact_and_does_not_grow_the_tilt() -> None:
    tilt = math.radians(3.0)
    down = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    spin, dt = math.radians(71.0), 1.0 / 1.9
    for _ in range(10_000):
        rotate_down(down, 0.0, 0.0, spin, dt)
    angle = -spin * dt * 10_000
    expected = [math.sin(tilt) * math.cos(angle), math.sin(tilt) * math.sin(angle), math.cos(tilt)]
    np.testing.assert_allclose(down, expected, atol=1e-9)


def test_treating_yaw_as_the_integral_of_wz_is_wrong_when_the_azimuth_of_the_axis_turns() -> None:
    motion = (0.0, math.radians(60.0), 0.0, 0.0, 0.1)
    w = body_rate(1.0, *motion)
    down = attitude(1.0, *motion).T @ np.array([0.0, 0.0, 1.0])
    assert yaw_rate(down, *w) == pytest.approx(0.0, abs=1e-8)
    assert abs(w[2]) > 0.04
