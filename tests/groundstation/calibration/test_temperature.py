"""Bias and matrix over temperature."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from groundstation.calibration import attitudes
from groundstation.calibration.temperature import TemperatureModel, fit_temperature_polynomials, from_datasheet
from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_request import TemperatureRequest
from groundstation.report.figure_panels import render_panels
from telemetry.errors import CalibrationError

SIX = np.concatenate([np.eye(3), -np.eye(3)])
TEMPERATURES = np.array([0.0, 20.0, 40.0, 60.0])
TRUTH = np.tile(SIX, (4, 1))
HELD = np.repeat(TEMPERATURES, 6)
MODEL = TemperatureModel(
    25.0,
    np.array([[0.1, -0.2, 0.3], [1e-3, 2e-3, -3e-3], [1e-5, -2e-5, 4e-6]]),
    np.array([9.81 * np.eye(3) + np.arange(9).reshape(3, 3) / 50.0, 1e-3 * np.arange(9).reshape(3, 3)]),
)


def read(model: TemperatureModel, truth: np.ndarray, temperature: np.ndarray) -> np.ndarray:
    """Readings one by one, straight from the definition."""
    rows = []
    for w, t in zip(truth, temperature, strict=True):
        difference = t - model.reference
        bias = sum(b * difference**p for p, b in enumerate(model.bias))
        matrix = sum(m * difference**q for q, m in enumerate(model.matrix))
        rows.append(matrix @ w + bias)
    return np.array(rows)


def test_the_coefficients_come_back_whatever_the_axis() -> None:
    result = fit_temperature_polynomials(TRUTH, read(MODEL, TRUTH, HELD), HELD, bias_degree=2, matrix_degree=1)
    np.testing.assert_allclose(result.model.bias[0], MODEL.bias[0], atol=1e-12)
    np.testing.assert_allclose(result.model.bias[1], MODEL.bias[1], atol=1e-13)
    np.testing.assert_allclose(result.model.bias[2], MODEL.bias[2], atol=1e-14)
    np.testing.assert_allclose(result.model.matrix[0], MODEL.matrix[0], atol=1e-12)
    np.testing.assert_allclose(result.model.matrix[1], MODEL.matrix[1], atol=1e-13)
    assert result.residual_rms() < 1e-12
    assert result.condition < 100.0


@given(
    temperature=st.floats(-40.0, 150.0),
    truth=st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3),
)
def test_the_correction_undoes_the_sensor(temperature: float, truth: list[float]) -> None:
    vectors, held = np.array([truth]), np.array([temperature])
    np.testing.assert_allclose(MODEL.correct(read(MODEL, vectors, held), held), vectors, atol=1e-11)


def test_without_slopes_the_fit_is_that_of_the_attitudes() -> None:
    readings = read(MODEL, SIX, np.full(6, 25.0)) + 0.01 * np.random.default_rng(1).normal(size=(6, 3))
    result = fit_temperature_polynomials(SIX, readings, np.full(6, 25.0), bias_degree=0, matrix_degree=0)
    plain = attitudes.fit_attitudes(SIX, readings)
    np.testing.assert_allclose(result.model.matrix[0], plain.matrix, atol=1e-13)
    np.testing.assert_allclose(result.model.bias[0], plain.bias, atol=1e-13)
    np.testing.assert_allclose(result.matrix_std[0], plain.matrix_std(), rtol=1e-9)
    np.testing.assert_allclose(result.bias_std[0], plain.bias_std(), rtol=1e-9)


@pytest.mark.parametrize("known", [True, False])
def test_the_standard_errors_are_those_of_many_repetitions(known: bool) -> None:
    rng, std = np.random.default_rng(2), np.array([0.01, 0.03, 0.02])
    exact = read(MODEL, TRUTH, HELD)
    covs = np.tile(np.diag(std**2), (24, 1, 1)) if known else None
    fits = [
        fit_temperature_polynomials(TRUTH, exact + std * rng.normal(size=exact.shape), HELD, bias_degree=2, covs=covs)
        for _ in range(300)
    ]
    for name in ("bias", "matrix"):
        scatter = np.std([getattr(f.model, name) for f in fits], axis=0)
        claimed = np.sqrt(np.mean([getattr(f, f"{name}_std") ** 2 for f in fits], axis=0))
        assert claimed.shape == scatter.shape
        # 300 repetitions tell a standard deviation to 4 %; the worst of 27 stays within four of those.
        np.testing.assert_allclose(claimed, scatter, rtol=0.17)


def test_a_linear_model_of_a_bent_bias_leaves_residuals() -> None:
    bent = fit_temperature_polynomials(TRUTH, read(MODEL, TRUTH, HELD), HELD, bias_degree=1, matrix_degree=1)
    assert bent.residual_rms() > 1e-3


def test_slopes_of_a_datasheet() -> None:
    matrix, bias = MODEL.matrix[0], MODEL.bias[0]
    model = from_datasheet(matrix, bias, 25.0, np.array([0.01, 0.02, 0.03]), np.array([1e-4, 2e-4, -1e-4]))
    at = model.matrix_at(np.array([25.0, 35.0]))
    np.testing.assert_allclose(at[0], matrix)
    np.testing.assert_allclose(at[1], np.array([[1.001], [1.002], [0.999]]) * matrix)
    np.testing.assert_allclose(model.bias_at(np.array(35.0)), np.array([0.2, 0.0, 0.6]), atol=1e-15)


def test_a_record_at_one_temperature_has_no_slopes() -> None:
    held = np.linspace(24.0, 27.5, 24)
    with pytest.raises(
        CalibrationError, match=r"expected a record that spans 10.0 K or slopes of a datasheet, got 3.5 K"
    ):
        fit_temperature_polynomials(TRUTH, read(MODEL, TRUTH, held), held)


def test_attitudes_that_were_not_held_at_each_temperature_are_refused() -> None:
    # Each attitude at a temperature of its own: what is slope and what is attitude cannot be told.
    held = np.array([0.0, 20.0, 40.0, 60.0, 0.0, 20.0])
    with pytest.raises(
        CalibrationError, match=r"expected a design of rank 8, got 6: .* at 2 temperatures or more, 4 were"
    ):
        fit_temperature_polynomials(SIX, read(MODEL, SIX, held), held)


def test_a_curve_through_two_temperatures_is_refused() -> None:
    truth, held = np.tile(SIX, (2, 1)), np.repeat([0.0, 60.0], 6)
    with pytest.raises(
        CalibrationError, match=r"expected a design of rank 9, got 8: .* at 3 temperatures or more, 2 were"
    ):
        fit_temperature_polynomials(truth, read(MODEL, truth, held), held, bias_degree=2)


@pytest.mark.parametrize(
    ("truth", "readings", "temperature", "reason"),
    [
        (TRUTH, TRUTH, HELD[:5], r"expected \(n, 3\), \(n, 3\) and \(n,\)"),
        (TRUTH, TRUTH[:5], HELD, r"expected \(n, 3\), \(n, 3\) and \(n,\)"),
        (TRUTH[:0], TRUTH[:0], HELD[:0], r"expected \(n, 3\), \(n, 3\) and \(n,\)"),
        (TRUTH, TRUTH, np.where(HELD == 0.0, np.nan, HELD), "expected finite truth, readings and temperatures"),
        (TRUTH, np.full(TRUTH.shape, np.inf), HELD, "expected finite truth, readings and temperatures"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(
    truth: np.ndarray, readings: np.ndarray, temperature: np.ndarray, reason: str
) -> None:
    with pytest.raises(CalibrationError, match=reason):
        fit_temperature_polynomials(truth, readings, temperature)


def test_degrees_and_covariances_that_are_none_are_refused() -> None:
    with pytest.raises(CalibrationError, match="expected degrees of 0 or more, got -1 and 1"):
        fit_temperature_polynomials(TRUTH, TRUTH, HELD, bias_degree=-1)
    with pytest.raises(CalibrationError, match="expected a positive definite"):
        fit_temperature_polynomials(TRUTH, TRUTH, HELD, covs=np.zeros((24, 3, 3)))


def test_its_figure_shows_every_axis_and_every_residual(tmp_path: Path) -> None:
    readings = read(MODEL, 9.8 * TRUTH, HELD) / 9.81
    rows = [",".join(map(repr, row)) for row in np.column_stack([HELD, 9.8 * TRUTH, readings]).tolist()]
    path = tmp_path / "oven.csv"
    path.write_text("\n".join(["temperature_c,true_x,true_y,true_z,x,y,z", *rows]) + "\n")
    curves, left = answer_calibration(TemperatureRequest(path, unit="m/s2", force=True), "2026-01-31").panels()
    figure = Figure()
    curves.draw(figure)
    bias, scale = figure.axes
    assert [line.get_ydata()[-1] for line in bias.lines[:3]] == pytest.approx(
        [(MODEL.bias[0] + 35.0 * MODEL.bias[1] + 35.0**2 * MODEL.bias[2])[k] / 9.81 for k in range(3)]
    )
    by_definition = [100.0 * ((MODEL.matrix[0] + 35.0 * MODEL.matrix[1])[k, k] / 9.81 - 1.0) for k in range(3)]
    assert [line.get_ydata()[-1] for line in scale.lines[:3]] == pytest.approx(by_definition, abs=1e-9)
    other = Figure()
    left.draw(other)
    assert [len(line.get_xdata()) for line in other.axes[0].lines[1:]] == [24, 24, 24]
    assert render_panels([curves, left], "svg").startswith(b"<?xml")
