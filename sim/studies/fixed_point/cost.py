"""What a cycle of the integer kernel costs against one of the float64 kernel, in one run and inside compiled loops."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import ANGLE_Q, DEG, FORCE_Q, PERIOD, RATE_Q, TIME_Q, VAR_Q, Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.filter.fixed import cycle as fixed_cycle
from node.kernels.filter.float64 import cycle
from node.kernels.record.filter_conversion import config_in_integers, state_in_integers
from node.kernels.record.filter_record import default_config, new_state
from node.kernels.string import relay

AIDING_VAR = (0.003 * DEG) ** 2
WARM = 400  # cycles before the clock is read
STEP = round(PERIOD * 2.0**TIME_Q)
QUARTER = STEP // 4
FIXED_YAW = round(0.1 * 2.0**ANGLE_Q)
FIXED_VAR = round(AIDING_VAR * 2.0**VAR_Q)
GRAVITY = 9.81


@kernel
def drive_float64(state: Any, config: Any, rate: Array, force: Array, first: int) -> None:
    """Cycles of the float64 kernel, one for each row of ``rate`` (n, 3), each with an aiding."""
    for k in range(rate.shape[0]):
        start = 1000.0 + (first + k) * PERIOD
        cycle.run_cycle(state, config, rate[k], force, start, start + PERIOD, 1)
        relay.offer_aiding(state, config, 0.1, AIDING_VAR, 0.0, 0.0, start + 0.75 * PERIOD, first + k, 0)


@kernel
def drive_fixed(state: Any, config: Any, rate: Array, force: Array, first: int) -> None:
    """Cycles of the integer kernel, one for each row of ``rate`` (n, 3), each with an aiding."""
    for k in range(rate.shape[0]):
        start = (1000 << TIME_Q) + (first + k) * STEP
        fixed_cycle.run_cycle(state, config, rate[k], force, start, start + STEP, 1)
        at = start + STEP - QUARTER
        relay.offer_aiding(state, config, FIXED_YAW, FIXED_VAR, 0, 0, at, first + k, 0)


def measure_cycle_costs(cycles: int = 20_000, rounds: int = 7) -> list[dict[str, Any]]:
    """Rows of kind of cycle, ns of either kernel (best of ``rounds``, taken in turns) and their ratio."""
    random = np.random.default_rng(1)
    config, force = default_config(), np.array([0.0, 0.0, -GRAVITY])
    state = new_state(config)
    fixed_config, _ = config_in_integers(config[0])
    fixed_state = state_in_integers(state[0], GRAVITY)
    fixed_force = np.array([0, 0, -1 << FORCE_Q])
    first, rows = 0, []
    for case, spin, n in (("", 0.0, WARM), ("turning", 71.0 * DEG, cycles), ("rest", 0.0, cycles)):
        floats, integers = [], []
        for _ in range(rounds):
            rate = 1e-5 * random.standard_normal((n, 3)) + np.array([0.0, 0.0, spin])
            fixed_rate = np.rint(rate * 2.0**RATE_Q).astype(np.int64)
            begin = time.process_time()
            drive_float64(state[0], config[0], rate, force, first)
            middle = time.process_time()
            drive_fixed(fixed_state[0], fixed_config[0], fixed_rate, fixed_force, first)
            floats.append((middle - begin) / n * 1e9)
            integers.append((time.process_time() - middle) / n * 1e9)
            first += n
        if case:
            ns, fixed_ns = min(floats), min(integers)
            rows.append({"case": case, "float64_ns": ns, "fixed_ns": fixed_ns, "ratio": fixed_ns / ns})
    return rows
