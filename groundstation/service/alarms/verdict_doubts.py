"""What a verdict rests on, found in its parts: the deviations, and everything that makes them doubtful now."""

from __future__ import annotations

import math
from collections.abc import Iterator

from groundstation.config import GroundConfig
from groundstation.service.alarms.rig_alarms import RigAlarms
from groundstation.service.alarms.verdict import Doubt, Known
from groundstation.service.hole.surveyed_hole import Hole
from groundstation.service.string.drill_string import DrillString

BEHIND = 1.5  # tubes by which the deepest survey may be behind the bit
ALARMS = {
    "depth_refused": Doubt.DEPTH,
    "depth_contradicts": Doubt.DEPTH,
    "depth_silent": Doubt.STALE,
    "clock": Doubt.CLOCK,
}


def known_of(config: GroundConfig, string: DrillString, hole: Hole, alarms: RigAlarms) -> Known:
    """What is known of the way of the hole."""
    design = config.design
    worst = hole.deviations.worst(first=1)
    return Known(
        target=design.length,
        curvature=math.radians(config.steering_deg_per_m),
        bit=string.bit,
        worst=worst,
        projection=hole.projection if worst is not None else None,
        doubts=(
            *_doubts_of_time(string, alarms, config.stale_after),
            *_doubts(string, hole, alarms, BEHIND * config.tube_length),
        ),
    )


def _doubts(string: DrillString, hole: Hole, alarms: RigAlarms, behind: float) -> Iterator[tuple[Doubt, str]]:
    """What is doubtful of depth and surveys; the deepest may be ``behind`` the bit (m)."""
    for alarm in alarms:
        if alarm.kind.code in ALARMS:
            yield ALARMS[alarm.kind.code], f"{alarm.subject}: {alarm.detail}"
    stations = [station for station in hole.stations if station.md > 0.0]
    if not stations:
        return
    deepest, bit = stations[-1], string.bit
    if bit is not None and bit - deepest.md > behind:
        yield Doubt.STALE, f"the bit is at {bit:.1f} m, the deepest survey at {deepest.md:.1f} m"
    if not deepest.is_trusted:
        yield Doubt.YAW, f"the yaw of the survey at {deepest.md:.1f} m is untrusted"


def _doubts_of_time(string: DrillString, alarms: RigAlarms, stale_after: float) -> Iterator[tuple[Doubt, str]]:
    """Silence is judged by when messages arrive."""
    if not string.time.is_known:
        yield Doubt.CLOCK, "rig time is not known: the encoder is not heard"
    if string.bit is None:
        yield Doubt.DEPTH, "no depth of the bit is known"
    elif string.depth_age > stale_after and not alarms.stands("depth_silent", "depth"):
        yield Doubt.STALE, "no reading of the depth comes"
    if silent := string.silent:
        yield Doubt.STALE, f"silent: tube{'s' if len(silent) > 1 else ''} {', '.join(map(str, silent))}"
    elif not string.tubes:
        yield Doubt.STALE, "no tube has been heard"
