"""Named bounds at exactly their value and on either side of it, and closed forms with numbers of their own."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from test_clock_variance import ABOVE, JITTER, OFFSET, RATE, WAY, exchange, synchronised
from test_which_key import joined, joint

from telemetry.application.can_load import (
    HEADER,
    bus_load,
    header_load,
    message_bus_time,
    presence_rate,
    steady_traffic,
)
from telemetry.application.outbox import Outbox
from telemetry.errors import BorechainError
from telemetry.media.can_exchange import BUDGET_BURST, BUDGETS, Budget
from telemetry.media.can_timing import FD_LENGTHS, BitRates, classic_bits, fd_bits
from telemetry.media.isotp import frame_lengths
from telemetry.media.port import Priority
from telemetry.presentation.can_native import HEADER_EVERY
from telemetry.quantities import MAX_LIST, Quantity, ValueKind, check_numbers
from telemetry.records.record_stamps import times_of_stamps
from telemetry.runtime.own_clock import Schedule
from telemetry.transport.hop import pack_frame
from telemetry.transport.joint_seal import HEAD as SEALED_HEAD
from telemetry.transport.joint_seal import LAST_NUMBER

LARGEST = 2**32 - 1  # that four bytes hold


@pytest.mark.parametrize(("sigmas", "is_believed"), [(3.0, True), (5.9, True), (6.1, False), (12.0, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_exchange_is_believed_up_to_six_sigmas(sigmas: float, is_believed: bool, sign: float) -> None:
    clock, asked = synchronised(), 120.0
    spread = math.sqrt(clock.variance(asked + WAY) - ABOVE + JITTER**2)
    before = clock.rig_from_local(asked)
    exchange(clock, asked, off=clock.rig_from_local(asked) - rig_of(asked) + sign * sigmas * spread)
    assert (abs(clock.rig_from_local(asked) - before) > 1e-7) == is_believed


def rig_of(local: float) -> float:
    """Rig time as the neighbour of ``test_clock_variance`` tells it at a time of ours."""
    return 5000.0 + (1.0 + 3e-6) * (OFFSET + RATE * local - 400.0)


def stuffed_worst(bits: int) -> int:
    """Stuff bits of so many bits at worst: one after the first five, then one after each four more."""
    count, run = 0, 0
    for _ in range(bits):
        run += 1
        if run == 5:
            count, run = count + 1, 1  # the stuff bit is the first of the next five
    return count


@pytest.mark.parametrize("length", range(9))
def test_a_classic_frame_is_as_long_as_its_bits_one_by_one(length: int) -> None:
    # ISO 11898-1, extended: SOF 1, base 11, SRR 1, IDE 1, extension 18, RTR 1, r1 r0 2, DLC 4; data; CRC 15
    stuffed = 1 + 11 + 1 + 1 + 18 + 1 + 2 + 4 + 8 * length + 15
    rest = 1 + 1 + 1 + 7 + 3  # CRC and ACK delimiters and slot, end of frame, intermission
    assert classic_bits(length) == stuffed + stuffed_worst(stuffed) + rest
    assert BitRates(125e3).duration(length, fd=False) == pytest.approx(classic_bits(length) / 125e3, rel=1e-12)


@pytest.mark.parametrize("length", FD_LENGTHS)
def test_an_fd_frame_has_the_checksum_of_its_length(length: int) -> None:
    """17 bits up to 16 bytes of data and 21 beyond; each has a fixed stuff bit before its first and each four bits."""
    _, data = fd_bits(length)
    crc = {True: 17, False: 21}[length in (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16)]
    stuff_count = 4
    fixed = 1 + (stuff_count + crc) // 4
    plain = 1 + 4 + 8 * length  # ESI, DLC, data
    assert data == plain + plain // 4 + stuff_count + crc + fixed


@pytest.mark.parametrize("priority", list(Priority))
@pytest.mark.parametrize("idle", [2.0, 3.0, 1e6])
def test_a_budget_saves_no_more_than_its_burst_however_long_it_is_not_used(priority: Priority, idle: float) -> None:
    budget, most = Budget(), int(BUDGET_BURST * BUDGETS[priority])
    for now in (0.0, idle, 2.0 * idle):
        assert [budget.allows(priority, now) for _ in range(most + 1)] == [True] * most + [False]


@given(number=st.integers(1, 50), share=st.floats(0.0, 0.999))
@example(number=1, share=0.0)
@example(number=7, share=0.0)
def test_a_deadline_is_later_than_what_has_ended_also_where_that_ended_on_one(number: int, share: float) -> None:
    schedule = Schedule(100.0, 0.5)
    missed = schedule.finish(100.0 + 0.5 * (number + share))
    assert schedule.due == 100.0 + 0.5 * (number + 1)
    assert missed == number - 1


def test_a_joint_begins_another_session_when_its_numbers_are_used_up() -> None:
    """The number of a frame has four bytes; the frame after the last of them is as good as any."""
    upper, lower = joint(2, 1), joint(1, 1)
    joined(upper, lower)
    upper._number = LARGEST - 1
    assert LAST_NUMBER == LARGEST
    told = []
    for _ in range(3):
        frame = upper.close(b"beat")
        assert frame is not None
        *_, session, _, number = SEALED_HEAD.unpack_from(frame)
        told.append((number, session))
    assert [number for number, _ in told] == [LARGEST, 1, 2]
    assert told[0][1] != told[1][1] == told[2][1]


@pytest.mark.parametrize(
    ("count", "is_taken"), [(0, True), (MAX_LIST - 1, True), (MAX_LIST, True), (MAX_LIST + 1, False)]
)
def test_a_list_may_be_exactly_as_long_as_it_says(count: int, is_taken: bool) -> None:
    quantity = Quantity("values", ValueKind.NUMBERS, "numbers")
    if is_taken:
        assert check_numbers(quantity, [1.0] * count) == (1.0,) * count
    else:
        with pytest.raises((ValueError, BorechainError), match="at most"):
            check_numbers(quantity, [1.0] * count)


def test_what_is_not_receipted_is_sent_after_ten_seconds_and_then_twice_as_late_up_to_a_minute() -> None:
    outbox = Outbox()
    outbox.keep_payload(1, b"survey", 0.0)
    sent, now = [], 0.0
    while len(sent) < 7:
        if list(outbox.due_payloads(now)):
            sent.append(now)
        now = outbox.next_due()
    assert [later - before for before, later in itertools.pairwise(sent)] == [10.0, 20.0, 40.0, 60.0, 60.0, 60.0]


@pytest.mark.parametrize("profile", ["native", "tunnel"])
@pytest.mark.parametrize("fd", [False, True])
def test_the_headers_of_both_ends_are_part_of_the_load(profile: str, fd: bool) -> None:
    """Each end of the native profile says its header again and again; the tunnel has it in every frame."""
    rates = BitRates(125e3, 500e3)
    lengths = frame_lengths(len(pack_frame(HEADER, [])), 64 if fd else 8)
    once = sum(rates.duration(length, fd=fd) for length in lengths)
    expected = 0.0 if profile == "tunnel" else once / HEADER_EVERY + once / HEADER_EVERY
    assert header_load(profile, rates, fd=fd) == pytest.approx(expected, rel=1e-12)
    assert header_load(profile, rates, fd=fd, sealed=True) == 0.0
    steady = steady_traffic(24)
    besides = sum(t.rate * message_bus_time(t.message, profile, rates, fd=fd) for t in steady)
    signs = presence_rate(steady, profile) * rates.duration(8, fd=fd)
    assert bus_load(steady, profile, rates, fd=fd) == pytest.approx(besides + expected + signs, rel=1e-12)


@pytest.mark.parametrize("bits", [16, 24, 32])
@pytest.mark.parametrize("begin", [0, 5, 47])
def test_a_counter_that_begins_anew_goes_on_where_it_was_row_by_row(bits: int, begin: int) -> None:
    """Steps that differ, so that no row can be put between its neighbours unseen."""
    tick, turn = 1e-6, 2**bits
    steps = np.array([20_000 + 37 * (k % 7) for k in range(99)])
    true = np.concatenate([[turn - 20_300 * 50 + begin], steps]).cumsum()
    true = true if true[0] >= 0 else true + 100 * turn
    found = times_of_stamps((true % turn) * tick, tick, True, np.zeros(100, bool))
    assert found.wraps == len({int(t) // turn for t in true}) - 1
    assert (found.strays, found.jumps, found.gaps, found.repeats) == ((), (), (), 0)
    np.testing.assert_allclose(found.times - found.times[0], (true - true[0]) * tick, atol=1e-9)
