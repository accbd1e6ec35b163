"""Identifiers of 29 bit: priority 3, type 5, source 8, destination 8, part 5; the lower goes first.

A joint has two ends and nothing names the neighbour, so the destination is always ``EVERYBODY``.
"""

from __future__ import annotations

from typing import NamedTuple

from telemetry.media.port import Priority

EVERYBODY = 255
# types of the message kinds are their numbers (``telemetry.schema.MessageKind``); those of the medium itself stand
# above
PRESENCE, FLOW_CONTROL, TUNNEL = 29, 30, 31
PART_MASK = 0x1F
SOURCE_SHIFT = 13
PRIORITIES = tuple(Priority)


class Identifier(NamedTuple):
    """Parts of an identifier."""

    priority: Priority
    type: int
    source: int
    part: int = 0
    destination: int = EVERYBODY

    def pack(self) -> int:
        """The 29 bits."""
        return packed_identifier(self.priority, self.type, self.source, self.part, self.destination)

    @classmethod
    def unpack(cls, bits: int) -> Identifier | None:
        """Parts of 29 bits; None where the priority is none of ours."""
        priority = bits >> 26
        if priority >= len(PRIORITIES):
            return None
        source, destination = bits >> SOURCE_SHIFT & 0xFF, bits >> 5 & 0xFF
        return cls(PRIORITIES[priority], bits >> 21 & 0x1F, source, bits & PART_MASK, destination)


def packed_identifier(priority: int, type_: int, source: int, part: int = 0, destination: int = EVERYBODY) -> int:
    """The 29 bits of an identifier of these parts."""
    return priority << 26 | type_ << 21 | source << SOURCE_SHIFT | destination << 5 | part
