"""Trust in the sensors: which is faulty, the safe state while it is, and the word that it has proved itself."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.quantity import NONE
from node.kernels.filter.resets import lose_yaw
from node.kernels.record.events import Code, event_count, queue_event

SANE_CYCLES: Final = 3  # in a row, until the readings are used again; more than the filter's lag
SENSOR_RECOVERED = kernel_constant(Code.SENSOR_RECOVERED)


@kernel
def is_faulty(trust: Any) -> bool:
    """Whether a sensor's readings are not to be relied on."""
    return bool(trust.fault != 0 and trust.proving == 0)


@kernel
def hold_safe_state(node: Any) -> None:
    """Keep the safe state around a cycle: what needs the faulty sensor is unknown, and nothing is learnt."""
    state = node.filter
    if is_faulty(node.guard.gyro):
        lose_yaw(state)
        state.bias_count = 0
        for k in range(3):
            state.bias_sum[k] = 0
    if is_faulty(node.guard.force):
        state.surveyed = 1


@kernel
def tell_recovery(node: Any, trust: Any) -> None:
    """Tell that a sensor has proved itself, of what fault and after how many cycles."""
    after, cycles = event_count(node.guard.rate, trust.fault), event_count(node.guard.rate, trust.cycles)
    queue_event(node, SENSOR_RECOVERED, after, cycles, NONE, NONE)
