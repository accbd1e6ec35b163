"""What goes over a CAN joint or by radio as it was read and approved: signals, frames of a bad hour, figures, C.

What a byte stands for is said by docs/borechain.dbc and by the tests beside this one, which hold each figure against a
calculation of its own; here every byte is held. After a change that is meant, run this file with ``.venv/bin/python``
and ``PYTHONPATH=tests/telemetry:tests/tools:.``; the difference is read like code.
"""

from __future__ import annotations

import contextlib
import difflib
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from test_can_exchange import joined

from telemetry.errors import DecodeError, EncodeError
from telemetry.frozen import replace as changed
from telemetry.media.can_exchange import ACKNOWLEDGE_LIMIT
from telemetry.media.can_identifier import Identifier
from telemetry.media.port import PortFrame, Priority
from telemetry.presentation.can_c_codec import write_native_codec
from telemetry.presentation.can_messages import NATIVE, NativeMessage
from telemetry.presentation.can_native import rounded_message
from telemetry.quantities import ValueKind
from telemetry.radio.link_request import PipeRequest, SoilRequest
from telemetry.radio.pipe_links import pipe_result
from telemetry.radio.soil_links import soil_links
from telemetry.schema import SPEC_OF, MessageField

APPROVED = Path(__file__).parents[1] / "data" / "wire"
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
COUNT = 240  # of the frames of a sender so far; ends at 255 and goes on with 0
DRAWN = 20  # messages of each kind


def value_of(field: MessageField, dice: random.Random) -> Any:
    """A value of a field, large or small; at the ends of its range now and then."""
    low, high = max(field.low, -1e4), min(field.high, 1e4)
    match field.kind:
        case ValueKind.BOOLEAN:
            return dice.random() < 0.5
        case ValueKind.INTEGER if field.enumeration is not None:
            return dice.choice(list(field.enumeration))
        case ValueKind.INTEGER:
            return dice.choice([int(low), int(high), dice.randint(int(low), int(high)), dice.randint(0, 40)])
        case ValueKind.VECTOR:
            return tuple(dice.uniform(-0.05, 0.05) for _ in range(3))
        case ValueKind.BINARY:
            return bytes(dice.getrandbits(8) for _ in range(int(field.high)))
        case _ if dice.random() < 0.03:
            return dice.choice([field.low, field.high])
    size = min(high, 10.0) * 10.0 ** dice.uniform(-6.0, 0.0)
    return -size if low < 0.0 and dice.random() < 0.5 else max(size, low)


def signal_lines() -> Iterator[str]:
    """Drawn messages of each kind, in frames of either length, and what is made of them."""
    dice = random.Random(52)
    for native in NATIVE.values():
        for k in range(DRAWN):
            message = native.message(*(value_of(field, dice) for field in SPEC_OF[native.message].fields))
            if k % 10:
                message = changed(message, **{name: before for _, name, before in native._unsaid})
            yield from message_lines(native, message, k)


def message_lines(native: NativeMessage, message: Any, number: int) -> Iterator[str]:
    values = [getattr(message, name) for name in message.__struct_fields__]
    yield f"{native.name} {number}"
    for fd in (False, True):
        try:
            frames = native.pack(values, COUNT + number & 0xFF, fd=fd)
        except EncodeError as error:
            yield f"  {error}"
            continue
        yield f"  {' '.join(frame.hex() for frame in frames)}"
        yield f"  is {native.message(*native.unpack(frames, fd=fd))!r}"
    with contextlib.suppress(EncodeError):
        yield f"  rounded {rounded_message(message)!r}"


def exchange_lines() -> Iterator[str]:
    """A joint whose frames get lost, which opens and closes, while everything waits to go both ways."""
    for largest in (8, 64):
        dice = random.Random(largest)
        upper, lower, wire = joined(largest)
        for k in range(40):
            for end, side in ((upper, "u"), (lower, "l")):
                priority = dice.choice(list(Priority))
                key = dice.choice(["", "", "state"])
                end.queue.offer(PortFrame(f"{side}{k}".encode() * dice.randint(1, 60), priority, key))
            share = 0.2 if 10 < k < 20 else 0.0
            wire.is_lost = lambda dice=dice, share=share: dice.random() < share  # type: ignore[misc]
            wire.is_open = 24 < k < 28
            wire.run(ACKNOWLEDGE_LIMIT if wire.is_open else dice.uniform(0.005, 0.06))
        wire.run(3.0)
        yield f"frames of up to {largest} bytes: {len(wire.sent)}"
        yield from (f"  {at:.3f} {tuple(map(int, identifier))}" for at, identifier in wire.sent)
        for address, heard in wire.heard.items():
            yield from (f"  {address} heard {payload[:4].decode()} {len(payload)}" for payload in heard)
        for _ in range(200):  # garbage, some of it under the address of an end
            identifier = Identifier(dice.randrange(8), dice.choice([29, 30, 31, 3]), dice.choice([1, 2, 9]), 0, 255)
            data = bytes(dice.getrandbits(8) for _ in range(dice.choice([0, 1, 5, 8, largest])))
            for end in (upper, lower):
                with contextlib.suppress(DecodeError):
                    end.on_frame(identifier.pack(), data, wire.now)
            wire.run(0.002)
        for end in (upper, lower):
            yield f"  {end.address} {end.is_up} {dict(end.counters)}"


def radio_lines() -> Iterator[str]:
    """Links through soils and pipes, every figure."""
    soils = (
        SoilRequest(),
        SoilRequest(0.6, 0.1, 1.4, (0.05, 0.3), 17.0, 433.0, (0.25, 1.5), 10.0, 1.5, -110.0),
        SoilRequest(0.15, 0.5, 1.6, (0.12, 0.2), 4.0, 1300.0, (0.15,), -3.0, -2.0, -95.0),
    )
    for soil in soils:
        yield f"{asdict(soil)}"
        yield from (f"  {link}" for link in soil_links(soil))
    pipes = (
        PipeRequest(),
        PipeRequest(4.5, 6.5, "X60 seamless", None, 85.0, 95.0),
        PipeRequest(2.2, 9.0, None, 0.8, 140.0, 70.0),
    )
    for pipe in pipes:
        yield f"{asdict(pipe)}"
        found = pipe_result(pipe)
        yield f"  { ({name: value for name, value in found.items() if name != 'links'}) }"
        yield from (f"  {link}" for link in found["links"])


def codec_lines() -> Iterator[str]:
    """The codec in C."""
    written = write_native_codec()
    yield from (written.header + written.code).splitlines()


DOCUMENTS: dict[str, Callable[[], Iterator[str]]] = {
    "signals.txt": signal_lines, "exchange.txt": exchange_lines, "radio.txt": radio_lines, "codec.c": codec_lines,
}  # fmt: skip


def is_alike(one: str, other: str) -> bool:
    """Whether two lines differ in the last digits of their numbers alone."""
    if NUMBER.split(one) != NUMBER.split(other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(a == b or ("." in a and float(a) == pytest.approx(float(b), rel=1e-9)) for a, b in pairs)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_every_line_is_what_was_approved(name: str) -> None:
    found, kept = list(DOCUMENTS[name]()), (APPROVED / name).read_text(encoding="utf-8").splitlines()
    if len(found) != len(kept) or not all(map(is_alike, found, kept)):
        pytest.fail("\n".join(difflib.unified_diff(kept, found, "approved", "found", lineterm="", n=1)))


if __name__ == "__main__":
    APPROVED.mkdir(exist_ok=True)
    for document, lines in DOCUMENTS.items():
        (APPROVED / document).write_text("\n".join(lines()) + "\n", encoding="utf-8")
