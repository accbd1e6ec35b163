"""The bound: what the best filter and the best smoother make of what a node hears and reads, as covariances.

The model is the world's own (white noise, Gauss-Markov bias, constant scale, constant offset of the clock with its
wander), so nothing is left out or put in for safety, and the gyroscope's increments end wherever an aiding is valid:
a node, which has means over its cycles, cannot do better. A string at rest does not turn, and its gyroscope then
measures its bias. Covariances need no readings, only when what was measured, and how well.
Source: Kalman filter and Rauch-Tung-Striebel smoother; Gelb (ed.), Applied Optimal Estimation, 1974, 4.2 and 5.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.kernels.record.filter_record import UNKNOWN_YAW_VAR
from node.kernels.record.node_record import A_RATE, A_SEQUENCE, A_VALID, A_YAW_VAR
from sim.string.head_measurements import measure_head
from sim.string.schedule import aiding_passes
from sim.world.world import World

Array = npt.NDArray[np.float64]
YAW, BIAS, SCALE, STAMP = range(4)
STATES = 4
AXIS = 2  # of the string


@dataclass(frozen=True, slots=True)
class Model:
    """Errors of one node of a world, SI units."""

    noise: float  # rad/s/sqrt(Hz)
    bias_std: float  # rad/s
    bias_tau: float  # s
    scale_std: float
    stamp_std: float  # s, constant
    stamp_walk: float  # s/sqrt(s)


@dataclass(frozen=True, slots=True)
class NodeTimeline:
    """Timeline of a node: ``times`` (n,) s, the mean spin before each (rad/s), and the measurements at it.

    ``var`` is that of an aiding (rad^2), infinite where there is none; ``rate`` is the spin at that moment.
    """

    times: Array
    spin: Array
    rate: Array
    var: Array


@dataclass(frozen=True, slots=True)
class Bound:
    """Variances of the yaw (rad^2) at every time of a course."""

    times: Array
    filtered: Array
    smoothed: Array


def model_of(world: World, hops: int) -> Model:
    """Errors of the node ``hops`` below the encoder."""
    file = world.scenario.file
    gyro, clocks = file.gyroscope, file.clocks
    clock_var = hops * 1e-6 * (clocks.joint_std_ms**2 + clocks.wander_std_ms**2)
    walk_var = hops * 2e-6 * clocks.wander_std_ms**2 / clocks.wander_tau_s
    noise, bias = np.radians(gyro.noise_dps_rthz[AXIS]), np.radians(gyro.bias_std_dps[AXIS])
    return Model(noise, bias, gyro.bias_tau_s, gyro.scale_factor_std, clock_var**0.5, walk_var**0.5)


def node_timeline(world: World) -> NodeTimeline:
    """Cycles of a world that is plain, and the aidings of which nothing is lost."""
    measured, ends = measure_head(world), world.ends
    heard = aiding_passes(world.scenario.file.aiding, ends - world.begin, world.seed)
    used = np.flatnonzero(heard)
    _, first = np.unique(measured[used, A_SEQUENCE], return_index=True)  # a repetition is the same measurement
    used = used[np.sort(first)]
    valid = np.maximum(measured[used, A_VALID], world.begin)
    times = np.concatenate([ends, valid])
    order = np.argsort(times, kind="stable")
    var = np.concatenate([np.full(len(ends), np.inf), measured[used, A_YAW_VAR]])[order]
    rate = np.concatenate([np.zeros(len(ends)), measured[used, A_RATE]])[order]
    turned = world.motion.drive(times[order])[0]
    apart = np.diff(times[order], prepend=world.begin)
    spin = np.divide(np.diff(turned, prepend=turned[0]), apart, out=np.zeros(len(apart)), where=apart > 0.0)
    return NodeTimeline(times[order], spin, rate, var)


def bound_of(model: Model, course: NodeTimeline, begin: float) -> Bound:
    """Variances (rad^2) of the yaw by all data before each time, and by all data; begins at ``begin`` (s)."""
    count = len(course.times)
    before, after = np.empty((2, count, STATES, STATES))
    steps = np.empty((count, STATES, STATES))
    known = np.diag([UNKNOWN_YAW_VAR, model.bias_std**2, model.scale_std**2, model.stamp_std**2])
    for k, dt in enumerate(np.diff(course.times, prepend=begin)):
        steps[k], noise = step_of(model, float(course.spin[k]), float(dt))
        before[k] = known = steps[k] @ known @ steps[k].T + noise
        if course.spin[k] == 0.0 and dt > 0.0:
            known = posterior_cov(known, np.eye(STATES)[BIAS], model.noise**2 / float(dt))
        if np.isfinite(course.var[k]):
            known = posterior_cov(known, np.array([1.0, 0.0, 0.0, course.rate[k]]), float(course.var[k]))
        after[k] = known
    smoothed = after.copy()
    for k in range(count - 2, -1, -1):
        gain = after[k] @ steps[k + 1].T @ np.linalg.pinv(before[k + 1], hermitian=True)
        smoothed[k] = after[k] + gain @ (smoothed[k + 1] - before[k + 1]) @ gain.T
    return Bound(course.times, after[:, YAW, YAW], smoothed[:, YAW, YAW])


def step_of(model: Model, spin: float, dt: float) -> tuple[Array, Array]:
    """F and Q over ``dt`` (s); a string at rest does not turn."""
    turning = spin != 0.0
    decay = np.exp(-dt / model.bias_tau)
    step = np.eye(STATES)
    step[BIAS, BIAS] = decay
    if turning:
        step[YAW, BIAS], step[YAW, SCALE] = -dt, -spin * dt
    bias_var = model.bias_std**2 * (1.0 - decay**2)
    return step, np.diag([model.noise**2 * dt * turning, bias_var, 0.0, model.stamp_walk**2 * dt])


def posterior_cov(known: Array, row: Array, var: float) -> Array:
    """Covariance after a scalar measurement ``row`` (4,) with the variance ``var``."""
    seen = known @ row
    return np.asarray(known - np.outer(seen, seen) / (row @ seen + var))
