"""Parameter blocks on disk under power cuts and a disk that refuses."""

import errno
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.process.block_store import SLOT_SIZE, BlockStore, pack_slot, unpack_slot
from telemetry.errors import DecodeError
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.runtime.disk import MachineDisk


def block(version: int) -> ParameterBlock:
    return ParameterBlock(3, version, SensorParameters(bias=(1e-3 * version, 0.0, 0.0)))


def good(_block: ParameterBlock) -> str:
    return ""


def loaded(folder: Path) -> tuple[ParameterBlock | None, list[str]]:
    store = BlockStore(folder)
    return store.load(good), store.faults


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Versions 1 and 2 were kept; 2 is in use."""
    store = BlockStore(tmp_path)
    assert store.load(good) is None
    store.keep_block(block(1))
    store.keep_block(block(2))
    return tmp_path


def test_the_newest_block_is_in_use_after_a_restart(folder: Path) -> None:
    assert loaded(folder) == (block(2), [])
    store = BlockStore(folder)
    store.load(good)
    store.keep_block(block(3))
    assert loaded(folder) == (block(3), [])


@given(st.integers(0, 2**60), st.integers(0, 2**32 - 1))
def test_a_slot_gives_back_what_was_packed(generation: int, version: int) -> None:
    assert unpack_slot(pack_slot(ParameterBlock(250, version), generation)) == (
        ParameterBlock(250, version),
        generation,
    )


@given(st.data())
def test_any_damage_to_a_slot_is_seen(data: st.DataObject) -> None:
    slot = bytearray(pack_slot(block(2), 3))
    slot[data.draw(st.integers(0, SLOT_SIZE - 1))] ^= data.draw(st.integers(1, 255))
    with pytest.raises(DecodeError):
        unpack_slot(bytes(slot))


def test_a_cut_at_any_byte_of_the_new_file_leaves_the_block_in_use(folder: Path) -> None:
    third = pack_slot(block(3), 3)
    for cut in range(len(third) + 1):
        (folder / "parameters-1.new").write_bytes(third[:cut])
        assert loaded(folder) == (block(2), [])


def test_a_slot_torn_at_any_byte_falls_back_to_the_one_before(folder: Path) -> None:
    second = pack_slot(block(2), 2)
    for cut in range(len(second)):
        (folder / "parameters-0").write_bytes(second[:cut])
        found, faults = loaded(folder)
        assert found == block(1)
        assert faults[0].startswith("parameters-0")


STEPS = ("write", "half of the write", "force", "rename", "force_names")


def break_step(monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    """Make one step of the writing fail as a full or dying disk would."""
    plain_write = MachineDisk.write

    def fail(*_: Any) -> Any:
        raise OSError(errno.ENOSPC, "No space left on device")

    def write_half(disk: MachineDisk, path: Path, data: bytes, offset: int = 0) -> None:
        plain_write(disk, path, data[: len(data) // 2], offset)
        fail()

    if step == "half of the write":
        monkeypatch.setattr(MachineDisk, "write", write_half)
    else:
        monkeypatch.setattr(MachineDisk, step, fail)


@pytest.mark.parametrize("step", STEPS)
def test_a_disk_that_refuses_any_step_leaves_the_block_in_use(
    folder: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    store = BlockStore(folder)
    assert store.load(good) == block(2)
    with monkeypatch.context() as broken:
        break_step(broken, step)
        with pytest.raises(OSError, match="No space"):
            store.keep_block(block(3))
    assert loaded(folder) == (block(2), [])
    store.keep_block(block(3))
    assert loaded(folder) == (block(3), [])


def test_a_block_that_is_unfit_falls_back_and_is_named(folder: Path) -> None:
    store = BlockStore(folder)
    found = store.load(lambda one: "condition" if one.version == 2 else "")
    assert found == block(1)
    assert store.faults == ["parameters-0: version 2: condition"]
    store.keep_block(block(3))
    assert loaded(folder) == (block(3), [])


def test_two_damaged_slots_are_named_and_no_block_is_found(folder: Path) -> None:
    for k in (0, 1):
        (folder / f"parameters-{k}").write_bytes(b"damaged")
    found, faults = loaded(folder)
    assert found is None
    assert len(faults) == 2


def test_segments_are_kept_whole_or_not_at_all(tmp_path: Path) -> None:
    store = BlockStore(tmp_path)
    assert store.upload() is None
    store.keep_upload(b"segments")
    assert BlockStore(tmp_path).upload() == b"segments"
    whole = (tmp_path / "upload").read_bytes()
    for cut in range(len(whole)):
        (tmp_path / "upload").write_bytes(whole[:cut])
        assert store.upload() is None
    store.drop_upload()
    store.drop_upload()
    assert not (tmp_path / "upload").exists()
