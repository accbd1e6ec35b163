import json
import math
import re
from pathlib import Path
from typing import Any

import msgpack
import pytest
from golden.make_payloads import MADE
from hypothesis import given
from hypothesis import strategies as st
from messages_of_schema import MESSAGES, messages

from telemetry.errors import DecodeError, EncodeError
from telemetry.frozen import replace
from telemetry.messages import (
    BASE,
    MAX_SEGMENTS,
    SEGMENT_SIZE,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    NodeState,
    Receipt,
    Reply,
    SessionOffer,
    TimeRequest,
    UploadPhase,
)
from telemetry.presentation.msgpack_codec import (
    MAX_PAYLOAD,
    decode_message,
    encode_message,
    open_payload,
    state_origin,
    unwritten_message,
)
from telemetry.schema import SCHEMA, MessageKind
from telemetry.transport.hop import BUNDLE_LIMIT, ENTRY_BYTES, MAX_FRAME

ANY = st.one_of(*MESSAGES.values())
OF_BEFORE = set(MessageKind) - {
    MessageKind.DEPTH_READING,
    MessageKind.SESSION_OFFER,
}  # kinds that there were when the payloads were recorded
GOLDEN = json.loads((Path(__file__).parent / "golden" / "payloads.json").read_text())


def test_the_schema_names_every_field_of_every_message_once() -> None:
    assert [spec.kind for spec in SCHEMA] == list(MessageKind)
    for spec in SCHEMA:
        assert [field.name for field in spec.fields] == list(spec.message.__struct_fields__)
        assert len({field.key for field in spec.fields}) == len(spec.fields)
        assert all(field.meaning and field.key for field in spec.fields)


def test_payloads_of_before_the_schema_are_written_as_they_were() -> None:
    assert [encode_message(message).hex() for message in MADE] == GOLDEN["made"]
    assert {MessageKind(msgpack.unpackb(bytes.fromhex(payload))["k"]) for payload in GOLDEN["made"]} == OF_BEFORE


@pytest.mark.parametrize("payload", GOLDEN["made"] + GOLDEN["recorded"])
def test_a_payload_of_before_the_schema_is_read_and_written_bit_for_bit(payload: str) -> None:
    assert encode_message(decode_message(bytes.fromhex(payload))).hex() == payload


@given(messages(Reply))
def test_a_reply_without_values_is_said_as_before_there_were_any(reply: Reply) -> None:
    rows = msgpack.unpackb(encode_message(reply))
    assert (rows["v"], "w" in rows["b"]) == ((3, True) if reply.values else (1, False))


def test_replies_of_earlier_versions_share_no_values() -> None:
    payload = encode_message(Reply(1, 2, True, ""))
    decode_message(payload).values["a"] = 1  # type: ignore[union-attr]
    assert decode_message(payload) == Reply(1, 2, True, "")


@pytest.mark.slow
@given(ANY)
def test_decoding_gives_back_what_was_encoded(message: Any) -> None:
    assert decode_message(encode_message(message)) == message


@given(ANY)
def test_the_envelope_tells_the_route_without_the_body(message: Any) -> None:
    envelope = open_payload(encode_message(message))
    if isinstance(message, Receipt | Command | BlockSegment | SessionOffer):
        assert envelope.target == message.tube
    else:
        assert envelope.target == BASE
        assert envelope.origin == getattr(message, "tube", 255)


@given(ANY)
def test_a_state_is_known_by_its_first_bytes(message: Any) -> None:
    tube = message.tube if isinstance(message, NodeState) else None
    assert state_origin(encode_message(message)) == state_origin(unwritten_message(message)) == tube


@given(MESSAGES[NodeState], st.data())
def test_what_looks_like_a_state_is_one_of_that_tube_or_refused(state: NodeState, data: st.DataObject) -> None:
    payload = bytearray(encode_message(state))
    payload[data.draw(st.integers(0, 15))] = data.draw(st.integers(0, 255))
    del payload[data.draw(st.just(len(payload)) | st.integers(0, len(payload))) :]
    found = state_origin(bytes(payload))
    try:
        opened = open_payload(bytes(payload))
    except DecodeError:
        return
    rows = msgpack.unpackb(bytes(payload), strict_map_key=False)
    is_as_written = opened.kind is MessageKind.NODE_STATE and list(rows)[:3] == ["v", "k", "o"]
    assert found == (opened.origin if is_as_written else None)


@given(MESSAGES[Aiding])
def test_aiding_is_said_in_the_earliest_version_that_can(aiding: Aiding) -> None:
    aiding = replace(aiding, epoch=0, seal=b"")
    twisted = bool(aiding.torque or aiding.torsion_var or aiding.under_torque)
    rows = msgpack.unpackb(encode_message(aiding))
    assert rows["v"] == (2 if twisted else 1)
    assert ({"q", "tv", "u"} <= set(rows["b"])) == twisted


@given(MESSAGES[Aiding])
def test_aiding_of_an_old_node_is_read_as_that_of_a_rigid_string(aiding: Aiding) -> None:
    rigid = replace(aiding, torque=0.0, torsion_var=0.0, under_torque=False, epoch=0, seal=b"")
    rows = msgpack.unpackb(encode_message(rigid))
    rows["b"] |= {"q": 5.0, "tv": 1.0, "u": True}  # keys that version 1 does not know
    assert decode_message(msgpack.packb(rows)) == rigid


@given(MESSAGES[NodeState])
def test_a_state_is_said_as_before_there_was_what_it_does_not_use(state: NodeState) -> None:
    """Neither an alignment nor a radio costs a byte where there is none."""
    state = replace(state, epoch=0, numbered=0)
    aligned = state.alignment != (0.0, 0.0, 0.0)
    by_radio = min(state.upper_margin, state.lower_margin) < math.inf
    rows = msgpack.unpackb(encode_message(state))
    assert rows["v"] == (4 if by_radio else 2 if aligned else 1)
    assert ("al" in rows["b"]) == (aligned or by_radio)
    assert ({"um", "lm"} <= set(rows["b"])) == by_radio
    assert decode_message(msgpack.packb(rows)) == state


@pytest.mark.parametrize(
    ("message", "version", "named"),
    [
        (TimeRequest(3.0), 2, "time_request: expected version 1, got 2"),
        (Receipt(3, 4), 6, "^payload: version: .*<= 5"),
        (Receipt(3, 4), 0, "^payload: version: .*>= 1"),
        (Receipt(3, 4), True, "^payload: version: .*bool"),
        (Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, 1.0, 1, 0), 2, "^Aiding: torque: "),
    ],
)
def test_a_version_that_is_not_known_or_lacks_its_fields_is_refused(message: Any, version: int, named: str) -> None:
    rows = msgpack.unpackb(encode_message(message)) | {"v": version}
    with pytest.raises(DecodeError, match=named):
        decode_message(msgpack.packb(rows))


@given(st.binary(max_size=300))
def test_random_bytes_are_refused_by_name(payload: bytes) -> None:
    with pytest.raises(DecodeError):
        decode_message(payload)


@given(ANY, st.data())
def test_truncated_payloads_are_refused(message: Any, data: st.DataObject) -> None:
    payload = encode_message(message)
    with pytest.raises(DecodeError):
        decode_message(payload[: data.draw(st.integers(0, len(payload) - 1))])


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


@pytest.mark.slow
@given(ANY, st.data())
def test_a_wrong_value_in_the_right_shape_is_refused_or_within_range(message: Any, data: st.DataObject) -> None:
    rows = msgpack.unpackb(encode_message(message))
    key = data.draw(st.sampled_from(sorted(rows["b"])))
    rows["b"][key] = data.draw(WRONG)
    try:
        decoded = decode_message(msgpack.packb(rows))
    except DecodeError:
        return
    assert decode_message(encode_message(decoded)) == decoded  # what is accepted is a message like any other


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"v": 5}, "payload: receipt: expected version 4, got 5"),
        ({"v": None}, "payload: version: Expected `int`, got `None`"),
        ({"k": 99}, "payload: kind: Invalid enum value 99"),
        ({"k": True}, "payload: kind: Expected `int`, got `bool`"),
        ({"o": -1}, "payload: origin: Expected `int` >= 0"),
        ({"o": 256, "t": "x"}, "payload: origin: Expected `int` <= 255"),
        ({"t": 1e9}, "payload: target: Expected `int`, got `float`"),
        ({"t": False}, "payload: target: Expected `int`, got `bool`"),
        ({"s": "x"}, "payload: sequence: Expected `int`, got `str`"),
        ({"s": 2**53 + 1}, f"payload: sequence: Expected `int` <= {2**53}"),
        ({"b": 3}, "Receipt: Expected `object`, got `int`"),
    ],
)
def test_a_wrong_envelope_is_refused_by_name(change: dict[str, Any], named: str) -> None:
    rows = msgpack.unpackb(encode_message(Receipt(3, 4))) | change
    with pytest.raises(DecodeError, match=f"^{re.escape(named)}"):
        decode_message(msgpack.packb(rows))


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
        encode_message(message)


def test_a_segment_fits_one_payload_and_a_frame_holds_a_bundle() -> None:
    worst = BlockSegment(250, 2**53, 2**32 - 1, bytes(32), 32, 31, b"x" * SEGMENT_SIZE, bytes(32))
    assert len(encode_message(worst)) <= MAX_PAYLOAD
    assert MAX_PAYLOAD + ENTRY_BYTES <= BUNDLE_LIMIT <= MAX_FRAME - 128
