"""Cyclic messages as signals: rounding, ranges, the DBC file, and the profile between two links."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cantools
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from messages_of_schema import MESSAGES

from telemetry.application.can_load import RepeatedMessage, steady_traffic
from telemetry.errors import DecodeError, EncodeError
from telemetry.frozen import replace
from telemetry.media.can_identifier import Identifier
from telemetry.media.can_profile import NativePart
from telemetry.messages import Aiding, Command, Hello, NodeMode, NodeState, TimeReply, TimeRequest
from telemetry.presentation.can_dbc import IDENTIFIER_MASK, database_differences, dbc_text, frame_layouts, identifier_of
from telemetry.presentation.can_forms import FD_PART
from telemetry.presentation.can_messages import NATIVE, UNSAID, NativeMessage
from telemetry.presentation.can_native import HEADER_EVERY, NativeProfile, native_parts, rounded_frame, rounded_message
from telemetry.presentation.can_signals import Scale
from telemetry.presentation.msgpack_codec import encode_message, open_payload, values_of_opened
from telemetry.schema import MessageKind
from telemetry.transport.hop import HopLink, LinkFrame, parse_frame
from telemetry.unwritten import Content

DBC = Path(__file__).parents[2] / "docs" / "borechain.dbc"
AIDING = Aiding(1.0, 2e-6, 3e-7, -0.3, 1.24, 1234.56789, 7 << 32 | 5, 3, 480.0, 1e-5, True)
CYCLIC = sorted(NATIVE)


def native_of(message: object) -> NativeMessage:
    return next(native for native in NATIVE.values() if native.message is type(message))


@st.composite
def cyclic(draw: st.DrawFn) -> Any:
    return draw(MESSAGES[NATIVE[draw(st.sampled_from(CYCLIC))].message])


def expressible(message: Any) -> list[int]:
    """Raw numbers of a message; examples that only the tunnel carries are left out."""
    try:
        return native_of(message).raws_of(message)
    except EncodeError:
        assume(False)
        raise


@pytest.mark.slow
@given(cyclic())
def test_a_message_arrives_within_a_step_and_a_relay_changes_nothing(message: Any) -> None:
    native, raws = native_of(message), expressible(message)
    arrived = native.message_of(native.fd.unpack(native.fd.pack(raws, 17)))
    assert native.message_of(native.classic.unpack(native.classic.pack(raws, 17))) == arrived
    assert native.raws_of(arrived) == raws
    for name, signal in native.signals.items():
        if signal.scale in (Scale.LINEAR, Scale.CIRCLE) and hasattr(message, name):
            apart = abs(getattr(arrived, name) - getattr(message, name))
            assert min(apart, abs(apart - math.tau)) <= 0.53 * signal.step  # times have 14 digits before their step
        elif signal.scale in (Scale.INTEGER, Scale.SWITCH):
            assert getattr(arrived, name) == getattr(message, name)


@given(st.floats(1e-10, 1.0), st.floats(0.0, math.tau))
def test_a_variance_arrives_within_its_step_and_holds_the_rounding_of_its_value(var: float, yaw: float) -> None:
    arrived = rounded_message(replace(AIDING, yaw=yaw, yaw_var=var))
    assert isinstance(arrived, Aiding)
    step = NATIVE[MessageKind.AIDING].signals["yaw"].step
    least, most = var * 10**-0.0251, (var + step**2 / 12.0 + (1.24e-5) ** 2 / 12.0) * 10**0.0251
    assert least <= arrived.yaw_var <= most


def test_a_variance_of_zero_stays_zero_and_one_too_small_is_rounded_up() -> None:
    arrived = rounded_message(replace(AIDING, yaw=0.0, valid_at=1000.0, yaw_var=0.0, torsion_var=1e-30))
    assert isinstance(arrived, Aiding)
    assert arrived.yaw_var == 0.0
    assert 0.0 < arrived.torsion_var < 1e-10


def test_what_stands_on_a_step_costs_no_variance() -> None:
    once = rounded_message(AIDING)
    assert rounded_message(once) == once


def test_an_angle_that_rounds_to_full_scale_is_zero_again() -> None:
    arrived = rounded_message(replace(AIDING, yaw=math.nextafter(math.tau, 0.0)))
    assert isinstance(arrived, Aiding)
    assert arrived.yaw == 0.0


STATE = NodeState(
    3, 1000.0, 2, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.01, 0.0, -0.01), 1e-3, 0.01, 1e-5, math.inf, 1e-8, 0, 5, 0
)  # type: ignore[arg-type]


def test_an_age_that_is_infinite_arrives_so_and_a_long_one_stays_finite() -> None:
    assert rounded_message(STATE).aiding_age == math.inf  # type: ignore[union-attr]
    assert 1e5 < rounded_message(replace(STATE, aiding_age=1e9)).aiding_age < math.inf  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (replace(AIDING, yaw=math.nan), "Aiding: yaw: expected a number"),
        (replace(AIDING, yaw=7.0), "Aiding: yaw: expected a number in"),
        (replace(AIDING, rate=math.inf), "Aiding: rate: expected a number"),
        (replace(AIDING, valid_at=2e9), "Aiding: valid_at: expected"),
        (replace(AIDING, yaw_var=math.nan), "Aiding: yaw_var: expected a number"),
        (replace(STATE, gyro_bias=(0.0, 3.0, 0.0)), "NodeState: gyro_bias_y: expected"),
        (replace(STATE, overruns=70_000), "NodeState: overruns: expected"),
        (replace(STATE, aiding_age=math.nan), "NodeState: aiding_age: expected"),
        (replace(STATE, upper_margin=12.0), "NodeState: upper_margin: expected none where there is no radio"),
        (TimeRequest(math.inf), "TimeRequest: asked_at: expected"),
        (replace(AIDING, under_torque=-1), "Aiding: under_torque: expected"),  # type: ignore[arg-type]
        (Hello(1, 2**40, 1, NodeMode.STILL, 1.0), "Hello: boot_count: expected an integer"),
    ],
)
def test_a_value_that_cannot_be_said_is_refused_by_name(message: Any, says: str) -> None:
    with pytest.raises(EncodeError, match=says):
        native_of(message).raws_of(message)


@pytest.mark.parametrize("kind", CYCLIC)
@given(length=st.integers(0, 80))
def test_a_frame_of_another_length_is_refused_by_name(kind: MessageKind, length: int) -> None:
    native = NATIVE[kind]
    for form in (native.fd, native.classic):
        right = [bytes(layout.length) for layout in form.layouts]
        assume(length != form.layouts[0].length)
        with pytest.raises(DecodeError, match=f"{form.layouts[0].name}: expected .* bytes, got {length}"):
            form.unpack([bytes(length), *right[1:]])


def outcome(act: Callable[[], Any]) -> str:
    """What comes of a call, or the error it raises; -0.0 is told from 0.0."""
    try:
        return repr(act())
    except (EncodeError, DecodeError) as error:
        return f"{type(error).__name__}: {error}"


ODD = (0.0, -0.0, math.inf, -math.inf, math.nan, 1, -1, 2**60, True, None, "x", b"", 1e300, [0.0, 1, 0.0], (0.0,) * 3)


@pytest.mark.slow
@given(cyclic(), st.data(), st.booleans())
def test_compiled_and_field_by_field_say_the_same(message: Any, data: st.DataObject, fd: bool) -> None:
    native = native_of(message)
    values = list(values_of_opened(open_payload(encode_message(message))))
    if data.draw(st.booleans()):
        values[data.draw(st.integers(0, len(values) - 1))] = data.draw(st.sampled_from(ODD))
    form = native.form(fd=fd)
    said = outcome(lambda: form.pack(native.raws_of_values(values), 17))
    assert outcome(lambda: native.pack(values, 17, fd=fd)) == said
    frames = [data.draw(st.binary(min_size=layout.length, max_size=layout.length)) for layout in form.layouts]
    if "Error" not in said and data.draw(st.booleans()):
        frames = native.pack(values, 17, fd=fd)
    heard = outcome(lambda: native.values_of(form.unpack(frames)))
    assert outcome(lambda: native.unpack(frames, fd=fd)) == heard


@pytest.mark.parametrize("traffic", steady_traffic(1), ids=lambda traffic: type(traffic.message).__name__)
@pytest.mark.parametrize("fd", [False, True])
def test_what_comes_all_the_time_takes_the_compiled_way(traffic: RepeatedMessage, fd: bool) -> None:
    native = native_of(traffic.message)
    values = list(values_of_opened(open_payload(encode_message(traffic.message))))
    data = native.packers[fd](values, 17)
    assert data is not None
    assert native.unpackers[fd](data) is not None


@pytest.mark.parametrize("kind", CYCLIC)
@given(data=st.data())
def test_any_bits_are_a_message_or_refused_by_name(kind: MessageKind, data: st.DataObject) -> None:
    native = NATIVE[kind]
    length = native.fd.layouts[0].length
    frame = data.draw(st.binary(min_size=length, max_size=length))
    named = ""
    try:
        message = native.message_of(native.fd.unpack([frame]))
        raws = native.raws_of(message)
        assert native.raws_of(native.message_of(native.fd.unpack(native.fd.pack(raws, 0)))) == raws
    except DecodeError as error:
        named = str(error)
    assert not named or named.startswith(f"{native.name}: ")


def test_the_file_in_the_repository_is_made_from_the_schema() -> None:
    assert DBC.read_text() == dbc_text(), "run python docs/make_dbc.py"


@pytest.fixture(scope="module")
def database() -> Any:
    return cantools.database.load_file(str(DBC), frame_id_mask=IDENTIFIER_MASK)


def test_a_foreign_tool_reads_every_message_as_we_mean_it(database: Any) -> None:
    assert database_differences(cantools.database.load_file(str(DBC))) == []
    names = [message.name for message in database.messages]
    assert names == [layout.name for _, layout, _ in frame_layouts()]


@pytest.mark.parametrize(
    ("ours", "theirs", "says"),
    [
        ("SG_ yaw : 8|24@1+", "SG_ yaw : 8|23@1+", "Aiding.yaw: expected start, bits"),
        ("SG_ hops ", "SG_ hop ", "Hello.hops: missing"),
        ("SG_ hops ", "SG_ hop ", "Hello.hop: unknown"),
        ('"rad/s"', '"deg/s"', "Aiding.rate: expected start, bits, step, offset and unit"),
    ],
)
def test_a_file_that_differs_is_told_by_signal(ours: str, theirs: str, says: str) -> None:
    text = dbc_text()
    assert ours in text
    found = database_differences(cantools.database.load_string(text.replace(ours, theirs)))
    assert any(line.startswith(says) for line in found), found


@settings(max_examples=40)
@given(cyclic())
def test_a_foreign_tool_decodes_our_frames(database: Any, message: Any) -> None:
    native, raws = native_of(message), expressible(message)
    by_name = dict(zip(native.signals, raws, strict=True))
    for form in (native.fd, native.classic):
        for layout, data in zip(form.layouts, form.pack(raws, 5), strict=True):
            sent_by_9 = identifier_of(native, layout) | 9 << 13
            decoded = database.get_message_by_frame_id(sent_by_9).decode(data, decode_choices=False)
            for signal, _ in layout.places:
                raw = 5 if signal.name == "count" else by_name[signal.name]
                value = (signal.first + raw) * signal.step  # times have 14 digits before their step
                assert decoded[signal.name] == pytest.approx(value, rel=1e-12, abs=0.1 * signal.step)


def linked() -> tuple[HopLink, HopLink, NativeProfile, NativeProfile]:
    """Two links that have met, each with its profile."""
    upper, lower = HopLink(2, 1), HopLink(1, 1)
    profiles = NativeProfile(), NativeProfile()
    for link in (upper, lower):
        link.bundle_limit = 0
        link.send_best_effort(encode_message(Hello(link._address, 1, 1, NodeMode.STILL, 1.0)), "hello")
    carry(upper, lower, *profiles, 1.0)
    carry(lower, upper, profiles[1], profiles[0], 1.0)
    return upper, lower, *profiles


def test_an_acknowledgement_that_was_lost_is_said_again() -> None:
    upper, lower, ours, theirs = linked()
    carry(upper, lower, ours, theirs, 1.1)
    lower.send_reliable(b"survey")
    assert carry(lower, upper, theirs, ours, 1.2) == [b"survey"]
    assert [ours.split(frame.payload, 1.3, fd=True).rest for frame in upper.take_frames(1.3)] != []  # not heard
    assert carry(lower, upper, theirs, ours, 1.4) == []
    assert lower.waiting == 1
    carry(upper, lower, ours, theirs, 1.5)
    assert lower.waiting == 0


def type_and_part(part: NativePart) -> tuple[int, int]:
    """What its identifier says of a part."""
    identifier = Identifier.unpack(part.identifier)
    assert identifier is not None
    return identifier.type, identifier.part


def carry(
    sender: HopLink, receiver: HopLink, out: NativeProfile, into: NativeProfile, now: float, *, fd: bool = True
) -> list[bytes]:
    """Payloads that arrive of all frames that are due."""
    arrived: list[Content] = []
    for frame in sender.take_frames(now):
        split = out.split(frame.content, now, fd=fd)
        for part in split.parts:
            try:
                joined = into.join(sender._address, *type_and_part(part), part.data)
            except DecodeError:
                continue
            if joined is not None:
                arrived += receiver.receive(joined, now)
        if split.rest is not None:
            into.observe(split.rest)
            arrived += receiver.receive(split.rest, now)
    return [bytes(payload) for payload in arrived]


@pytest.mark.parametrize("fd", [True, False])
def test_what_two_links_say_arrives_rounded_or_as_it_was(fd: bool) -> None:
    upper, lower, ours, theirs = linked()
    order = encode_message(Command(1, 5, "timing", {}))
    upper.send_best_effort(encode_message(AIDING), "aiding")
    upper.send_reliable(order)
    arrived = carry(upper, lower, ours, theirs, 2.0, fd=fd)
    assert sorted(arrived) == sorted([encode_message(rounded_message(AIDING)), order])
    assert lower.counters["bad_frames"] == 0
    assert lower.quality == 1.0
    for _ in range(3):
        assert carry(lower, upper, theirs, ours, 2.1, fd=fd) == []
    assert upper.waiting == 0  # acknowledged


def test_only_the_signals_travel_while_there_is_no_news() -> None:
    upper, _, ours, _ = linked()
    carried = []
    for k in range(24):
        now = 2.0 + k * HEADER_EVERY / 8
        upper.send_best_effort(encode_message(replace(AIDING, valid_at=1000.0 + k)), "aiding")
        (frame,) = upper.take_frames(now)
        split = ours.split(frame.payload, now, fd=True)
        assert [(type_and_part(part), len(part.data)) for part in split.parts] == [((1, FD_PART), 32)]
        carried.append(split.rest is not None)
    assert 3 <= sum(carried) <= 4


def test_a_message_that_no_signal_can_say_takes_the_tunnel() -> None:
    upper, lower, ours, theirs = linked()
    far = encode_message(replace(STATE, overruns=70_000))
    assert native_parts(far, 1, fd=True) is None
    upper.send_best_effort(far, "state")
    assert carry(upper, lower, ours, theirs, 2.0) == [far]


def test_an_end_that_starts_anew_understands_from_the_first_frame_on() -> None:
    upper, lower, ours, _ = linked()
    late, into = HopLink(1, 2), NativeProfile()
    late.bundle_limit = 0
    got: list[bytes] = []
    for k in range(16):
        upper.send_best_effort(encode_message(replace(AIDING, valid_at=1000.0 + k)), "aiding")
        got += carry(upper, late, ours, into, 2.0 + k * HEADER_EVERY / 8)
    assert len(got) == 16
    assert lower.peer == late.peer
    late.send_reliable(b"survey")
    assert carry(late, upper, into, ours, 6.0) == [b"survey"]


def test_what_must_not_be_lost_waits_for_the_header() -> None:
    _, lower, ours, _ = linked()
    aiding = native_parts(encode_message(AIDING), 5, fd=True)
    assert aiding is not None
    joined = ours.join(9, *type_and_part(aiding[0]), aiding[0].data)
    assert isinstance(joined, LinkFrame)
    numbered = LinkFrame(joined.header, [*joined.entries, (1, b"survey")])
    late = HopLink(1, 2)
    assert [bytes(payload) for payload in late.receive(numbered, 2.0)] == [encode_message(rounded_message(AIDING))]
    assert late.next_wake(2.0) == math.inf  # nothing to acknowledge
    assert late.peer is None
    assert late.is_up(2.0)
    assert lower.peer == (2, 1)
    lower.receive(joined, 2.0)
    assert lower.peer == (2, 1)


def test_parts_of_two_messages_are_not_put_together() -> None:
    profile = NativeProfile()
    first = native_parts(encode_message(AIDING), 1, fd=False)
    second = native_parts(encode_message(replace(AIDING, yaw=2.0)), 2, fd=False)
    assert first is not None
    assert second is not None
    profile.observe(header_of(2))
    joined = [profile.join(2, *type_and_part(part), part.data) for part in [*first[:2], *second]]
    (whole,) = [frame for frame in joined if frame is not None]
    parsed = parse_frame(bytes(whole))
    assert parsed is not None
    assert parsed[1] == [[0, encode_message(rounded_message(replace(AIDING, yaw=2.0)))]]


def header_of(address: int) -> bytes:
    """A frame of a link that has something to say."""
    link = HopLink(address, 1)
    link.send_best_effort(encode_message(TimeRequest(1.0)), "time")
    return link.take_frames(0.0)[0].payload


@given(st.integers(0, 40), st.integers(0, 31), st.binary(max_size=64))
def test_any_part_is_taken_or_refused_by_name(type_: int, part: int, data: bytes) -> None:
    profile = NativeProfile()
    profile.observe(header_of(2))
    joined, named = None, ""
    try:
        joined = profile.join(2, type_, part, data)
    except DecodeError as error:
        named = str(error)
    assert joined is None or parse_frame(joined) is not None
    assert named or joined is None or type_ in CYCLIC


def test_a_bundle_is_rounded_as_its_messages_are() -> None:
    link = HopLink(2, 1)
    link.send_best_effort(encode_message(AIDING), "aiding")
    link.send_best_effort(encode_message(TimeReply(1.0, 2.0, 3.0, 4.0, 1.0, 1e-9)), "time")
    (frame,) = link.take_frames(0.0)
    before, after = parse_frame(frame.payload), parse_frame(rounded_frame(frame.payload))
    assert before is not None
    assert after is not None
    assert before[0] == after[0]
    assert after[1][0] == [0, encode_message(rounded_message(AIDING))]
    assert rounded_frame(b"garbage") == b"garbage"
    assert set(Aiding.__struct_fields__) - set(UNSAID) == set(NATIVE[MessageKind.AIDING].signals)
