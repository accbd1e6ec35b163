"""Parameter blocks on a chip in told time: uploads of the product, answers, restarts, cuts, and who is not believed."""

from __future__ import annotations

import ctypes

import msgspec
import numpy as np
import pytest
from chip_in_process import BLOCK_VERSION, KEPT_BYTES, UNTRUSTED, PowerFailedError
from chip_rig import CHIP, EPOCH, Rig
from hypothesis import given, settings
from hypothesis import strategies as st
from needed_programs import needs_gcc

from node.firmware.block_trial import record_of
from node.kernels.record.integer_node import FIXED_PARAMETERS, PARAMETER_POWERS, PARAMETER_SCALES
from node.kernels.record.sensor_record import PARAMETERS
from telemetry.frozen import replace
from telemetry.messages import BlockStatus, Event, NodeState, Severity, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.authentication import sealed_segment
from telemetry.transport.upload import Upload, split_block

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
GYROSCOPE = SensorParameters(bias=(1e-4, 0.0, 2e-4), bias_slopes=((1e-6, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3))
BLOCK = ParameterBlock(CHIP, 4, GYROSCOPE, SensorParameters(bias=(0.02, -0.01, 0.03)))
REST = 62.0  # s, until the bias is known
pytestmark = [needs_gcc, pytest.mark.slow]


@pytest.fixture(scope="module")
def library(library: ctypes.CDLL) -> ctypes.CDLL:
    """The library with a key."""
    library.shim_key(KEY)
    return library


def rocking(at: float) -> float:
    """Rates to and fro: a steady one that the head does not have would be a step of the gyroscope, and a stop."""
    return 0.2 if at % 2.1 < 1.05 else -0.2


class Uploading(Rig):
    """A rig whose base uploads a block."""

    def upload(self, block: ParameterBlock, key: bytes = KEY, sequence: int = 7, seconds: float = 60.0) -> BlockStatus:
        """The answer that ends it, or the last one."""
        upload = Upload(split_block(block.canonical(), CHIP, sequence, block.version, key), self.world.now)
        self._statuses().clear()
        end = self.world.now + seconds
        while self.world.now < end:
            for segment in upload.due_segments(self.world.now):
                self.base.endpoint.mail.send_segment(segment)
            self.world.run(0.1)
            if any(upload.on_status(status) for status in self._new_statuses()):
                break
        return self._said[-1]

    _said: list[BlockStatus]

    def _statuses(self) -> list[BlockStatus]:
        self._said = []
        self._taken = len(self.heard(BlockStatus))
        return self._said

    def _new_statuses(self) -> list[BlockStatus]:
        fresh = self.heard(BlockStatus)[self._taken :]
        self._taken += len(fresh)
        self._said += fresh
        return fresh

    def corrections(self, library: ctypes.CDLL) -> np.ndarray:
        """Numbers of those in use, without the work space of a step."""
        made = np.zeros(1, FIXED_PARAMETERS)
        library.shim_corrections(made.ctypes.data_as(ctypes.c_void_p))
        return numbers_of(made)


def numbers_of(record: np.ndarray) -> np.ndarray:
    sensors = [record[0][name] for name in ("gyroscope", "accelerometer")]
    parts = [np.ravel(sensor[name]) for sensor in sensors for name in ("matrix", "bias", "reference")]
    return np.concatenate(parts)


def test_a_block_is_taken_at_rest_told_and_kept_over_a_start(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    identity = ParameterBlock(CHIP, 0)
    state = rig.heard(NodeState)[-1]
    assert (state.parameters_version, state.parameters_hash) == (0, identity.sha256()[:8])

    status = rig.upload(BLOCK)
    assert status == BlockStatus(CHIP, 7, BLOCK.sha256(), UploadPhase.APPLIED, 0, 4, BLOCK.sha256(), "")
    rig.world.run(12.0)
    state = rig.heard(NodeState)[-1]
    assert (state.parameters_version, state.parameters_hash) == (4, BLOCK.sha256()[:8])
    (event,) = [event for event in rig.heard(Event) if event.code == "parameters_applied"]
    assert event.arguments == {"version": 4, "before": 0, "hash": BLOCK.sha256().hex()}
    assert (event.severity, event.epoch) == (Severity.INFO, EPOCH)
    words = FIXED_PARAMETERS.itemsize // 8
    scales = PARAMETER_SCALES[:words] / 9.80665 ** PARAMETER_POWERS[:words]
    expected = np.floor(record_of(BLOCK).view(np.float64) * scales + 0.5).view(PARAMETERS)
    assert np.abs(rig.corrections(library) - numbers_of(expected)).max() <= 1

    before = rig.corrections(library)
    rig.chip.begin(rig.world.now_us)
    assert np.array_equal(rig.corrections(library), before)
    rig.world.run(8.0)
    state = rig.heard(NodeState)[-1]
    assert (state.parameters_version, state.parameters_hash) == (4, BLOCK.sha256()[:8])
    assert rig.upload(BLOCK, sequence=8).phase is UploadPhase.APPLIED  # it is in use already


def test_a_block_of_another_key_or_of_none_changes_nothing(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(8.0)
    status = rig.upload(BLOCK, OTHER)
    assert (status.phase, status.received, status.version) == (UploadPhase.UNTRUSTED, 0, 0)
    assert status.detail == "the tag is not of the node's key"
    rig.world.run(3.0)  # the sender gave up at the third answer, its other segments were under way
    assert rig.chip.number(UNTRUSTED) == 5
    assert [event.code for event in rig.heard(Event)].count("upload_untrusted") == 1  # at most one a minute
    assert rig.chip.number(BLOCK_VERSION) == 0
    library.shim_key(None)
    try:
        rig.chip.begin(rig.world.now_us)
        rig.world.run(5.0)
        assert rig.upload(BLOCK).detail == "the node has no key of the rig"
    finally:
        library.shim_key(KEY)


@pytest.mark.parametrize("part", ["tube", "sequence", "version", "count", "index", "data", "digest"])
def test_a_segment_that_was_changed_is_not_believed(library: ctypes.CDLL, image: bytes, part: str) -> None:
    rig = Uploading(library, image)
    rig.world.run(4.0)
    segment = split_block(BLOCK.canonical(), CHIP, 7, BLOCK.version, KEY)[1]
    values = {"tube": 3, "sequence": 8, "version": 5, "count": 6, "index": 2, "data": b"x" * 192, "digest": bytes(32)}
    told = replace(segment, **{part: values[part]})
    forged = replace(told, tube=CHIP, tag=sealed_segment(told, KEY).tag if part == "tube" else told.tag)
    rig.base.endpoint.mail.send_segment(forged)
    rig.world.run(2.0)
    assert rig.chip.number(UNTRUSTED) == 1
    assert rig.heard(BlockStatus)[-1].phase is UploadPhase.UNTRUSTED


FAR = SensorParameters(matrix=((1.5, 0.0, 0.0), (0.0, 1.5, 0.0), (0.0, 0.0, 1.5)))


@pytest.mark.parametrize(
    ("block", "reason"),
    [
        (ParameterBlock(3, 4), "tube: expected this one"),
        (ParameterBlock(CHIP, 4, FAR), "gyroscope: expected a matrix within 0.2 of the identity or the last"),
        (ParameterBlock(CHIP, 4, SensorParameters(bias=(0.0, 0.0, float("nan")))), "parameter block: expected finite"),
        (ParameterBlock(CHIP, 4, SensorParameters(bias=(0.0, 0.0, 0.3))), "at rest it gives another rate than none"),
        (ParameterBlock(CHIP, 5000), "version: expected at most 4095"),
    ],
)
def test_a_block_that_cannot_be_is_refused_and_told(
    library: ctypes.CDLL, image: bytes, block: ParameterBlock, reason: str
) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    status = rig.upload(block)
    assert status.phase is UploadPhase.REFUSED
    assert status.detail.startswith(reason)
    assert (status.version, status.in_use) == (0, ParameterBlock(CHIP, 0).sha256())
    rig.world.run(3.0)
    told = [event.arguments for event in rig.heard(Event) if event.code == "parameters_refused"]
    assert told == ([] if block.version == 5000 else [{"version": 4, "reason": status.detail, "in_use": 0}])
    assert rig.upload(BLOCK if block.version == 4 else block, sequence=9).phase is (
        UploadPhase.APPLIED if block.version == 4 else UploadPhase.REFUSED
    )


def test_a_block_of_another_hash_is_refused(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(4.0)
    for segment in split_block(BLOCK.canonical(), CHIP, 7, BLOCK.version, KEY):
        rig.base.endpoint.mail.send_segment(sealed_segment(replace(segment, digest=bytes(32)), KEY))
    rig.world.run(4.0)
    status = rig.heard(BlockStatus)[-1]
    assert (status.phase, status.detail) == (UploadPhase.REFUSED, "the hash of the whole does not fit")


def test_a_negative_zero_is_hashed_as_zero(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    sent = bytearray(BLOCK.canonical())
    assert sent[12 + 8 : 12 + 16] == bytes(8)
    sent[12 + 15] = 0x80
    for segment in split_block(bytes(sent), CHIP, 7, BLOCK.version, KEY):
        rig.base.endpoint.mail.send_segment(segment)
    rig.world.run(12.0)
    assert rig.heard(NodeState)[-1].parameters_hash == BLOCK.sha256()[:8]


def test_an_older_block_is_refused(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    assert rig.upload(BLOCK).phase is UploadPhase.APPLIED
    older = rig.upload(ParameterBlock(CHIP, 3), sequence=8)
    assert (older.phase, older.detail) == (UploadPhase.REFUSED, "version: expected newer than the one in use")


def test_a_turning_string_waits_and_takes_the_block_as_it_stands(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    rig.world.motion = rocking
    rig.world.run(6.0)
    assert rig.upload(BLOCK, seconds=25.0).phase is UploadPhase.WAITING
    rig.world.motion = lambda at: 0.0
    rig.world.run(20.0)
    assert rig.chip.number(BLOCK_VERSION) == 4


def test_a_start_in_the_middle_of_an_upload_goes_on_with_it(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    first = split_block(BLOCK.canonical(), CHIP, 7, BLOCK.version, KEY)[0]
    rig.base.endpoint.mail.send_segment(first)
    rig.world.run(4.0)
    assert rig.heard(BlockStatus)[-1].received == 1
    rig.chip.begin(rig.world.now_us)
    rig.world.run(4.0)
    for segment in split_block(BLOCK.canonical(), CHIP, 7, BLOCK.version, KEY)[1:]:
        rig.base.endpoint.mail.send_segment(segment)
    rig.world.run(12.0)
    assert rig.chip.number(BLOCK_VERSION) == 4


@pytest.mark.parametrize("words", [0, 1, 700, -2, -1])
def test_a_cut_while_a_block_is_saved_leaves_the_one_or_the_other(
    library: ctypes.CDLL, image: bytes, words: int
) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    rig.world.motion = rocking
    rig.world.run(6.0)
    assert rig.upload(BLOCK, seconds=25.0).phase is UploadPhase.WAITING
    rig.world.run(4.0)
    rig.world.motion = lambda at: 0.0
    all_words = 3 + (rig.chip.number(KEPT_BYTES) + 7) // 8
    rig.chip.power_fails_after(words % all_words)
    with pytest.raises(PowerFailedError):
        rig.world.run(30.0)
    rig.chip.power_fails_after(-1)
    rig.chip.begin(rig.world.now_us)
    version = rig.chip.number(BLOCK_VERSION)
    assert version in (0, 4)
    rig.world.run(20.0)
    assert rig.chip.number(BLOCK_VERSION) == 4  # what had come whole was kept too
    assert rig.heard(NodeState)[-1].parameters_hash == BLOCK.sha256()[:8]


def test_a_worn_flash_takes_no_block(library: ctypes.CDLL, image: bytes) -> None:
    rig = Uploading(library, image)
    rig.world.run(REST)
    rig.world.motion = rocking
    rig.world.run(6.0)
    assert rig.upload(BLOCK, seconds=25.0).phase is UploadPhase.WAITING
    rig.world.run(4.0)
    before = rig.corrections(library)
    library.shim_wear(1)
    rig.world.motion = lambda at: 0.0
    rig.world.run(20.0)
    library.shim_wear(0)
    assert rig.chip.number(BLOCK_VERSION) == 0
    assert np.array_equal(rig.corrections(library), before)
    assert rig.heard(BlockStatus)[-1].detail == "flash: it does not take the block"


class Answer(ctypes.Structure):
    _fields_ = [
        ("upload", ctypes.c_int64), ("detail", ctypes.c_char_p), ("digest", ctypes.c_uint8 * 32),
        ("phase", ctypes.c_uint8), ("is_due", ctypes.c_bool),
    ]  # fmt: skip


class Kept(ctypes.Structure):
    _fields_ = [
        ("in_use", ctypes.c_uint8 * 32), ("digest", ctypes.c_uint8 * 32), ("version", ctypes.c_uint32),
        ("coming", ctypes.c_uint32), ("received", ctypes.c_uint32), ("bytes", ctypes.c_uint8 * 796),
    ]  # fmt: skip


DIGESTS = st.binary(min_size=32, max_size=32)
ANSWERS = st.builds(
    BlockStatus,
    st.integers(1, 250),
    st.integers(0, 2**53 - 1),
    DIGESTS,
    st.sampled_from(UploadPhase),
    st.integers(0, 31),
    st.integers(0, 2**32 - 1),
    DIGESTS,
    st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=70),
)


@settings(deadline=None)
@given(ANSWERS)
def test_an_answer_has_the_bytes_that_pythons_has(library: ctypes.CDLL, status: BlockStatus) -> None:
    answer = Answer(status.sequence, status.detail.encode(), (ctypes.c_uint8 * 32)(*status.digest), status.phase, True)
    kept = Kept((ctypes.c_uint8 * 32)(*status.in_use), version=status.version)
    room = (ctypes.c_uint8 * 224)()
    length = library.word_status(status.tube, ctypes.byref(answer), status.received, ctypes.byref(kept), room, 224)
    assert bytes(room)[:length] == encode_message(status)


@given(st.binary(max_size=200))
def test_garbage_is_no_segment(library: ctypes.CDLL, garbage: bytes) -> None:
    segment = (ctypes.c_uint64 * 16)()
    library.word_segment.restype = ctypes.c_bool
    whole = msgspec.msgpack.encode({"v": 1, "k": 11, "o": CHIP, "t": CHIP, "s": 1, "b": {}})
    for payload in (garbage, whole, whole[:-1] + garbage):
        assert not library.word_segment(payload, len(payload), segment)
