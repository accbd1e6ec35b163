"""The native profile as a DBC file, for tools that know CAN but not us; and where such a file differs from it.

Identifiers hold the sender: those of the file are of sender 0, and a tool compares them under ``IDENTIFIER_MASK``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from telemetry.media.can_frame import EXTENDED
from telemetry.media.can_identifier import Identifier
from telemetry.presentation.can_forms import Layout
from telemetry.presentation.can_messages import NATIVE, NativeMessage
from telemetry.presentation.can_native import PRIORITIES
from telemetry.presentation.can_signals import COUNT, Scale, Signal
from telemetry.schema import SPEC_OF

IDENTIFIER_MASK = 0x1FE0001F  # priority, type and part; not the sender and the addressee
NODE = "borechain"
HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: {node}\n'
EXTENDED_CAN, EXTENDED_CAN_FD = 1, 15  # of the attribute VFrameFormat
ATTRIBUTES = (
    'BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN",'
    + ",".join(['"reserved"'] * 12)
    + ',"StandardCAN_FD","ExtendedCAN_FD";\nBA_DEF_DEF_ "VFrameFormat" "ExtendedCAN";\n'
)


def dbc_text() -> str:
    """The file: every message in its frame of CAN FD and in those of classic CAN."""
    blocks = [HEAD.format(node=NODE)]
    comments, formats, values = [], [], []
    for native, layout, is_fd in frame_layouts():
        identifier = EXTENDED | identifier_of(native, layout)
        lines = [f"BO_ {identifier} {layout.name}: {layout.length} {NODE}"]
        lines += [signal_line(signal, start) for signal, start in layout.places]
        blocks.append("\n".join(lines) + "\n")
        kind = EXTENDED_CAN_FD if is_fd else EXTENDED_CAN
        formats.append(f'BA_ "VFrameFormat" BO_ {identifier} {kind};\n')
        comments += [f'CM_ SG_ {identifier} {s.name} "{signal_meaning(native, s)}";\n' for s, _ in layout.places]
        values += [line for s, _ in layout.places if (line := value_line(native, identifier, s))]
    return "\n".join(blocks) + "\n" + "".join([*comments, ATTRIBUTES, *formats, *values])


def frame_layouts() -> Iterator[tuple[NativeMessage, Layout, bool]]:
    """Every frame, and whether it is one of CAN FD."""
    for native in NATIVE.values():
        for form in (native.fd, native.classic):
            for layout in form.layouts:
                yield native, layout, form is native.fd


def identifier_of(native: NativeMessage, layout: Layout) -> int:
    """Identifier of a frame of sender 0."""
    return Identifier(PRIORITIES[native.kind], int(native.kind), 0, layout.part).pack()


def signal_line(signal: Signal, start: int) -> str:
    """One signal: little-endian, unsigned."""
    low, high = signal.first * signal.step, (signal.first + signal.largest) * signal.step
    scale = f"({signal.step!r},{low!r}) [{low!r}|{high!r}]"
    return f' SG_ {signal.name} : {start}|{signal.bits}@1+ {scale} "{signal.unit}" Vector__XXX'


def signal_meaning(native: NativeMessage, signal: Signal) -> str:
    """What a signal means, in the schema's words."""
    if signal is COUNT:
        return "frames of the link so far, modulo 256; the same in all parts of one message"
    fields = SPEC_OF[native.message].fields
    (field,) = [f for f in fields if signal.name in (f.name, *(f"{f.name}_{end}" for end in "xyz12"))]
    extra = {Scale.DECIBEL: "; the lowest is zero", Scale.AGE: "; the highest is infinite"}.get(signal.scale, "")
    return field.meaning.replace('"', "'") + extra


def value_line(native: NativeMessage, identifier: int, signal: Signal) -> str:
    """Names of the values of an enumeration; nothing of another signal."""
    fields = {field.name: field for field in SPEC_OF[native.message].fields}
    enumeration = fields[signal.name].enumeration if signal.name in fields else None
    if enumeration is None or signal.bits > 8:
        return ""
    names = " ".join(f'{int(member)} "{str(member.name).lower()}"' for member in enumeration)
    return f"VAL_ {identifier} {signal.name} {names} ;\n"


def database_differences(database: Any) -> list[str]:
    """Where a database that cantools has read differs from our messages: message and signal, expected, got."""
    found = []
    theirs = {message.name: message for message in database.messages}
    for native, layout, is_fd in frame_layouts():
        other = theirs.get(layout.name)
        if other is None:
            found.append(f"{layout.name}: missing")
            continue
        frame = (identifier_of(native, layout), layout.length, is_fd)
        got = (other.frame_id, other.length, other.is_fd)
        if frame != got:
            found.append(f"{layout.name}: expected identifier, length and FD {frame}, got {got}")
        found += signal_differences(layout, {signal.name: signal for signal in other.signals})
    return found


def signal_differences(layout: Layout, theirs: dict[str, Any]) -> list[str]:
    """Where signals of one frame differ."""
    found = []
    for signal, start in layout.places:
        name = f"{layout.name}.{signal.name}"
        other = theirs.pop(signal.name, None)
        if other is None:
            found.append(f"{name}: missing")
            continue
        ours = (start, signal.bits, signal.step, signal.first * signal.step, signal.unit)
        got = (other.start, other.length, float(other.scale), float(other.offset), other.unit or "")
        if ours != got or other.is_signed or other.byte_order != "little_endian":
            found.append(f"{name}: expected start, bits, step, offset and unit {ours}, got {got}")
    return found + [f"{layout.name}.{name}: unknown" for name in theirs]
