"""Quantities in two forms: every operation in integers is that of the floats over its whole range; none overflows."""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic import circular as c
from node.kernels.arithmetic import operations as n
from node.kernels.arithmetic.angles import wrap_angle, wrap_positive
from node.kernels.arithmetic.formats import (
    ANGLE_Q,
    FORCE_PART,
    FORCE_Q,
    MEAN_Q,
    NEVER,
    PRODUCT_Q,
    RATE_PART,
    RATE_Q,
    SQUARE_Q,
    STIFFNESS_Q,
    TIME_Q,
    TORQUE_Q,
    TURNS_Q,
    VAR_Q,
    VECTOR_Q,
    WEIGHT_Q,
)
from node.kernels.arithmetic.quantity import (
    LONG_AGO,
    NO_NUMBER,
    NONE,
    ONE,
    Constant,
    angle_quantity,
    factor_quantity,
    force_quantity,
    rate_quantity,
    rate_variance_quantity,
    temperature_quantity,
    time_quantity,
    variance_quantity,
)
from node.kernels.record.events import TOLD_Q, event_degrees
from node.kernels.sensors.aligner import centripetal_force, tilt_of, turning_time_limit
from node.kernels.sensors.static_average import bounded_sum, deviation_product, force_for_mean, without_one
from node.kernels.sensors.sweep import angle_square, fine_product
from node.kernels.string.twist import twist_angle

Q = {"time": TIME_Q, "rate": RATE_Q, "angle": ANGLE_Q, "force": FORCE_Q, "var": VAR_Q, "factor": VECTOR_Q}
Q |= {"torque": TORQUE_Q, "stiffness": STIFFNESS_Q, "weight": WEIGHT_Q, "stamp": VAR_Q + 12, "told": TOLD_Q}
Q |= {"turns": TURNS_Q, "squares": SQUARE_Q, "fine": PRODUCT_Q, "mean": MEAN_Q}
Q |= {"joint": 2 * RATE_PART, "mixed": RATE_PART + FORCE_PART}


def calling(operation: Callable[..., Any], arguments: int) -> Callable[..., Any]:
    """A kernel that calls ``operation``, where numba takes it by the types of its arguments."""
    own = numba.njit(operation) if operation.__name__ == "<lambda>" else operation
    one, two, three = lambda a: own(a), lambda a, b: own(a, b), lambda a, b, c: own(a, b, c)  # noqa: PLW0108
    return numba.njit(error_model="numpy")((one, two, three)[arguments - 1])


# what is computed; of each argument what it is and from where to where; what comes out, and how far off it may be:
# relative, and in counts
CASES: dict[str, tuple[Callable[..., Any], list[tuple[str, float, float]], str, float, float]] = {
    "times": (n.times_factor, [("rate", -32, 32), ("factor", -2, 2)], "rate", 0.0, 2),
    "times a variance": (n.times_factor, [("var", 0, 12), ("factor", -2, 2)], "var", 0.0, 2),
    "over": (n.over_factor, [("rate", -32, 32), ("factor", 0.25, 2)], "rate", 2e-9, 4),
    "ratio": (n.quantity_ratio, [("var", 0, 12), ("var", 1e-8, 12)], "factor", 3e-9, 20),
    "fraction": (n.bounded_ratio, [("angle", 0, 4), ("angle", 3, 6)], "factor", 3e-9, 2),
    "share": (
        n.proportional_share,
        [("rate", -32, 32), ("time", -0.6, 0.6), ("time", 0.3, 5)],
        "rate",
        1e-8,
        2.0**25,
    ),
    "turn": (n.turned_angle, [("rate", -32, 32), ("time", -4096, 4096)], "angle", 3e-7, 64),
    "turn of a cycle": (n.turned_angle, [("rate", -32, 32), ("time", -8, 8)], "angle", 0.0, 2),
    "speed": (n.turning_rate, [("angle", -1, 1), ("time", 1e-3, 6)], "rate", 3e-9, 40000),
    "speed of a large angle": (n.turning_rate, [("angle", -4, 4), ("time", 4e-3, 6)], "rate", 3e-9, 40000),
    "square": (n.angular_square, [("angle", -4, 4)], "var", 0.0, 2.0**31),
    "product": (n.angular_product, [("angle", -4, 4), ("angle", -4, 4)], "var", 0.0, 2.0**31),
    "root": (n.angular_root, [("var", 0, 16)], "angle", 5e-9, 2),
    "time_root": (n.time_root, [("var", 0, 16)], "time", 5e-9, 2),
    "half": (n.half_of, [("angle", -100, 100)], "angle", 0.0, 1),
    "length": (
        n.vector_length,
        [("force", -32, 32), ("force", -32, 32), ("force", -32, 32)],
        "force",
        5e-9,
        20,
    ),
    "scaled": (n.indicated_rate, [("rate", -32, 32), ("rate", -0.5, 0.5)], "rate", 0.0, 600_000),
    "unscaled": (n.true_rate, [("rate", -32, 32), ("rate", -0.5, 0.5)], "rate", 5e-9, 4),
    "stamp_square": (n.stamp_square, [("time", 0, 0.05)], "stamp", 0.0, 2.0**38),
    "scale_square": (n.scale_square, [("factor", 0, 0.05)], "stamp", 0.0, 2.0**35),
    "wound": (twist_angle, [("torque", 0, 1e6), ("stiffness", 1e3, 1e9)], "angle", 3e-9, 1100),
    "cosine": (lambda a: c.spin_of(a)[0], [("angle", -130, 130)], "factor", 0.0, 60),
    "sine": (lambda a: c.spin_of(a)[1], [("angle", -130, 130)], "factor", 0.0, 60),
    "arcsine": (c.arcsine, [("factor", -0.99, 0.99)], "angle", 0.0, 10000),
    "arctangent": (c.arctangent, [("factor", -1, 1), ("factor", 0.01, 1)], "angle", 0.0, 4),
    "arctangent behind": (c.arctangent, [("factor", 0.01, 1), ("factor", -1, 1)], "angle", 0.0, 4),
    "reach": (c.planar_length, [("factor", -2, 2), ("factor", -2, 2)], "factor", 5e-9, 20),
    "angle_of_turns": (c.angle_of_turns, [("turns", 0, 128)], "angle", 1e-9, 1),
    "turns_of": (c.turns_of, [("angle", 0, 1000)], "turns", 1e-9, 1),
    "longest": (turning_time_limit, [("turns", 0, 128)], "time", 1e-6, 2),
    "inward": (centripetal_force, [("rate", -0.262, 0.262), ("factor", -2, 2)], "force", 0.0, 4),
    "tilt_of": (tilt_of, [("angle", 0, 1), ("weight", 0, 128)], "angle", 0.0, 200),
    "angle_square": (angle_square, [("angle", -127, 127)], "squares", 1e-6, 4),
    "fine_product": (fine_product, [("factor", -1, 1), ("factor", -1, 1)], "fine", 0.0, 1),
    "joint": (lambda a, b: deviation_product(a, b, 50), [("rate", -16, 16), ("rate", -16, 16)], "joint", 2e-9, 600),
    "joint of rate and force": (
        lambda a, b: deviation_product(a, b, 47),
        [("rate", -16, 16), ("mean", -16, 16)],
        "mixed",
        2e-9,
        600,
    ),
    "added": (
        bounded_sum,
        [("joint", -256, 256), ("joint", -256, 256)],
        "joint",
        0.0,
        64,
    ),  # the float has 53 bits of 59
    "fine force": (force_for_mean, [("force", -32, 32)], "mean", 0.0, 0),
    "all but one": (lambda a: without_one(a, 7000), [("mean", -64, 64)], "mean", 0.0, 1),
    "degrees": (lambda a: event_degrees(a, ANGLE_Q), [("angle", -1000, 1000)], "told", 1e-8, 1),
    "wrap": (wrap_angle, [("angle", -1000, 1000)], "angle", 0.0, 400),
    "wrap_positive": (wrap_positive, [("angle", -1000, 1000)], "angle", 0.0, 400),
    "a binary angle": (lambda a: n.offset_angle(n.kept_angle(a)), [("angle", -3.1, 3.1)], "angle", 0.0, 2000),
}
KERNELS = {name: calling(case[0], len(case[1])) for name, case in CASES.items()}


@pytest.mark.parametrize("name", CASES)
@given(data=st.data())
def test_integers_compute_what_floats_do(name: str, data: st.DataObject) -> None:
    _, arguments, kind, relative, counts = CASES[name]
    whole = [data.draw(st.integers(round(low * 2.0 ** Q[k]), round(high * 2.0 ** Q[k]))) for k, low, high in arguments]
    exact = float(KERNELS[name](*(w * 2.0 ** -Q[k] for w, (k, *_) in zip(whole, arguments, strict=True))))
    if kind == "angle" and "wrap" in name and min(abs(exact), math.pi - abs(exact), math.tau - abs(exact)) < 1e-6:
        return  # on either side of the seam
    found = KERNELS[name](*whole)
    assert isinstance(found, int)
    assert abs(found - exact * 2.0 ** Q[kind]) <= relative * abs(exact) * 2.0 ** Q[kind] + counts


@given(st.integers(1 << 42, 1 << 61))
def test_what_is_beyond_the_range_is_held(large: int) -> None:
    assert KERNELS["fine force"](large) == -KERNELS["fine force"](-large) == 32 << MEAN_Q
    assert KERNELS["square"](large) == KERNELS["square"](-large) == 16 << VAR_Q
    assert KERNELS["product"](large, -large) == -16 << VAR_Q
    assert KERNELS["speed"](1 << ANGLE_Q, 1) == -KERNELS["speed"](-1 << ANGLE_Q, 1) == 1024 << RATE_Q
    assert KERNELS["fraction"](large, 1) == -KERNELS["fraction"](-large, 1) == 2 << VECTOR_Q
    assert KERNELS["ratio"](large, 0) == -KERNELS["ratio"](-large, 0) == 1 << 61
    assert KERNELS["root"](-large) == 0


@given(st.integers(1 << 50, 1 << 61))
def test_a_sum_of_products_is_held(large: int) -> None:
    assert KERNELS["joint"](large, -large) == KERNELS["joint"](-large, 16 << RATE_Q) == -256 << 50
    assert KERNELS["added"](1 << 59, large >> 3) == -KERNELS["added"](-1 << 59, -large >> 3) == 1 << 59


@numba.njit
def meet(x: Any, found: Any) -> bool:
    """What a constant is beside ``x``, in every way the firmware uses one."""
    found[0], found[1], found[2] = ONE, x + ONE, max(x, ONE)
    found[3] = ONE if x > ONE else x
    found[4], found[5] = NONE, LONG_AGO
    return bool(n.is_number(x) and not n.is_number(found[4]))


def test_a_constant_takes_the_form_of_what_it_meets() -> None:
    floats, integers = np.zeros(6), np.zeros(6, np.int64)
    assert meet(0.5, floats)
    assert meet(1 << 29, integers)
    assert floats.tolist()[:4] == [1.0, 1.5, 1.0, 0.5]
    assert (math.isnan(floats[4]), floats[5]) == (True, -math.inf)
    assert integers.tolist() == [1 << 30, 3 << 29, 1 << 30, 1 << 29, NO_NUMBER, NEVER]


@pytest.mark.parametrize(
    ("constant", "q", "unit"),
    [
        (time_quantity(3.0), TIME_Q, 1.0),
        (rate_quantity(-0.1), RATE_Q, 1.0),
        (angle_quantity(math.pi), ANGLE_Q, 1.0),
        (force_quantity(0.3), FORCE_Q, 9.80665),
        (variance_quantity(10.0), VAR_Q, 1.0),
        (rate_variance_quantity(1e-6), VAR_Q, 2.0**-12),
        (factor_quantity(0.999), VECTOR_Q, 1.0),
        (temperature_quantity(25.0), VECTOR_Q, 128.0),
    ],
)
def test_a_constant_is_a_float_that_knows_its_integer(constant: Constant, q: int, unit: float) -> None:
    assert constant.fixed == pytest.approx(float(constant) / unit * 2.0**q, abs=0.5)
