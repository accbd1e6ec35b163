"""The drive's torque at the encoder node: when the string is held, when it is free, what may be left in it."""

import math
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.errors import NodeConfigurationError
from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.firmware.torque import TorqueSettings, drive_record
from node.kernels.string.drive_torque import follow_torque
from node.kernels.string.encoder_step import new_encoder
from node.process.encoder_process import sample_of


class Torque(NamedTuple):
    size: float
    holding: bool


class Watch:
    def __init__(self, settings: TorqueSettings) -> None:
        self.encoders, self.drives = new_encoder(0, settings.drilling), drive_record(settings)

    def on_cycle(self, measured: float | None, *, turning: bool) -> Torque:
        reading, has_sensor = math.nan if measured is None else measured, measured is not None
        follow_torque(self.encoders[0], self.drives[0], reading, has_sensor, turning)
        return Torque(float(self.encoders["torque"][0]), bool(self.encoders["gripped"][0]))


def watch(**settings: float) -> Watch:
    return Watch(TorqueSettings(**settings))


def test_a_string_is_free_after_four_cycles_within_the_dead_band() -> None:
    it = watch()
    for torque in (300.0, 500.0, 200.0, 5.0):
        assert it.on_cycle(torque, turning=False) == Torque(max(torque, 0.01 * 500.0 if torque < 300 else 0.0), True)
    assert [it.on_cycle(0.5, turning=False).holding for _ in range(5)] == [True, True, True, False, False]
    assert it.on_cycle(0.0, turning=False) == Torque(5.0, holding=False)


def test_torque_that_comes_back_begins_the_wait_anew() -> None:
    it = watch()
    readings = [100.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0]
    assert [it.on_cycle(torque, turning=False).holding for torque in readings] == [True] * 8 + [False]


def test_a_grip_to_make_up_a_joint_does_not_free_what_drilling_trapped() -> None:
    it = watch()
    for torque in (500.0, *[0.0] * 4, 40.0, *[0.0] * 4):
        said = it.on_cycle(torque, turning=False)
    assert said == Torque(5.0, holding=False)
    for torque in (300.0, *[0.0] * 4):
        said = it.on_cycle(torque, turning=True)
    assert said == Torque(3.0, holding=False)


def test_a_drive_without_a_sensor_is_under_its_setting_while_it_turns() -> None:
    it = watch(drilling=400.0, trapped_fraction=0.02)
    assert it.on_cycle(None, turning=False) == Torque(8.0, holding=False)  # it may have been drilling before the start
    assert it.on_cycle(None, turning=True) == Torque(400.0, holding=True)
    assert [it.on_cycle(None, turning=False).holding for _ in range(4)] == [True, True, True, False]


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=40))
def test_whatever_a_sensor_says_the_torque_is_a_number_in_range(readings: list[float]) -> None:
    it = watch()
    for reading in readings:
        said = it.on_cycle(reading, turning=False)
        assert 0.0 <= said.size <= 1e6


def test_a_rigid_string_has_no_torque() -> None:
    it = watch()
    assert {it.on_cycle(None, turning=turning) for turning in (True, False, True)} == {Torque(0.0, holding=False)}


def test_grip_and_release_at_rest_are_new_measurements() -> None:
    encoder = EncoderNode()
    said = [encoder.on_cycle(EncoderSample(7, 1000.0, True, torque), 1001.0 + k) for k, torque in
            enumerate([0.0, 0.0, 500.0, 500.0, *[0.0] * 6])]  # fmt: skip
    numbers = [aiding.sequence for aiding in said]
    assert numbers[0] == numbers[1] < numbers[2] == numbers[6] < numbers[7] == numbers[9]
    assert [aiding.under_torque for aiding in said] == [False] * 2 + [True] * 5 + [False] * 3
    assert (said[2].torque, said[9].torque, said[9].torsion_var) == (500.0, 5.0, 0.0)
    assert len({aiding.yaw for aiding in said}) == 1


def test_a_sample_may_bring_the_torque() -> None:
    assert sample_of([0.0, 5, 1.0, 1]) == EncoderSample(5, 1.0, True)
    assert sample_of([0.0, 5, 1.0, 1, -80]) == EncoderSample(5, 1.0, True, -80.0)
    assert sample_of([0.0, 5, 1.0, 1, "much"]) is None
    assert sample_of([0.0, 5, 1.0, 1, 80, 3]) is None


def test_a_sample_may_bring_the_edges_before_the_last() -> None:
    assert sample_of([0.0, 5, 1.0, 1, None, [0.9, 0.7]]) == EncoderSample(5, 1.0, True, earlier=(0.9, 0.7))
    assert sample_of([0.0, 5, 1.0, 1, 80, [0.9, "x"]]) is None
    assert sample_of([0.0, 5, 1.0, 1, 80, [0.9], 3]) is None


@pytest.mark.parametrize(
    ("name", "value"),
    [("drilling", -1.0), ("drilling", math.nan), ("dead_band", math.inf), ("trapped_fraction", 1.1),
     ("trapped_fraction", math.nan), ("release_cycles", 0)],
)  # fmt: skip
def test_settings_of_the_torque_that_cannot_be_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(NodeConfigurationError, match=f"torque.{name}"):
        TorqueSettings(**{name: value})  # type: ignore[arg-type]
