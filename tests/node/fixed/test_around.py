"""What stands around the filter in integers, part by part against floats over the range of its inputs."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.firmware.alignment_orders import tube_rotation
from node.kernels.arithmetic.formats import ANGLE_Q, DEG, FORCE_Q, PERIOD, RATE_Q, TIME_Q, VAR_Q, VECTOR_Q, WEIGHT_Q
from node.kernels.arithmetic.quantity import NO_NUMBER, WARMTH_Q
from node.kernels.record.filter_conversion import config_in_integers, state_in_integers
from node.kernels.record.filter_record import default_config, new_state
from node.kernels.record.integer_node import FIXED_PARAMETERS, FORCE, formats_of, in_integers, scales_of
from node.kernels.record.node_record import AIDINGS, DELAYED, GUARD, MISMATCH, NODE
from node.kernels.record.sensor_record import OFFSET, PARAMETERS, STATIC, SWEEP
from node.kernels.record.word_conversion import learn_numbers, learn_words, show_words
from node.kernels.sensors.alignment import extreme_var, fit_circle, take_extremes, to_tube
from node.kernels.sensors.cluster import fuse_readings
from node.kernels.sensors.coarse_level import level_coarsely
from node.kernels.sensors.correction import COLDEST, HOTTEST, correct_cycle, identity_parameters
from node.kernels.sensors.delay import make_up_delay
from node.kernels.sensors.integer_extremes import variance_in_integers
from node.kernels.sensors.static_average import add_static
from node.kernels.sensors.sweep import MOST_SAMPLES, add_to_sweep
from node.kernels.turns.aiding_watch import AT_ONCE, find_mismatch, reset_aiding_watch

G = 9.81
REACHES = {68: 0.001}  # (rad/s)^2: in the format whose numbers are held below 2^-7
RATE, PULL = st.floats(-9.0, 9.0), st.floats(-16.0 * G, 16.0 * G)
VECTORS = st.tuples(RATE, RATE, RATE), st.tuples(PULL, PULL, PULL)
UNIT = st.floats(-1.0, 1.0)


def whole(values: Any, q: int) -> np.ndarray:
    return np.rint(np.asarray(values, float) * 2.0**q).astype(np.int64)


def learnt(record: np.ndarray, path: str = "") -> np.ndarray:
    """The record in integers, by the table of formats."""
    made = np.zeros(record.shape, in_integers(record.dtype))
    scales, powers = scales_of(np.tile(formats_of(record.dtype, path), record.size))
    counter = state_in_integers(new_state(default_config())[0], G)[0]
    learn_words(counter, made.view(np.int64), record.view(np.int64), record.view(float), scales, powers, G)
    assert counter["overflows"] == 0
    return made


def turned_back(made: np.ndarray, kind: np.dtype[Any], path: str = "") -> np.ndarray:
    shown = np.zeros(made.shape, kind)
    scales, powers = scales_of(np.tile(formats_of(kind, path), made.size))
    words = made.view(np.int64)
    counts = np.divide(1.0, scales, out=np.zeros(len(scales)), where=scales > 0.0)
    show_words(words, ~words, shown.view(np.int64), shown.view(float), counts, powers, G)
    return shown


@given(
    *VECTORS,
    st.floats(float(COLDEST) - 30.0, float(HOTTEST) + 30.0),
    st.lists(UNIT, min_size=96, max_size=96),
)
def test_readings_are_corrected_alike(rate: Any, pull: Any, temperature: float, part: list[float]) -> None:
    """Over the largest blocks that a node takes: matrices 0.2 off that drift by 0.1, biases of 20 deg/s and 2 m/s^2."""
    block, parts = identity_parameters(), iter(part)
    block["identity"] = 0
    for sensor, bias in (("gyroscope", 20.0 * DEG), ("accelerometer", 2.0)):
        for k, share in enumerate((0.2, 0.04 / 105.0, 0.03 / 105.0**2, 0.03 / 105.0**3)):
            block[0][sensor]["matrix"][k] += share * np.array([next(parts) for _ in range(9)]).reshape(3, 3)
            drift = 1.0 if k == 0 else 0.3 / 105.0**k
            block[0][sensor]["bias"][k] = bias * drift * np.array([next(parts) for _ in range(3)])
    floats = np.array(rate), np.array(pull)
    integers = whole(rate, RATE_Q), whole(np.array(pull) / G, FORCE_Q)
    correct_cycle(block[0], temperature, *floats)
    correct_cycle(learnt(block)[0], round(temperature * 2.0**WARMTH_Q), *integers)
    np.testing.assert_allclose(integers[0] * 2.0**-RATE_Q, floats[0], atol=3e-7)
    np.testing.assert_allclose(integers[1] * 2.0**-FORCE_Q * G, floats[1], atol=1e-5)


def test_a_reading_that_is_none_stays_what_it_is() -> None:
    block = np.zeros(1, FIXED_PARAMETERS)
    rate, pull = np.array([1, NO_NUMBER, 3]), np.array([4, 5, 6])
    correct_cycle(block[0], 0, rate, pull)
    assert (rate.tolist(), pull.tolist()) == ([1, NO_NUMBER, 3], [4, 5, 6])


@given(VECTORS[0], st.floats(-10.0 * DEG, 10.0 * DEG), st.floats(-10.0 * DEG, 10.0 * DEG))
def test_vectors_are_turned_into_the_tubes_frame_alike(vector: Any, pitch: float, roll: float) -> None:
    axis = np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])
    floats, integers = np.array(vector), whole(vector, RATE_Q)
    to_tube(axis, floats)
    to_tube(whole(axis, VECTOR_Q), integers)
    np.testing.assert_allclose(integers * 2.0**-RATE_Q, floats, atol=1e-7)


@given(st.lists(st.tuples(VECTORS[0], st.floats(-0.01, 0.03)), min_size=1, max_size=6))
def test_a_late_window_is_made_up_for_alike(cycles: Any) -> None:
    memory = np.zeros(1, DELAYED)
    memory["late"] = np.nan
    integers = learnt(memory, ".delayed")
    assert integers["late"] == NO_NUMBER
    for vector, late in cycles:
        rate, fixed = np.array(vector), whole(vector, RATE_Q)
        doubt = make_up_delay(memory[0], late, rate, PERIOD)
        found = make_up_delay(integers[0], round(late * 2.0**TIME_Q), fixed, round(PERIOD * 2.0**TIME_Q))
        np.testing.assert_allclose(fixed * 2.0**-RATE_Q, rate, atol=1e-6)
        assert found * 2.0**-VAR_Q == pytest.approx(doubt, rel=1e-3, abs=1e-12)


@given(
    st.lists(st.tuples(*VECTORS, st.floats(0.1, 10.0)), min_size=1, max_size=8),
)
def test_imus_are_fused_alike(imus: Any) -> None:
    readings = np.array([(*rate, *pull) for rate, pull, _ in imus])
    weights = np.array([1.0 / noise**2 for *_, noise in imus])
    floats, integers = np.zeros(6), np.zeros(6, np.int64)
    fuse_readings(readings, weights, floats)
    fuse_readings(
        np.hstack([whole(readings[:, :3], RATE_Q), whole(readings[:, 3:] / G, FORCE_Q)]),
        whole(weights, WEIGHT_Q),
        integers,
    )
    np.testing.assert_allclose(integers[:3] * 2.0**-RATE_Q, floats[:3], atol=2e-4)
    np.testing.assert_allclose(integers[3:] * 2.0**-FORCE_Q * G, floats[3:], atol=4e-3)


@given(
    st.lists(
        st.tuples(st.integers(-250, 250), st.floats(1.0, 6.0), st.floats(1.0, 60.0), st.integers(0, 1)),
        min_size=3,
        max_size=12,
    ),
    st.floats(1e-4, 0.01),
)
def test_mismatches_are_found_alike(aidings: Any, sigma: float) -> None:
    watch, found = np.zeros(1, AIDINGS), np.zeros(1, MISMATCH)
    reset_aiding_watch(watch[0])
    own, fixed = learnt(watch, ".aidings"), learnt(found)
    now = 1000.0
    for thousandths, spin, elapsed, rejected in aidings:
        innovation, now = 1e-3 * thousandths, now + elapsed
        find_mismatch(watch[0], found[0], innovation, sigma, spin, now, rejected, 0, AT_ONCE)
        given_whole = whole(innovation, ANGLE_Q), whole(sigma, ANGLE_Q), whole(spin, RATE_Q), whole(now, TIME_Q)
        find_mismatch(own[0], fixed[0], *(int(x) for x in given_whole), rejected, 0, AT_ONCE)
        shown = turned_back(fixed, MISMATCH)
        assert [shown[0][k] for k in ("fault", "steady", "refuted")] == [
            found[0][k] for k in ("fault", "steady", "refuted")
        ]
        assert shown[0]["rate"] == pytest.approx(found[0]["rate"], abs=1e-6)
        assert [own[0][k] for k in ("seen", "wrong")] == [watch[0][k] for k in ("seen", "wrong")]


@given(st.floats(0.0, math.pi), st.floats(0.0, math.tau), st.floats(0.9, 1.1), st.floats(0.0, 0.2))
def test_a_node_is_levelled_coarsely_alike(lean: float, towards: float, weight: float, turning: float) -> None:
    config, state = default_config(), new_state(default_config())
    down = np.array([math.sin(lean) * math.cos(towards), math.sin(lean) * math.sin(towards), math.cos(lean)])
    integers, (settings, _) = state_in_integers(state[0], G), config_in_integers(config[0])
    rate, pull = np.array([turning, 0.0, 0.0]), -G * weight * down
    level_coarsely(state[0], config[0], rate, pull)
    level_coarsely(integers[0], settings[0], whole(rate, RATE_Q), whole(pull / G, FORCE_Q))
    if min(abs(abs(weight - 1.0) - 0.05), abs(lean - 0.1)) > 1e-6:
        np.testing.assert_allclose(integers[0]["down"] * 2.0**-VECTOR_Q, state[0]["down"], atol=1e-7)


TILT = st.floats(-9.0 * DEG, 9.0 * DEG)


@given(
    st.tuples(TILT, TILT),
    st.floats(-1.0, 1.75).map(lambda power: 10.0**power * DEG),
    st.floats(-2.5, -0.5).map(lambda power: 10.0**power * DEG),
    st.sampled_from([-20.0, -3.0, -1.0, 1.0, 2.0, 8.0, 20.0]),
    st.integers(40, 400),
    st.integers(0, 2**32 - 1),
)
def test_a_turn_is_fitted_alike(
    mount: tuple[float, float], lean: float, noise: float, turns: float, samples: int, seed: int
) -> None:
    """Every mount, lean to 56 deg, noise of 0.003 to 0.3 deg, turns at any pace and either way."""
    random, (pitch, roll) = np.random.default_rng(seed), mount
    axis = np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])
    angles = np.cumsum(random.uniform(0.3, 1.7, samples))
    angles *= turns * math.tau / angles[-1]
    down = np.array([np.cos(angles), -np.sin(angles), np.ones(samples)]).T
    down *= [math.sin(lean), math.sin(lean), math.cos(lean)]
    pulls = -G * down @ tube_rotation(axis) + G * noise * random.standard_normal((samples, 3))
    sums = np.zeros(1, SWEEP)
    integers = learnt(sums, ".sweeps")
    for pull, angle in zip(pulls, angles, strict=True):
        add_to_sweep(sums[0], pull, angle)
        add_to_sweep(integers[0], whole(pull / G, FORCE_Q), int(whole(angle, ANGLE_Q)))
    for fit in (fit_circle, take_extremes):
        found = np.zeros(1, OFFSET)
        own = learnt(found, ".offsets")
        assert fit(sums[0], found[0]) == fit(integers[0], own[0]) == 1
        shown = turned_back(own, OFFSET, ".offsets")
        np.testing.assert_allclose(shown[0]["axis"], found[0]["axis"], atol=2e-7)
        for name in ("pitch", "roll", "lean"):
            assert shown[0][name] == pytest.approx(found[0][name], abs=3e-7), name
        for name in ("pitch_std", "roll_std", "lean_std", "noise"):
            assert shown[0][name] == pytest.approx(found[0][name], rel=1e-2), name


@pytest.mark.parametrize("turns", [0.0, 0.25])
def test_an_arc_has_no_middle_in_integers_either(turns: float) -> None:
    integers = learnt(np.zeros(1, SWEEP), ".sweeps")
    for angle in np.linspace(0.0, turns * math.tau, 100):
        pull = whole([0.1 * math.cos(angle), 0.1 * math.sin(angle), -1.0], FORCE_Q)
        add_to_sweep(integers[0], pull, int(whole(angle, ANGLE_Q)))
    assert fit_circle(integers[0], learnt(np.zeros(1, OFFSET), ".offsets")[0]) == 0


@pytest.mark.slow
def test_the_sums_of_the_longest_turn_fit() -> None:
    """Every angle at its largest, and every direction along an axis."""
    sweep = learnt(np.zeros(1, SWEEP), ".sweeps")
    pull, angle = whole([1.0, 0.0, 0.0], FORCE_Q), int(whole(20.2 * math.tau, ANGLE_Q))
    for _ in range(MOST_SAMPLES):
        add_to_sweep(sweep[0], pull, angle)
    for name, one in (("sum_angle", 20.2 * math.tau), ("sum_angle_squares", (20.2 * math.tau) ** 2)):
        assert turned_back(sweep, SWEEP, ".sweeps")[0][name] == pytest.approx(MOST_SAMPLES * one, rel=1e-6)
    assert np.abs(sweep.view(np.int64)).max() < NO_NUMBER


@given(st.floats(-1.0, 4.5).map(lambda power: 10.0**power), st.integers(1, 3000))
def test_the_law_of_extremes_is_the_same(ratio: float, samples: int) -> None:
    """Few samples of little noise lie so far below the radius that the law ends; what it comes to then is next to 0."""
    found = variance_in_integers(round(ratio * 2.0**24), samples) * 2.0**-38
    assert found == pytest.approx(extreme_var(ratio, samples), rel=1e-3, abs=1e-6)


@given(
    st.integers(1, 300),
    st.integers(0, 2**32 - 1),
    st.floats(-5.0, -1.0).map(lambda power: 10.0**power),
    st.floats(-5.0, 0.0).map(lambda power: 10.0**power),
    *VECTORS,
)
def test_a_static_record_is_summed_alike(
    count: int, seed: int, rate_noise: float, force_noise: float, usual: Any, pull: Any
) -> None:
    random = np.random.default_rng(seed)
    rates = np.array(usual) / 10.0 + rate_noise * random.standard_normal((count, 3))
    pulls = np.array(pull) + force_noise * random.standard_normal((count, 3))
    sums = np.zeros(1, STATIC)
    own = learnt(sums, ".sums")
    for rate, force in zip(rates, pulls, strict=True):
        add_static(sums[0], rate, force, 30.0, 1)
        add_static(own[0], whole(rate, RATE_Q), whole(force / G, FORCE_Q), round(30.0 * 2.0**WARMTH_Q), 1)
    shown = turned_back(own, STATIC, ".sums")[0]
    np.testing.assert_allclose(shown["mean"], sums[0]["mean"], atol=1e-7)
    spread = np.maximum(np.sqrt(np.diag(sums[0]["scatter"])), 1e-30)
    near = 1e-3 + math.sqrt(count) * np.array([1e-7] * 3 + [1e-6] * 3) / spread
    assert (np.abs(shown["scatter"] - sums[0]["scatter"]) <= np.outer(spread, spread) * (near[:, None] + near)).all()
    steps = np.sqrt(sums[0]["steps"])
    np.testing.assert_allclose(np.sqrt(shown["steps"]), steps, rtol=1e-3, atol=1e-6 * math.sqrt(count))


@given(st.data())
def test_a_record_is_shown_as_it_was_learnt(data: st.DataObject) -> None:
    kinds = {name: NODE.fields[name][0] for name in ("mount", "twist", "joints")} | {"guard": GUARD}  # type: ignore[index]
    name = data.draw(st.sampled_from(sorted(kinds)))
    record = np.zeros(1, kinds[name])
    formats, words = formats_of(kinds[name], f".{name}"), record.view(np.int64)
    for k, q in enumerate(formats):
        if q < 0:
            words[k] = data.draw(st.integers(-5, 1000))
        else:
            odd, reach = st.sampled_from([math.nan, -math.inf, 0.0]), REACHES.get(int(q), 8.0)
            record.view(float)[k] = data.draw(
                odd | st.floats(-reach, reach).map(lambda x: math.ldexp(round(x * 2**20), -20))
            )
    shown = turned_back(learnt(record, f".{name}"), kinds[name], f".{name}")
    np.testing.assert_allclose(shown.view(float)[formats >= 0], record.view(float)[formats >= 0], atol=1e-6)
    assert (shown.view(np.int64)[formats < 0] == words[formats < 0]).all()
    again = learnt(shown, f".{name}")
    assert (again.view(np.int64) == learnt(record, f".{name}").view(np.int64)).all()


def test_a_number_beyond_its_range_is_held_and_counted() -> None:
    counter = state_in_integers(new_state(default_config())[0], G)[0]
    made = np.zeros(5, np.int64)
    given_values = np.array([1e30, -1e30, np.inf, np.nan, 1.0])
    learn_numbers(counter, made, given_values, *scales_of(np.array([FORCE] * 5)), G)
    assert made[:2].tolist() == [NO_NUMBER - 1, 1 - NO_NUMBER]
    assert made[2:4].tolist() == [NO_NUMBER, NO_NUMBER]
    assert made[4] == pytest.approx(2.0**FORCE_Q / G, abs=0.5)
    assert counter["overflows"] == 2


def test_every_number_of_the_record_has_a_format() -> None:
    assert PARAMETERS.fields is not None
    for kind, path in ((NODE.fields["cluster"][0], ".cluster"), (PARAMETERS, "")):  # type: ignore[index]
        assert len(formats_of(kind, path)) * 8 == kind.itemsize
    with pytest.raises(KeyError, match="unheard_of"):
        formats_of(np.dtype([("unheard_of", "f8")]))
