"""The model of the MWD tool: azimuth whatever the tool face, inverse, gauge, and derivatives against complex steps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.calibration.mwd_model import (
    LocalModel,
    Triad,
    axis_signs,
    coefficient_names,
    gravity_inclination,
    magnetic_azimuth,
    magnetic_dip,
    nominal_triad,
    tool_face,
    tool_readings,
    turned_triad,
    vectors_of_volts,
)
from sim.instruments.mwd_jig import DIP, FIELD, Heating, draw_tool, make_design, measure_tool, true_vectors
from telemetry.errors import CalibrationError

DEG = math.pi / 180.0
TINY = 1e-30  # imaginary, of a complex step


def ideal(inclination: float, face: float, azi: float) -> tuple[np.ndarray, np.ndarray]:
    return true_vectors(np.array([inclination]), np.array([face]), np.array([azi]))


def difference(a: float, b: float) -> float:
    return math.remainder(a - b, 2.0 * math.pi)


@given(
    inclination=st.floats(10.0 * DEG, 120.0 * DEG),
    face=st.floats(0.0, 2.0 * math.pi),
    azi=st.floats(0.0, 2.0 * math.pi),
)
def test_azimuth_is_exact_at_every_tool_face(inclination: float, face: float, azi: float) -> None:
    gravity, field = ideal(inclination, face, azi)
    assert gravity_inclination(gravity)[0] == pytest.approx(inclination, abs=1e-12)
    assert abs(difference(magnetic_azimuth(gravity, field)[0], azi)) < 1e-11
    assert abs(difference(tool_face(gravity)[0], face)) < 1e-11
    assert magnetic_dip(gravity, field)[0] == pytest.approx(DIP, abs=1e-12)


def test_the_printed_minus_would_spread_azimuth_over_the_tool_face() -> None:
    face = np.linspace(0.0, 2.0 * math.pi, 36, endpoint=False)
    same = np.ones_like(face)
    (ga, gb, gc), (hx, hy, hz) = (v.T for v in true_vectors(60.0 * DEG * same, face, 50.0 * DEG * same))
    wrong = np.arctan2(hx * gb - hy * ga, gc * (hx * ga - hy * gb) + hz * (ga * ga + gb * gb))
    assert np.ptp(np.degrees(np.angle(np.exp(1j * (wrong - 50.0 * DEG))))) > 20.0


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6))
def test_voltages_of_a_tool_lead_back_to_what_it_stood_in(seed: int) -> None:
    tool, design = draw_tool(seed), make_design(Heating.ALTERNATING)
    record = measure_tool(tool, design, seed, noise=0.0, jig_std=0.0)
    seen = tool_readings(
        tool.accelerometers, tool.magnetometers, record.gravity_volts, record.field_volts, record.temperature
    )
    assert np.allclose(seen.tilt, design.tilt, atol=1e-7)  # arctan2 loses half the digits on the axis
    assert np.allclose(seen.gravity_size, 1.0, atol=1e-13)
    assert np.allclose(seen.field_size, FIELD, atol=1e-11)


def test_a_turned_triad_turns_its_outputs_and_nothing_else() -> None:
    triad = draw_tool(3).accelerometers
    random = np.random.default_rng(1)
    volts, temperature = 3.0 * random.standard_normal((20, 3)), random.uniform(20.0, 90.0, 20)
    c, s = math.cos(0.3), math.sin(0.3)
    expected = vectors_of_volts(triad, volts, temperature) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(vectors_of_volts(turned_triad(triad, 0.3), volts, temperature), expected, atol=1e-13)


def test_sixty_coefficients_have_sixty_names_and_come_back_by_name() -> None:
    tool = draw_tool(1)
    both = tool.accelerometers.coefficients() | tool.magnetometers.coefficients()
    assert len(both) == 60
    assert {"SF_A0", "B_C3", "m_AB", "SF_X0", "m_ZY"} <= set(both)
    back = Triad.of("ABC", tool.accelerometers.coefficients())
    assert np.array_equal(back.scale, tool.accelerometers.scale)
    assert np.array_equal(back.cross, tool.accelerometers.cross)
    assert len(coefficient_names("ABC", 12)) == 12


def test_missing_and_unknown_coefficients_are_named() -> None:
    coefficients = nominal_triad("XYZ", 0.06).coefficients()
    del coefficients["m_XZ"]
    with pytest.raises(CalibrationError, match=r"m_XZ.*SF_Q0"):
        Triad.of("XYZ", coefficients | {"SF_Q0": 1.0})


@pytest.fixture
def local_point() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(7)
    return random.standard_normal((5, 3)), 0.05 * random.standard_normal(12)


def local_at(w: np.ndarray, z: np.ndarray, axes: str) -> LocalModel:
    return LocalModel.at(w, np.tile(z[:3], (len(w), 1)), np.tile(z[3:6], (len(w), 1)), z[6:], axis_signs(axes))


@pytest.mark.parametrize("axes", ["ABC", "XYZ"])
def test_first_derivatives_are_those_of_a_complex_step(local_point: tuple, axes: str) -> None:
    w, z = local_point
    jacobian = local_at(w, z, axes).jacobian()
    for a, step in enumerate(1j * TINY * np.eye(12)):
        at = local_at(w, z + step, axes)
        assert np.allclose(jacobian[:, :, a], at.vector.imag / TINY, rtol=1e-13, atol=1e-14)
        if a < 3:
            assert np.allclose(local_at(w, z, axes).slope[:, a], at.u[:, a].imag / TINY, rtol=1e-13)


@pytest.mark.parametrize("axes", ["ABC", "XYZ"])
def test_second_derivatives_are_those_of_a_complex_step(local_point: tuple, axes: str) -> None:
    w, z = local_point
    weight = np.random.default_rng(8).standard_normal((5, 3))
    curvature = local_at(w, z, axes).curvature(weight)
    for a, step in enumerate(1j * TINY * np.eye(12)):
        stepped = np.einsum("nk,nkb->nb", weight, local_at(w, z + step, axes).jacobian().imag / TINY)
        assert np.allclose(curvature[:, a, :], stepped, rtol=1e-13, atol=1e-14)
