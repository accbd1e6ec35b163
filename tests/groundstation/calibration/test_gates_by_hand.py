"""Gates of a calibration by hand: each shuts beyond its bound, for what it is about, and says what it found."""

from __future__ import annotations

import math

import numpy as np
import pytest

from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.landing_gates import Gate, face_gate, linear_gates, pass_gates, rows_twice, triad_gates
from telemetry.errors import CalibrationError

RANDOM = np.random.default_rng(12)
TRUTH = 9.81 * np.array([way / np.linalg.norm(way) for way in RANDOM.standard_normal((24, 3))])
NOISE = 0.01


def gates_of(
    readings: np.ndarray,
    truth: np.ndarray = TRUTH,
    *,
    nominal: float = 1.0,
    reading_si: float = 1.0,
    sensor: str = "accelerometer",
    jig: float = 0.0,
    matrix: np.ndarray | None = None,
) -> dict[str, Gate]:
    basis = np.column_stack([np.ones(len(truth)), truth])
    found = np.linalg.lstsq(basis, readings, rcond=None)[0]
    fit = AttitudeFit(
        found[1:].T if matrix is None else matrix, found[0], np.eye(12), readings - basis @ found, 1.0, 4,
        np.ones(len(truth)), degrees=len(truth) - 4,
    )  # fmt: skip
    names = [f"row {k}" for k in range(len(truth))]
    return {gate.name: gate for gate in linear_gates(truth, readings, names, fit, nominal, reading_si, sensor, jig)}


def shut(gates: dict[str, Gate]) -> list[str]:
    return [gate.name for gate in gates.values() if not gate.holds]


def noisy(seed: int = 1, size: float = NOISE, count: int = 24) -> np.ndarray:
    """Readings of a sensor with a matrix and a bias, with noise that the fit has nothing to take from."""
    noise = np.random.default_rng(seed).standard_normal((count, 3))
    basis = np.column_stack([np.ones(count), TRUTH[:count]])
    noise -= basis @ np.linalg.lstsq(basis, noise, rcond=None)[0]
    noise *= size / math.sqrt(float(np.sum(noise**2)) / (3 * (count - 4)))
    return np.asarray(
        TRUTH[:count] @ np.array([[1.02, 0.01, 0.0], [0.0, 0.97, 0.02], [0.01, 0.0, 1.01]]).T + 0.05 + noise
    )


@pytest.mark.parametrize("nominal", [1.0, 20.0])
def test_a_sensor_that_is_as_it_should_be_passes_all_gates(nominal: float) -> None:
    assert shut(gates_of(nominal * noisy(), nominal=nominal, reading_si=1.0 / nominal)) == []
    gates = gates_of(noisy())
    assert pass_gates(list(gates.values()), force=False) == ()


@pytest.mark.parametrize(
    ("sizes", "names"),
    [
        ((0.71, 0.80, 0.88), []), ((0.69, 0.80, 0.85), ["scale"]), ((1.39, 1.30, 1.20), []),
        ((1.41, 1.30, 1.20), ["scale"]), ((1.0, 1.0, 1.24), []), ((1.0, 1.0, 1.26), ["axes"]),
        ((1.0, 1.0, -1.0), ["right-handed"]),
    ],
)  # fmt: skip
def test_axes_are_right_handed_alike_and_near_their_nominal(sizes: tuple[float, ...], names: list[str]) -> None:
    for nominal in (1.0, 0.25):
        found = gates_of(nominal * noisy(), nominal=nominal, reading_si=1.0 / nominal, matrix=nominal * np.diag(sizes))
        assert shut(found) == names


def test_a_residual_counts_by_its_degrees_of_freedom_and_names_the_worst_row() -> None:
    for size, names in ((0.0199, []), (0.0201, ["residual"])):
        assert shut(gates_of(noisy(size=size))) == names
        assert shut(gates_of(5.0 * noisy(size=size), nominal=5.0, reading_si=0.2)) == names
    readings = noisy()
    readings[7, 1] -= 0.3
    assert "row 7: was it this attitude?" in gates_of(readings)["residual"].found
    rate = np.abs(TRUTH).max()
    for size, names in ((1.99e-3, []), (2.01e-3, ["residual"])):
        assert shut(gates_of(noisy(size=size * rate), sensor="gyroscope")) == names
    allowed = math.hypot(0.02, 0.003 * 9.81)
    assert shut(gates_of(noisy(size=0.99 * allowed), jig=0.003)) == []
    assert shut(gates_of(noisy(size=1.01 * allowed), jig=0.003)) == ["residual"]
    scaled = 4.0 * noisy(size=0.99 * allowed)
    assert shut(gates_of(scaled, nominal=4.0, reading_si=0.25, jig=0.003)) == []


def test_rows_that_stand_twice_are_paired_with_the_first_of_their_kind() -> None:
    rows = np.array([[1.0, 0.0], [2.0, 0.0], [1.0, -0.0], [3.0, 1.0], [1.0, 0.0], [2.0, 0.0]])
    assert rows_twice(rows) == [(0, 2), (0, 4), (1, 5)]
    readings, truth = noisy(), TRUTH.copy()
    readings[9], truth[9] = readings[4], truth[4]
    gates = gates_of(readings, truth)
    assert "1 readings stand twice, as row 4 and row 9" in gates["duplicates"].found
    assert shut(gates)[:1] == ["duplicates"]


@pytest.mark.parametrize(("count", "names"), [(2, []), (3, ["range"])])
def test_three_readings_at_one_outermost_value_are_a_range(count: int, names: list[str]) -> None:
    readings = noisy()
    largest = float(np.abs(readings).max()) + 0.003
    at = np.argsort(-np.abs(readings), axis=None)[:count]
    rows, columns = np.unravel_index(at, readings.shape)
    readings[rows, columns] = np.sign(readings[rows, columns]) * largest
    found = gates_of(readings, jig=1.0)
    assert shut(found) == names
    if names:
        assert f"3 readings stand at +-{largest:.6g}" in found["range"].found


def test_a_bias_that_walks_shows_in_the_order_and_the_same_residuals_shuffled_do_not() -> None:
    caught, honest = 0, 0
    for seed in range(12):
        walk = np.cumsum(np.random.default_rng(seed).standard_normal((24, 3)), axis=0)
        caught += "drift" in shut(gates_of(noisy(size=1e-4) + 2e-3 * walk))
        order = np.random.default_rng(seed + 100).permutation(24)
        honest += "drift" in shut(gates_of(noisy(size=1e-4) + 2e-3 * walk[order]))
    assert caught >= 10
    assert honest <= 2


def test_a_bent_axis_is_told_by_its_share_and_a_straight_one_seldom() -> None:
    bent = noisy(size=1e-3)
    felt = TRUTH @ np.array([0.0, 0.97, 0.02])
    bent[:, 1] += 3e-5 * felt**3
    found = gates_of(bent)["linear"]
    assert not found.holds
    share = 3e-5 * float(np.abs(felt).max()) ** 2
    assert found.found.startswith("axis y is bent by ")
    assert float(found.found.split()[5].rstrip("%")) / 100.0 == pytest.approx(share, rel=0.1)
    assert sum("linear" in shut(gates_of(noisy(seed))) for seed in range(20)) <= 1


def test_a_half_is_judged_by_the_lever_of_the_other_and_by_the_noise_of_the_whole() -> None:
    steep = TRUTH[:12].copy()
    steep[::2, 2] *= 0.01  # one half knows little of an axis: by its lever the other half stands far off
    steep = np.vstack([steep, steep])
    readings = steep + 0.01 * np.random.default_rng(3).standard_normal(steep.shape)
    assert gates_of(readings, steep)["halves"].holds
    parted = noisy(size=1e-3)
    parted[::2] += [0.02, 0.0, 0.0]
    parted[::2] *= 1.01
    gates = gates_of(parted)
    noise = gates_of(noisy(size=1e-3))["halves"]
    assert noise.holds
    assert gates["halves"].holds  # what is common to a half is in the noise of the whole


def test_a_tool_face_turns_with_the_jig_but_for_a_constant() -> None:
    jig = np.radians(np.arange(0.0, 360.0, 30.0))
    tilt = np.full(12, math.radians(40.0))
    off = np.radians(np.tile([4.0, -4.0], 6))
    for sign in (1.0, -1.0):
        assert face_gate(jig + 1.3 + sign * 0.7 * off, jig, tilt).holds
        found = face_gate(jig + 1.3 + sign * off, jig, tilt)
        assert (found.holds, found.found[:11]) == (False, "4 deg rms b")
    assert "backwards" in face_gate(-jig + 0.4, jig, tilt).found
    tilt[:9] = math.radians(11.0)  # below a fifth: no face is read
    assert face_gate(-jig, jig, tilt).holds


def test_a_triad_passes_up_to_its_bounds_and_force_lands_what_does_not() -> None:
    assert all(gate.holds for gate in triad_gates(3e-3, math.radians(0.1), "G"))
    size, angle = triad_gates(3.01e-3, math.radians(0.1001), "G")
    assert (size.holds, angle.holds, size.found) == (False, False, "0.003 of |G| rms, expected up to 0.003")
    assert pass_gates([size, Gate("fine", holds=True)], force=True) == (f"size: {size.found}",)
    with pytest.raises(CalibrationError, match=r"refused by size: .*; angle: .* \(--force lands it"):
        pass_gates([size, angle], force=False)


def test_faces_over_two_rounds_and_one_more_turn_with_the_jig_or_against_it() -> None:
    """Nine faces a quarter of a turn apart: all nine agree one way, and of the other eight of nine cancel."""
    jig, tilt = np.arange(9) * math.pi / 2.0, np.full(9, 1.0)
    assert face_gate(jig + 0.3, jig, tilt).holds
    against = face_gate(-jig, jig, tilt)
    assert (against.holds, against.found.startswith("turns against the jig's")) == (False, True)
