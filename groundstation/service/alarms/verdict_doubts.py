"""What a verdict rests on, found in the model: the deviations, and everything that makes them doubtful now."""

from __future__ import annotations

import math
from collections.abc import Iterator

from groundstation.service.alarms.verdict import Doubt, Known
from groundstation.service.answers.model import RigModel

BEHIND = 1.5  # tubes by which the deepest survey may be behind the bit
ALARMS = {
    "depth_refused": Doubt.DEPTH,
    "depth_contradicts": Doubt.DEPTH,
    "depth_silent": Doubt.STALE,
    "clock": Doubt.CLOCK,
}


def known_of(k: RigModel) -> Known:
    """What the model knows of the way of the hole."""
    design = k.config.design
    worst = k.hole.deviations.worst(first=1)
    return Known(
        target=design.length,
        curvature=math.radians(k.config.steering_deg_per_m),
        bit=k.depths.latest,
        worst=worst,
        projection=k.hole.projection if worst is not None else None,
        doubts=tuple(_doubts(k)),
    )


def _doubts(k: RigModel) -> Iterator[tuple[Doubt, str]]:
    yield from _doubts_of_time(k)
    for alarm in k.rig_alarms:
        if alarm.kind.code in ALARMS:
            yield ALARMS[alarm.kind.code], f"{alarm.subject}: {alarm.detail}"
    stations = [station for station in k.stations if station.md > 0.0]
    if not stations:
        return
    deepest, bit = stations[-1], k.depths.latest
    if bit is not None and bit - deepest.md > BEHIND * k.config.tube_length:
        yield Doubt.STALE, f"the bit is at {bit:.1f} m, the deepest survey at {deepest.md:.1f} m"
    if not deepest.is_trusted:
        yield Doubt.YAW, f"the yaw of the survey at {deepest.md:.1f} m is untrusted"


def _doubts_of_time(k: RigModel) -> Iterator[tuple[Doubt, str]]:
    """Silence is judged by when messages arrive."""
    if not math.isfinite(k.rig_now):
        yield Doubt.CLOCK, "rig time is not known: the encoder is not heard"
    if k.depths.latest is None:
        yield Doubt.DEPTH, "no depth of the bit is known"
    elif k.now - k.depth_heard_at > k.config.stale_after and not k.rig_alarms.stands("depth_silent", "depth"):
        yield Doubt.STALE, "no reading of the depth comes"
    silent = [tube for tube in k.tally.tubes if k.is_stale(tube)]
    if silent:
        yield Doubt.STALE, f"silent: tube{'s' if len(silent) > 1 else ''} {', '.join(map(str, silent))}"
    elif not k.tally.tubes:
        yield Doubt.STALE, "no tube has been heard"
