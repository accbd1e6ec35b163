"""What the configuration says of the errors, and what changes of it while a node runs; for floats and integers.

The floats hold standard deviations, the integers the variances that are made of them.
"""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.formats import CEILING, FACTOR_Q, TAU_Q, TIME_Q, UNIT
from node.kernels.arithmetic.integers import multiply_q31, quotient_q30, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import SHORTEST, angular_root, angular_square, by_record, stamp_square


@kernel
def over_time(area: int, time: int) -> int:
    """A variance times seconds (Q56) by a time (s, Q28, at least 1 ms), held at the ceiling of variances."""
    over = max(time, SHORTEST)
    return CEILING if area >> 32 >= over else rounded_shift(quotient_q30(area, over), 30 - TIME_Q)


@by_record(lambda config, k: config.bias_var[k])
def bias_var(config: Any, k: int) -> float:
    """Variance of the part of bias ``k`` that wanders, (rad/s)^2."""
    return float(config.bias_std[k] ** 2)


@by_record(lambda config: config.boot_bias_var)
def boot_bias_var(config: Any) -> float:
    """Variance of a bias before the node has stood still for long enough, (rad/s)^2."""
    return float(config.boot_bias_std**2)


@by_record(lambda config: config.scale_var)
def scale_var(config: Any) -> float:
    """Variance of the scale before the first turn; 0: it is not estimated."""
    return float(config.scale_std**2)


@by_record(lambda config: config.stamp_var)
def stamp_var(config: Any) -> float:
    """Variance of the time stamp before the first aiding (s^2)."""
    return float(config.stamp_std**2)


@by_record(lambda config, k, count, time: over_time(count * min(config.rate_noise[k], CEILING >> 5), time))
def noise_over(config: Any, k: int, count: int, time: float) -> float:
    """Variance of the mean rate ``k`` over a ``time``, ``count``-fold, (rad/s)^2."""
    return float(count * config.gyro_noise[k] ** 2 / time)


@by_record(lambda config, k, time: over_time(config.bias_area[k], time))
def bias_mean_var(config: Any, k: int, time: float) -> float:
    """Variance of a bias that is the mean rate ``k`` over a ``time`` at rest: N^2 / T + 2 sigma_b^2 tau / T."""
    correlated = 2.0 * config.bias_std[k] ** 2 * config.bias_tau[k] / time
    return float(config.gyro_noise[k] ** 2 / time + correlated)


@by_record(lambda config, off, var: multiply_q31(int(angular_square(off)), config.gate_inverse) > var)
def is_beyond_gate(config: Any, off: float, var: float) -> bool:
    """Whether an angle is beyond the gate of a variance (rad^2)."""
    return bool(abs(off) > config.gate * angular_root(var))


@kernel
def square_force(std: int) -> int:
    """The variance (g^2, Q56) of a force that is off by ``std`` (g, Q46)."""
    return int(angular_square(std)) >> 12


@kernel
def set_gyro_noise(config: Any, k: int, var: int) -> None:
    """Set N^2 of gyroscope ``k`` (unit^2 s, Q56), and what of the integers is made of it."""
    config.rate_noise[k] = var
    config.changes += 1
    config.noise_var[k] = var >> (2 * UNIT)
    config.rate_walk[k] = multiply_q31(var, config.attitude_var) << (31 - FACTOR_Q)
    config.walk[k] = config.rate_walk[k] >> (2 * UNIT)


@kernel
def set_bias_var(config: Any, k: int, var: int) -> None:
    """Set the variance of the part of bias ``k`` that wanders, and what of the integers is made of it."""
    config.changes += 1
    config.bias_var[k] = min(var, CEILING)
    config.bias_drive[k] = multiply_q31(config.bias_var[k], config.bias_factor_var) << (31 - FACTOR_Q)
    config.bias_area[k] = config.rate_noise[k] + (multiply_q31(config.bias_var[k], config.twice_tau[k]) << (31 - TAU_Q))


def _widen(config: Any, k: int, moved: int) -> None:
    set_bias_var(config, k, max(config.bias_var[k], angular_square(moved)))


@by_record(_widen)
def widen_bias(config: Any, k: int, moved: float) -> None:
    """Bias ``k`` may wander by as much as it ``moved`` (rad/s)."""
    config.bias_std[k] = max(config.bias_std[k], moved)


def _calm(config: Any, k: int, plain: int) -> None:
    set_bias_var(config, k, max(angular_square(plain), config.bias_var[k] >> 2))


@by_record(_calm)
def calm_bias(config: Any, k: int, plain: float) -> None:
    """Bias ``k`` wanders half as much, but not less than ``plain`` (rad/s)."""
    config.bias_std[k] = max(plain, 0.5 * config.bias_std[k])


@kernel
def over_weight(var: int, weight: int) -> int:
    """A variance by the weight (Q24) of the IMUs in use."""
    return quotient_q30(var >> 6, weight)


def _set_noise(config: Any, settings: Any, weight: int) -> None:
    config.force_var = over_weight(square_force(settings.plain_force_std), weight)
    for k in range(3):
        plain = int(angular_square(settings.plain_gyro_noise[k]))
        set_gyro_noise(config, k, over_weight(plain, weight))
        set_bias_var(config, k, over_weight(int(angular_square(settings.plain_bias_std[k])), weight))


@by_record(_set_noise)
def set_noise(config: Any, settings: Any, weight: float) -> None:
    """The noise of IMUs of so much ``weight`` together, that of the configuration being 1."""
    factor = 1.0 / math.sqrt(weight)
    config.force_std = settings.plain_force_std * factor
    for k in range(3):
        config.gyro_noise[k] = settings.plain_gyro_noise[k] * factor
        config.bias_std[k] = settings.plain_bias_std[k] * factor


def _set_stamp(config: Any, std: int, walk: int, hops: int) -> None:
    config.changes += 1
    config.stamp_std = std
    config.stamp_var = stamp_square(std)
    config.stamp_walk_var = angular_square(walk) * hops


@by_record(_set_stamp)
def set_stamp(config: Any, std: float, walk: float, hops: int) -> None:
    """The time stamp is off by ``std`` (s) and wanders by that of so many joints' clocks (``walk``, s/sqrt(s))."""
    config.stamp_std = std
    config.stamp_walk = walk * math.sqrt(hops)
