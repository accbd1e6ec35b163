"""The power goes after every single call of every store of a node: what was kept is there, or what was before it."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from strict_disk import Left, PowerCutError, StrictDisk

from node.firmware.saved_state import Saved
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.process import journal as journal_room
from node.process.block_store import BlockStore
from node.process.counter import read_count, write_count
from node.process.journal import Journal
from node.process.survey_log import PLACES, SurveyLog
from telemetry.parameters import ParameterBlock
from telemetry.runtime.disk import replace_file

FOLDER = Path("/node")
Act = Callable[[StrictDisk], None]


def cuts(begun: Callable[[], StrictDisk], act: Act) -> Iterator[tuple[StrictDisk, bool]]:
    """Each disk that a cut within ``act`` may leave, and whether the act was over."""
    whole = begun()
    before = whole.calls
    act(whole)
    for calls in range(whole.calls - before + 1):
        for left in Left:
            disk = begun()
            disk.calls_left = calls
            is_over = calls == whole.calls - before
            if is_over:
                act(disk)
            else:
                with pytest.raises(PowerCutError):
                    act(disk)
            yield disk.after_cut(left), is_over


def after(*acts: Act) -> Callable[[], StrictDisk]:
    """Make a disk on which these acts are over."""

    def begun() -> StrictDisk:
        disk = StrictDisk()
        for act in acts:
            act(disk)
        return disk

    return begun


def replaced(data: bytes) -> Act:
    return lambda disk: replace_file(disk, FOLDER / "file", data)


@pytest.mark.parametrize("before", [(), (b"old",), (b"older and longer", b"old")])
def test_a_file_is_the_old_one_or_the_new_one(before: tuple[bytes, ...]) -> None:
    old = before[-1] if before else None
    for disk, is_over in cuts(after(*map(replaced, before)), replaced(b"the new one")):
        found = disk.read(FOLDER / "file") if disk.identity(FOLDER / "file") else None
        assert found in (([] if is_over else [old]) + [b"the new one"])


def test_what_a_cut_left_beside_a_file_does_not_get_into_the_next() -> None:
    for disk, _ in cuts(after(replaced(b"old")), replaced(b"a new one that is long")):
        replace_file(disk, FOLDER / "file", b"short")
        assert disk.read(FOLDER / "file") == b"short"


@pytest.mark.parametrize("count", [1, 2, 9])
def test_no_number_of_a_start_is_given_twice(count: int) -> None:
    begun = after(*((lambda disk, n=n: write_count(disk, FOLDER, n)) for n in range(1, count)))
    for disk, is_over in cuts(begun, lambda disk: write_count(disk, FOLDER, count)):
        assert read_count(disk, FOLDER / "boots") in ({count} if is_over else {count - 1, count})


NODE = new_node(default_config())


def unpacked(data: bytes) -> Saved:
    if len(data) != 8 or data[0] != 7:
        raise journal_room.SavedStateError("torn")
    return Saved(NODE, data[1:], data[1], 0.0)


@pytest.fixture
def numbered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slots that hold no more than the number of a save, seen to be torn by their first byte and their length."""
    monkeypatch.setattr(
        journal_room, "pack_state_slot", lambda state, blob, generation: bytes([7, generation]) + blob.ljust(6, b"x")
    )
    monkeypatch.setattr(journal_room, "unpack_state_slot", unpacked)


def saved_through(disk: StrictDisk, numbers: range, restarts: bool) -> None:
    journal = Journal(FOLDER, 4, disk)
    for number in numbers:
        if restarts:
            journal = Journal(FOLDER, 4, disk)
        journal.save(NODE, b"%d" % number)


@pytest.mark.usefixtures("numbered")
@pytest.mark.parametrize("restarts", [False, True])
@pytest.mark.parametrize("saves", [1, 2, 4, 5, 9])
def test_a_saved_state_is_the_last_or_the_one_before(saves: int, restarts: bool) -> None:
    begun = after(lambda disk: saved_through(disk, range(1, saves), restarts))

    def save(disk: StrictDisk) -> None:
        journal = Journal(FOLDER, 4, disk)
        journal.load()
        journal.save(NODE, b"%d" % saves)

    old = b"%d" % (saves - 1) if saves > 1 else None
    for disk, is_over in cuts(begun, save):
        try:
            loaded = Journal(FOLDER, 4, disk).load()
        except journal_room.SavedStateError:
            loaded = None  # of the first save ever there may be a torn slot alone
        found = None if loaded is None else loaded[1].rstrip(b"x")[1:]
        assert found in (([] if is_over else [old]) + [b"%d" % saves])


@pytest.mark.usefixtures("numbered")
def test_saves_in_one_life_go_to_one_slot_after_the_other_and_spare_all_others() -> None:
    disk = StrictDisk()
    journal = Journal(FOLDER, 4, disk)
    for number in range(1, 10):
        before = {name: bytes(content.seen) for name, content in disk.seen.items()}
        journal.save(NODE, b"%d" % number)
        changed = [name for name, content in disk.seen.items() if before.get(name) != content.seen]
        assert changed == [f"slot-{(number - 1) % 4}"]


def block(version: int) -> ParameterBlock:
    return ParameterBlock(3, version)


def kept(version: int) -> Act:
    def keep(disk: StrictDisk) -> None:
        store = BlockStore(FOLDER, disk)
        store.load(lambda _: "")
        store.keep_block(block(version))

    return keep


@pytest.mark.parametrize("versions", [1, 2, 3, 4])
def test_a_block_is_the_newest_or_the_one_before_and_never_lost(versions: int) -> None:
    for disk, is_over in cuts(after(*map(kept, range(1, versions))), kept(versions)):
        store = BlockStore(FOLDER, disk)
        found = store.load(lambda _: "")
        version = 0 if found is None else found.version
        assert version in ({versions} if is_over else {versions - 1, versions})
        assert store.faults == []


def test_segments_of_an_upload_are_the_newest_or_those_before() -> None:
    def gathered(data: bytes) -> Act:
        return lambda disk: BlockStore(FOLDER, disk).keep_upload(data)

    for disk, is_over in cuts(after(gathered(b"one")), gathered(b"one, two and three")):
        found = BlockStore(FOLDER, disk).upload()
        assert found in ([b"one, two and three"] if is_over else [b"one", b"one, two and three"])


def test_a_dropped_upload_is_whole_or_gone() -> None:
    begun = after(lambda disk: BlockStore(FOLDER, disk).keep_upload(b"one"))
    for disk, _ in cuts(begun, lambda disk: BlockStore(FOLDER, disk).drop_upload()):
        assert BlockStore(FOLDER, disk).upload() in (None, b"one")


def logged(numbers: range) -> Act:
    def log(disk: StrictDisk) -> None:
        kept = SurveyLog(FOLDER, disk)
        for number in numbers:
            kept.append_payload(number, b"survey %d" % number)

    return log


@pytest.mark.parametrize("before", [0, 3, PLACES, PLACES + 2])
def test_a_survey_in_the_log_stays_there_and_its_place_is_that_of_the_oldest(before: int) -> None:
    newest = before + 1

    def one_more(disk: StrictDisk) -> None:
        SurveyLog(FOLDER, disk).append_payload(newest, b"survey %d" % newest)
        disk.force_names(FOLDER)  # its name is forced with those of the saved state

    log = logged(range(1, before + 1))

    full = StrictDisk()
    log(full)
    full.force_names(FOLDER)
    first = max(1, before - PLACES + 1)
    for disk, is_over in cuts(lambda: copy.deepcopy(full), one_more):
        found = dict(SurveyLog(FOLDER, disk).payloads(1, newest))
        others = set(range(max(first, newest - PLACES + 1), newest))
        assert others <= set(found)
        assert all(payload == b"survey %d" % number for number, payload in found.items())
        if is_over:
            assert set(found) == others | {newest}


def test_the_log_gives_exactly_the_numbers_that_are_asked_for() -> None:
    disk = StrictDisk()
    logged(range(1, PLACES + 6))(disk)
    for _ in range(2):
        log = SurveyLog(FOLDER, disk)
        assert [number for number, _ in log.payloads(7, 9)] == [7, 8, 9]
        assert [number for number, _ in log.payloads(9, 9)] == [9]
        assert [number for number, _ in log.payloads(1, 6)] == [6]
        assert log.complete_from == 6
    few = StrictDisk()
    logged(range(1, 4))(few)
    assert SurveyLog(FOLDER, few).complete_from == 0
    few.seen["surveys"].seen[20] ^= 1
    lost = SurveyLog(FOLDER, few)
    assert [number for number, _ in lost.payloads(1, 9)] == [2, 3]
    assert lost.complete_from == 2
