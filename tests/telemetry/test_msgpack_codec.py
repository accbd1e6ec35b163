import dataclasses
import math
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import (
    BASE,
    MAX_SEGMENTS,
    MAX_TUBE,
    SEGMENT_SIZE,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    Event,
    Hello,
    ImuMean,
    Mode,
    NodeFlag,
    NodeState,
    Receipt,
    Reply,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
    UploadPhase,
)
from telemetry.presentation.msgpack_codec import FIELDS, MAX_PAYLOAD, decode, encode, peek
from telemetry.transport.hop import ENTRIES_PER_FRAME, MAX_FRAME

TURN = 2.0 * math.pi
TUBE = st.integers(1, MAX_TUBE)
SEQUENCE = st.integers(0, 2**53)
TIME = st.floats(-1e12, 1e12)
VAR = st.floats(0.0, 100.0)
YAW = st.floats(0.0, TURN)
HOPS = st.integers(-1, BASE)
FLAGS = st.integers(0, 255).map(NodeFlag)
VECTOR = st.tuples(*[st.floats(-10.0, 10.0)] * 3)
U32 = st.integers(0, 2**32 - 1)
HASH = st.binary(min_size=32, max_size=32)
COV = st.builds(lambda d, c: ((d, c, 0.0), (c, d, 0.0), (0.0, 0.0, d)), st.floats(0.0, 1.0), st.floats(-1.0, 1.0))
SCALAR = st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False, allow_infinity=False)
ARGUMENTS = st.dictionaries(st.text(max_size=20), SCALAR | st.text(max_size=50), max_size=8)
IMU = st.builds(
    lambda force, d: ImuMean(force, ((d, 0.0, 0.0), (0.0, d, 0.0), (0.0, 0.0, d))), VECTOR, st.floats(0.0, 1.0)
)
MESSAGES: dict[type, st.SearchStrategy[Any]] = {
    Aiding: st.builds(
        Aiding,
        YAW,
        VAR,
        VAR,
        st.floats(-TURN, TURN),
        st.floats(-100, 100),
        TIME,
        SEQUENCE,
        HOPS,
        st.just(0.0) | st.floats(0.0, 1e6),
        st.just(0.0) | VAR,
        st.booleans(),
    ),
    Hello: st.builds(Hello, TUBE, st.integers(0, 2**32 - 1), HOPS, st.sampled_from(Mode), st.floats(0.0, 1.0)),
    TimeRequest: st.builds(TimeRequest, TIME),
    TimeReply: st.builds(TimeReply, TIME, TIME, TIME, TIME, st.floats(0.5, 2.0), st.floats(0.0, 1e9)),
    NodeState: st.builds(
        NodeState,
        tube=TUBE,
        at=TIME,
        hops=HOPS,
        mode=st.sampled_from(Mode),
        yaw=YAW,
        yaw_var=VAR,
        systematic_var=VAR,
        gyro_bias=VECTOR,
        scale_factor=st.floats(-1.0, 1.0),
        innovation=st.floats(-TURN, TURN),
        innovation_var=VAR,
        aiding_age=st.floats(0.0, math.inf),
        clock_var=st.floats(0.0, 1e9),
        flags=FLAGS,
        cycles=SEQUENCE,
        overruns=SEQUENCE,
        parameters_version=U32,
        parameters_hash=st.binary(min_size=8, max_size=8),
    ),
    SurveyMeasurement: st.builds(
        SurveyMeasurement,
        tube=TUBE,
        sequence=SEQUENCE,
        station_at=TIME,
        hops=HOPS,
        imus=st.lists(IMU, min_size=1, max_size=4).map(tuple),
        yaw=YAW,
        yaw_var=VAR,
        systematic_var=VAR,
        samples=st.integers(1, 1000),
        settle_time=st.floats(0.0, 1e6),
        flags=FLAGS,
    ),
    Receipt: st.builds(Receipt, TUBE, SEQUENCE),
    Command: st.builds(Command, TUBE, SEQUENCE, st.text(max_size=50), ARGUMENTS),
    Reply: st.builds(Reply, TUBE, SEQUENCE, st.booleans(), st.text(max_size=256)),
    BlockSegment: st.builds(
        BlockSegment,
        TUBE,
        SEQUENCE,
        st.integers(1, 2**32 - 1),
        HASH,
        st.integers(1, MAX_SEGMENTS),
        st.integers(0, MAX_SEGMENTS - 1),
        st.binary(min_size=1, max_size=SEGMENT_SIZE),
        HASH,
    ),
    BlockStatus: st.builds(
        BlockStatus,
        TUBE,
        SEQUENCE,
        HASH,
        st.sampled_from(UploadPhase),
        st.integers(0, 2**MAX_SEGMENTS - 1),
        U32,
        HASH,
        st.text(max_size=256),
    ),
    StaticRecord: st.builds(
        StaticRecord,
        tube=TUBE,
        sequence=SEQUENCE,
        command=SEQUENCE,
        begun_at=TIME,
        ended_at=TIME,
        samples=st.integers(2, 10000),
        rate=VECTOR,
        rate_cov=COV,
        force=VECTOR,
        force_cov=COV,
        temperature=st.floats(-40.0, 150.0),
        moved=st.booleans(),
    ),
    Event: st.builds(Event, TUBE, SEQUENCE, TIME, st.sampled_from(Severity), st.text(max_size=50), ARGUMENTS),
}
ANY = st.one_of(*MESSAGES.values())


def test_every_message_has_a_codec_and_a_test() -> None:
    assert set(FIELDS) == set(MESSAGES)
    for message, (_, fields) in FIELDS.items():
        assert [field.name for field in fields] == [field.name for field in dataclasses.fields(message)]
        assert len({field.key for field in fields}) == len(fields)


@pytest.mark.slow
@given(ANY)
def test_decoding_gives_back_what_was_encoded(message: Any) -> None:
    assert decode(encode(message)) == message


@given(ANY)
def test_the_envelope_tells_the_route_without_the_body(message: Any) -> None:
    envelope = peek(encode(message))
    if isinstance(message, Receipt | Command | BlockSegment):
        assert envelope.target == message.tube
    else:
        assert envelope.target == BASE
        assert envelope.origin == getattr(message, "tube", 255)


@given(MESSAGES[Aiding])
def test_aiding_is_said_in_the_earliest_version_that_can(aiding: Aiding) -> None:
    twisted = bool(aiding.torque or aiding.torsion_var or aiding.under_torque)
    rows = msgpack.unpackb(encode(aiding))
    assert rows["v"] == (2 if twisted else 1)
    assert ({"q", "tv", "u"} <= set(rows["b"])) == twisted


@given(MESSAGES[Aiding])
def test_aiding_of_an_old_node_is_read_as_that_of_a_rigid_string(aiding: Aiding) -> None:
    rigid = dataclasses.replace(aiding, torque=0.0, torsion_var=0.0, under_torque=False)
    rows = msgpack.unpackb(encode(rigid))
    rows["b"] |= {"q": 5.0, "tv": 1.0, "u": True}  # keys that version 1 does not know
    assert decode(msgpack.packb(rows)) == rigid


@given(MESSAGES[NodeState])
def test_a_state_of_a_node_never_aligned_is_said_as_before_there_was_an_alignment(state: NodeState) -> None:
    aligned = state.alignment != (0.0, 0.0, 0.0)
    rows = msgpack.unpackb(encode(state))
    assert (rows["v"], "al" in rows["b"]) == ((2, True) if aligned else (1, False))
    assert decode(msgpack.packb(rows)) == state


@pytest.mark.parametrize(
    ("message", "version", "named"),
    [
        (Receipt(3, 4), 2, "receipt: expected version 1, got 2"),
        (Receipt(3, 4), 3, "schema version 1 to 2, got 3"),
        (Receipt(3, 4), 0, "schema version"),
        (Receipt(3, 4), True, "schema version"),
        (Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, 1.0, 1, 0), 2, "torque"),
    ],
)
def test_a_version_that_is_not_known_or_lacks_its_fields_is_refused(message: Any, version: int, named: str) -> None:
    rows = msgpack.unpackb(encode(message)) | {"v": version}
    with pytest.raises(DecodeError, match=named):
        decode(msgpack.packb(rows))


@given(st.binary(max_size=300))
def test_random_bytes_are_refused_by_name(payload: bytes) -> None:
    with pytest.raises(DecodeError):
        decode(payload)


@given(ANY, st.data())
def test_truncated_payloads_are_refused(message: Any, data: st.DataObject) -> None:
    payload = encode(message)
    with pytest.raises(DecodeError):
        decode(payload[: data.draw(st.integers(0, len(payload) - 1))])


WRONG = st.one_of(
    st.just(math.nan),
    st.just(math.inf),
    st.just(-math.inf),
    st.just(1e300),
    st.just(2**63),
    st.just("text"),
    st.just(b"bytes"),
    st.just(b"x" * 200),
    st.just([]),
    st.just([math.nan] * 3),
    st.just({"a": {"b": 1}}),
    st.none(),
    st.booleans(),
)


@given(ANY, st.data())
def test_a_wrong_value_in_the_right_shape_is_refused_or_within_range(message: Any, data: st.DataObject) -> None:
    rows = msgpack.unpackb(encode(message))
    key = data.draw(st.sampled_from(sorted(rows["b"])))
    rows["b"][key] = data.draw(WRONG)
    try:
        decoded = decode(msgpack.packb(rows))
    except DecodeError:
        return
    assert decode(encode(decoded)) == decoded  # what is accepted is a message like any other


@pytest.mark.parametrize(
    "change", [{"v": 2}, {"v": None}, {"k": 99}, {"k": True}, {"o": -1}, {"t": 1e9}, {"s": "x"}, {"b": 3}]
)
def test_a_wrong_envelope_is_refused(change: dict[str, Any]) -> None:
    rows = msgpack.unpackb(encode(Receipt(3, 4))) | change
    with pytest.raises(DecodeError):
        decode(msgpack.packb(rows))


@pytest.mark.parametrize(
    "message",
    [
        Aiding(math.nan, 1.0, 0.0, 0.0, 0.0, 0.0, 1, 0),
        Aiding(0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1, 0),
        Aiding(7.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1, 0),
        Receipt(BASE + 1, 1),
        Command(1, 1, "x" * 300),
        BlockSegment(1, 1, 0, bytes(32), 1, 0, b"x", bytes(32)),
        BlockSegment(1, 1, 1, bytes(31), 1, 0, b"x", bytes(32)),
        BlockSegment(1, 1, 1, bytes(32), 1, 0, b"x" * (SEGMENT_SIZE + 1), bytes(32)),
        BlockStatus(1, 1, bytes(32), UploadPhase.PARTIAL, 1 << MAX_SEGMENTS, 0, bytes(32), ""),
    ],
)
def test_a_message_out_of_range_is_not_sent(message: Any) -> None:
    with pytest.raises(EncodeError):
        encode(message)


def test_eight_segments_fit_one_frame_and_each_one_payload() -> None:
    worst = BlockSegment(250, 2**53, 2**32 - 1, bytes(32), 32, 31, b"x" * SEGMENT_SIZE, bytes(32))
    assert len(encode(worst)) <= MAX_PAYLOAD
    assert ENTRIES_PER_FRAME * (len(encode(worst)) + 16) + 128 <= 4096 <= MAX_FRAME
