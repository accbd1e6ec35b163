"""How much of its time a joint's bus is busy: by the number of tubes below it, the bit rates and the profile.

Counted over the messages that are sent all the time, worst stuffing: aiding and node states each 1.9 Hz, hellos of both
ends each second and their signs of life, a clock exchange each ten seconds. What ISO-TP's receiver answers counts too.
Under keys every frame of the link has a seal, states and the measurement one of their own, and signals carry nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from telemetry.application.end_seal import OVERHEAD as END_SEAL
from telemetry.application.measurement_seal import SEAL_SIZE
from telemetry.frozen import replace
from telemetry.media.can_exchange import PRESENCE_EVERY
from telemetry.media.can_timing import CLASSIC_LARGEST, FD_LARGEST, BitRates
from telemetry.media.isotp import frame_lengths
from telemetry.messages import Aiding, Hello, Message, NodeFlag, NodeMode, NodeState, TimeReply, TimeRequest
from telemetry.presentation.can_messages import NATIVE
from telemetry.presentation.can_native import HEADER_EVERY
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.schema import SPEC_OF
from telemetry.transport.hop import Header, pack_frame
from telemetry.transport.joint_seal import OVERHEAD as JOINT_SEAL

CYCLE = 1.0 / 1.9  # s
HELLO_PERIOD, SYNC_PERIOD = 1.0, 10.0  # s
PRESENCE_BYTES = 8
PROFILES = ("tunnel", "native")
HEADER = Header(250, 7 << 24 | 1 << 8 | 250, 500_000, 6 << 24 | 249, 3000, 0)
AIDING = Aiding(1.2345678, 2.5e-6, 1.5e-6, -0.123456, 1.2345678, 5000.123456, 3 << 32 | 9000, 24, 480.0, 1e-6, True)
STATE = NodeState(
    24, 5000.123456, 25, NodeMode.TRACKING, 1.2345678, 2.5e-6, 1.5e-6, (1e-3, -2e-3, 3e-3), 1e-3, 1e-4, 3e-6, 0.53,
    1e-8,
    NodeFlag.NONE, 9000, 0, 2, bytes(range(8)), (1e-3, 2e-3, 3e-4),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class RepeatedMessage:
    """A periodic message."""

    message: Message
    rate: float  # 1/s


def steady_traffic(tubes: int, cycle: float = CYCLE) -> list[RepeatedMessage]:
    """Periodic messages over the joint above ``tubes`` tubes while the string turns; ``cycle`` in s."""
    return [
        RepeatedMessage(AIDING, 1.0 / cycle),
        RepeatedMessage(STATE, tubes / cycle),
        RepeatedMessage(Hello(250, 7, 25, NodeMode.TRACKING, 0.99), 2.0 / HELLO_PERIOD),
        RepeatedMessage(TimeRequest(5000.123456), 1.0 / SYNC_PERIOD),
        RepeatedMessage(TimeReply(5000.1, 5000.2, 5000.3, 5000.4, 1.0000012, 1e-8), 1.0 / SYNC_PERIOD),
    ]


def link_bytes(message: Message, *, sealed: bool) -> int:
    """Size (bytes) of a frame of the link that carries only this message."""
    if not sealed:
        return len(pack_frame(HEADER, [(0, encode_message(message))]))
    if isinstance(message, Aiding):
        message = replace(message, seal=bytes(SEAL_SIZE))
    own = bytes(END_SEAL) if isinstance(message, NodeState) else b""
    return JOINT_SEAL + len(pack_frame(HEADER, [(0, own + encode_message(message))]))


def frame_bytes(message: Message, profile: str, *, fd: bool, sealed: bool = False) -> list[int]:
    """Bytes of data in each CAN frame of a message, alone in its frame of the link."""
    if sealed or profile == "tunnel":
        return frame_lengths(link_bytes(message, sealed=sealed), FD_LARGEST if fd else CLASSIC_LARGEST)
    native = NATIVE[SPEC_OF[type(message)].kind]
    return [layout.length for layout in (native.fd if fd else native.classic).layouts]


def message_bus_time(message: Message, profile: str, rates: BitRates, *, fd: bool, sealed: bool = False) -> float:
    """Bus time of a message, s."""
    return sum(rates.duration(length, fd=fd) for length in frame_bytes(message, profile, fd=fd, sealed=sealed))


def header_load(profile: str, rates: BitRates, *, fd: bool, sealed: bool = False) -> float:
    """Share of time in which the bus carries the headers that both ends of the native profile repeat."""
    if sealed or profile == "tunnel":
        return 0.0
    header = frame_lengths(len(pack_frame(HEADER, [])), FD_LARGEST if fd else CLASSIC_LARGEST)
    return 2.0 * sum(rates.duration(length, fd=fd) for length in header) / HEADER_EVERY


def bus_load(traffic: list[RepeatedMessage], profile: str, rates: BitRates, *, fd: bool, sealed: bool = False) -> float:
    """Share of time in which the bus is busy, signs of life included; over 1: more than it can carry."""
    messages = sum(t.rate * message_bus_time(t.message, profile, rates, fd=fd, sealed=sealed) for t in traffic)
    signs = presence_rate(traffic, profile) * rates.duration(PRESENCE_BYTES, fd=fd)
    return messages + header_load(profile, rates, fd=fd, sealed=sealed) + signs


def presence_rate(traffic: list[RepeatedMessage], profile: str) -> float:
    """Signs of life a second (1/s) of the upper end, which sends little; the states below stand for the lower one's."""
    states = sum(t.rate for t in traffic if isinstance(t.message, NodeState))
    own = sum(t.rate for t in traffic if isinstance(t.message, Aiding)) + 1.0 / HELLO_PERIOD
    return max(1.0 / PRESENCE_EVERY - own - (states if profile == "tunnel" else 0.0), 0.0)


def load_table(
    tubes: tuple[int, ...], bitrates: tuple[float, ...], data_ratio: float, *, sealed: bool = False
) -> Iterator[tuple[int, str, str, float, float]]:
    """Tubes, profile, frames, nominal bit rate and load of every combination; FD's data run ``data_ratio`` as fast."""
    for count in tubes:
        for frames in ("classic", "fd"):
            for profile in PROFILES:
                for bitrate in bitrates:
                    rates = BitRates(bitrate, data_ratio * bitrate)
                    busy = bus_load(steady_traffic(count), profile, rates, fd=frames == "fd", sealed=sealed)
                    yield count, profile, frames, bitrate, busy
