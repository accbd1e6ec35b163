import math

import pytest

from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.kernels.string.encoder_step import EDGE_STD, QUANTUM


def test_a_turning_head_is_known_at_its_last_edge() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.0, True), 1000.5)
    aiding = encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.0)
    assert aiding.yaw == pytest.approx(430 * QUANTUM)
    assert aiding.valid_at == 1000.9
    assert aiding.yaw_var == EDGE_STD**2
    assert aiding.rate == pytest.approx(430 * QUANTUM / 0.9)


def test_a_counter_that_times_no_edge_is_known_to_a_count() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.5, True, timed=False), 1000.5)
    aiding = encoder.on_cycle(EncoderSample(430, 1001.0, True, timed=False), 1001.0)
    assert aiding.yaw == pytest.approx(430.5 * QUANTUM)
    assert aiding.yaw_var == pytest.approx(QUANTUM**2 / 12.0)
    assert (aiding.valid_at, aiding.rate) == (1001.0, pytest.approx(860 * QUANTUM))


def test_a_falling_edge_is_the_upper_border_of_its_count() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(100, 1000.0, True), 1000.5)
    aiding = encoder.on_cycle(EncoderSample(49, 1000.9, False), 1001.0)
    assert aiding.yaw == pytest.approx(50 * QUANTUM)
    assert aiding.rate < 0.0


def test_a_rest_is_one_measurement_however_often_it_is_said() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.0, True), 1000.5)
    turning = encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.0)
    rests = [encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.5 + k) for k in range(5)]
    assert {r.sequence for r in rests} == {turning.sequence + 1}
    assert rests[-1].valid_at == 1005.5
    assert rests[0].yaw == pytest.approx(430.5 * QUANTUM)
    assert rests[0].yaw_var == pytest.approx(QUANTUM**2 / 12.0)
    assert math.degrees(math.sqrt(rests[0].yaw_var)) == pytest.approx(0.0254, abs=1e-4)
    again = encoder.on_cycle(EncoderSample(440, 1006.0, True), 1006.5)
    assert again.sequence == turning.sequence + 2


def test_a_count_that_changes_without_an_edge_is_a_new_measurement_of_the_rest() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.0, True), 1000.5)
    encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.0)
    rest = encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.5)
    miscounted = [encoder.on_cycle(EncoderSample(487, 1000.9, True), 1002.0 + k) for k in range(3)]
    assert [m.sequence - rest.sequence for m in miscounted] == [0, 1, 1]  # once two readings in a row say so
    assert [m.yaw - rest.yaw for m in miscounted] == pytest.approx([0.0, 57 * QUANTUM, 57 * QUANTUM])


def test_a_reading_that_is_off_alone_leaves_a_rest_the_measurement_it_is() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.0, True), 1000.5)
    encoder.on_cycle(EncoderSample(430, 1000.9, True), 1001.0)
    counts = [430, 487, 430, 401, 433, 430, 401, 430]  # wrong in another way each time, or not in a row
    rests = [encoder.on_cycle(EncoderSample(c, 1000.9, True), 1001.5 + k) for k, c in enumerate(counts)]
    assert len({(r.sequence, r.yaw, r.yaw_var) for r in rests}) == 1
    turning = encoder.on_cycle(EncoderSample(440, 1010.0, True), 1010.5)
    assert turning.rate == pytest.approx(10 * QUANTUM / 9.1)


def test_numbers_of_a_later_life_are_larger() -> None:
    assert EncoderNode(2 << 32).on_cycle(EncoderSample(0, 1.0, True), 2.0).sequence > 1 << 33


def test_two_edges_in_one_instant_are_no_infinite_rate() -> None:
    encoder = EncoderNode()
    encoder.on_cycle(EncoderSample(0, 1000.0, True), 1000.5)
    assert encoder.on_cycle(EncoderSample(1, 1000.0 + 1e-9, True), 1001.0).rate == 100.0
