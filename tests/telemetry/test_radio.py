"""Physics of the radio: printed values, handbook points, the shape over whole ranges, and what lies outside a model."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import InputError, RadioError
from telemetry.radio.limits import ELECTRIC_CONSTANT, IMPEDANCE, SPEED_OF_LIGHT
from telemetry.radio.path_loss import link_margin, packet_error_rate, path_loss, propagation_constants, received_power
from telemetry.radio.soil_dielectric import PorosityWarning, Soil, soil_permittivity, water_permittivity
from telemetry.radio.steel import API_5L, CARBON_PERCENT, RESISTIVITY, TEMPERATURES, carbon_of, steel_resistivity
from telemetry.radio.waveguide import (
    TE11,
    TE21,
    TM01,
    WaveguideMode,
    cut_off,
    link_reach,
    nepers_to_decibels,
    wall_attenuation,
)

F = 868e6
FREQUENCIES = st.floats(0.3e9, 1.3e9)
DENSITIES = st.floats(1.0, 1.8)


@st.composite
def textures(draw: st.DrawFn) -> tuple[float, float]:
    sand = draw(st.floats(0.0, 1.0))
    return sand, draw(st.floats(0.0, 1.0 - sand))


def power(sand: float, clay: float, water: float, distance: float, log=np.log10, **more: float) -> float:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PorosityWarning)
        eps = soil_permittivity(Soil(sand, clay, water=water, **more), F)
    return float(received_power(path_loss(*propagation_constants(*eps, F), distance, log)))


def test_constants_are_those_of_free_space() -> None:
    assert pytest.approx(8.8541878e-12, rel=1e-6) == ELECTRIC_CONSTANT
    assert pytest.approx(376.7303, rel=1e-6) == IMPEDANCE


def test_water_is_that_of_the_tables() -> None:
    """80.1 at rest and 0.58e-10 s / 2 pi at 20 C; at the relaxation, 17.1 GHz, the loss is half the span."""
    real, loss = water_permittivity(1.0, 20.0)
    assert real == pytest.approx(80.1, abs=0.1)
    assert loss == pytest.approx(0.0, abs=1e-7)
    real, loss = water_permittivity(1.0 / 0.583e-10, 20.0)
    assert loss == pytest.approx(0.5 * (80.1 - 4.9), rel=1e-3)
    assert real == pytest.approx(4.9 + 0.5 * (80.1 - 4.9), rel=2e-3)


def test_dry_soil_is_a_mixture_of_solids_and_air() -> None:
    """Without water the formula of the model is elementary: solids of 4.67 at 1.5 of 2.66 g/cm^3."""
    solid = (1.01 + 0.44 * 2.66) ** 2 - 0.062
    mixed = 1.0 + 1.5 / 2.66 * (solid**0.65 - 1.0)
    real, loss = soil_permittivity(Soil(0.3, 0.3, 1.5, 0.0), F)
    assert real == pytest.approx(1.15 * mixed ** (1.0 / 0.65) - 0.68, rel=1e-6)
    assert loss == pytest.approx(0.0, abs=1e-4)


def test_moist_soil_is_that_of_the_formula_written_out() -> None:
    """Silt loam, 17.16 % sand, 19 % clay, 1.37 g/cm^3, 20 % water at 915 MHz and 20 C, step by step."""
    sand, clay, density, water, f = 0.1716, 0.19, 1.37, 0.20, 915e6
    x = f * 0.58286e-10
    water_real = 4.9 + (80.0889 - 4.9) / (1.0 + x * x)
    conductivity = 0.0467 + 0.2204 * density - 0.4111 * sand + 0.6614 * clay
    water_loss = x * (80.0889 - 4.9) / (1.0 + x * x) + conductivity / (math.tau * 8.8541878e-12 * f) * (
        (2.66 - density) / (2.66 * water)
    )
    of_real, of_loss = 1.2748 - 0.519 * sand - 0.152 * clay, 1.33797 - 0.603 * sand - 0.166 * clay
    solid = (1.01 + 0.44 * 2.66) ** 2 - 0.062
    mixed = 1.0 + density / 2.66 * (solid**0.65 - 1.0) + water**of_real * water_real**0.65 - water
    real, loss = soil_permittivity(Soil(sand, clay, density, water, 20.0), f)
    assert real == pytest.approx(1.15 * mixed ** (1.0 / 0.65) - 0.68, rel=1e-4)
    assert loss == pytest.approx((water**of_loss * water_loss**0.65) ** (1.0 / 0.65), rel=1e-4)


@given(FREQUENCIES, st.floats(0.01, 100.0))
def test_without_soil_the_path_loss_is_that_of_free_space(frequency: float, distance: float) -> None:
    """Friis: 20 log10(4 pi d f / c), to the rounding of 6.4 dB."""
    alpha, beta = propagation_constants(1.0, 0.0, frequency)
    assert alpha == 0.0
    friis = 20.0 * math.log10(2.0 * math.tau * distance * frequency / SPEED_OF_LIGHT)
    assert path_loss(alpha, beta, distance) == pytest.approx(friis, abs=0.4)


@given(st.floats(1.0, 80.0), st.floats(1e-6, 100.0), FREQUENCIES)
def test_attenuation_and_phase_are_the_square_root_of_the_permittivity(real: float, loss: float, f: float) -> None:
    root = np.sqrt(complex(real, -loss)) * math.tau * f / SPEED_OF_LIGHT
    alpha, beta = propagation_constants(real, loss, f)
    assert beta == pytest.approx(root.real, rel=1e-9)
    assert alpha == pytest.approx(-root.imag, rel=1e-9)


@given(textures(), st.floats(0.01, 0.75), st.floats(0.05, 0.3), DENSITIES)
def test_received_power_falls_with_water_clay_and_distance(
    texture: tuple[float, float], water: float, distance: float, density: float
) -> None:
    sand, clay = texture
    here = power(sand, clay, water, distance, bulk_density=density)
    assert power(sand, clay, water + 0.05, distance, bulk_density=density) < here
    assert power(sand, clay, water, 1.1 * distance, bulk_density=density) < here
    if clay + 0.02 <= 1.0 - sand:
        assert power(sand, clay + 0.02, water, distance, bulk_density=density) < here


@pytest.mark.parametrize(
    ("water", "printed", "low", "high"), [(0.01, -54.5, -32.0, -22.0), (0.80, -95.1, -73.0, -41.0)]
)
def test_the_printed_powers_follow_with_natural_logarithms_alone(
    water: float, printed: float, low: float, high: float
) -> None:
    share = np.linspace(0.0, 1.0, 21)
    textures = [(sand, clay) for sand in share for clay in share if sand + clay <= 1.0]
    ours = [power(*texture, water, 0.3) for texture in textures]
    natural = [power(*texture, water, 0.3, np.log) for texture in textures]
    assert low - 0.1 < min(ours) < max(ours) < high
    assert min(natural) < printed < max(natural)
    assert printed < min(ours) - 15.0


def test_a_million_links_at_once_are_the_same_links_one_by_one() -> None:
    n, random = 1_000_000, np.random.default_rng(3)
    sand, clay, water = random.uniform(0.0, 0.5, n), random.uniform(0.0, 0.5, n), random.uniform(0.0, 0.3, n)
    f, distance = random.uniform(0.3e9, 1.3e9, n), random.uniform(0.1, 0.3, n)
    eps = soil_permittivity(Soil(sand, clay, 1.5, water), f)
    over = link_margin(received_power(path_loss(*propagation_constants(*eps, f), distance)))
    rho = steel_resistivity(random.uniform(0.06, 1.22, n), random.uniform(20.0, 400.0, n))
    lost = wall_attenuation(TE11, 0.03, 4.0 * f + 3e9, rho)
    assert over.shape == lost.shape == (n,)
    for k in range(0, n, 250_000):
        alone = soil_permittivity(Soil(sand[k], clay[k], 1.5, water[k]), f[k])
        assert link_margin(
            received_power(path_loss(*propagation_constants(*alone, f[k]), distance[k]))
        ) == pytest.approx(over[k])
        assert wall_attenuation(TE11, 0.03, 4.0 * f[k] + 3e9, rho[k]) == pytest.approx(lost[k])


def test_more_water_than_pores_is_answered_with_a_warning() -> None:
    with pytest.warns(PorosityWarning, match="holds at most 44 % by volume .its porosity., got 80 %"):
        real, _ = soil_permittivity(Soil(0.3, 0.3, 1.5, [0.2, 0.8]), F)
    assert real[1] > real[0]


@given(st.floats(-60.0, 60.0), st.floats(0.1, 10.0))
def test_packet_error_rate_is_logistic(over: float, width: float) -> None:
    rate, other = packet_error_rate(over, width), packet_error_rate(-over, width)
    assert rate + other == pytest.approx(1.0)
    assert rate == pytest.approx(1.0 / (1.0 + math.exp(over / width)), rel=1e-9)
    assert packet_error_rate(over + 1.0, width) <= rate


@pytest.mark.parametrize(("mode", "ghz"), [(TE11, 2.928), (TM01, 3.825), (TE21, 4.858)], ids=["TE11", "TM01", "TE21"])
def test_cut_offs_of_a_bore_of_three_centimetres(mode: WaveguideMode, ghz: float) -> None:
    assert cut_off(mode, 0.03) * 1e-9 == pytest.approx(ghz, abs=5e-4)


@given(st.floats(1e-8, 1e-6))
def test_the_modes_are_apart_by_a_factor_that_no_steel_changes(rho: float) -> None:
    te, tm = (nepers_to_decibels(wall_attenuation(mode, 0.03, 5e9, rho)) for mode in (TE11, TM01))
    assert tm / te == pytest.approx(1.653, abs=5e-4)


def test_the_printed_attenuation_and_reaches() -> None:
    assert nepers_to_decibels(wall_attenuation(TE11, 0.03, 5e9, 1.12e-7)) == pytest.approx(0.034, abs=1e-4)
    assert link_reach(0.034, 110.0) == pytest.approx(3235.0, abs=0.5)
    assert link_reach(0.030, 110.0) == pytest.approx(3666.0, abs=1.0)


@given(st.floats(0.01, 0.5), st.floats(1.001, 50.0))
def test_attenuation_of_tm_is_the_surface_over_the_guide(radius: float, over: float) -> None:
    """TM01 against the wave impedance and geometry, and least at sqrt(3) times the cut-off."""
    lowest = float(cut_off(TM01, radius))
    best = wall_attenuation(TM01, radius, math.sqrt(3.0) * lowest, 1e-7)
    assert wall_attenuation(TM01, radius, over * lowest, 1e-7) >= best * (1.0 - 1e-12)


@pytest.mark.parametrize(
    ("carbon", "warm", "published"), [(0.10, 20.0, 14.3), (0.20, 20.0, 15.9), (0.40, 20.0, 17.1), (0.80, 100.0, 23.2)]
)
def test_resistivity_is_near_published_points(carbon: float, warm: float, published: float) -> None:
    assert steel_resistivity(carbon, warm) == pytest.approx(published * 1e-8, rel=0.03)


def test_resistivity_goes_through_its_measurements() -> None:
    carbon, warm = np.meshgrid(CARBON_PERCENT, TEMPERATURES, indexing="ij")
    np.testing.assert_allclose(steel_resistivity(carbon, warm), RESISTIVITY, rtol=1e-12)


@given(st.floats(0.06, 1.21), st.floats(20.0, 399.0))
def test_resistivity_rises_with_carbon_and_temperature(carbon: float, warm: float) -> None:
    here = steel_resistivity(carbon, warm)
    assert steel_resistivity(carbon + 0.01, warm) > here
    assert steel_resistivity(carbon, warm + 1.0) > here


def test_every_grade_has_a_resistivity() -> None:
    assert carbon_of("X52 seamless") == 0.31
    assert all(16e-8 < steel_resistivity(carbon) < 18e-8 for carbon in API_5L.values())


@pytest.mark.parametrize(("name", "mode"), [("TE11", TE11), ("TM0,12", WaveguideMode("TM", 0, 12))])
def test_a_mode_is_named_as_it_is_read(name: str, mode: WaveguideMode) -> None:
    assert WaveguideMode.parse(name) == mode
    assert str(mode) == name


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (lambda: soil_permittivity(Soil(0.3, 0.3), 2.4e9), "frequency: expected 0.3..1.3 GHz, got 2.4"),
        (lambda: soil_permittivity(Soil(0.3, 0.3), [1e9, 0.2e9]), "frequency: expected 0.3..1.3 GHz, got 0.2"),
        (lambda: soil_permittivity(Soil(0.3, 0.3), math.nan), "frequency: expected 0.3..1.3 GHz, got nan"),
        (lambda: soil_permittivity(Soil(-0.1, 0.3), F), "sand: expected 0..1, got -0.1"),
        (
            lambda: soil_permittivity(Soil(0.7, 0.6), F),
            "sand and clay: expected fractions of at most 1 together, got 1.3",
        ),
        (lambda: soil_permittivity(Soil(0.3, 0.3, 3.0), F), "bulk density: expected 0.5..2.6 g/cm^3, got 3"),
        (lambda: soil_permittivity(Soil(0.3, 0.3, 1.5, 1.2), F), "water: expected 0..1, got 1.2"),
        (lambda: soil_permittivity(Soil(0.3, 0.3, temperature=50.0), F), "temperature: expected 0..40 C, got 50"),
        (lambda: path_loss(1.0, 1.0, -0.1), "distance: expected more than 0 m, got -0.1"),
        (lambda: packet_error_rate(3.0, 0.0), "width: expected more than 0 dB, got 0"),
        (
            lambda: wall_attenuation(TE11, 0.03, 2.4e9, 1e-7),
            "frequency: expected more than 2.928 GHz, the cut-off of TE11 in this pipe, got 2.4; "
            "below it nothing propagates",
        ),
        (lambda: cut_off(TE11, -0.03), "radius: expected 0.01..1000 cm, got -3"),
        (lambda: wall_attenuation(TE11, 0.03, 5e9, 0.0), "resistivity: expected more than 0 ohm m, got 0"),
        (lambda: link_reach(0.0, 110.0), "attenuation: expected more than 0 dB/m, got 0"),
        (lambda: steel_resistivity(2.0), "carbon: expected 0.06..1.22 %, got 2"),
        (lambda: steel_resistivity(0.2, 10.0), "temperature: expected 20..400 C, got 10"),
        (lambda: carbon_of("X80"), "grade: expected one of A25, A seamless"),
        (lambda: WaveguideMode.parse("TEM"), "mode: expected a name such as TE11 or TM01, got 'TEM'"),
        (lambda: WaveguideMode("TE", 1, 0), "mode: expected m of 0..20 and n of 1..20, got TE10"),
    ],
)
def test_what_lies_outside_a_model_is_refused_with_its_range(asked, named: str) -> None:
    with pytest.raises(RadioError) as refused:
        asked()
    assert str(refused.value).startswith(named)
    assert len(str(refused.value).splitlines()) == 1
    assert isinstance(refused.value, InputError)
