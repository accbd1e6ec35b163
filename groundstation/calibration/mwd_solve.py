"""Calibration of the MWD tool: 12 parameters a triad at one temperature, 30 over a range of temperatures.

Start: the nominal tool. Parameters: SF = nominal (1 + s) and B in units of the reference, polynomials in
theta = (T - 30 C)/50 C; the result is in volts and units again.
Accelerometers: tilt and |G| do not see a turn about the tool's axis, so one parameter is held by m_AB = m_BA; with a
tool-face reference the solution is afterwards turned onto it, which changes neither tilt nor |G|. Standard errors of
the misalignments hold the roll as known. Magnetometers have the vertical of the accelerometers as reference and need
no such hold, so both triads end in one frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.calibration.jig import Jig
from groundstation.calibration.mwd_cost import Problem
from groundstation.calibration.mwd_design import (
    POOR_LEVERAGE,
    parameter_covariance,
    predicted_stds,
    refuse_open,
    with_jig,
)
from groundstation.calibration.mwd_model import (
    LOCAL,
    Triad,
    coefficient_names,
    tool_face,
    turned_triad,
    vectors_of_volts,
)
from groundstation.calibration.mwd_newton import free_parameter_matrix, minimise_cost
from groundstation.calibration.mwd_record import (
    ACCELEROMETER_VOLTS_PER_G,
    MAGNETOMETER_VOLTS_PER_MICROTESLA,
    TriadRecord,
    accelerometer_record,
    check_record,
    magnetometer_record,
)
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
ONE_TEMPERATURE = 3.0  # C, span beyond which 12 parameters are too few
OUTLIER, OUTLIER_FLOOR = 15.0, 2e-3  # median residuals; of the reference or rad


@dataclass(frozen=True, slots=True)
class MwdErrors:
    """Errors over the readings of a record: of the size (unit) and of the tilt or dip (rad)."""

    size_max: float
    size_rms: float
    angle_max: float
    angle_rms: float


@dataclass(frozen=True, slots=True)
class MwdFit:
    """A calibrated triad and what it rests on.

    ``cost`` is E in units of the reference; ``standard_errors`` by name, in the units of the coefficients;
    ``predicted_size_std`` (unit) and ``predicted_angle_std`` (rad) are the largest over the sphere and the record's
    temperatures; ``temperatures`` (C) the range outside which the polynomials extrapolate.
    """

    triad: Triad
    parameters: int
    iterations: int
    cost: float
    coefficients: dict[str, float]
    standard_errors: dict[str, float]
    before: MwdErrors
    after: MwdErrors
    predicted_size_std: float
    predicted_angle_std: float
    temperatures: tuple[float, float]
    warnings: tuple[str, ...]


def solve_accelerometers(
    volts: Array,
    temperature: Array,
    tilt: Array,
    parameters: int = 30,
    *,
    tool_face_reference: Array | None = None,
    volts_per_g: float = ACCELEROMETER_VOLTS_PER_G,
    jig: Jig | None = None,
) -> MwdFit:
    """Coefficients of the accelerometers from voltages (n, 3), temperatures (n,) C and the jig's tilts (n,) rad.

    ``jig`` : errors of the tilts, common to all tool faces of one; without it the residuals alone are noise.

    Raises
    ------
    CalibrationError
        When a reading cannot be, the design leaves a parameter open, or the search does not end.
    """
    fit = fit_triad(accelerometer_record(volts, temperature, tilt, volts_per_g), parameters, jig)
    if tool_face_reference is None:
        return fit
    if tool_face_reference.shape != tilt.shape or not np.all(np.isfinite(tool_face_reference)):
        raise CalibrationError(f"expected a finite tool-face reference for each of the {len(tilt)} readings")
    wrong = tool_face(vectors_of_volts(fit.triad, volts, temperature)) - tool_face_reference
    roll = float(np.angle(np.sum(np.sin(tilt) ** 2 * np.exp(1j * wrong))))
    triad = turned_triad(fit.triad, roll)
    return replace(fit, triad=triad, coefficients=_named(triad, parameters))


def solve_magnetometers(
    volts: Array,
    temperature: Array,
    gravity: Array,
    size: Array | float,
    dip: Array | float,
    parameters: int = 30,
    *,
    volts_per_microtesla: float = MAGNETOMETER_VOLTS_PER_MICROTESLA,
) -> MwdFit:
    """Coefficients of the magnetometers from voltages (n, 3), temperatures (n,) C and calibrated gravity (n, 3).

    ``size`` (microtesla) and ``dip`` (rad) are the site's field, constant or at each reading.

    Raises
    ------
    CalibrationError
        As ``solve_accelerometers``.
    """
    return fit_triad(magnetometer_record(volts, temperature, gravity, size, dip, volts_per_microtesla), parameters)


def fit_triad(record: TriadRecord, parameters: int, jig: Jig | None = None) -> MwdFit:
    """Minimise the cost of a record and judge the result; ``jig`` : errors of its reference angles."""
    check_record(record, parameters)
    problem, free = record.problem(parameters), free_parameter_matrix(parameters, record.axes)
    refuse_open(record, problem, free)
    x, iterations = minimise_cost(problem, free)
    _refuse_outlier(problem, x)
    cost, unit_cov = problem.value(x), parameter_covariance(problem, x, free)
    if unit_cov is None:
        raise CalibrationError("the solution leaves a coefficient open though the design should not")
    by_jig, noise = np.zeros_like(unit_cov), cost / _degrees(problem, free)
    if jig is not None:
        by_jig, noise = with_jig(problem, x, unit_cov, jig)
    cov = noise * unit_cov + by_jig
    leverage, (size_std, angle_std) = max(predicted_stds(record, x, unit_cov)), predicted_stds(record, x, cov)
    triad = record.triad(x)
    return MwdFit(
        triad,
        parameters,
        iterations,
        cost,
        _named(triad, parameters),
        _named(record.triad(np.sqrt(np.diag(cov)), base=0.0), parameters),
        _errors(problem, np.zeros_like(x), record.unit),
        _errors(problem, x, record.unit),
        size_std * record.unit,
        angle_std,
        (float(record.temperature.min()), float(record.temperature.max())),
        tuple(_warnings(record, parameters, leverage)),
    )


def _degrees(problem: Problem, free: Array) -> int:
    """Degrees of freedom of the residuals: two a reading (size, angle), three on the axis, less the free parameters."""
    return 2 * len(problem.angle) + int(problem.on_axis().sum()) - int(free.shape[1])


def _refuse_outlier(problem: Problem, x: Array) -> None:
    """Name the reading that moved or was misread; systematic errors of a design are not outliers."""
    found = []
    for what, error in zip(("size", "angle"), np.abs(problem.errors(x)), strict=True):
        limit = max(OUTLIER * float(np.median(error)), OUTLIER_FLOOR)
        worst = int(np.argmax(error))
        found.append((float(error[worst]) / limit, worst, what, float(error[worst]), limit))
    excess, worst, what, size, limit = max(found)  # a wrong reading bends its neighbours: the worst of all is to blame
    if excess > 1.0:
        raise CalibrationError(
            f"reading {worst + 1}: its {what} is off by {size:.2g} (limit {limit:.2g}) "
            "from what the others say; it moved, was misread or has another attitude"
        )


def _errors(problem: Problem, x: Array, unit: float) -> MwdErrors:
    e_g, e_t = problem.errors(x)
    size, angle = unit * np.abs(e_g), np.abs(e_t)
    rms = [float(np.sqrt(np.mean(e**2))) for e in (size, angle)]
    return MwdErrors(float(size.max()), rms[0], float(angle.max()), rms[1])


def _named(triad: Triad, parameters: int) -> dict[str, float]:
    every = triad.coefficients()
    return {name: every[name] for name in coefficient_names(triad.axes, parameters)}


def _warnings(record: TriadRecord, parameters: int, leverage: float) -> list[str]:
    found = []
    span = float(np.ptp(record.temperature))
    if parameters == LOCAL and span > ONE_TEMPERATURE:
        found.append(f"12 parameters hold at one temperature, the record spans {span:.1f} C")
    if leverage > POOR_LEVERAGE:
        found.append(
            f"poor design: errors of {leverage:.1f} times a reading's are to be expected; "
            "vary the order of tool faces or the direction of heating between tilts, and spread the tilts"
        )
    return found
