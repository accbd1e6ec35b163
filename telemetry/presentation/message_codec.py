"""A message to the fields that go on the wire and back, checked both ways by the types made from the schema."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, TypeAlias

from msgspec import DecodeError as MsgspecError
from msgspec import Raw, Struct, ValidationError, convert
from msgspec.msgpack import Decoder
from msgspec.structs import astuple

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import ImuMean, Message, Stand
from telemetry.presentation.wire_structs import struct_of
from telemetry.quantities import ValueKind
from telemetry.schema import SCHEMA, MessageField, MessageSpec

Values: TypeAlias = Sequence[Any]
# the field that msgspec refuses, in what it says
NAMED = re.compile(r"required field `(\w+)`|`\$(?:\.(\w+)|\[(\d+)\])")
REFUSED = (MsgspecError, ValueError, TypeError, RecursionError)  # whatever it raises for bytes


class MessageCodec:
    """One message on the wire, made from its line of the schema; what every message needs is looked up here once.

    Between a message and its bytes stand the values of all its fields in the order of the schema, checked.
    """

    def __init__(self, spec: MessageSpec) -> None:
        sinces = [field.since for field in spec.fields]
        self.name = spec.message.__name__
        if sinces != sorted(sinces):
            raise ValueError(f"{self.name}: expected fields of later schema versions after all others")
        self.kind, self.message, self.newest = spec.kind, spec.message, spec.newest
        names = [field.name for field in spec.fields]
        self.tube_at = names.index("tube") if "tube" in names else None
        self.sequence_at = names.index("sequence") if "sequence" in names else None
        versions = range(1, spec.newest + 1)
        self._structs = {version: struct_of(spec, version) for version in versions}
        self._decoders = {version: Decoder(struct) for version, struct in self._structs.items()}
        self._widths = {version: sum(since <= version for since in sinces) for version in versions}
        self._check: Callable[[Values], Struct] = check_of_values(spec)
        self._newer = [(k, f.since, f.before) for k, f in reversed([*enumerate(spec.fields)]) if f.since > 1]
        self._before = {v: tuple(f.before for f in spec.fields if f.since > v) for v in versions}
        self._makers = [(place, make) for place, field in enumerate(spec.fields) if (make := maker_of(field))]
        self._names = {field.key: field.name for field in spec.fields} | {str(k): name for k, name in enumerate(names)}

    def values_of(self, message: Message) -> Values:
        """Values of the fields of a message.

        Raises
        ------
        EncodeError
            When one is not as the schema says; named.
        """
        values = astuple(message)
        try:
            return astuple(self._check(values))
        except ValidationError:
            pass  # it may be of a type derived from the right one
        try:
            return astuple(self._check(to_plain(values)))
        except ValidationError as error:
            raise EncodeError(f"{self.name}: {name_refusal(error, self._names)}") from error

    def read(self, version: int, body: Raw) -> Values:
        """Values of the body of a payload of a schema version; those of later versions are what stands for them.

        Raises
        ------
        DecodeError
            When one is missing or not as the schema says; named.
        """
        try:
            return astuple(self._decoders[version].decode(body)) + self._before[version]
        except REFUSED as error:
            raise DecodeError(f"{self.name}: {name_refusal(error, self._names)}") from error

    def message_of(self, values: Values) -> Message:
        """Message of the values of its fields."""
        if self._makers:
            made = list(values)
            for place, make in self._makers:
                made[place] = make(made[place])
            values = made
        message: Message = self.message(*values)
        return message

    def body_of(self, values: Values) -> tuple[int, Struct]:
        """Earliest schema version that can say the values, and its body with them."""
        for place, since, before in self._newer:
            if values[place] != before:
                return since, self._structs[since](*values[: self._widths[since]])
        return 1, self._structs[1](*values[: self._widths[1]])


def check_of_values(spec: MessageSpec) -> Callable[[Values], Struct]:
    """Function from the values of all fields of a message to a struct of them, checked; each option takes its time."""
    kinds = {field.kind for field in spec.fields}
    options: dict[str, Any] = {"type": struct_of(spec, spec.newest, as_list=True)}
    if ValueKind.BINARY in kinds:
        options["builtin_types"] = (bytes,)  # else it takes text for encoded bytes
    if kinds & {ValueKind.IMUS, ValueKind.STANDS}:
        options["from_attributes"] = True
    return partial(convert, **options)


def maker_of(field: MessageField) -> Callable[[Any], Any] | None:
    """Function from what comes on the wire to a value of the message, where that is another one."""
    if field.enumeration is not None and issubclass(field.enumeration, enum.Flag):
        return cache(field.enumeration)  # no more numbers than the range of the field has
    return MAKERS.get(field.kind)


def imus_of(imus: tuple[Any, ...]) -> tuple[ImuMean, ...]:
    """Means of the IMUs of a cluster."""
    return tuple([ImuMean(imu.force, imu.force_cov) for imu in imus])


def stands_of(stands: tuple[Any, ...]) -> tuple[Stand, ...]:
    """Stands of the bit."""
    return tuple([Stand(*astuple(stand)) for stand in stands])


def name_refusal(error: Exception, keys: Mapping[str, str]) -> str:
    """What is wrong, after the name of the field that it is wrong with, of those that stand under ``keys``."""
    found = NAMED.search(str(error))
    key = found[found.lastindex or 0] if found else None
    return f"{keys.get(key, key)}: {error}" if key else str(error)


def to_plain(value: Any) -> Any:
    """A value whose type is derived from one of Python's own, as one of that: a number of numpy as a float."""
    if isinstance(value, list | tuple):
        return tuple(map(to_plain, value))
    if isinstance(value, dict):
        return {to_plain(name): to_plain(item) for name, item in value.items()}
    if isinstance(value, ImuMean | Stand):
        return to_plain(astuple(value))
    own = next((kind for kind in (bool, int, float, str) if isinstance(value, kind)), None)
    return value if own is None else own(value)


MAKERS: dict[ValueKind, Callable[[Any], Any]] = {
    ValueKind.IMUS: imus_of,
    ValueKind.STANDS: stands_of,
    ValueKind.SCALARS: dict,  # its own
    ValueKind.VALUES: dict,
}
CODECS: dict[type[Any], MessageCodec] = {spec.message: MessageCodec(spec) for spec in SCHEMA}
CODEC_OF: dict[int, MessageCodec] = {int(codec.kind): codec for codec in CODECS.values()}
