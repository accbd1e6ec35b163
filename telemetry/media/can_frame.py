"""A CAN frame as Linux lays it out (``struct can_frame``, ``struct canfd_frame``), which the loopback bus carries too.

Source: include/uapi/linux/can.h and can/error.h.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000  # flags of can_id
IDENTIFIER = 0x1FFFFFFF
ERROR_CONTROLLER, ERROR_PROTOCOL, ERROR_ACK, ERROR_BUS_OFF = 0x04, 0x08, 0x20, 0x40  # classes of an error frame
RX_OVERFLOW = 0x01  # data[1] of a controller error
BIT_RATE_SWITCH, ERROR_PASSIVE, IS_FD = 0x01, 0x02, 0x04  # flags of an FD frame
FD_FLAGS = BIT_RATE_SWITCH | IS_FD
OWN = 0x01  # in a reserved byte of the loopback bus: the receiver's own frame, now acknowledged
CLASSIC = struct.Struct("<IBBBB8s")
FD = struct.Struct("<IBBBB64s")
HEAD = struct.Struct("<IB")  # what either begins with: identifier and length
OWN_FRAME = 1 << 32  # beside the flags of Linux in an identifier that is handed on: an own frame, acknowledged
HEADER = 8  # bytes before the data
LENGTH_AT, OWN_AT, COUNT_AT = 4, 6, 7  # places of bytes in it
Arrival = tuple[int, bytes]  # identifier with its flags, and data


@dataclass(frozen=True, slots=True)
class CanFrame:
    """One frame; ``can_id`` has the flags of Linux in its highest three bits."""

    can_id: int
    data: bytes = b""
    fd: bool = False
    own: bool = False

    @property
    def is_error(self) -> bool:
        """Whether the frame is an error report of the controller."""
        return bool(self.can_id & ERROR)

    @property
    def rank(self) -> int:
        """Rank in arbitration, the smaller wins: an identifier of 11 bit before one of 29 with the same start."""
        if self.can_id & EXTENDED:
            return (self.can_id & IDENTIFIER) << 1 | 1
        return (self.can_id & 0x7FF) << 19

    def pack(self, count: int = 0) -> bytes:
        """Bytes on the loopback bus; ``count`` numbers what one receiver gets, modulo 256."""
        layout = FD if self.fd else CLASSIC
        flags = BIT_RATE_SWITCH if self.fd else 0
        return layout.pack(self.can_id, len(self.data), flags, OWN if self.own else 0, count & 0xFF, self.data)


def unpack_frame(datagram: bytes) -> tuple[CanFrame, int]:
    """Frame and its number.

    Raises
    ------
    ValueError
        When the bytes are not a frame.
    """
    fd = len(datagram) == FD.size
    if not fd and len(datagram) != CLASSIC.size:
        raise ValueError(f"CAN frame: expected {CLASSIC.size} or {FD.size} bytes, got {len(datagram)}")
    can_id, length, _flags, reserved, count, data = (FD if fd else CLASSIC).unpack(datagram)
    if length > len(data):
        raise ValueError(f"CAN frame: expected a length of at most {len(data)}, got {length}")
    return CanFrame(can_id, data[:length], fd, bool(reserved & OWN)), count


def is_frame(datagram: bytes) -> bool:
    """Return whether ``unpack_frame`` accepts the datagram."""
    return len(datagram) in (FD.size, CLASSIC.size) and datagram[LENGTH_AT] <= len(datagram) - HEADER


def arrival_of(datagram: bytes) -> Arrival:
    """Return identifier and data of a datagram that is a frame, as a port takes them."""
    identifier, length = HEAD.unpack_from(datagram)
    return identifier | (OWN_FRAME if datagram[OWN_AT] & OWN else 0), datagram[HEADER : HEADER + length]


def error_frame(error_class: int, detail: int = 0) -> CanFrame:
    """Return a frame by which a controller reports an error to its own computer."""
    return CanFrame(ERROR | error_class, bytes([0, detail, 0, 0, 0, 0, 0, 0]))
