"""Saved state over power cuts: a ring of slots, checksums, and what a node knows when it wakes."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.errors import SavedStateError
from node.firmware.saved_layouts import dtype_description
from node.firmware.saved_state import layout_name, pack_state_slot, resume_node, unpack_state_slot
from node.kernels.arithmetic.formats import DEG
from node.kernels.record.filter_record import Err, default_config
from node.kernels.record.node_record import KEPT_SIZE, new_node
from node.process.counter import BootCounter
from node.process.journal import Journal


def state(yaw: int) -> np.ndarray:
    made = new_node(default_config())
    made["filter"]["now_yaw"] = yaw
    made["filter"]["static_bias"] = [1e-4, 2e-4, 3e-4]
    return made


@given(st.binary(max_size=300), st.integers(0, 2**60))
def test_a_slot_gives_back_what_was_packed(blob: bytes, generation: int) -> None:
    got = unpack_state_slot(pack_state_slot(state(7), blob, generation))
    assert got.nodes.tobytes()[:KEPT_SIZE] == state(7).tobytes()[:KEPT_SIZE]
    resume_node(got.nodes, default_config())
    wanted = state(7)
    resume_node(wanted, default_config())
    assert got.nodes.tobytes() == wanted.tobytes(), "what is not saved a start makes anew"
    assert (got.blob, got.generation) == (blob, generation)


@given(st.binary(max_size=300))
def test_what_a_longer_save_left_behind_a_slot_is_not_looked_at(rest: bytes) -> None:
    got = unpack_state_slot(pack_state_slot(state(7), b"blob", 3) + rest)
    assert (got.nodes.tobytes()[:KEPT_SIZE], got.blob) == (state(7).tobytes()[:KEPT_SIZE], b"blob")


def test_a_slot_says_when_it_was_saved() -> None:
    made = state(7)
    made["filter"]["now"] = 1234.5
    assert unpack_state_slot(pack_state_slot(made, b"", 1)).saved_at == 1234.5


def test_every_layout_of_the_record_has_its_version() -> None:
    assert layout_name() == "16-3ece823e", (
        "the fields of the node's record are others than before: count NODE_LAYOUT up and put the new name here"
    )


@pytest.mark.parametrize(
    "other",
    [
        [("a", "f8"), ("c", "i8")],
        [("b", "i8"), ("a", "f8")],
        [("a", "f8"), ("b", "u8")],
        [("a", "f8", (1,)), ("b", "i8")],
        [("a", "f8"), ("b", [("x", "i8")])],
    ],
)
def test_a_description_tells_layouts_of_one_size_apart(other: list[tuple[str, str]]) -> None:
    one = np.dtype([("a", "f8"), ("b", "i8")], align=True)
    assert np.dtype(other).itemsize == one.itemsize
    assert dtype_description(one) == "{a@0:<f8,b@8:<i8}16"
    assert dtype_description(np.dtype(other)) != dtype_description(one)


@given(st.data())
def test_any_damage_to_a_slot_is_seen(data: st.DataObject) -> None:
    slot = bytearray(pack_state_slot(state(7), b"blob", 3))
    at = data.draw(st.integers(0, len(slot) - 1))
    slot[at] ^= data.draw(st.integers(1, 255))
    with pytest.raises(SavedStateError):
        unpack_state_slot(bytes(slot))


@given(st.data())
def test_any_torn_slot_is_seen(data: st.DataObject) -> None:
    slot = pack_state_slot(state(7), b"blob", 3)
    with pytest.raises(SavedStateError):
        unpack_state_slot(slot[: data.draw(st.integers(0, len(slot) - 1))])


def test_the_newest_good_slot_wins_wherever_the_writing_was_cut(tmp_path: Path) -> None:
    journal = Journal(tmp_path, 2)
    assert journal.load() is None
    journal.save(state(1), b"one")
    journal.save(state(2), b"two")
    slots = [(tmp_path / f"slot-{k}").read_bytes() for k in (0, 1)]
    third = pack_state_slot(state(3), b"three", 3)
    for cut in range(0, len(third), 97):
        (tmp_path / "slot-0").write_bytes(third[:cut])  # the third save goes over the first
        found = Journal(tmp_path, 2).load()
        assert found is not None
        assert found[1] == b"two"
    (tmp_path / "slot-0").write_bytes(third)
    found = Journal(tmp_path, 2).load()
    assert found is not None
    assert (int(found[0][0]["filter"]["now_yaw"]), found[1]) == (3, b"three")
    assert slots[1] == (tmp_path / "slot-1").read_bytes()


def test_damaged_slots_are_an_error_that_names_them(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.save(state(1), b"")
    journal.save(state(2), b"")
    for k in (0, 1):
        (tmp_path / f"slot-{k}").write_bytes(b"damaged")
    with pytest.raises(SavedStateError, match="slot-0, slot-1"):
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


def test_a_node_that_turned_keeps_its_constants_and_doubts_its_attitude() -> None:
    saved = state(12345)
    saved[0]["filter"]["P"][Err.YAW, Err.YAW] = (0.01 * DEG) ** 2
    saved[0]["filter"]["still_cycles"] = 0
    resume_node(saved, default_config())
    assert int(saved[0]["filter"]["yaw"]) == 12345
    assert saved[0]["filter"]["P"][Err.YAW, Err.YAW] == pytest.approx(math.pi**2 / 3.0, rel=1e-3)
    assert np.diagonal(saved[0]["filter"]["P"])[[Err.TILT_X, Err.TILT_Y]].tolist() == [1.0, 1.0]
    np.testing.assert_array_equal(saved[0]["filter"]["static_bias"], [1e-4, 2e-4, 3e-4])


def test_a_node_that_stood_still_keeps_its_yaw_and_its_trust() -> None:
    saved = state(12345)
    saved[0]["filter"]["P"][Err.YAW, Err.YAW] = (0.01 * DEG) ** 2
    saved[0]["filter"]["still_cycles"] = 40
    resume_node(saved, default_config())
    assert saved[0]["filter"]["P"][Err.YAW, Err.YAW] == (0.01 * DEG) ** 2


def test_boots_are_counted_on_the_disk(tmp_path: Path) -> None:
    assert [BootCounter(tmp_path).boots for _ in range(3)] == [1, 2, 3]
