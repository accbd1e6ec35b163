"""Saved state over power cuts: two slots, checksums, and what a node knows when it wakes."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.errors import SavedStateError
from node.firmware.saved_state import pack, resume, unpack
from node.kernels.layout import DEG, Err, default_config
from node.kernels.record import new_node
from node.process.counter import BootCounter
from node.process.journal import Journal


def state(yaw: int) -> np.ndarray:
    made = new_node(default_config())
    made["filter"]["now_yaw"] = yaw
    made["filter"]["static_bias"] = [1e-4, 2e-4, 3e-4]
    return made


@given(st.binary(max_size=300), st.integers(0, 2**60))
def test_a_slot_gives_back_what_was_packed(blob: bytes, generation: int) -> None:
    got, got_blob, got_generation = unpack(pack(state(7), blob, generation))
    assert got.tobytes() == state(7).tobytes()
    assert (got_blob, got_generation) == (blob, generation)


@given(st.data())
def test_any_damage_to_a_slot_is_seen(data: st.DataObject) -> None:
    slot = bytearray(pack(state(7), b"blob", 3))
    at = data.draw(st.integers(0, len(slot) - 1))
    slot[at] ^= data.draw(st.integers(1, 255))
    with pytest.raises(SavedStateError):
        unpack(bytes(slot))


@given(st.data())
def test_any_torn_slot_is_seen(data: st.DataObject) -> None:
    slot = pack(state(7), b"blob", 3)
    with pytest.raises(SavedStateError):
        unpack(slot[: data.draw(st.integers(0, len(slot) - 1))])


def test_the_newest_good_slot_wins_wherever_the_writing_was_cut(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    assert journal.load() is None
    journal.save(state(1), b"one")
    journal.save(state(2), b"two")
    slots = [(tmp_path / f"slot-{k}").read_bytes() for k in (0, 1)]
    third = pack(state(3), b"three", 3)
    for cut in range(0, len(third), 97):
        (tmp_path / "slot-1").write_bytes(third[:cut])  # the third save goes over the first
        found = Journal(tmp_path).load()
        assert found is not None
        assert found[1] == b"two"
    (tmp_path / "slot-1").write_bytes(third)
    found = Journal(tmp_path).load()
    assert found is not None
    assert (int(found[0][0]["filter"]["now_yaw"]), found[1]) == (3, b"three")
    assert slots[0] == (tmp_path / "slot-0").read_bytes()


def test_two_damaged_slots_are_an_error_that_names_them(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.save(state(1), b"")
    journal.save(state(2), b"")
    for k in (0, 1):
        (tmp_path / f"slot-{k}").write_bytes(b"damaged")
    with pytest.raises(SavedStateError, match="slot-0"):
        Journal(tmp_path).load()


def test_saving_goes_on_where_an_earlier_life_ended(tmp_path: Path) -> None:
    first = Journal(tmp_path)
    for k in range(3):
        first.save(state(k), b"first")
    again = Journal(tmp_path)
    again.load()
    again.save(state(9), b"second")
    found = Journal(tmp_path).load()
    assert found is not None
    assert found[1] == b"second"


def test_a_node_that_turned_keeps_its_constants_and_doubts_its_yaw() -> None:
    saved = state(12345)
    saved[0]["filter"]["P"][Err.YAW, Err.YAW] = (0.01 * DEG) ** 2
    saved[0]["filter"]["still_cycles"] = 0
    resume(saved)
    assert int(saved[0]["filter"]["yaw"]) == 12345
    assert saved[0]["filter"]["P"][Err.YAW, Err.YAW] == pytest.approx(math.pi**2 / 3.0, rel=1e-3)
    np.testing.assert_array_equal(saved[0]["filter"]["static_bias"], [1e-4, 2e-4, 3e-4])


def test_a_node_that_stood_still_keeps_its_yaw_and_its_trust() -> None:
    saved = state(12345)
    saved[0]["filter"]["P"][Err.YAW, Err.YAW] = (0.01 * DEG) ** 2
    saved[0]["filter"]["still_cycles"] = 40
    resume(saved)
    assert saved[0]["filter"]["P"][Err.YAW, Err.YAW] == (0.01 * DEG) ** 2


def test_boots_are_counted_on_the_disk(tmp_path: Path) -> None:
    assert [BootCounter(tmp_path).boots for _ in range(3)] == [1, 2, 3]
