import dataclasses
import math
import pickle
from typing import Any

import msgpack
import pytest
from golden.make_payloads import MADE
from hypothesis import given
from hypothesis import strategies as st
from messages_of_schema import MESSAGES

from telemetry.messages import BASE, DepthReading, SessionOffer
from telemetry.presentation.compiled import lister_of, reader_of
from telemetry.presentation.fields import codec_of
from telemetry.presentation.msgpack_codec import DOWNWARD, decode, encode, open_payload, values_of_opened
from telemetry.schema import SCHEMA, SPEC_OF, Field, MessageSpec

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
    codecs = [codec_of(field) for field in SPEC_OF[type(message)].fields]
    values = [getattr(message, c.name) for c in codecs]
    packed = [v if c.pack is None else c.pack(v) for c, v in zip(codecs, values, strict=True)]
    body: dict[str, Any] = msgpack.unpackb(msgpack.packb(dict(zip([c.key for c in codecs], packed, strict=True))))
    return body


def read_field_by_field(spec: MessageSpec, body: dict[str, Any], version: int) -> Any:
    """What a reader is to say, without one."""
    codecs = [codec_of(field) for field in spec.fields]
    return spec.message(*[c.check(body.get(c.key)) if c.since <= version else c.default() for c in codecs])


def list_field_by_field(message: Any) -> list[Any]:
    """What a lister is to say, without one."""
    return [codec.check(getattr(message, codec.name)) for codec in map(codec_of, SPEC_OF[type(message)].fields)]


def odd_values(field: Field) -> list[Any]:
    """What stands at and beyond the ends of a field's range, and what is of another kind."""
    bounds = [field.low, field.high, math.nextafter(field.low, -math.inf), math.nextafter(field.high, math.inf)]
    whole = [int(bound) + step for bound in bounds if math.isfinite(bound) for step in (-1, 0, 1)]
    sizes = [bytes(size) for size in whole if 0 <= size < 1000]
    axes = [[bound if axis == k else 0.0 for k in range(3)] for bound in bounds for axis in range(3)]
    return [*EDGES, *bounds, *whole, *sizes, *VECTORS, *axes]


def verdict(judge: Any, *arguments: Any) -> str:
    """What is made of the arguments with the type of every value, or why they are refused."""
    try:
        return repr(judge(*arguments))
    except ValueError as error:
        return f"refused: {error}"


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
def test_a_reader_says_what_the_checks_say_field_by_field(given_body: tuple[MessageSpec, dict[str, Any], int]) -> None:
    spec, body, version = given_body
    read = reader_of(spec, [codec_of(field) for field in spec.fields], version)
    assert verdict(read, body) == verdict(read_field_by_field, spec, body, version)


@pytest.mark.parametrize("spec", SCHEMA, ids=lambda spec: spec.message.__name__)
def test_every_odd_value_that_comes_is_judged_as_its_check_does(spec: MessageSpec) -> None:
    body = whole_body(ONE_OF[spec.message])
    read = reader_of(spec, [codec_of(field) for field in spec.fields], spec.newest)
    for field in spec.fields:
        for value in odd_values(field):
            changed = body | {field.key: value}
            expected = verdict(read_field_by_field, spec, changed, spec.newest)
            assert verdict(read, changed) == expected, (field.name, value)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_every_odd_value_that_is_to_go_is_judged_as_its_check_does(message: Any) -> None:
    spec = SPEC_OF[type(message)]
    listed = lister_of(spec, [codec_of(field) for field in spec.fields])
    for field in spec.fields:
        for value in odd_values(field):
            for sequence in [value, tuple(value)] if isinstance(value, list) else [value]:
                changed = dataclasses.replace(message, **{field.name: sequence})
                assert verdict(listed, changed) == verdict(list_field_by_field, changed), (field.name, sequence)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_a_message_that_was_read_is_as_frozen_as_one_that_was_made(message: Any) -> None:
    read = decode(encode(message))
    assert type(read) is type(message)
    assert read == message
    assert pickle.loads(pickle.dumps(read)) == message == dataclasses.replace(read)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(read, dataclasses.fields(read)[0].name, 0)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_a_written_payload_is_that_of_a_map_in_the_earliest_version(message: Any) -> None:
    spec = SPEC_OF[type(message)]
    codecs = [codec_of(field) for field in spec.fields]
    values = [codec.check(getattr(message, codec.name)) for codec in codecs]
    version = max([1, *(c.since for c, value in zip(codecs, values, strict=True) if c.since > 1 and value != c.before)])
    packed = [v if c.pack is None else c.pack(v) for c, v in zip(codecs, values, strict=True)]
    body = {c.key: value for c, value in zip(codecs, packed, strict=True) if c.since <= version}
    origin = getattr(message, "tube", 255)
    target = origin if spec.kind in DOWNWARD else BASE
    rows = {
        "v": version, "k": int(spec.kind), "o": origin, "t": target, "s": getattr(message, "sequence", 0), "b": body
    }  # fmt: skip
    assert encode(message) == msgpack.packb(rows)


@pytest.mark.parametrize("message", ONE_OF.values(), ids=lambda message: type(message).__name__)
def test_values_are_picked_as_they_came_and_one_that_is_missing_is_none(message: Any) -> None:
    payload = encode(message)
    opened = open_payload(payload)
    codecs = [codec_of(field) for field in SPEC_OF[type(message)].fields]
    version, body = opened.rows["v"], opened.rows["b"]
    expected = [body.get(c.key) if c.since <= version else c.default() for c in codecs]
    assert values_of_opened(opened) == expected
    lost = dict(list(body.items())[1:])
    without = values_of_opened(opened._replace(rows=opened.rows | {"b": lost}))
    assert without == [None, *expected[1:]]
