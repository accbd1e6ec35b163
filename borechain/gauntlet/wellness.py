"""Whether all is well a minute after the last fault: the next stop surveyed, all live, nothing waiting, no cause left.

What stands without an end is named here, alarm by alarm, with what must have happened to this rig that it may stand: an
alarm that is not named, or that stands without its reason, is not well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from borechain.gauntlet.gauntlet_rig import BIAS_AFTER, GauntletRig
from borechain.gauntlet.oracles import DEPTH_TOLERANCE, is_at_place
from sim.gauntlet.expected_doubts import misled_by
from sim.gauntlet.fault import TUBES
from sim.gauntlet.faulty_world import TUBE_LENGTH
from telemetry.application.endpoint_state import parse_state
from telemetry.messages import BASE

ALWAYS = frozenset({"setup", "unchecked"})  # doubts of a verdict: the gauntlet's crew checks no north
OF_ONE_TUBE = frozenset({"uncertain", "yaw", "no_survey"})  # where a tube has lost what it knew
AVERAGED = 21.0  # s into a stop, by which its survey is made
OF_DECEPTION = frozenset({"contradiction", "uncertain", "depth"})  # where what is measured or told is wrong to the end
Row = dict[str, Any]


def still_unwell(rig: GauntletRig) -> Iterator[str]:
    """What of a rig is not well although nothing has failed for a minute, in which it was drilled on and surveyed."""
    if rig.off:
        yield f"without power: {sorted(rig.off)}"
    for address, process in rig.stepper.processes.items():
        if waiting := parse_state(process.endpoint.export_state()).parcels:
            yield f"process {address}: {len(waiting)} messages still wait for their receipts"
    shown = rig.inline.ask("alarms")["rig"]
    if standing := sorted({(row["code"], row["subject"]) for row in shown if not _may_stand(rig, row)}):
        yield f"still stand: {', '.join(f'{code} of {subject}' for code, subject in standing)}"
    yield from (f"tube {tube}: {found} at the last stop" for tube, found in _unsurveyed(rig))
    if doubts := sorted(set(rig.inline.ask("verdict")["doubts"]) - _doubts_left(rig)):
        yield f"the verdict is not live: {', '.join(doubts)}"


def unready_tubes(rig: GauntletRig) -> set[int]:
    """Tubes that have lost their memory, and not rested since for long enough to know their gyroscopes."""
    since = _drilled_on(rig) - BIAS_AFTER
    return {tube for tube, at in rig.forgot_at.items() if max(at, rig.spoiled_until.get(tube, at)) > since}


def odd_tubes(rig: GauntletRig) -> set[int]:
    """Tubes whose force is not of gravity's size, since before the survey of the last stop was made and to its end.

    Gravity has one size, however a tube leans. A node that stands still must not average another force: what is left of
    the stop once it knows that is too short for a second average. So no survey is owed; that it is missing, or of no
    gravity, is to be told.
    """
    stop = next(phase for phase in reversed(rig.world.phases) if phase.kind == "stop")
    made = stop.start + AVERAGED
    return {tube for tube, (since, until) in rig.world.odd.items() if since < made and until > stop.end}


def _unsurveyed(rig: GauntletRig) -> Iterator[tuple[int, str]]:
    """Tubes whose survey of the last stop is not there once, or not fully believed, and what is there."""
    if "depth" in misled_by(rig.world.deceptions):
        return  # where it stood is told wrongly to the end
    odd = odd_tubes(rig)
    for tube in set(TUBES) - unready_tubes(rig):
        rows = [row for row in _measured(rig, tube) if is_at_place((tube, row["md_m"]), [_place(rig, tube)])]
        found = [row["trust"] for row in rows]
        if tube in odd:
            if any("gravity" not in row["quality"] for row in rows) or not (rows or _is_told_missing(rig, tube)):
                yield tube, f"{' and '.join(found) or 'no survey'} of an odd force, which is not told,"
        elif found != ["full"]:
            yield tube, " and ".join(found) or "no survey"


def _is_told_missing(rig: GauntletRig, tube: int) -> bool:
    """Whether an alarm says that the survey of a tube at the last stop is missing."""
    return any(
        row["code"] == "survey_missing" and _is_of_last_stop(rig, row) and tube in _numbers(row["detail"])
        for row in rig.inline.ask("alarms")["rig"]
    )


def _is_of_last_stop(rig: GauntletRig, row: Row) -> bool:
    """Whether a survey that is missing is one of the last stop."""
    return abs(float(row["subject"].split()[2]) - rig.world.bit_depth(rig.world.end)) <= DEPTH_TOLERANCE


def _doubts_left(rig: GauntletRig) -> set[str]:
    """Doubts of the verdict that a minute does not take away."""
    left = set(ALWAYS)
    if unready_tubes(rig):
        left |= OF_ONE_TUBE
    if rig.world.deceptions or rig.world.slipped:
        left |= OF_DECEPTION
    return left


def _may_stand(rig: GauntletRig, row: Row) -> bool:
    """Whether an alarm may stand in a rig that is well: a notice, or the word of what will not come back."""
    reason = REASONS.get(row["code"])
    return row["level"] == "notice" or (reason is not None and reason(rig, row))


def _was_missed(rig: GauntletRig, row: Row) -> bool:
    """A survey that is missing is not there, and of an earlier stop, or of a tube that could make none."""
    md, tubes = float(row["subject"].split()[2]), _numbers(row["detail"])
    places = [(tube, md - TUBE_LENGTH * (tube - 1)) for tube in tubes]
    if any(is_at_place((tube, one["md_m"]), places) for tube in tubes for one in _measured(rig, tube)):
        return False
    could_not = unready_tubes(rig) | odd_tubes(rig)
    return not _is_of_last_stop(rig, row) or set(tubes) <= could_not or "depth" in misled_by(rig.world.deceptions)


def _was_untrusted(rig: GauntletRig, row: Row) -> bool:
    """A survey without a yaw is of an earlier stop, or of a tube that cannot know it yet."""
    (tube,) = _numbers(row["subject"])
    early = [one for one in _measured(rig, tube) if not is_at_place((tube, one["md_m"]), [_place(rig, tube)])]
    return tube in unready_tubes(rig) or any(one["trust"] == "unknown_yaw" for one in early)


def _was_unplaced(rig: GauntletRig, row: Row) -> bool:
    """A survey that no depth brackets is of before the string was drilled on; or the depth is wrong to the end."""
    if "depth" in misled_by(rig.world.deceptions) or rig.ground is None:
        return True
    now = rig.ground.model.string.time
    since = now.rig_now - (rig.now - _drilled_on(rig))
    waiting = [one.message for one in rig.ground.model.placement.waiting]
    return all(m.epoch != now.epoch or m.station_at < since for m in waiting if f"tube {m.tube}" == row["subject"])


def _was_lost(rig: GauntletRig, row: Row) -> bool:
    """Numbers that will not come were in a database or a memory that was changed from outside."""
    return bool(rig.disk(BASE).handled or any(rig.disk(tube).handled for tube in TUBES))


REASONS: dict[str, Callable[[GauntletRig, Row], bool]] = {
    "survey_missing": _was_missed,
    "survey_set_aside": lambda rig, _: rig.world.spoiled,
    "survey_untrusted": _was_untrusted,
    "survey_unplaced": _was_unplaced,
    "numbers_lost": _was_lost,
    "database": lambda rig, _: bool(rig.disk(BASE).handled),  # a disk that rots is told until the next start
    "tube_sensor": lambda rig, row: bool(set(_numbers(row["subject"])) & unready_tubes(rig)),
    "blunder": lambda rig, _: bool(rig.world.deceptions),
    "joint": lambda rig, _: bool(rig.world.deceptions),
    "depth_contradicts": lambda rig, _: "depth" in misled_by(rig.world.deceptions),
}


def _measured(rig: GauntletRig, tube: int) -> list[Row]:
    return [row for row in rig.inline.ask("measurements")["measurements"] if row["tube"] == tube]


def _place(rig: GauntletRig, tube: int) -> tuple[int, float]:
    """A tube and where its node stands at the end, m."""
    return tube, rig.world.bit_depth(rig.world.end) - TUBE_LENGTH * (tube - 1)


def _drilled_on(rig: GauntletRig) -> float:
    """When (s) the string was drilled on after the last fault."""
    return next(phase.start for phase in reversed(rig.world.phases) if phase.kind == "drill")


def _numbers(text: str) -> list[int]:
    return [int(word) for word in text.replace(",", " ").split() if word.isdigit()]
