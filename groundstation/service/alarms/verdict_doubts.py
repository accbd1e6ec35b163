"""What a verdict rests on, found in its parts: the deviations, and everything that makes them doubtful now."""

from __future__ import annotations

import math
from collections.abc import Iterator

from groundstation.config import GroundConfig
from groundstation.service.alarms.rig_alarms import RigAlarms
from groundstation.service.alarms.verdict import Known
from groundstation.service.alarms.verdict_words import VerdictDoubt
from groundstation.service.hole.examined_hole import UNSOLVED
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.setup.readiness import told_briefly
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_checks import (
    contradicted_kinds,
    say_contradiction,
    say_unchecked,
    unchecked_kinds,
)
from groundstation.service.setup.setup_items import missing_names, setup_items
from groundstation.service.string.known_string import KnownString

BEHIND = 1.5  # tubes by which the deepest survey may be behind the bit
ALARMS = {
    "depth_refused": VerdictDoubt.DEPTH,
    "depth_contradicts": VerdictDoubt.DEPTH,
    "depth_silent": VerdictDoubt.STALE,
    "clock": VerdictDoubt.CLOCK,
    "lease": VerdictDoubt.STALE,
    "same_number": VerdictDoubt.SETUP,
}


def known_of(
    config: GroundConfig, string: KnownString, setup: SetupBook, hole: SurveyedHole, alarms: RigAlarms
) -> Known:
    """What is known of the way of the hole."""
    design = config.design
    worst = hole.deviations.worst(first=1)
    return Known(
        target=design.length,
        curvature=math.radians(config.steering_deg_per_m),
        stop=config.tube_length,
        bit=string.bit,
        worst=worst,
        projection=hole.projection if worst is not None else None,
        unfound=_unfound_by_look(hole),
        drift=_unfound_by_drift(hole),
        doubts=(
            *_doubts_of_setup(config, setup, string),
            *_doubts_of_time(string, alarms, config.stale_after),
            *_doubts_of_surveys(string, hole, alarms, BEHIND * config.tube_length),
            *_contradictions(hole),
        ),
    )


def _unfound_by_look(hole: SurveyedHole) -> float:
    """By how much (m) the toe may be off if the tube errs that read the last station alone."""
    examined = hole.examined if hole.is_adjusted else None
    alone = None if examined is None else examined.last_look
    return 0.0 if alone is None else alone.toe


def _unfound_by_drift(hole: SurveyedHole) -> float:
    """By how much (m) the toe may be off if the encoder slips at every stop, too little to be found."""
    examined = hole.examined if hole.is_adjusted else None
    drift = None if examined is None else examined.unseen_drift
    return 0.0 if drift is None else drift.toe


def _doubts_of_setup(config: GroundConfig, setup: SetupBook, string: KnownString) -> Iterator[tuple[VerdictDoubt, str]]:
    """Without north, or the angle of a joint, no azimuth is known; what was told once may be a slip."""
    if missing := missing_names(setup_items(config, setup, string)):
        yield VerdictDoubt.SETUP, f"not told: {told_briefly(missing)}"
    for kind in contradicted_kinds(setup):
        yield VerdictDoubt.CONTRADICTION, say_contradiction(setup, kind)
    if unchecked := unchecked_kinds(setup):
        yield VerdictDoubt.UNCHECKED, say_unchecked(unchecked)


def _doubts_of_surveys(
    string: KnownString, hole: SurveyedHole, alarms: RigAlarms, behind: float
) -> Iterator[tuple[VerdictDoubt, str]]:
    """What is doubtful of depth and surveys; the deepest may be ``behind`` the bit (m)."""
    for alarm in alarms:
        if alarm.kind.code in ALARMS:
            yield ALARMS[alarm.kind.code], f"{alarm.subject}: {alarm.detail}"
    stations = [station for station in hole.stations if station.md > 0.0]
    if not stations:
        return
    deepest, bit = stations[-1], string.bit
    if bit is not None and bit - deepest.md > behind:
        yield VerdictDoubt.STALE, f"the bit is at {bit:.1f} m, the deepest survey at {deepest.md:.1f} m"
    for md in hole.turned_back:
        yield VerdictDoubt.YAW, f"the survey at {md:.1f} m points back up the hole"
    if not deepest.is_trusted:
        yield VerdictDoubt.YAW, f"the yaw of the survey at {deepest.md:.1f} m is untrusted"


def _contradictions(hole: SurveyedHole) -> Iterator[tuple[VerdictDoubt, str]]:
    """What is wrong with the hole and may be one thing or another."""
    if not hole.is_adjusted:
        return
    if hole.is_unsolved:
        yield VerdictDoubt.CONTRADICTION, UNSOLVED
    for sentence in hole.examined.doubts if hole.examined is not None else ():
        yield VerdictDoubt.CONTRADICTION, sentence


def _doubts_of_time(string: KnownString, alarms: RigAlarms, stale_after: float) -> Iterator[tuple[VerdictDoubt, str]]:
    """Silence is judged by when messages arrive."""
    if not string.time.is_known:
        yield VerdictDoubt.CLOCK, "rig time is not known: the encoder is not heard"
    if string.bit is None:
        yield VerdictDoubt.DEPTH, "no depth of the bit is known"
    elif string.depth_age > stale_after and not alarms.stands("depth_silent", "depth"):
        yield VerdictDoubt.STALE, "no reading of the depth comes"
    if silent := string.silent:
        yield VerdictDoubt.STALE, f"silent: tube{'s' if len(silent) > 1 else ''} {', '.join(map(str, silent))}"
    elif not string.tubes:
        yield VerdictDoubt.STALE, "no tube has been heard"
