"""The native profile's codec in C99: a header and a code, from the table that the DBC file is made from.

Messages are structs of whole steps. What is packed and unpacked is refused as Python refuses it: a frame of another
length, and a value outside the schema by the number of its member.
"""

from __future__ import annotations

import hashlib
import re
from typing import Final, NamedTuple

from telemetry.media.can_identifier import SOURCE_SHIFT
from telemetry.presentation.can_c_fields import WORD_BITS, CField, fields_in_c
from telemetry.presentation.can_dbc import identifier_of
from telemetry.presentation.can_forms import FD_PART, Form
from telemetry.presentation.can_messages import NATIVE, NativeMessage

NATIVE_HEADER, NATIVE_CODE = "borechain_native.h", "borechain_native.c"
PREFIX: Final = "borechain_native_"
HELPERS: Final = """\
/* Bits of data, the lowest of the first byte first. */
static uint32_t get_word(const uint8_t *data, unsigned start, unsigned bits)
{
    uint32_t word = 0u;
    unsigned taken = 0u;
    while (taken < bits) {
        const unsigned offset = (start + taken) & 7u;
        unsigned part = 8u - offset;
        if (part > bits - taken) {
            part = bits - taken;
        }
        word |= (((uint32_t)data[(start + taken) >> 3] >> offset) & ((1u << part) - 1u)) << taken;
        taken += part;
    }
    return word;
}

static uint64_t get_long(const uint8_t *data, unsigned start, unsigned bits)
{
    return ((uint64_t)get_word(data, start + 32u, bits - 32u) << 32) | get_word(data, start, 32u);
}

/* Data begins as zeros. */
static void put_word(uint8_t *data, unsigned start, unsigned bits, uint32_t word)
{
    unsigned given = 0u;
    while (given < bits) {
        const unsigned offset = (start + given) & 7u;
        unsigned part = 8u - offset;
        uint8_t *byte = &data[(start + given) >> 3];
        if (part > bits - given) {
            part = bits - given;
        }
        *byte = (uint8_t)(*byte | (((word >> given) & ((1u << part) - 1u)) << offset));
        given += part;
    }
}

static void put_long(uint8_t *data, unsigned start, unsigned bits, uint64_t value)
{
    put_word(data, start, 32u, (uint32_t)(value & UINT32_MAX));
    put_word(data, start + 32u, bits - 32u, (uint32_t)(value >> 32));
}
"""


class NativeCodec(NamedTuple):
    """The codec in C.

    Attributes
    ----------
    header, code : texts of ``NATIVE_HEADER`` and ``NATIVE_CODE``
    digest : of both, which is in the names that the linker sees
    """

    header: str
    code: str
    digest: str


def write_native_codec() -> NativeCodec:
    """The codec of every message that has signals, the same to the byte from the same schema."""
    messages = [MessageInC(native) for native in NATIVE.values()]
    declared = "\n".join(message.declarations() for message in messages)
    functions = "\n".join(message.functions() for message in messages)
    digest = hashlib.sha256("\0".join((declared, HELPERS, functions)).encode()).hexdigest()[:16]
    names = [name for message in messages for name in message.entries]
    renamed = "\n".join(f"#define {name} {name}_{digest}" for name in names)
    most = max(len(native.classic.layouts) for native in NATIVE.values())
    return NativeCodec(header_text(declared, renamed, most, digest), code_text(functions), digest)


class MessageInC:
    """One message: its struct, its frames and the functions between them."""

    def __init__(self, native: NativeMessage) -> None:
        self._native = native
        self._word = snake_case(native.name)
        self._fields = fields_in_c(native)
        self._struct = f"struct {PREFIX}{self._word}"
        self._macro = f"{PREFIX}{self._word}".upper()
        self.entries = [
            f"{PREFIX}{verb}_{self._word}{suffix}" for suffix in ("", "_classic") for verb in ("pack", "unpack")
        ]

    def declarations(self) -> str:
        """Struct, constants and prototypes."""
        members = "\n".join(
            line for number, field in enumerate(self._fields, 1) for line in member_lines(field, number)
        )
        ages = [field for field in self._fields if field.is_age]
        constants = [
            f"#define {self._macro}_TYPE {int(self._native.kind)}",
            f"#define {self._macro}_LENGTH {self._native.fd.layouts[0].length} /* bytes on CAN FD */",
            f"#define {self._macro}_PARTS {len(self._native.classic.layouts)} /* frames on classic CAN */",
            *(f"#define {self._macro}_INFINITE_{one.name.upper()} {one.literal(one.highest)}" for one in ages),
            *self._identifiers(),
        ]
        lengths = f"extern const uint8_t {PREFIX}{self._word}_lengths[{self._macro}_PARTS];"
        prototypes = "\n".join(f"{one};" for one in self._prototypes())
        return f"{self._struct} {{\n{members}\n}};\n" + "\n".join(constants) + f"\n{lengths}\n{prototypes}\n"

    def functions(self) -> str:
        """The lengths, the check and the functions."""
        pack, unpack, pack_classic, unpack_classic = self._prototypes()
        lengths = ", ".join(f"{layout.length}u" for layout in self._native.classic.layouts)
        check = f"check_{self._word}"
        refuse = f"    const int refused = {check}(values);\n    if (refused != 0) {{\n        return refused;\n    }}"
        return f"""\
const uint8_t {PREFIX}{self._word}_lengths[{self._macro}_PARTS] = {{{lengths}}};

static int {check}(const {self._struct} *values)
{{
{self._checks()}
    return {PREFIX.upper()}TAKEN;
}}

{pack}
{{
{refuse}
    memset(data, 0, {self._macro}_LENGTH);
    data[0] = count;
{self._puts(self._native.fd, "data")}
    return {PREFIX.upper()}TAKEN;
}}

{unpack}
{{
    {self._struct} found;
    int refused;
    if (length != {self._macro}_LENGTH) {{
        return {PREFIX.upper()}BAD_LENGTH;
    }}
{self._gets(self._native.fd, "data")}
{self._answer(check)}
}}

{pack_classic}
{{
    unsigned part;
{refuse}
    memset(data, 0, 8u * {self._macro}_PARTS);
    for (part = 0u; part < {self._macro}_PARTS; part++) {{
        data[part][0] = count;
    }}
{self._puts(self._native.classic, "data[{part}]")}
    return {PREFIX.upper()}TAKEN;
}}

{unpack_classic}
{{
    {self._struct} found;
    int refused;
    unsigned part;
    for (part = 0u; part < {self._macro}_PARTS; part++) {{
        if (lengths[part] != {PREFIX}{self._word}_lengths[part]) {{
            return {PREFIX.upper()}BAD_LENGTH;
        }}
    }}
{self._gets(self._native.classic, "data[{part}]")}
{self._answer(check)}
}}
"""

    def _answer(self, check: str) -> str:
        return (
            f"    refused = {check}(&found);\n    if (refused == 0) {{\n        *values = found;\n    }}\n"
            "    return refused;"
        )

    def _prototypes(self) -> list[str]:
        """Of pack and unpack on CAN FD, then on classic CAN."""
        pack, unpack, pack_classic, unpack_classic = self.entries
        parts = f"[{self._macro}_PARTS]"
        given, found = f"const {self._struct} *values", f"{self._struct} *values"
        return [
            prototype_text(pack, given, "uint8_t count", f"uint8_t data[{self._macro}_LENGTH]"),
            prototype_text(unpack, "const uint8_t *data", "size_t length", found),
            prototype_text(pack_classic, given, "uint8_t count", f"uint8_t data{parts}[8]"),
            prototype_text(unpack_classic, f"uint8_t data{parts}[8]", f"const uint8_t lengths{parts}", found),
        ]

    def _identifiers(self) -> list[str]:
        """Identifiers of sender 0: on CAN FD, and of the first frame on classic CAN."""
        forms = (("", self._native.fd), ("_CLASSIC", self._native.classic))
        return [
            f"#define {self._macro}_IDENTIFIER{suffix} UINT32_C(0x{identifier_of(self._native, form.layouts[0]):08X})"
            for suffix, form in forms
        ]

    def _checks(self) -> str:
        lines = []
        for number, field in enumerate(self._fields, 1):
            if refusals := field.refusals:
                lines.append(f"    if ({' || '.join(refusals)}) {{\n        return {number};\n    }}")
        return "\n".join(lines) if lines else "    (void)values;"

    def _puts(self, form: Form, data: str) -> str:
        return "\n".join(
            f"    {put_line(field, data.format(part=f'{frame}u'), start)}"
            for field, (frame, start, _) in zip(self._fields, form.places, strict=True)
        )

    def _gets(self, form: Form, data: str) -> str:
        return "\n".join(
            f"    {get_line(field, data.format(part=f'{frame}u'), start)}"
            for field, (frame, start, _) in zip(self._fields, form.places, strict=True)
        )


def member_lines(field: CField, number: int) -> list[str]:
    """A member of the struct with its meaning above it, and what answers where it is refused."""
    return [f"    /* {number}: {field.meaning} */", f"    {field.c_type} {field.name};"]


def prototype_text(name: str, *arguments: str) -> str:
    """A prototype, its arguments on lines of their own."""
    return f"int {name}(\n    " + ",\n    ".join(arguments) + ")"


def put_line(field: CField, data: str, start: int) -> str:
    """Line that writes a member."""
    value = f"values->{field.name}"
    if field.bits > WORD_BITS:
        raw = f"(uint64_t)({value} - {field.literal(field.first)})" if field.first else value
        return f"put_long({data}, {start}u, {field.bits}u, {raw});"
    raw = f"(uint32_t)({value} - {field.literal(field.first)})" if field.first else value
    return f"put_word({data}, {start}u, {field.bits}u, {raw});"


def get_line(field: CField, data: str, start: int) -> str:
    """Line that reads a member."""
    is_long = field.bits > WORD_BITS
    raw = f"get_{'long' if is_long else 'word'}({data}, {start}u, {field.bits}u)"
    if field.first:
        wide = 64 if is_long else WORD_BITS
        raw = f"({f'(int{wide}_t)' if field.is_signed else ''}{raw} + {field.literal(field.first)})"
    is_whole = not field.is_signed and field.type_bits >= WORD_BITS
    return f"found.{field.name} = {'' if is_whole else f'({field.c_type})'}{raw};"


def snake_case(name: str) -> str:
    """A name of a class as words."""
    return re.sub(r"(?<=.)(?=[A-Z])", "_", name).lower()


def header_text(declared: str, renamed: str, most_parts: int, digest: str) -> str:
    """Text of the header."""
    return f"""\
/* Cyclic messages as signals on CAN. Written by `borechain firmware codec` from the table of the DBC file: do not edit.
 *
 * A member is a whole number of its signal's steps. The identifiers are those of sender 0: the address of another one
 * stands {SOURCE_SHIFT} bits up, the part of a message on classic CAN in the lowest five. The first byte of a frame is
 * the count: frames of the link so far, the same in all parts of one message.
 * An answer above 0 is the number of the first member whose value is outside the schema's range; what is refused
 * changes nothing but data that was to be packed.
 * What is called carries the digest of the table in its name: a header of another table does not link.
 */
#ifndef BORECHAIN_NATIVE_H
#define BORECHAIN_NATIVE_H

#include <stddef.h>
#include <stdint.h>

#define {PREFIX.upper()}DIGEST "{digest}"
#define {PREFIX.upper()}TAKEN 0
#define {PREFIX.upper()}BAD_LENGTH (-1)
#define {PREFIX.upper()}MOST_PARTS {most_parts}u /* of a message on classic CAN */
#define {PREFIX.upper()}FD_PART {FD_PART}u /* of a message that is whole in one frame */

{renamed}

{declared}
#endif
"""


def code_text(functions: str) -> str:
    """Text of the code."""
    return f"""\
/* Cyclic messages as signals on CAN. Written by `borechain firmware codec`: do not edit. */
#include "{NATIVE_HEADER}"

#include <string.h>

{HELPERS}
{functions}"""
