"""Which stands of the bit are stops, as they come in. No I/O."""

from __future__ import annotations

from groundstation.service.string.depth import DepthLog
from groundstation.service.string.stops import Stops, is_in_stand
from telemetry.frozen import replace
from telemetry.messages import Stand

FIRST_EPOCH = 1  # of rig time: an encoder that has never started before


def take_stand(depths: DepthLog, stops: Stops, told: Stand) -> None:
    """Remember a stand; one that follows another at a smaller depth is a stop.

    One that follows another at the same depth goes on with its stop: nothing is known of the time in between. One that
    follows a stop that was too short for a survey is one in its place, wherever it is: the string was lifted off. The
    first that is known is a stop where a tube surveyed in it, and where the encoder has started before: who hears first
    then of a string that rests in its hole has lost what came before, and lacks the surveys of it.
    """
    stand = depths.add_stand(told)
    if stand is None:
        return
    whole, before = stand, depths.stand_before(stand)
    while before is not None and (before.epoch, before.md) == (stand.epoch, stand.md):
        whole, before = replace(stand, begun_at=before.begun_at), depths.stand_before(before)
    if before is not None:
        is_stop = before.md < stand.md or (before.md > stand.md and stops.is_too_short(before))
    else:
        is_stop = stand.epoch != FIRST_EPOCH or stops.know(whole) or stops.was_surveyed(whole)
    if is_stop:
        stops.on_stand(whole)
    elif before is not None and before.md == stand.md:
        stops.on_later_stand(before, whole)


def take_survey(depths: DepthLog, stops: Stops, epoch: int, at: float) -> None:
    """Take the first known stand for a stop if a survey was taken in it, at ``at`` (s): its begin was not heard."""
    for first in depths.stands[:1]:
        if is_in_stand(first, epoch, at):
            stops.on_stand(first)
