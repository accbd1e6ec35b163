"""The border of the integer loop: configuration, state, readings and aiding between SI floats and Q formats.

This is the one module of the folder that knows floats. It runs beside the loop, never inside it: readings once a
cycle, configuration and state when somebody changed them. What does not fit is held at the end of its range and
counted in ``overflows``.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.fixed.layout import (
    CEILING,
    FASTEST,
    FIXED_CONFIG,
    FIXED_STATE,
    FORCE_Q,
    LEVEL_Q,
    NEVER,
    RATE_Q,
    STRONGEST,
    TIME_Q,
    UNIT,
    VAR_Q,
    VECTOR_Q,
)
from node.kernels.jit import kernel
from node.kernels.layout import Array, Err

LARGEST: Final = 1 << 61
SAME: Final = (
    "yaw_known",
    "reference_hops",
    "last_sequence",
    "rejected",
    "pending",
    "pending_sequence",
    "cycles",
    "consumed",
    "ring_quiet",
    "mode",
    "still_cycles",
    "surveyed",
    "rate_exceeded",
    "bias_count",
)
FORMATS: Final = {
    "static_bias": RATE_Q,
    "bias": RATE_Q,
    "scale": RATE_Q,
    "stamp": RATE_Q,
    "now_rate": RATE_Q,
    "ring_rate": RATE_Q,
    "bias_sum": RATE_Q,
    "down": VECTOR_Q,
    "now_down": VECTOR_Q,
    "static_bias_var": VAR_Q + 2 * UNIT,
    "systematic_var": VAR_Q,
    "innovation_var": VAR_Q,
    "pending_var": VAR_Q,
    "innovation": 40,
    "epoch": TIME_Q,
    "now": TIME_Q,
    "pending_at": TIME_Q,
    "ring_start": TIME_Q,
    "ring_end": TIME_Q,
}
ANGLES: Final = ("reference_offset", "pending_yaw")  # rad beside binary angles
TIMES: Final = ("last_aided", "stopped_at")  # -inf and nan beside NEVER
UNITS: Final = np.array([0] * int(Err.BIAS_X) + [UNIT] * (len(Err) - int(Err.BIAS_X)))
COVARIANCE: Final = np.exp2(VAR_Q + UNITS[:, None] + UNITS[None, :])
TURN: Final = 2.0 * math.pi


@kernel
def to_fixed(record: Any, value: float, q: int, limit: int) -> int:
    """``value`` in Q``q``, held within -limit..limit and then counted."""
    scaled = math.floor(value * 2.0**q + 0.5)
    if not abs(scaled) <= limit:
        record.overflows += 1
        return -limit if scaled < 0 else limit
    return int(scaled)


@kernel
def take_reading(fixed: Any, rate: Array, force: Array, gravity: float, fixed_rate: Array, fixed_force: Array) -> None:
    """Mean rate (3, rad/s) and specific force (3, m/s^2) of a cycle as Q46 rad/s and Q26 g."""
    for k in range(3):
        fixed_rate[k] = to_fixed(fixed, rate[k], RATE_Q, FASTEST)
        fixed_force[k] = to_fixed(fixed, force[k] / gravity, FORCE_Q, STRONGEST)


@kernel
def show_cycle(fixed: Any, state: Any, gravity: float) -> None:
    """Write what one cycle may have changed into the float64 record ``state``, but for covariances and the queue."""
    slot = (fixed.cycles - 1) % fixed.ring_start.shape[0]
    rate, time, vector = 2.0**-RATE_Q, 2.0**-TIME_Q, 2.0**-VECTOR_Q
    state.ring_start[slot], state.ring_end[slot] = fixed.ring_start[slot] * time, fixed.ring_end[slot] * time
    state.ring_quiet[slot] = fixed.ring_quiet[slot]
    for k in range(3):
        state.ring_rate[slot, k] = fixed.ring_rate[slot, k] * rate
        state.ring_force[slot, k] = fixed.ring_force[slot, k] * (2.0**-FORCE_Q * gravity)
        state.down[k], state.now_down[k] = fixed.down[k] * vector, fixed.now_down[k] * vector
        state.static_bias[k], state.bias[k] = fixed.static_bias[k] * rate, fixed.bias[k] * rate
        state.static_bias_var[k] = fixed.static_bias_var[k] * 2.0 ** -(VAR_Q + 2 * UNIT)
        state.bias_sum[k] = fixed.bias_sum[k] * rate
    state.epoch, state.now = fixed.epoch * time, fixed.now * time
    state.yaw, state.now_yaw, state.yaw_known = fixed.yaw, fixed.now_yaw, fixed.yaw_known
    state.scale, state.stamp, state.now_rate = fixed.scale * rate, fixed.stamp * rate, fixed.now_rate * rate
    state.innovation, state.innovation_var = fixed.innovation * 2.0**-40, fixed.innovation_var * 2.0**-VAR_Q
    state.rejected, state.cycles, state.consumed = fixed.rejected, fixed.cycles, fixed.consumed
    state.mode, state.still_cycles, state.surveyed = fixed.mode, fixed.still_cycles, fixed.surveyed
    state.rate_exceeded, state.bias_count = fixed.rate_exceeded, fixed.bias_count
    state.stopped_at = fixed.stopped_at * time if fixed.stopped_at != NEVER else math.nan


@kernel
def show_covariance(fixed: Any, state: Any, scale: Array) -> None:
    """Write the covariances into the float64 record; ``scale`` (8, 8) is the value of 1."""
    for i in range(scale.shape[0]):
        for j in range(scale.shape[1]):
            state.P[i, j] = fixed.P[i, j] / scale[i, j]
            state.now_P[i, j] = fixed.now_P[i, j] / scale[i, j]


@kernel
def show_survey(fixed: Any, state: Any, gravity: float) -> None:
    """Write the last survey (g) into the float64 record (m/s^2)."""
    unit = gravity * 2.0**-FORCE_Q
    for i in range(3):
        state.survey_force[i] = fixed.survey_force[i] * unit
        for j in range(3):
            state.survey_force_cov[i, j] = fixed.survey_force_cov[i, j] * unit * unit


@kernel
def show_aiding(fixed: Any, state: Any) -> None:
    """Write the reference, its age and the queue of measurements into the float64 record."""
    angle = 2.0 * math.pi / 4294967296.0
    state.reference_hops, state.reference_offset = fixed.reference_hops, fixed.reference_offset * angle
    state.systematic_var = fixed.systematic_var * 2.0**-VAR_Q
    state.last_sequence, state.pending = fixed.last_sequence, fixed.pending
    state.last_aided = fixed.last_aided * 2.0**-TIME_Q if fixed.last_aided != NEVER else -math.inf
    for k in range(fixed.pending):
        state.pending_at[k] = fixed.pending_at[k] * 2.0**-TIME_Q
        state.pending_yaw[k] = fixed.pending_yaw[k] * angle
        state.pending_var[k] = fixed.pending_var[k] * 2.0**-VAR_Q
        state.pending_sequence[k] = fixed.pending_sequence[k]


def learn_state(state: Any, gravity: float, overflows: int) -> Array:
    """Integers of a whole float64 ``state`` (a record of dtype ``STATE``), one record of dtype ``FIXED_STATE``."""
    made = np.zeros(1, FIXED_STATE)
    record = made[0]
    record["overflows"] = overflows
    for name in SAME:
        record[name] = state[name]
    record["yaw"], record["now_yaw"] = state["yaw"], state["now_yaw"]
    for name, q in FORMATS.items():
        record[name] = held(record, state[name] * 2.0**q)
    for name in ANGLES:
        record[name] = np.floor(np.mod(state[name], TURN) / TURN * 2.0**32 + 0.5).astype(np.int64) & 0xFFFFFFFF
    for name in TIMES:
        record[name] = held(record, state[name] * 2.0**TIME_Q) if math.isfinite(state[name]) else NEVER
    for name in ("ring_force", "survey_force"):
        record[name] = held(record, state[name] / gravity * 2.0**FORCE_Q)
    record["survey_force_cov"] = held(record, state["survey_force_cov"] / gravity**2 * 4.0**FORCE_Q)
    for name in ("P", "now_P"):
        record[name] = held_covariance(record, state[name] * COVARIANCE)
    return made


def held(record: Any, value: Any) -> Any:
    """Nearest integers of ``value``, held within their range and then counted."""
    kept = np.clip(np.nan_to_num(np.rint(value)), -LARGEST, LARGEST)
    record["overflows"] += int(np.count_nonzero(kept != np.rint(value)))
    return np.asarray(kept).astype(np.int64)


def held_covariance(record: Any, value: Array) -> Array:
    """A covariance whose variances are held at their ceiling, by scaling rows and columns: it stays positive."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(np.diag(value) > CEILING, np.sqrt(CEILING / np.diag(value)), 1.0)
    record["overflows"] += int(np.count_nonzero(factor < 1.0))
    fixed: Array = held(record, value * factor[:, None] * factor[None, :])
    return fixed


def learn_config(config: Any) -> tuple[Array, int]:
    """Integers of a configuration (a record of dtype ``CONFIG``) and how many of them did not fit."""
    made, count = np.zeros(1, FIXED_CONFIG), np.zeros(1, FIXED_STATE)
    record, counter = made[0], count[0]
    noise = config["gyro_noise"] ** 2
    walk = noise * config["attitude_factor"] ** 2
    bias = config["bias_std"] ** 2
    unit2 = 4.0**UNIT
    variances = {
        "walk": walk,
        "rate_walk": walk * unit2,
        "noise_var": noise,
        "bias_var": bias * unit2,
        "bias_drive": bias * config["bias_factor"] ** 2 * unit2,
        "bias_area": (noise + 2.0 * bias * config["bias_tau"]) * unit2,
        "still_walk_var": config["still_walk"] ** 2,
        "stamp_var": config["stamp_std"] ** 2 * unit2,
        "stamp_walk_var": config["stamp_walk"] ** 2 * unit2,
        "aiding_floor_var": config["aiding_floor_var"],
        "force_var": (config["force_std"] / config["gravity"]) ** 2,
    }
    for name, value in variances.items():
        record[name] = held(counter, np.asarray(value) * 2.0**VAR_Q)
    record["bias_decay"] = held(counter, math.log2(math.e) / config["bias_tau"] * 2.0**42)
    record["stamp_on"] = int(config["stamp_std"] > 0.0)
    record["gate_inverse"] = min(round(2.0**LEVEL_Q / max(config["gate"], 1.0) ** 2), 1 << LEVEL_Q)
    for name in ("rate_limit", "still_rate"):
        record[name] = held(counter, config[name] * 2.0**RATE_Q)
    for name in ("reject_limit", "lag_cycles", "survey_samples", "settle_cycles", "static_cycles"):
        record[name] = config[name]
    return made, int(counter["overflows"])
