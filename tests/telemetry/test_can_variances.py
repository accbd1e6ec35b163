"""Variances on CAN: what rounding adds is in them, by its closed form, and none that is not zero arrives as zero.

A figure is read off what arrives by both ways of packing, compiled and signal by signal: they share their formulas, so
the one is no judge of the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from telemetry.frozen import replace
from telemetry.messages import Aiding, NodeMode, NodeState, TimeReply
from telemetry.presentation.can_messages import NATIVE, NativeMessage
from telemetry.presentation.msgpack_codec import encode_message, open_payload, values_of_opened

HALF_STEP_DB = 0.2501  # a variance is in steps of 0.5 dB
AIDING = Aiding(1.0, 2e-6, 3e-7, -0.3, 0.0, 1234.5, 7 << 32 | 5, 3, 480.0, 1e-5, True)
STATE = NodeState(
    3, 1000.0, 2, NodeMode.TRACKING, 0.0, 1e-6, 1e-6, (0.01, 0.0, -0.01), 1e-3, 0.0, 1e-5, 2.0, 1e-8, 0, 5, 0
)  # type: ignore[arg-type]


def compiled(native: NativeMessage, values: list[Any], fd: bool) -> Any:
    data = native.packers[fd](values, 17)
    assert data is not None
    found = native.unpackers[fd](data)
    assert found is not None
    return native.message(*found)


def signal_by_signal(native: NativeMessage, values: list[Any], fd: bool) -> Any:
    form = native.form(fd=fd)
    return native.message(*native.values_of(form.unpack(form.pack(native.raws_of_values(values), 17))))


WAYS = [(way, fd) for way in (compiled, signal_by_signal) for fd in (False, True)]
Way = Callable[[NativeMessage, list[Any], bool], Any]


def arrived(message: Any, way: Way, fd: bool) -> Any:
    """A message as the other end reads it."""
    native = next(native for native in NATIVE.values() if native.message is type(message))
    return way(native, list(values_of_opened(open_payload(encode_message(message)))), fd)


def apart_db(var: float, other: float) -> float:
    return abs(10.0 * math.log10(var / other))


@pytest.mark.parametrize(("way", "fd"), WAYS)
@given(own=st.sampled_from([0.0, 2e-8, 1e-6]), rate=st.floats(20.0, 99.0), part=st.floats(0.1, 0.9))
@example(own=0.0, rate=50.0, part=0.5)
def test_a_time_that_was_rounded_leaves_what_turns_in_its_step_in_the_variance(
    way: Way, fd: bool, own: float, rate: float, part: float
) -> None:
    """Ten microseconds at the rate of the head: a twelfth of its square, beside what the yaw had."""
    rate = round(rate, 5)
    for sign in (1.0, -1.0):
        message = replace(AIDING, yaw=0.0, yaw_var=own, rate=sign * rate, valid_at=1234.5 + part * 1e-5)
        expected = own + (rate * 1e-5) ** 2 / 12.0
        assert apart_db(arrived(message, way, fd).yaw_var, expected) <= HALF_STEP_DB


@pytest.mark.parametrize(("way", "fd"), WAYS)
@given(own=st.sampled_from([0.0, 5e-12, 1e-9]), part=st.floats(0.1, 0.9))
def test_rig_time_that_was_rounded_leaves_its_step_in_the_variance_of_the_clock(
    way: Way, fd: bool, own: float, part: float
) -> None:
    message = TimeReply(1.0, 2.0, 3.0, 4.0 + part * 1e-5, 1.0, own, 1)
    expected = own + 1e-10 / 12.0
    assert apart_db(arrived(message, way, fd).clock_var, expected) <= HALF_STEP_DB


@pytest.mark.parametrize(("way", "fd"), WAYS)
@pytest.mark.parametrize("var", [5e-324, 1e-30, 1e-13])
@pytest.mark.parametrize(
    "name", ["yaw_var", "systematic_var", "torsion_var", "innovation_var", "clock_var", "aiding's systematic_var"]
)
def test_no_variance_arrives_as_zero_unless_it_is(way: Way, fd: bool, var: float, name: str) -> None:
    field = name.rpartition(" ")[2]
    message: Any = AIDING if name in ("torsion_var", "aiding's systematic_var") else STATE
    message = replace(message, yaw=0.0, offset=0.0) if message is AIDING else message
    assert arrived(replace(message, **{field: var}), way, fd).__getattribute__(field) > 0.0
    if field in ("torsion_var", "systematic_var"):
        assert getattr(arrived(replace(message, **{field: 0.0}), way, fd), field) == 0.0


@pytest.mark.parametrize(("way", "fd"), WAYS)
@given(db=st.floats(-90.0, 19.0))
def test_a_variance_arrives_within_half_of_its_step(way: Way, fd: bool, db: float) -> None:
    var = 10.0 ** (db / 10.0)
    assert apart_db(arrived(replace(STATE, systematic_var=var), way, fd).systematic_var, var) <= HALF_STEP_DB


@pytest.mark.parametrize(("way", "fd"), WAYS)
def test_every_age_that_is_finite_stays_finite_up_to_the_largest_number_of_its_signal(way: Way, fd: bool) -> None:
    last = (2**24 - 2) * 0.01 - 10.0  # the signal begins at -10 s
    for age in (last - 0.01, last, last + 0.01, last + 0.02, 1e12):
        assert arrived(replace(STATE, aiding_age=age), way, fd).aiding_age == pytest.approx(min(age, last), rel=1e-12)
    assert arrived(replace(STATE, aiding_age=math.inf), way, fd).aiding_age == math.inf
