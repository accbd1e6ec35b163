"""What a design of tilts, tool faces and temperatures can determine: the errors it leaves, over the whole sphere.

Judged by its leverage, the largest error of size (in references) or angle (rad) anywhere on the sphere and in the
record's temperatures, in errors of one reading: 0.3 for every attitude at every temperature, 1 to 2.5 where tool-face
order or heating direction varies between tilts, 10 to 16 for a single heating ramp, above 1000 where a coefficient is
open.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.calibration.jig import Jig
from groundstation.calibration.mwd_cost import AxisGeometry, Problem, parameter_layout
from groundstation.calibration.mwd_model import volts_of
from groundstation.calibration.mwd_record import TriadRecord
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
POOR_LEVERAGE = 6.0
OPEN_LEVERAGE = 200.0
RANK = 1e-11  # of the largest eigenvalue of the normal matrix with unit columns
GRID_DEG = 30.0
LEVELS = 5  # of temperature


def parameter_covariance(problem: Problem, x: Array, free: Array) -> Array | None:
    """(k, k) covariance of the parameters for residuals of variance 1; None where one of them is open."""
    normal = free.T @ problem.terms(x).normal @ free
    unit = np.sqrt(np.diag(normal))
    if not np.all(unit > 0.0):
        return None
    values, axes = np.linalg.eigh(normal / np.outer(unit, unit))
    if values[0] < RANK * values[-1]:
        return None
    scaled = free @ (axes / unit[:, None])
    return np.asarray(scaled @ (scaled / values).T)


def with_jig(problem: Problem, x: Array, unit_cov: Array, jig: Jig) -> tuple[Array, float]:
    """Covariance (k, k) of the parameters by the jig's errors, and the variance of the noise beside them.

    The error of a tilt is common to all readings at it, so the noise is what is left within the tilts. About the tool's
    axis itself a lean of the jig turns with the tool faces, so there it counts as another error at each of them.
    """
    jacobian = problem.residual_jacobian(x).reshape(len(problem.angle), 4, -1)
    on_axis = problem.on_axis()
    tilts, setting = np.unique(np.round(problem.angle[~on_axis], 6), return_inverse=True)
    tilted, upright = jacobian[~on_axis, 1], jacobian[on_axis, 1:3].reshape(-1, jacobian.shape[2])
    together = np.zeros((len(tilts), tilted.shape[1]))
    np.add.at(together, setting.ravel(), tilted)
    each = jig.common**2 + jig.random**2
    normal = jig.common**2 * together.T @ together + jig.random**2 * tilted.T @ tilted + each * upright.T @ upright
    return np.asarray(unit_cov @ normal @ unit_cov), _noise_within(problem, x, jacobian, setting.ravel(), jig)


def _noise_within(problem: Problem, x: Array, jacobian: Array, setting: npt.NDArray[np.intp], jig: Jig) -> float:
    """Variance of the noise from what neither the parameters nor a common error of each tilt explain.

    Sizes do not see the jig; angles off the axis do so as their tilts do, if nothing else turns them.
    """
    tilted = np.flatnonzero(~problem.on_axis())
    common = np.zeros((len(jacobian), 4, setting.max(initial=-1) + 1))
    common[tilted, 1, setting] = 1.0
    used = np.zeros((len(jacobian), 4), dtype=bool)
    used[:, 0] = True
    used[tilted, 1] = jig.random == 0.0
    axes, values, _ = np.linalg.svd(np.concatenate([jacobian, common], axis=2)[used], full_matrices=False)
    axes = axes[:, values > RANK**0.5 * values[0]]
    residuals = problem.residuals(x).reshape(len(jacobian), 4)[used]
    left = residuals - axes @ (axes.T @ residuals)
    return float(left @ left / max(len(residuals) - axes.shape[1], 1))


def refuse_open(record: TriadRecord, problem: Problem, free: Array) -> None:
    """Refuse a design that leaves a coefficient open, before anything is solved.

    Raises
    ------
    CalibrationError
        With what the design has.
    """
    x = np.zeros(len(free))
    cov = parameter_covariance(problem, x, free)
    if cov is None or max(predicted_stds(record, x, cov)) > OPEN_LEVERAGE:
        angles = len(np.unique(np.round(np.degrees(record.angle))))
        raise CalibrationError(
            f"the design cannot tell its {len(x)} coefficients apart ({angles} reference angles, temperatures over "
            f"{np.ptp(record.temperature):.1f} C): it needs more tilts, at least three tool faces at each, and for 30 "
            "coefficients at least four temperatures"
        )


def predicted_stds(record: TriadRecord, x: Array, cov: Array) -> tuple[float, float]:
    """Largest standard deviations of size (in references) and angle (rad) that the parameters' covariance leaves."""
    steps = np.arange(0.0, 360.0, GRID_DEG)
    polar, around = np.meshgrid(np.radians(steps[steps <= 180.0]), np.radians(steps))
    sphere = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    vector = np.tile(sphere.reshape(-1, 3), (LEVELS, 1))
    levels = np.linspace(record.temperature.min(), record.temperature.max(), LEVELS)
    temperature = np.repeat(levels, polar.size)
    volts = volts_of(record.triad(x), vector * record.unit, temperature)
    # the angle counts from the tool's axis for the magnetometers too: it stands for any direction
    axis, size = np.tile([0.0, 0.0, 1.0], (len(vector), 1)), np.full(len(vector), record.unit)
    angle = np.tile(polar.ravel(), LEVELS)
    there = TriadRecord(volts, temperature, size, axis, angle, record.axes, record.volts_per_unit).problem(len(x))
    local = there.local(x)
    at = AxisGeometry.of(local.vector, axis)
    index, power = parameter_layout(there.powers)
    rows = np.stack([at.radial, at.tangent / at.size[:, None]], axis=1) @ local.jacobian()
    rows = rows[:, :, index] * there.theta[:, None, None] ** power
    std = np.sqrt(np.maximum(np.einsum("nik,kl,nil->ni", rows, cov, rows), 0.0))
    return float(std[:, 0].max()), float(std[:, 1].max())
