"""Which medium carries the frames of which joint in a simulated rig."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, TypeAlias

from sim.can.can_hub import running_hub
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.messages import BASE, ENCODER, Side

Transport: TypeAlias = Literal["zenoh", "can", "can-classic"]
CHOICES: dict[str, tuple[Transport, ...]] = {
    "zenoh": ("zenoh",),
    "can": ("can",),
    "can-classic": ("can-classic",),
    "mixed": ("can", "can-classic", "zenoh"),
}
FRAMES = {"can": "fd", "can-classic": "classic"}


@dataclass(frozen=True, slots=True)
class Transports:
    """Media of a rig's joints: the one above tube 1 has the first of ``turn``, those above it the others in turn.

    The base station and the upper end of the encoder are on zenoh, as where a ground station stands above a string
    on CAN. ``hub`` is the UDP port of the simulated segments.
    """

    turn: Sequence[Transport] = ("zenoh",)
    hub: int = 0

    @property
    def need_hub(self) -> bool:
        """Whether any joint is on CAN."""
        return any(transport != "zenoh" for transport in self.turn)

    def medium_of(self, address: int, side: Side) -> str | None:
        """Medium of one end, as ``telemetry.media.media_table`` names it; None: the rig's zenoh session."""
        if address == BASE or (address, side) == (ENCODER, Side.UPPER):
            return None
        joint = len(self.turn) - 1 if address == ENCODER else address - (1 if side is Side.UPPER else 2)
        transport = self.turn[joint % len(self.turn)]
        return None if transport == "zenoh" else f"can:{self.hub},interface={INTERFACE},frames={FRAMES[transport]}"

    def media_of(self, address: int) -> dict[Side, str]:
        """Media of the ends of one process that are not on zenoh."""
        media = {side: self.medium_of(address, side) for side in Side}
        return {side: medium for side, medium in media.items() if medium is not None}


@contextmanager
def open_transports(chosen: str | None, otherwise: Sequence[Transport]) -> Iterator[Transports]:
    """Transports of a rig: the choice of its operator or else of its scenario, with the hub that they need."""
    turn = CHOICES[chosen] if chosen is not None else tuple(otherwise)
    transports = Transports(turn)
    if not transports.need_hub:
        yield transports
        return
    with running_hub() as hub:
        yield Transports(turn, hub.port)
