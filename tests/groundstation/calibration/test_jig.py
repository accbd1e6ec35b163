"""Errors of a jig: intervals hold what they state though all readings of one setting err alike."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from groundstation.calibration.attitudes import fit_attitudes, true_vectors
from groundstation.calibration.coverage import coverage_factor
from groundstation.calibration.intervals import Interval, Spread, coverage_interval
from groundstation.calibration.jig import Jig, cross_product_matrices, reading_errors, settings_of, spreads_of
from groundstation.calibration.mwd_solve import solve_accelerometers
from groundstation.calibration.turntable import SETTINGS, as_observations
from groundstation.report.calibration_sheets import AttitudeErrors, linear_sheet
from sim.instruments.mwd_jig import Heating, draw_tool, make_design, measure_tool
from telemetry.errors import CalibrationError

MATRIX = np.array([[9.9, 0.2, -0.1], [-0.3, 9.7, 0.15], [0.05, -0.25, 9.85]])
BIAS = np.array([0.1, -0.2, 0.3])
NINE = ((0, 0), (0, 90), (0, 180), (0, -90), (90, 0), (-90, 0), (45, 0), (-45, 90), (0, 45))
NOISE, LEAN = 0.01, 1e-3  # of a reading, rad of a setting: alike in the readings of an accelerometer in m/s2
DESIGNS = {"turn table": 2, "nine attitudes": 5, "nine, nine times": 77}


def design(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Truth (n, 3) and settings (n,)."""
    if name == "turn table":
        return as_observations(np.zeros((3, 3)), np.zeros((3, 3)), 1.0)[0], SETTINGS
    nine = true_vectors(*np.radians(np.array(NINE, float)).T)
    truth = nine if name == "nine attitudes" else np.tile(nine, (9, 1))
    return truth, settings_of(truth)


SHARES = (0.01, 0.1, 0.3, 0.6, 1.0, 3.0, 10.0, 100.0)  # of noise to what a lean does to a reading


@functools.cache
def intervals_of(name: str, jig: Jig) -> list[list[Interval]]:
    """Intervals of bias and of the columns of the matrix, by axis."""
    truth, settings = design(name)
    basis = np.column_stack([np.ones(len(truth)), truth])
    spreads = spreads_of(basis, reading_errors(truth, MATRIX, settings, jig))
    return [[coverage_interval(spread) for spread in row] for row in spreads]


def held(name: str, share: float, runs: int, jig: Jig) -> np.ndarray:
    """Share of bias and of the columns of the matrix (4, 3) within their intervals."""
    truth, settings = design(name)
    rng, wanted = np.random.default_rng(15), np.vstack([BIAS, MATRIX.T])
    basis = np.column_stack([np.ones(len(truth)), truth])
    n = (runs, len(truth), 3)
    turns = jig.common * rng.normal(size=(runs, settings.max() + 1, 3))[:, settings] + jig.random * rng.normal(size=n)
    readings = (truth + np.cross(turns, truth)) @ MATRIX.T + BIAS + share * NOISE * rng.normal(size=n)
    found = np.linalg.pinv(basis) @ readings
    squares = np.sum((readings - basis @ found) ** 2, axis=1)
    half = [[one.half_width(squares[:, axis]) for axis, one in enumerate(row)] for row in intervals_of(name, jig)]
    inside = np.abs(found - wanted) <= np.moveaxis(np.array(half), -1, 0)
    return np.asarray(np.mean(inside, axis=0))


@pytest.mark.statistical
@pytest.mark.parametrize("name", DESIGNS)
def test_intervals_hold_95_percent_of_4000_runs(name: str) -> None:
    for share in SHARES:
        inside = held(name, share, 4000, Jig(LEAN, 0.0))
        assert np.all((inside > 0.93) & (inside < 0.97)), share


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
def test_intervals_hold_95_percent_whatever_is_the_jigs(name: str) -> None:
    for share in SHARES[:-1:3]:
        inside = held(name, share, 1000, Jig(LEAN, 0.0))
        assert 0.93 < np.mean(inside) < 0.97, share


@pytest.mark.slow
def test_the_fit_states_these_intervals_and_the_residuals_alone_hold_less() -> None:
    truth, settings = design("nine, nine times")
    assert fit_attitudes(truth, truth @ MATRIX.T + BIAS, jig=Jig(LEAN, 0.0), settings=settings).degrees == 77
    rng, blind = np.random.default_rng(15), []
    basis = np.column_stack([np.ones(len(truth)), truth])
    for run in range(25):
        turns = LEAN * rng.normal(size=(settings.max() + 1, 3))[settings]
        readings = (truth + np.cross(turns, truth)) @ MATRIX.T + BIAS + NOISE * rng.normal(size=truth.shape)
        plain = fit_attitudes(truth, readings)
        blind.append(np.abs(plain.matrix - MATRIX) <= plain.matrix_expanded())
        if run == 0:
            found = fit_attitudes(truth, readings, jig=Jig(LEAN, 0.0), settings=settings)
            spreads = spreads_of(basis, reading_errors(truth, found.matrix, settings, Jig(LEAN, 0.0)))
            squares = np.sum(found.residuals**2, axis=0)
            mine = [
                [float(coverage_interval(s).half_width(squares[axis])) for axis, s in enumerate(row)] for row in spreads
            ]
            np.testing.assert_allclose(np.vstack([found.bias_expanded(), found.matrix_expanded().T]), mine)
    assert np.mean(blind) < 0.85  # what the residuals alone call 95 %


def test_a_jig_common_and_random_in_part_is_held_too() -> None:
    inside = held("nine attitudes", 0.1, 1000, Jig(0.7 * LEAN, 0.7 * LEAN))
    assert 0.93 < np.mean(inside) < 0.97


@pytest.mark.parametrize("degrees", [1, 2, 5, 77])
def test_without_a_jig_the_interval_is_students(degrees: int) -> None:
    none = np.zeros(0)
    found = coverage_interval(Spread(2.0, 0.0, none, none, degrees)).half_width(np.array([4.0 * degrees]))
    np.testing.assert_allclose(found, math.sqrt(8.0) * coverage_factor(degrees), rtol=1e-9)


@pytest.mark.parametrize("degrees", [2, 77])
def test_noise_far_beyond_the_jig_is_students_too(degrees: int) -> None:
    one = Spread(2.0, 1e-9, np.array([1e-9]), np.array([1e-9]), degrees)
    np.testing.assert_allclose(
        coverage_interval(one).half_width(np.array([4.0 * degrees])),
        math.sqrt(8.0) * coverage_factor(degrees),
        rtol=0.1,
    )


def test_a_known_jig_alone_is_normal_where_readings_are_many() -> None:
    spread = Spread(0.1, 9.0, np.zeros(0), np.zeros(0), 400)
    np.testing.assert_allclose(coverage_interval(spread).half_width(np.array([1e-3])), 3.0 * 1.959964, rtol=0.01)


def test_a_lean_moves_readings_across_the_truth_and_by_the_sensors_matrix() -> None:
    truth = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    found = reading_errors(truth, 2.0 * np.eye(3), np.array([0, 0, 1]), Jig(1e-3, 0.0))
    np.testing.assert_allclose(found[0, :, 0, :], 4e-6 * np.diag([1.0, 1.0, 0.0]), atol=1e-18)
    np.testing.assert_allclose(found[0, :, 1, :], found[0, :, 0, :])
    np.testing.assert_allclose(found[0, :, 2, :], 0.0, atol=1e-18)
    np.testing.assert_allclose(cross_product_matrices(truth)[2] @ np.array([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0])


@pytest.mark.parametrize("times", [0.0, 0.02, 0.2])
def test_residuals_too_small_for_a_jig_give_its_own_intervals_and_say_so(times: float) -> None:
    """Readings that err by a fraction of the stated jig refute it; no interval is narrower than its standard error."""
    truth, settings = design("nine, nine times")
    rng, jig = np.random.default_rng(3), Jig(0.0, 10.0 * LEAN)
    turns = times * jig.random * rng.normal(size=truth.shape)
    fit = fit_attitudes(truth, (truth + np.cross(turns, truth)) @ MATRIX.T + BIAS, None, jig, settings)
    assert fit.combined is not None
    assert fit.combined.refuted.tolist() == [True] * 3
    assert np.allclose(fit.matrix_expanded(), 1.959964 * fit.matrix_std(), rtol=1e-6)
    assert np.allclose(fit.bias_expanded(), 1.959964 * fit.bias_std(), rtol=1e-6)
    warned = "residuals of x, y, z are smaller than the jig's stated errors leave them in 998 of 1000 records"
    names = [str(k) for k in range(len(truth))]
    sheet = linear_sheet("t", fit, AttitudeErrors(names, "g", fit.residuals[:, 0], fit.residuals[:, 0]), "", ())
    assert [line.startswith(warned) for line in sheet.warnings] == [True]


def test_residuals_of_a_jig_as_it_is_stated_refute_nothing() -> None:
    truth, settings = design("nine, nine times")
    refuted = 0
    for seed in range(20):
        turns = 10.0 * LEAN * np.random.default_rng(seed).normal(size=truth.shape)
        fit = fit_attitudes(truth, (truth + np.cross(turns, truth)) @ MATRIX.T, None, Jig(0.0, 10.0 * LEAN), settings)
        assert fit.combined is not None
        refuted += int(fit.combined.refuted.sum())
    assert refuted <= 1  # of 60 axes, where one in five hundred is expected


def test_a_jig_without_errors_is_refuted_by_nothing() -> None:
    without = coverage_interval(Spread(0.2, 0.0, np.zeros(0), np.zeros(0), 5))
    assert not without.is_refuted_by(np.array([0.0, 1e-300, 1.0])).any()
    assert without.half_width(np.array([4.0])) == pytest.approx(2.570582 * math.sqrt(0.2 * 4.0 / 5.0), rel=1e-6)


def test_a_stated_jig_without_errors_changes_nothing() -> None:
    truth, settings = design("nine attitudes")
    readings = truth @ MATRIX.T + BIAS + 0.01 * np.random.default_rng(3).normal(size=truth.shape)
    plain, stated = fit_attitudes(truth, readings), fit_attitudes(truth, readings, jig=Jig(0.0, 0.0), settings=settings)
    np.testing.assert_allclose(stated.matrix_std(), plain.matrix_std(), rtol=1e-9)
    np.testing.assert_allclose(stated.bias_expanded(), plain.bias_expanded(), rtol=2e-4)


@pytest.mark.parametrize("values", [(-1e-3, 0.0), (0.0, math.nan)])
def test_a_jig_that_cannot_be_is_refused(values: tuple[float, float]) -> None:
    with pytest.raises(CalibrationError, match="jig: expected two standard deviations, got"):
        Jig(*values)


SHOWN = 60  # runs solved without the jig too


def mwd_runs(runs: int) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Share of the z terms of an MWD tool in their intervals, and their scatter over both standard errors."""
    tool, nominal, lean = draw_tool(2), make_design(Heating.ROOM), 2e-4
    exact = measure_tool(tool, nominal, 0, noise=0.0, jig_std=0.0)
    truth = solve_accelerometers(exact.gravity_volts, exact.temperature, nominal.tilt, 12).coefficients
    names, rng = ("SF_C0", "B_C0"), np.random.default_rng(4)
    tilts, setting = np.unique(nominal.tilt, return_inverse=True)
    off, stated, blind = [], [], []
    for seed in range(runs):
        lean_of = lean * rng.normal(size=len(tilts)) * ((tilts > 1e-6) & (tilts < math.pi - 1e-6))
        stood = dataclasses.replace(nominal, tilt=nominal.tilt + lean_of[setting])
        record = measure_tool(tool, stood, seed, jig_std=0.0)
        readings = (record.gravity_volts, record.temperature, nominal.tilt, 12)
        found = solve_accelerometers(*readings, jig=Jig(lean, 0.0))
        off.append([found.coefficients[name] - truth[name] for name in names])
        stated.append([found.standard_errors[name] for name in names])
        if seed < SHOWN:
            blind.append(list(map(solve_accelerometers(*readings).standard_errors.__getitem__, names)))
    errors, mine, theirs = map(np.array, (off, stated, blind))
    inside = np.mean(np.abs(errors) <= coverage_factor(100) * mine, axis=0)
    scatter = np.std(errors, axis=0, ddof=1)
    return tuple(  # type: ignore[return-value]
        dict(zip(names, values.tolist(), strict=True))
        for values in (inside, scatter / np.mean(mine, axis=0), scatter / np.mean(theirs, axis=0))
    )


@pytest.mark.statistical
@pytest.mark.timeout(1200)
def test_the_z_terms_of_4000_mwd_tools_lie_in_their_intervals() -> None:
    inside, _, _ = mwd_runs(4000)
    assert all(0.93 < share < 0.97 for share in inside.values()), inside


@pytest.mark.slow
def test_the_z_terms_of_an_mwd_tool_scatter_as_stated() -> None:
    _, stated, blind = mwd_runs(SHOWN)
    assert all(0.75 < ratio < 1.3 for ratio in stated.values()), stated
    assert blind["B_C0"] > 2.3  # what it was without the jig
    assert blind["SF_C0"] > 1.6
