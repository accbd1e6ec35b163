import math
import pickle
from typing import Any

import msgpack
import numpy as np
import pytest
from checks_by_hand import by_hand
from golden.make_payloads import MADE
from hypothesis import given
from hypothesis import strategies as st
from messages_of_schema import MESSAGES
from msgspec import Raw

from telemetry.errors import DecodeError, EncodeError
from telemetry.frozen import replace
from telemetry.messages import BASE, Aiding, DepthReading, NodeState, Reply, SessionOffer, Stand
from telemetry.presentation.message_codec import CODECS
from telemetry.presentation.msgpack_codec import (
    DOWNWARD,
    decode_message,
    encode_message,
    open_payload,
    values_of_opened,
)
from telemetry.presentation.wire_structs import number_type
from telemetry.schema import SCHEMA, SPEC_OF, MessageField, MessageSpec

EDGES = [math.nan, math.inf, -math.inf, -0.0, 1e300, 2**63, -1, 0, 1, 2.0, True, None, "text", b"", b"12345678", [], {}]
VECTORS = [
    [0.0, 0.0],
    [0.0, 1, 2.0],
    [1, 0.0, 0.0],
    [0.0, 0.0, 1],
    [0, True, 0.0],
    [0.0, math.nan, 0.0],
    [1e9, 0.0, 0.0],
    [[0.0] * 3] * 3,
    [[-1.0] * 3] * 3,
]
ONE_OF = {type(message): message for message in (*MADE, DepthReading(1, 1.0, 2.0, ()), SessionOffer(1))}


def whole_body(message: Any) -> dict[str, Any]:
    """Fields of a message as they come by msgpack, those of every schema version."""
    fields = [by_hand(field) for field in SPEC_OF[type(message)].fields]
    values = [getattr(message, f.name) for f in fields]
    packed = [v if f.pack is None else f.pack(v) for f, v in zip(fields, values, strict=True)]
    body: dict[str, Any] = msgpack.unpackb(msgpack.packb(dict(zip([f.key for f in fields], packed, strict=True))))
    return body


def read(spec: MessageSpec, body: dict[str, Any], version: int) -> Any:
    """Message of the fields of a payload of a schema version."""
    codec = CODECS[spec.message]
    return codec.message_of(codec.read(version, Raw(msgpack.packb(body))))


def read_by_hand(spec: MessageSpec, body: dict[str, Any], version: int) -> Any:
    """What ``read`` is to say, field by field."""
    fields = [by_hand(field) for field in spec.fields]
    return spec.message(*[f.check(body.get(f.key)) if f.since <= version else f.default() for f in fields])


def checked(message: Any) -> Any:
    """Message as it is written."""
    codec = CODECS[type(message)]
    return codec.message_of(codec.values_of(message))


def checked_by_hand(message: Any) -> Any:
    """What ``checked`` is to say, field by field."""
    fields = map(by_hand, SPEC_OF[type(message)].fields)
    return type(message)(*[f.check(getattr(message, f.name)) for f in fields])


def odd_values(field: MessageField) -> list[Any]:
    """What stands at and beyond the ends of a field's range, and what is of another kind."""
    bounds = [field.low, field.high, math.nextafter(field.low, -math.inf), math.nextafter(field.high, math.inf)]
    whole = [int(bound) + step for bound in bounds if math.isfinite(bound) for step in (-1, 0, 1)]
    sizes = [bytes(size) for size in whole if 0 <= size < 1000]
    axes = [[bound if axis == k else 0.0 for k in range(3)] for bound in bounds for axis in range(3)]
    return [*EDGES, *bounds, *whole, *sizes, *VECTORS, *axes]


def verdict(judge: Any, *arguments: Any) -> str:
    """What is made of the arguments with the type of every value, or that they are refused."""
    try:
        return repr(judge(*arguments))
    except ValueError:
        return "refused"


def named(judge: Any, *arguments: Any) -> str:
    """The field that is refused by name, after that of the message."""
    with pytest.raises((DecodeError, EncodeError)) as refused:
        judge(*arguments)
    return str(refused.value).split(": ")[1]


def is_on_the_wire(value: Any) -> bool:
    """Whether msgpack can say a value."""
    try:
        msgpack.packb(value)
    except OverflowError:
        return False
    return True


@st.composite
def bodies(draw: st.DrawFn) -> tuple[MessageSpec, dict[str, Any], int]:
    """Fields of some message as they come, a few of them wrong, odd or missing, and any version that it has."""
    spec = draw(st.sampled_from(SCHEMA))
    body = whole_body(draw(MESSAGES[spec.message]))
    keys = [field.key for field in spec.fields]
    odd = st.sampled_from(EDGES + VECTORS) | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.binary(max_size=40)
    body |= draw(st.dictionaries(st.sampled_from(keys), odd, max_size=3))
    for key in draw(st.lists(st.sampled_from(keys), max_size=1)):
        body.pop(key, None)
    return spec, body, draw(st.integers(1, spec.newest))


@given(bodies())
def test_what_comes_is_judged_as_by_hand(given_body: tuple[MessageSpec, dict[str, Any], int]) -> None:
    spec, body, version = given_body
    found = verdict(read, spec, body, version)
    assert found == verdict(read_by_hand, spec, body, version)
    if found == "refused":
        (field,) = [field for field in spec.fields if field.name == named(read, spec, body, version)]
        assert verdict(by_hand(field).check, body.get(field.key)) == "refused"


@pytest.mark.parametrize("spec", SCHEMA, ids=lambda spec: spec.message.__name__)
def test_every_odd_value_that_comes_is_judged_as_by_hand(spec: MessageSpec) -> None:
    body = whole_body(ONE_OF[spec.message])
    for field in spec.fields:
        for value in filter(is_on_the_wire, odd_values(field)):
            changed = body | {field.key: value}
            expected = verdict(read_by_hand, spec, changed, spec.newest)
            assert verdict(read, spec, changed, spec.newest) == expected, (field.name, value)
            if expected == "refused":
                assert named(read, spec, changed, spec.newest) == field.name


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_every_odd_value_that_is_to_go_is_judged_as_by_hand(message: Any) -> None:
    for field in SPEC_OF[type(message)].fields:
        for value in odd_values(field):
            for sequence in [value, tuple(value)] if isinstance(value, list) else [value]:
                changed = replace(message, **{field.name: sequence})
                expected = verdict(checked_by_hand, changed)
                assert verdict(checked, changed) == expected, (field.name, sequence)
                if expected == "refused":
                    assert named(checked, changed) == field.name


@pytest.mark.parametrize("spec", SCHEMA, ids=lambda spec: spec.message.__name__)
def test_a_field_that_is_missing_is_named(spec: MessageSpec) -> None:
    for field in spec.fields:
        body = whole_body(ONE_OF[spec.message])
        del body[field.key]
        assert named(read, spec, body, spec.newest) == field.name


def test_what_is_in_the_list_of_another_field_is_refused_by_that() -> None:
    reading = DepthReading(1, 1.0, 2.0, (Stand(1, 5.0, 9.0, 3.0), Stand(1, 8.0, 9.0, 3.0)))
    assert named(checked, reading) == "stands"
    assert named(checked, replace(reading, stands=(Stand(1, 5.0, 4.0, 3.0),))) == "stands"
    survey = next(message for message in MADE if type(message).__name__ == "SurveyMeasurement")
    assert named(checked, replace(survey, imus=(replace(survey.imus[0], force=(0.0, math.nan, 0.0)),))) == "imus"


def test_a_range_without_an_end_would_let_nan_in() -> None:
    with pytest.raises(ValueError, match="NaN"):
        number_type(-math.inf, math.inf)


def test_numbers_of_numpy_are_written_as_any_other() -> None:
    state = next(message for message in MADE if isinstance(message, NodeState))
    bias = np.array(state.gyro_bias)
    given_ = replace(state, yaw=np.float64(state.yaw), gyro_bias=tuple(bias), flags=int(state.flags))
    assert encode_message(given_) == encode_message(state)
    reply = Reply(1, 2, True, "", {"a": 1.5, "b": (1.0, 2.0)})
    assert encode_message(
        replace(reply, values={"a": np.float64(1.5), "b": list(np.array([1.0, 2.0]))})
    ) == encode_message(reply)


def test_text_is_no_bytes() -> None:
    with pytest.raises(EncodeError, match=r"^Aiding: seal: "):
        encode_message(Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, 1.0, 1, 0, seal="AAAA"))  # type: ignore[arg-type]


@pytest.mark.parametrize("head", [b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xdb\xff\xff\xff\xff"])
@pytest.mark.parametrize("spec", SCHEMA, ids=lambda spec: spec.message.__name__)
def test_a_length_of_four_billions_is_refused_before_there_is_room_for_it(spec: MessageSpec, head: bytes) -> None:
    whole = encode_message(ONE_OF[spec.message])
    fields = msgpack.unpackb(whole)["b"]
    for key in (*fields, "unknown"):
        body = fields | {key: 0}
        said = [msgpack.packb(k) + (head if k == key else msgpack.packb(value)) for k, value in body.items()]
        with pytest.raises(DecodeError):
            decode_message(whole[: whole.index(b"\xa1b") + 2] + b"\xde" + len(said).to_bytes(2) + b"".join(said))


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_a_message_that_was_read_is_as_frozen_as_one_that_was_made(message: Any) -> None:
    read_ = decode_message(encode_message(message))
    assert type(read_) is type(message)
    assert read_ == message
    assert pickle.loads(pickle.dumps(read_)) == message == replace(read_)
    with pytest.raises(AttributeError, match="immutable"):
        setattr(read_, message.__struct_fields__[0], 0)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_a_written_payload_is_that_of_a_map_in_the_earliest_version(message: Any) -> None:
    spec = SPEC_OF[type(message)]
    fields = [by_hand(field) for field in spec.fields]
    values = [f.check(getattr(message, f.name)) for f in fields]
    version = max([1, *(f.since for f, value in zip(fields, values, strict=True) if f.since > 1 and value != f.before)])
    packed = [v if f.pack is None else f.pack(v) for f, v in zip(fields, values, strict=True)]
    body = {f.key: value for f, value in zip(fields, packed, strict=True) if f.since <= version}
    origin = getattr(message, "tube", 255)
    target = origin if spec.kind in DOWNWARD else BASE
    rows = {
        "v": version, "k": int(spec.kind), "o": origin, "t": target, "s": getattr(message, "sequence", 0), "b": body
    }  # fmt: skip
    assert encode_message(message) == msgpack.packb(rows)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_the_values_of_a_payload_are_those_of_all_fields(message: Any) -> None:
    opened = open_payload(encode_message(message))
    values = values_of_opened(opened)
    assert CODECS[type(message)].message_of(values) == message
    assert len(values) == len(message.__struct_fields__)


@pytest.mark.parametrize("spec", SCHEMA, ids=lambda spec: spec.message.__name__)
def test_what_an_older_payload_lacks_has_the_value_of_before(spec: MessageSpec) -> None:
    body = whole_body(ONE_OF[spec.message])
    for version in range(1, spec.newest + 1):
        message = read(spec, {f.key: body[f.key] for f in spec.fields if f.since <= version}, version)
        lacking = [f for f in spec.fields if f.since > version]
        assert [getattr(message, f.name) for f in lacking] == [f.before for f in lacking]
