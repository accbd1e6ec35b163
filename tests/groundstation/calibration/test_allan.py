"""Allan analysis: published numbers, spectra whose integrals are known, scaling, honest intervals, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.calibration.allan_analysis import (
    allan_variance,
    analyse_allan_deviation,
    curve_factors,
    fit_factors,
    relative_standard_error,
)
from groundstation.calibration.allan_fit import allan_design_matrix, fit_allan_variances, spectral_moments
from groundstation.calibration.bias_model import filter_noise, gauss_markov_variance
from sim.instruments.static_records import StaticNoise, static_record
from telemetry.errors import CalibrationError

RATE = 20.0
MPU_X = StaticNoise(white=8.9e-3, flicker=7.9e-3)
MPU_Z = StaticNoise(white=7.38e-3, flicker=3.33e-3)


def nbs_1000() -> np.ndarray:
    """The 1000-point test suite of NIST SP 1065: a prime modulus generator."""
    state, values = 1234567890, []
    for _ in range(1000):
        values.append(state / 2147483647)
        state = 16807 * state % 2147483647
    return np.array(values)


def record(noise: StaticNoise, seconds: float = 600.0, rate: float = RATE, seed: int = 1) -> np.ndarray:
    return static_record((noise,), round(seconds * rate), rate, seed)[:, 0]


@pytest.mark.parametrize(("factor", "printed"), [(1, 2.922319e-1), (10, 9.159953e-2), (100, 3.241343e-2)])
def test_published_overlapping_deviation(factor: int, printed: float) -> None:
    assert math.sqrt(allan_variance(nbs_1000(), factor)) == pytest.approx(printed, abs=5e-8)


@pytest.mark.parametrize("factor", [1, 2, 7, 40])
def test_is_half_the_mean_square_difference_of_neighbouring_means(factor: int) -> None:
    y = np.random.default_rng(factor).standard_normal(150) + 1e3
    steps = [y[k + factor : k + 2 * factor].mean() - y[k : k + factor].mean() for k in range(len(y) - 2 * factor + 1)]
    assert allan_variance(y, factor) == pytest.approx(0.5 * np.mean(np.square(steps)), rel=1e-9)


def test_spectra_integrate_to_the_known_allan_variances() -> None:
    factors = (1, 2, 5, 16, 64)
    assert spectral_moments(8192, factors)[0] == pytest.approx(allan_design_matrix(np.array(factors)).T, rel=1e-4)


def test_covariance_of_white_noise_at_factor_1_is_three_over_the_terms() -> None:
    # d = w2 - w1 has variance 2 and covariance -1 with its neighbour: var of mean d^2/2 is (4 + 2) / 2 over the terms
    count = 4000
    assert spectral_moments(count, (1,))[1][0, 0, 0, 0] == pytest.approx(3.0 / (count - 1), rel=1e-9)


def second_differences(count: int, factor: int) -> np.ndarray:
    """Q (count, count) with y Q y the Allan variance of y."""
    boxes = np.array(
        [
            np.repeat([0, -1, 1, 0], [k, factor, factor, count - 2 * factor - k])
            for k in range(count)
            if k + 2 * factor <= count
        ]
    )
    return boxes.T @ boxes / (2.0 * factor**2 * len(boxes))


@pytest.mark.parametrize("term", ["white", "walk"])
def test_covariance_is_that_of_the_quadratic_forms(term: str) -> None:
    count, factors = 240, (1, 6, 24)
    index = np.arange(count)
    process = np.eye(count)
    if term == "walk":  # sample means of Brownian motion: min(i, j) + 1/2 between samples, i + 1/3 within one
        process = np.minimum.outer(index, index) + 0.5 - np.eye(count) / 6.0
    forms = [second_differences(count, n) @ process for n in factors]
    exact = np.array([[2.0 * np.sum(a * b.T) for b in forms] for a in forms])
    which = 0 if term == "white" else 2
    theory = spectral_moments(count, factors)[1][which, which]
    assert theory == pytest.approx(exact, rel=0.07)  # at a tenth of the record; far below it:
    assert theory[0] == pytest.approx(exact[0], rel=0.002)


def test_a_large_mean_costs_no_digits() -> None:
    y = 1e-6 * np.random.default_rng(14).standard_normal(100_000)
    assert allan_variance(y + 1e4, 1) == pytest.approx(allan_variance(y, 1), rel=1e-4, abs=0.0)


def test_covariance_is_what_repeated_records_scatter_by() -> None:
    factors, noise = (1, 4, 16, 64), StaticNoise(white=1.0, flicker=0.5, walk=0.05)
    table = np.array(
        [[allan_variance(y, n) for n in factors] for y in static_record((noise,) * 1000, 640, 1.0, seed=3).T]
    )
    squares = np.array([1.0, 0.25, 0.0025])
    theory = np.einsum("abmn,a,b->mn", spectral_moments(640, factors)[1], squares, squares)
    scatter = np.cov(table.T)
    assert np.diag(scatter) == pytest.approx(np.diag(theory), rel=0.2)  # 4 standard errors of a variance from 1000
    stds = np.sqrt(np.diag(theory))
    assert np.corrcoef(table.T) == pytest.approx(theory / np.outer(stds, stds), abs=0.12)
    assert theory[2, 3] / (stds[2] * stds[3]) > 0.2  # the correlation that makes plain weights dishonest


@given(n=st.floats(1e-3, 10), f=st.floats(1e-3, 10), k=st.floats(1e-3, 1))
@settings(max_examples=30, deadline=None)
def test_exact_variances_give_back_their_terms(n: float, f: float, k: float) -> None:
    factors = (1, 2, 4, 8, 16, 32, 64, 128, 256)
    exact = allan_design_matrix(np.array(factors)) @ np.array([n, f, 0.0]) ** 2
    plain = fit_allan_variances(exact, factors, 4096)
    assert (plain.random_walk.value**2, plain.floor.value**2) == pytest.approx((n**2, f**2), rel=1e-6, abs=1e-9)
    assert plain.rate_walk is None
    strong = fit_allan_variances(exact + (k + n + f) ** 2 * np.array(factors) / 3.0, factors, 4096)
    assert strong.rate_walk is not None
    assert strong.rate_walk.value == pytest.approx(k + n + f, rel=1e-6)


@given(scale=st.floats(1e-6, 1e6), offset=st.floats(-10.0, 10.0))
@settings(max_examples=15, deadline=None)
def test_scales_with_the_unit_and_ignores_the_mean(scale: float, offset: float) -> None:
    y = record(MPU_X, 100.0)
    one, other = analyse_allan_deviation(y, RATE)[0], analyse_allan_deviation(scale * (y + offset), RATE)[0]
    assert other.deviation == pytest.approx(scale * one.deviation, rel=1e-6, abs=0.0)
    for name in ("value", "std", "low", "high"):
        for term in ("random_walk", "floor"):
            wanted = scale * getattr(getattr(one, term), name)
            assert getattr(getattr(other, term), name) == pytest.approx(wanted, rel=1e-4, abs=0.0)


@pytest.mark.slow
@given(seed=st.integers(0, 10_000), rate=st.sampled_from([2.0, 20.0, 65.0]))
@settings(max_examples=15, deadline=None)
def test_white_noise_falls_with_slope_minus_one_half(seed: int, rate: float) -> None:
    result = analyse_allan_deviation(record(StaticNoise(white=0.3), 1000.0, rate, seed), rate)[0]
    early = result.tau < 20.0
    slope = np.polyfit(np.log(result.tau[early]), np.log(result.deviation[early]), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.1)
    assert result.random_walk.value == pytest.approx(0.3, rel=0.15)
    assert result.floor.high < 0.3


def test_rate_only_names_the_seconds() -> None:
    y = record(StaticNoise(white=1.0, flicker=0.2, walk=0.3), 1000.0)
    slow, fast = analyse_allan_deviation(y, RATE)[0], analyse_allan_deviation(y, 2.0)[0]
    assert slow.raw_at_1s.tau == fast.raw_at_1s.tau == 1.0
    assert slow.fit.rate_walk is not None
    assert slow.fit.rate_walk.low < 0.3 < slow.fit.rate_walk.high
    assert fast.random_walk.value == pytest.approx(math.sqrt(10.0), rel=0.05)  # the same readings, ten times as slow


@pytest.mark.slow
def test_two_hours_at_65_hz_give_back_what_they_were_made_of() -> None:
    truths = ((8.9e-3, 7.9e-3), (6.9e-3, 3.83e-3), (7.38e-3, 3.33e-3))
    readings = static_record(tuple(StaticNoise(white=n, flicker=f) for n, f in truths), 468_000, 65.0, seed=5)
    for result, (n, f) in zip(analyse_allan_deviation(readings, 65.0), truths, strict=True):
        assert result.random_walk.value == pytest.approx(n, rel=0.0077)
        assert result.floor.value == pytest.approx(f, rel=0.042)
        assert result.floor.std < 0.03 * f
        assert result.fit.rate_walk is None
        assert result.fit.consistent
        # the raw reading at 1 s holds the floor as well, which is what the fit is for
        assert result.raw_at_1s.deviation == pytest.approx(math.hypot(n, f), rel=0.03)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    held = []
    for noise in (MPU_X, MPU_Z):
        for y in static_record((noise,) * 60, 6000, RATE, seed=7).T:
            result = analyse_allan_deviation(y, RATE)[0]
            held.append(
                (
                    result.random_walk.low <= noise.white <= result.random_walk.high,
                    result.floor.low <= noise.flicker <= result.floor.high,
                )
            )
    share = np.mean(held, axis=0)
    assert np.all(share > 0.88)  # 95 % of 120, less three and a half standard deviations
    assert np.mean(share) < 1.0


def test_floor_from_a_generator_of_another_kind() -> None:
    # Kasdin's fractional difference, h_k = h_k-1 (k - 1/2) / k, has 1 / (2 sin pi f) for a spectrum: 1 / (2 pi f) below
    k = np.arange(1, 1 << 16)
    taps = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
    drive = np.random.default_rng(11).standard_normal(1 << 16)
    y = np.fft.irfft(np.fft.rfft(taps, 1 << 17) * np.fft.rfft(drive, 1 << 17))[: 1 << 16]
    result = analyse_allan_deviation(y, 65.0)[0]
    assert result.floor.value == pytest.approx(math.sqrt(2.0 * math.log(2.0) / math.pi), rel=0.05)


def test_other_shape_than_the_models_is_noticed() -> None:
    y = record(StaticNoise(white=8.538e-3, bias_std=1.2545e-2, bias_tau=15.87), 3600.0)
    result = analyse_allan_deviation(y, RATE)[0]
    assert not result.fit.consistent
    assert result.random_walk.low < 8.538e-3 < result.random_walk.high  # wider for it


def test_confidence_and_factors_of_the_curve() -> None:
    result = analyse_allan_deviation(record(MPU_X), RATE)[0]
    assert result.confidence[0] == pytest.approx(1.0 / math.sqrt(2.0 * (12_000 - 1)))
    assert relative_standard_error(90, 10) == pytest.approx(0.25)
    assert result.raw_minimum.confidence <= 0.25
    assert curve_factors(12_000)[:4] == [1, 2, 3, 4]
    assert curve_factors(12_000)[-1] <= 4_000
    assert fit_factors(12_000, RATE) == (2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)


@pytest.mark.parametrize(
    ("at_1s", "at_30s", "white", "bias"),
    [
        (8.9e-3, 7.9e-3, 8.538e-3, 1.2545e-2),
        (6.9e-3, 3.83e-3, 6.799e-3, 5.869e-3),
        (7.38e-3, 3.33e-3, 7.313e-3, 4.941e-3),
    ],
)
def test_published_white_and_gauss_markov_set(at_1s: float, at_30s: float, white: float, bias: float) -> None:
    noise = filter_noise(at_1s, at_30s)
    assert noise.bias_tau == pytest.approx(15.87, abs=0.005)
    assert noise.white == pytest.approx(white, abs=6e-7)
    assert noise.bias_std == pytest.approx(bias, abs=6e-7)


def test_gauss_markov_curve_has_its_peak_where_the_mapping_puts_it() -> None:
    taus = np.geomspace(0.01, 100.0, 20_001)
    curve = gauss_markov_variance(taus, 1.0)
    assert taus[np.argmax(curve)] == pytest.approx(1.89, abs=0.005)
    assert curve[0] == pytest.approx(2.0 / 3.0 * taus[0], rel=0.01)  # a random walk of 2 / tau_c below it
    assert curve[-1] == pytest.approx(2.0 / taus[-1], rel=0.02)  # white above it


@pytest.mark.parametrize(("at_1s", "at_floor", "tau"), [(1.0, 100.0, 30.0), (1.0, 0.1, 30.0), (1.0, 0.5, 1.0)])
def test_refuses_a_curve_that_no_such_noise_has(at_1s: float, at_floor: float, tau: float) -> None:
    with pytest.raises(CalibrationError, match="filter noise"):
        filter_noise(at_1s, at_floor, tau)


def spoiled(how: str) -> np.ndarray:
    y = np.stack([record(MPU_X, seed=s) for s in (1, 2, 3)], axis=1)
    time = np.arange(len(y)) / RATE
    match how:
        case "nan":
            y[77, 1] = np.nan
        case "stuck":
            y[:, 2] = 0.25
        case "saturated":
            y[:, 0] = np.clip(y[:, 0], -0.05, 0.05)
        case "step":
            y[time > 400.0, 1] += 0.5
        case "small step":
            y[time > 400.0, 1] += 0.15  # 1-s means scatter by 0.012, those of 9 s by less
        case "trend":
            y[:, 2] += 5e-4 * time
        case "short":
            y = y[:1100]
        case "few":
            y = y[:900]
        case "shape":
            y = y[:, :2]
    return y


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "message"),
    [
        ("nan", "reading 77 of axis y is nan"),
        ("stuck", "axis z is stuck"),
        ("saturated", "axis x is saturated"),
        ("step", "moved: the mean of axis y .* near 400.0 s"),
        ("small step", "moved: the mean of axis y .* near (39|40)"),
        ("trend", "axis z has a trend"),
        ("short", "too short: 1100 readings .* needed are 1200"),
        ("few", "too short"),
        ("shape", r"shape \(n,\) or \(n, 3\), got \(12000, 2\)"),
    ],
)
def test_refuses_what_is_no_static_record(how: str, message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        analyse_allan_deviation(spoiled(how), RATE)


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf, 0.5])
def test_refuses_a_rate_that_is_none(rate: float) -> None:
    with pytest.raises(CalibrationError, match="at least 1 Hz"):
        analyse_allan_deviation(np.zeros(5000), rate)


def test_good_records_are_not_refused() -> None:
    noise = (MPU_X, MPU_Z, StaticNoise(white=1e-2), StaticNoise(flicker=1e-2), StaticNoise(white=1e-2, walk=1e-3))
    for y in static_record(noise * 40, 6000, RATE, seed=13).T:
        analyse_allan_deviation(y, RATE)
