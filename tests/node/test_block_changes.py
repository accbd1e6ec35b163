"""From block to block: each upload beside the one before and after, and the power gone at every call of a change."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from strict_disk import Left, PowerCutError, StrictDisk

from node.firmware.block_trial import DIFFER_CYCLES, STILL_CYCLES, Trial, TrialVerdict
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.sensor_record import new_mount
from node.process.block_store import BlockStore
from node.process.block_updater import BlockUpdater
from node.process.tube_process import TubeProcess
from telemetry.frozen import replace
from telemetry.messages import BlockSegment, BlockStatus, Scalar, Severity, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.transport.authentication import sealed_segment
from telemetry.transport.upload import split_block

FOLDER = Path("/node")
KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
BIAS = 1e-3  # rad/s, of the gyroscope


def block(version: int, bias: float = BIAS) -> ParameterBlock:
    return ParameterBlock(3, version, SensorParameters(bias=(0.0, 0.0, bias)))


def segments(version: int, sequence: int, bias: float = BIAS, key: bytes = KEY) -> tuple[BlockSegment, ...]:
    return split_block(block(version, bias).canonical(), 3, sequence, version, key)


class Node:
    """A node at rest on a disk, and what it answers."""

    def __init__(self, disk: StrictDisk | None = None, now: float = 1000.0) -> None:
        self.disk = StrictDisk() if disk is None else disk
        self.process = TubeProcess(TubeSettings(3), FOLDER, key=KEY, disk=self.disk)
        self.now = now

    def rest(self, cycles: int) -> None:
        for k in range(cycles):
            self.now += PERIOD
            noise = 1e-6 * (1 + (k * 7) % 11)
            self.process.on_cycle(
                [self.now - PERIOD, noise, -noise, BIAS + noise, noise, 0.3 + noise, -9.8 - noise], self.now
            )
            self.process.take_frames(self.now)

    def take(self, *parts: BlockSegment) -> BlockStatus:
        for part in parts:
            status = self.process._blocks.on_segment(part, self.now)
        return status

    @property
    def version(self) -> int:
        return self.process.tube.parameters.version


@pytest.fixture(scope="module")
def rested() -> Callable[[], Node]:
    """A node that knows its bias, made once and copied by its disk."""
    node = Node()
    node.rest(130)
    node.process.close()

    def copied() -> Node:
        again = Node(node.disk.after_cut(Left.ALL), node.now)
        again.rest(8)
        return again

    return copied


@pytest.mark.parametrize("rounds", [1, 2])
def test_an_older_upload_does_not_take_the_place_of_a_newer_one(rested: Callable[[], Node], rounds: int) -> None:
    node = rested()
    newer, older = segments(9, 2), segments(8, 1, 2e-3)
    for _ in range(rounds):
        assert node.take(newer[0]).phase is UploadPhase.PARTIAL
        refused = node.take(older[0])
        assert (refused.phase, refused.received) == (UploadPhase.REFUSED, 0)
        assert "9 is being uploaded, got 8" in refused.detail
    assert node.take(*newer[1:]).phase is UploadPhase.WAITING
    assert node.take(*older).phase is UploadPhase.REFUSED
    node.rest(STILL_CYCLES + 1)
    assert node.version == 9


@pytest.mark.parametrize(("version", "is_taken"), [(4, False), (5, False), (6, True)])
def test_a_block_must_be_newer_than_the_one_in_use(rested: Callable[[], Node], version: int, is_taken: bool) -> None:
    node = rested()
    node.take(*segments(5, 1))
    node.rest(STILL_CYCLES + 1)
    assert node.version == 5
    first, *rest = segments(version, 2, 1.1e-3)
    assert (node.take(first).phase is not UploadPhase.REFUSED) == is_taken
    assert (node.take(*rest).phase is not UploadPhase.REFUSED) == is_taken


def test_a_newer_upload_ends_the_trial_of_the_one_before(rested: Callable[[], Node]) -> None:
    node = rested()
    for version in (5, 7):
        assert node.take(*segments(version, version)).phase is UploadPhase.WAITING
        assert node.process._blocks.trying
        node.take(segments(version + 1, version + 1, 2e-3)[0])
        assert not node.process._blocks.trying
        node.rest(STILL_CYCLES + DIFFER_CYCLES)
        assert node.version == 0


def test_a_block_that_was_refused_is_tried_again_when_it_comes_with_another_upload(rested: Callable[[], Node]) -> None:
    node = rested()
    wrong = segments(5, 1, 19.0 * DEG)  # at rest it would turn
    assert node.take(*wrong).phase is UploadPhase.WAITING
    node.rest(DIFFER_CYCLES + 1)
    assert node.take(wrong[0]).phase is UploadPhase.REFUSED
    assert node.take(segments(5, 2, 19.0 * DEG)[0]).phase is UploadPhase.PARTIAL


@pytest.mark.parametrize("named", [4, 6])
def test_a_block_has_the_version_of_its_segments(rested: Callable[[], Node], named: int) -> None:
    parts = split_block(block(named).canonical(), 3, 1, 5, KEY)
    status = rested().take(*parts)
    assert status.phase is UploadPhase.REFUSED
    assert f"expected that of its segments, 5, got {named}" in status.detail


@pytest.mark.parametrize("key", [KEY, OTHER])
def test_a_segment_is_believed_under_any_of_the_keys_that_are_valid(rested: Callable[[], Node], key: bytes) -> None:
    node = rested()

    def say(_severity: Severity, _code: str, _arguments: dict[str, Scalar]) -> None:
        pass

    store = BlockStore(FOLDER, node.disk)
    for keys, is_believed in (([KEY, OTHER], True), ([OTHER, KEY], True), ([bytes(32)], False), ([], False)):
        updater = BlockUpdater(node.process.tube, store, lambda keys=keys: keys, say, lambda: None)  # type: ignore[misc]
        status = updater.on_segment(segments(5, 1, key=key)[0], node.now)
        assert (status.phase is not UploadPhase.UNTRUSTED) == is_believed


def test_segments_that_are_not_believed_are_told_once_a_minute_with_how_many_came(
    rested: Callable[[], Node],
) -> None:
    node, said = rested(), []
    store = BlockStore(FOLDER, node.disk)
    updater = BlockUpdater(node.process.tube, store, lambda: [KEY], lambda *words: said.append(words), lambda: None)
    wrong = segments(5, 4, key=OTHER)[0]
    for now, count in ((1000.0, 1), (1000.0, None), (1059.999, None), (1060.0, 4), (1061.0, None)):
        said.clear()
        status = updater.on_segment(wrong, now)
        assert (status.phase, status.received, status.sequence) == (UploadPhase.UNTRUSTED, 0, 4)
        reason = "segment 0: the tag is not of the node's key"
        arguments = {"version": 5, "reason": reason, "segments": count}
        assert said == ([] if count is None else [(Severity.WARNING, "upload_untrusted", arguments)])
    bare = BlockUpdater(node.process.tube, store, list, lambda *words: said.append(words), lambda: None)
    said.clear()
    bare.on_segment(segments(5, 1)[0], 0.0)
    assert said[0][2] == {"version": 5, "reason": "the node has no key of the rig", "segments": 1}


@pytest.mark.parametrize("beyond", [0, 1])
def test_a_segment_has_a_number_below_that_of_all(rested: Callable[[], Node], beyond: int) -> None:
    part = segments(5, 1)[-1]
    wrong = sealed_segment(replace(part, index=part.count - 1 + beyond), KEY)
    assert (rested().take(wrong).phase is UploadPhase.UNTRUSTED) == bool(beyond)


def test_a_node_whose_blocks_are_lost_forgets_what_was_found_under_them(rested: Callable[[], Node]) -> None:
    node = rested()
    node.take(*segments(5, 1))
    node.rest(130)
    mount = node.process.nodes["mount"]
    mount["method"], mount["axis"], mount["std"] = 1, (0.02, -0.01, 0.99975), 1e-3
    assert node.process.state[0]["static_bias"].any()
    node.process.close()
    for is_damaged in (False, True):
        for name in ("parameters-0", "parameters-1"):
            if is_damaged and name in node.disk.seen:
                node.disk.seen[name].seen[40] ^= 1
        again = Node(node.disk.after_cut(Left.ALL))
        assert again.version == (0 if is_damaged else 5)
        assert again.process.state[0]["static_bias"].any() != is_damaged
        assert (again.process.nodes["mount"] == new_mount()).all() == is_damaged


REST = ((0.0, 0.0, 0.0), (0.0, 0.3, -9.8), 25.0)
TURNS = ((0.0, 0.0, 30.0 * DEG), (0.0, 0.3, -9.8), 25.0)


def verdicts(words: str) -> list[TrialVerdict]:
    """Of a trial that reads what agrees (a), differs (d), or is read while the string turns (t)."""
    trial = Trial(ParameterBlock(3, 1), 9.81)
    return [
        trial.judge_reading(*(TURNS if word == "d" else REST), standing=word != "t", quiet=word != "t")
        for word in words
    ]


@pytest.mark.parametrize(
    ("before", "last", "decided"),
    [
        ("aaa", "a", TrialVerdict.APPLY),
        ("aaadaaa", "a", TrialVerdict.APPLY),
        ("aaataaa", "a", TrialVerdict.APPLY),
        ("ddddddd", "d", TrialVerdict.REFUSE),
        ("dddddddaddddddd", "d", TrialVerdict.REFUSE),
        ("dddddddtddddddd", "d", TrialVerdict.REFUSE),
    ],
)
def test_only_readings_in_a_row_decide_about_a_block(before: str, last: str, decided: TrialVerdict) -> None:
    assert STILL_CYCLES == 4
    assert DIFFER_CYCLES == 8
    found = verdicts(before + last)
    assert found == [TrialVerdict.WAIT] * len(before) + [decided]


def test_a_cut_at_any_call_of_a_change_leaves_no_bias_of_another_block(rested: Callable[[], Node]) -> None:
    """The old block with the bias that was learnt or learnt anew, or the new one with a bias learnt anew."""

    def changing(calls: int) -> tuple[StrictDisk, bool]:
        node = rested()
        node.take(*segments(5, 1))
        node.rest(STILL_CYCLES - 1)
        node.disk.calls, node.disk.calls_left = 0, calls
        try:
            node.rest(2)
        except PowerCutError:
            return node.disk, False
        return node.disk, True

    versions, calls, is_over = set(), 0, False
    while not is_over:
        disk, is_over = changing(calls)
        calls += 1
        for left in Left:
            again = Node(disk.after_cut(left))
            versions.add(again.version)
            if again.version == 5:
                assert not again.process.state[0]["static_bias"].any()
            if is_over:
                assert again.version == 5
    assert versions == {0, 5}
    assert calls > 8
