"""White noise and Gauss-Markov bias for the filter: the drift that it predicts beside the drift of made sensors."""

import math

import numpy as np
import pytest

from groundstation.calibration.allan_analysis import analyse_allan_deviation
from groundstation.calibration.bias_model import FilterNoise, drift_std, fit_bias_model, seen_drift

RATE = 10.0
SPANS = (60.0, 300.0, 900.0)


def sensor(count: int, white: float, bias: float, tau: float, seed: int) -> np.ndarray:
    """Readings of a sensor: white noise and a Gauss-Markov bias, exact at every step."""
    from scipy.signal import lfilter  # a second, of everybody who collects the tests

    random = np.random.default_rng(seed)
    keep = math.exp(-1.0 / (RATE * tau))
    driven = random.standard_normal(count) * bias * math.sqrt(1.0 - keep**2)
    driven[0] = bias * random.standard_normal()
    return lfilter([1.0], [1.0, -keep], driven) + white * math.sqrt(RATE) * random.standard_normal(count)


def fitted(record: np.ndarray) -> FilterNoise:
    (found,) = analyse_allan_deviation(record, RATE)
    return fit_bias_model(found.tau, found.deviation, found.confidence)


@pytest.mark.parametrize(("tau", "span"), [(5.0, 60.0), (100.0, 300.0), (1000.0, 900.0)])
def test_the_drift_is_that_of_sampled_sensors(tau: float, span: float) -> None:
    noise = FilterNoise(0.01, 0.02, tau)
    drifts = []
    for seed in range(600):
        readings = sensor(round((60.0 + span) * RATE), noise.white, noise.bias_std, tau, seed)
        first = round(60.0 * RATE)
        drifts.append(np.sum(readings[first:] - np.mean(readings[:first])) / RATE)
    assert np.std(drifts) == pytest.approx(drift_std(noise, span), rel=0.09)


@pytest.mark.slow
@pytest.mark.parametrize("tau", [3.0, 15.87, 60.0, 200.0, 600.0])
@pytest.mark.parametrize("bias", [0.004, 0.02])
def test_predicted_drifts_cover_those_of_ten_made_sensors(tau: float, bias: float) -> None:
    """Two hours of a sensor give its noise; ninety-five in a hundred drifts of its next forty hours lie within 1.96."""
    later = sensor(1_440_000, 0.01, bias, tau, seed=1000 + round(tau))
    held = []
    for seed in range(4):
        noise = fitted(sensor(72_000, 0.01, bias, tau, seed=7 * seed + round(tau)))
        for span in SPANS:
            first, after = round(60.0 * RATE), round(span * RATE)
            runs = later[: len(later) // (first + after) * (first + after)].reshape(-1, first + after)
            drift = np.sum(runs[:, first:] - runs[:, :first].mean(axis=1, keepdims=True), axis=1) / RATE
            held.append(np.mean(np.abs(drift) < 1.96 * drift_std(noise, span)))
    assert 0.90 < np.mean(held) < 0.98, held


@pytest.mark.slow
@pytest.mark.parametrize("axes", [90, pytest.param(360, marks=pytest.mark.statistical)])
def test_no_axis_of_white_noise_is_without_a_pair(axes: int) -> None:
    """What the record does not show has a bound, and the drift predicted with it is not below that of white noise."""
    random = np.random.default_rng(2)
    for _ in range(axes):
        noise = fitted(0.02 * random.standard_normal(6000))
        assert noise.white == pytest.approx(0.02 / math.sqrt(RATE), rel=0.1)
        assert 0.0 < noise.bias_std < 0.5 * noise.white
        for span in (60.0, 300.0):
            assert drift_std(noise, span) > 0.95 * noise.white * math.sqrt(span + span**2 / 60.0)


def test_a_sensor_that_flickers_is_predicted_within_a_fifth() -> None:
    """Ten Gauss-Markov biases from 2 to 2000 s, alike in size: no single process, with the noise of an ADIS16405."""
    predicted, seen = [], []
    for seed in range(6):
        biases = [sensor(144_000, 0.0125, 0.004, tau, 10 * seed + k) for k, tau in enumerate(np.geomspace(2, 2000, 10))]
        record = np.sum(biases, axis=0)
        noise = fitted(record[:72_000])
        predicted.append([drift_std(noise, span) for span in SPANS])
        seen.append([seen_drift(record, RATE, span) for span in SPANS])
    ratio = np.sqrt(np.mean(np.square(predicted), axis=0) / np.mean(np.square(seen), axis=0))
    assert ratio == pytest.approx(1.0, abs=0.2)


def test_a_short_record_shows_no_long_drift() -> None:
    record = sensor(6000, 0.01, 0.01, 20.0, 1)
    assert seen_drift(record, RATE, 60.0) is not None
    assert seen_drift(record, RATE, 300.0) is None
