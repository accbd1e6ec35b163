"""Gates that a calibration passes before it lands: what its own record says against it, each by name.

Least squares takes any numbers. A mirrored axis, a swapped position, a row pasted twice or a sensor that warms up leave
traces in the record itself: in the sense of the axes, in the residuals' size, order and shape. A gate has a name and a
finding; a calibration that fails one is refused, or lands with the finding in its certificate where it was forced.
Source: JCGM 100:2008 (GUM), annex F, for what repeated readings do not show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.calibration.attitudes import AttitudeFit, rank_of
from groundstation.calibration.coverage import coverage_factor
from groundstation.calibration.residual_walk import find_walk
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
SCALES: Final = (0.7, 1.4)  # of a sensor's axes, in its nominal
UNEQUAL: Final = 1.25  # largest over smallest of the singular values of a matrix
LARGEST_RESIDUAL: Final = 0.02  # m/s^2 of one degree of freedom, as in the field; 0.12 deg of an attitude
LARGEST_SHARE: Final = 2e-3  # of the largest rate, the same of a gyroscope; a printed record has 1e-3
CLIPPED: Final = 3  # readings at one outermost value
CHANCE: Final = 0.001  # of an honest record to fail a gate that weighs noise
FEWEST_FREE: Final = 4  # degrees of freedom of a residual whose shape is judged
HALVES: Final = 12  # readings from which each half can be judged by the other
WORST_RATIO: Final = 4.0  # of what one half leaves in the other, in the noise of a reading
LARGEST_SIZE: Final = 3e-3  # relative, rms of |G| or |H| of an MWD tool over its record
LARGEST_ANGLE: Final = math.radians(0.1)  # rms of tilt or dip over it
LARGEST_FACE: Final = math.radians(3.0)  # rms, of tool faces beside the jig's
LEANING: Final = 0.2  # sine of a tilt, from which on a tool face is read


@dataclass(frozen=True, slots=True)
class Gate:
    """One gate: what it looked for, whether it holds and, where not, what was found."""

    name: str
    holds: bool
    found: str = ""


def pass_gates(gates: Sequence[Gate], *, force: bool) -> tuple[str, ...]:
    """Findings that were overruled by ``force``; none where all gates hold.

    Raises
    ------
    CalibrationError
        When one does not hold and nothing forces it; the message names every one.
    """
    failed = tuple(f"{gate.name}: {gate.found}" for gate in gates if not gate.holds)
    if failed and not force:
        raise CalibrationError(f"refused by {'; '.join(failed)} (--force lands it, and says so in its certificate)")
    return failed


def linear_gates(
    truth: Array,
    readings: Array,
    names: Sequence[str],
    fit: AttitudeFit,
    nominal: float,
    reading_si: float,
    sensor: str,
    jig: float = 0.0,
) -> list[Gate]:
    """Gates of G = M w + b.

    Parameters
    ----------
    truth, readings : (n, 3)
    names : (n,) of the readings
    nominal : reading of one unit of truth by a sensor without errors
    reading_si : SI of one unit of the readings
    sensor : ``gyroscope`` or ``accelerometer``
    jig : rad, standard deviation of the attitudes where it is stated; it explains as much of a residual, and neither
        its order nor its shape is then that of the sensor
    """
    degrees = max(len(truth) - 4, 1)
    noise = float(np.sqrt(np.sum(fit.residuals**2) / (3 * degrees)))
    largest = LARGEST_RESIDUAL / reading_si
    if sensor == "gyroscope":
        largest = LARGEST_SHARE * float(np.abs(truth).max()) * nominal
    largest = math.hypot(largest, jig * nominal * float(np.linalg.norm(truth, axis=1).max()))
    worst = int(np.argmax(np.linalg.norm(fit.residuals, axis=1)))
    judged = (
        []
        if jig > 0.0
        else [
            _order(truth, fit),
            _shape(truth, fit),
            _halves(truth, readings, noise),
            _alone(truth, names, fit),
        ]
    )
    return [
        *axes_gates(fit.matrix / nominal),
        Gate(
            "residual",
            noise <= largest,
            f"{noise:.3g} of one degree of freedom, expected up to {largest:.3g}; the largest is at {names[worst]}: "
            "was it this attitude?",
        ),
        _twice(truth, readings, names),
        range_gate(readings),
        _better(truth, readings, fit, nominal),
        *judged,
    ]


def axes_gates(matrix: Array) -> list[Gate]:
    """Gates of a matrix (3, 3) of readings by truth, without a unit: sense, size and evenness of its axes."""
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return [
        Gate(
            "right-handed",
            bool(np.linalg.det(matrix) > 0.0),
            "the axes are left-handed: one is mirrored, or two are exchanged",
        ),
        Gate(
            "scale",
            bool(SCALES[0] <= sizes[-1] and sizes[0] <= SCALES[1]),
            f"the axes answer with {sizes[-1]:.3g} to {sizes[0]:.3g} of the reference, expected {SCALES[0]} to "
            f"{SCALES[1]}: is it the reference of this record?",
        ),
        Gate(
            "axes",
            bool(sizes[0] < UNEQUAL * sizes[-1]),
            f"the axes are not three alike at right angles: largest over smallest answer {sizes[0] / sizes[-1]:.3g}, "
            f"expected up to {UNEQUAL}",
        ),
    ]


def face_gate(faces: Array, jig: Array, tilt: Array) -> Gate:
    """Tool faces (n,) of a calibrated tool beside the jig's (n,), rad, at its tilts: sense and distance."""
    weight = np.where(np.abs(np.sin(tilt)) > LEANING, np.sin(tilt) ** 2, 0.0)
    if np.sum(weight > 0.0) < 4 or np.ptp(jig[weight > 0.0]) < 1e-6:
        return Gate("tool face", holds=True)
    along, against = (np.sum(weight * np.exp(1j * (faces - sense * jig))) for sense in (1.0, -1.0))
    if abs(against) > abs(along):
        return Gate("tool face", False, "turns against the jig's: its faces run backwards or two wires are exchanged")
    left = np.angle(np.exp(1j * (faces - jig - np.angle(along))))
    rms = math.sqrt(float(np.sum(weight * left**2) / np.sum(weight)))
    text = f"{math.degrees(rms):.3g} deg rms beside the jig's, expected up to {math.degrees(LARGEST_FACE):.3g}"
    return Gate("tool face", rms <= LARGEST_FACE, text)


def triad_gates(size_rms: float, angle_rms: float, unit: str) -> list[Gate]:
    """Gates of an MWD triad: what its record keeps of errors of the size, relative, and of the angle (rad), rms."""
    return [
        Gate("size", size_rms <= LARGEST_SIZE, f"{size_rms:.2g} of |{unit}| rms, expected up to {LARGEST_SIZE:g}"),
        Gate(
            "angle",
            angle_rms <= LARGEST_ANGLE,
            f"{math.degrees(angle_rms):.2g} deg rms, expected up to {math.degrees(LARGEST_ANGLE):.2g}",
        ),
    ]


def range_gate(readings: Array) -> Gate:
    """Whether readings (n, 3) keep off the outermost value: three or more there are a sensor at its range."""
    sizes = np.abs(readings)
    at = int(np.sum(sizes == sizes.max()))
    return Gate("range", at < CLIPPED, f"{at} readings stand at +-{sizes.max():.6g}: the sensor was at its range")


def rows_twice(rows: Array) -> list[tuple[int, int]]:
    """Pairs of equal rows of (n, k), each with the first of its kind."""
    first: dict[bytes, int] = {}
    pairs = []
    for k, row in enumerate(rows):
        key = (row + 0.0).tobytes()
        if key in first:
            pairs.append((first[key], k))
        first.setdefault(key, k)
    return pairs


def _twice(truth: Array, readings: Array, names: Sequence[str]) -> Gate:
    pairs = rows_twice(np.hstack([truth, readings]))
    text = f"{len(pairs)} readings stand twice, as {names[pairs[0][0]]} and {names[pairs[0][1]]}" if pairs else ""
    return Gate("duplicates", not pairs, text)


def _better(truth: Array, readings: Array, fit: AttitudeFit, nominal: float) -> Gate:
    """Whether the record is explained better than by a sensor without errors."""
    before = math.sqrt(float(np.mean((readings - nominal * truth) ** 2)))
    after = fit.residual_rms()
    return Gate("gain", after <= before, f"{after:.3g} after, {before:.3g} before: no better than uncalibrated")


def _order(truth: Array, fit: AttitudeFit) -> Gate:
    """Whether residuals follow on each other in the order of the record: a bias that walks, a sensor that warms up."""
    text = "residuals follow on each other in the order of the record: the bias drifted, or the sensor warmed up"
    return Gate("drift", not find_walk(truth, fit.residuals), text)


def _shape(truth: Array, fit: AttitudeFit) -> Gate:
    """Whether what is left of an axis goes with the cube of what it feels."""
    n = len(truth)
    if n - 5 < FEWEST_FREE - 1:
        return Gate("linear", holds=True)
    basis = np.column_stack([np.ones(n), truth])
    for axis in range(3):
        felt = truth @ fit.matrix[axis]
        cube = felt**3
        cube = cube - basis @ np.linalg.lstsq(basis, cube, rcond=None)[0]
        size = float(cube @ cube)
        if size < 1e-6 * float(felt @ felt) ** 3 / n**2:
            continue  # the design does not tell a cube from a line
        slope = float(cube @ fit.residuals[:, axis]) / size
        rest = fit.residuals[:, axis] - slope * cube
        error = math.sqrt(float(rest @ rest) / (n - 5) / size)
        if abs(slope) > coverage_factor(n - 5, 1.0 - CHANCE / 3.0) * error:
            share = abs(slope) * float(np.abs(felt).max()) ** 2
            return Gate("linear", False, f"axis {'xyz'[axis]} is bent by {share:.2%} of its largest reading")
    return Gate("linear", holds=True)


def _alone(truth: Array, names: Sequence[str], fit: AttitudeFit) -> Gate:
    """Whether no reading lies farther off than the noise of all others allows it to."""
    n = len(truth)
    if n - 5 < FEWEST_FREE:
        return Gate("attitude", holds=True)
    basis = np.column_stack([np.ones(n), truth])
    free = 1.0 - np.sum(basis * np.linalg.pinv(basis).T, axis=1, keepdims=True)  # of each reading's variance
    free = np.where(free > 1e-9, free, np.inf)  # a reading that the fit follows wherever it lies shows nothing
    squares = np.sum(fit.residuals**2, axis=0)
    others = np.maximum(squares - fit.residuals**2 / free, 1e-12 * squares + 1e-300) / (n - 5)
    off = np.abs(fit.residuals) / np.sqrt(others * free)
    worst = int(np.argmax(off.max(axis=1)))
    limit = coverage_factor(n - 5, 1.0 - CHANCE / (3 * n))
    text = f"{names[worst]} lies {off.max():.3g} times as far off as the others scatter: was it this attitude?"
    return Gate("attitude", bool(off.max() <= limit), text)


def _halves(truth: Array, readings: Array, noise: float) -> Gate:
    """Whether each half of the record says what the other does."""
    if len(truth) < HALVES:
        return Gate("halves", holds=True)
    worst = 0.0
    scale = float(np.linalg.norm(truth, axis=1).max())
    for first in (0, 1):
        own, other = np.arange(len(truth)) % 2 == first, np.arange(len(truth)) % 2 != first
        basis = np.column_stack([np.full(len(truth), scale), truth])
        if rank_of(basis[own]) < 4:
            return Gate("halves", holds=True)
        found = np.linalg.lstsq(basis[own], readings[own], rcond=None)[0]
        spread = basis[other] @ np.linalg.pinv(basis[own])
        expected = noise * np.sqrt(1.0 + np.sum(spread**2, axis=1))
        left = (readings[other] - basis[other] @ found) / expected[:, None]
        worst = max(worst, math.sqrt(float(np.mean(left**2))))
    text = f"one half of the record is explained {worst:.2g} times worse by the other than its noise allows"
    return Gate("halves", worst <= WORST_RATIO, text)
