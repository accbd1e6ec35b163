"""Which end of which tube faces which: at the joints of a string, by cable at the surface, by radio over several."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final

from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.stepped import Due

FRAME_AT: Final = {Side.UPPER: Due.UPPER_FRAME, Side.LOWER: Due.LOWER_FRAME}  # event of a frame that comes in at an end


def join_ends(string: tuple[int, ...], *, open_top: bool) -> dict[tuple[int, Side], tuple[int, Due]]:
    """Where what a port sends comes in, of tubes that hang, top first; not through an open joint at the head."""
    ends = {}
    for upper, lower in itertools.pairwise((BASE, ENCODER, *string)):
        if upper == ENCODER and open_top:
            continue
        ends[upper, Side.LOWER] = lower, FRAME_AT[Side.UPPER]
        ends[lower, Side.UPPER] = upper, FRAME_AT[Side.LOWER]
    return ends


def radio_hearers(
    string: tuple[int, ...], sender: int, side: Side, reach: int, *, open_top: bool
) -> Iterator[tuple[int, Due, tuple[int, ...]]]:
    """Who hears what a port radiates within its ``reach``, at which end, and the tubes below the joints on the way.

    It does not pass an open joint at the head, and who is no part of the string is heard by none.
    """
    chain = (ENCODER, *string)
    if sender not in chain:
        return
    place = chain.index(sender)
    for away in range(1, reach + 1):
        other = place + (away if side is Side.LOWER else -away)
        if not 0 <= other < len(chain) or (open_top and 0 in (place, other)):
            return
        joints = chain[min(place, other) + 1 : max(place, other) + 1]
        yield chain[other], FRAME_AT[Side.UPPER if side is Side.LOWER else Side.LOWER], joints


def is_cable(address: int, side: Side) -> bool:
    """Whether a port is of the cable between the base station and the drive head."""
    return address == BASE or (address == ENCODER and side is Side.UPPER)
