"""What a profile of CAN is: which payloads have a form of their own on the bus, instead of ISO-TP."""

from __future__ import annotations

import importlib
from typing import NamedTuple, Protocol, cast

from telemetry.unwritten import Content

# name -> module with ``open_profile() -> Profile``; imported when it is asked for, for it stands above this room
PROFILES = {"native": "telemetry.presentation.can_native"}
TUNNEL_ALONE = "tunnel"
NAMES = (TUNNEL_ALONE, *PROFILES)


class NativePart(NamedTuple):
    """One frame of a message that has a form of its own: its identifier but for who sends it, and its data."""

    identifier: int
    data: bytes


class Split(NamedTuple):
    """A frame of the link: its parts of a form of their own, and what of it ISO-TP carries."""

    parts: list[NativePart]
    rest: bytes | None


class Profile(Protocol):
    """Forms of one end of a joint."""

    def split(self, content: Content, now: float, *, fd: bool) -> Split:
        """Parts of a frame of the link that is to be sent at ``now`` (s)."""

    def join(self, source: int, type_: int, part: int, data: bytes) -> Content | None:
        """Frame of the link that a part which arrived completes, or None while others are missing.

        Raises
        ------
        TelemetryError
            When it is none of a known form; the message names what is wrong.
        """

    def observe(self, payload: bytes) -> None:
        """See a frame of the link that came by ISO-TP."""


def open_profile(name: str) -> Profile | None:
    """Profile of a name; None for the tunnel, which carries everything as it is."""
    if name == TUNNEL_ALONE:
        return None
    return cast(Profile, importlib.import_module(PROFILES[name]).open_profile())
