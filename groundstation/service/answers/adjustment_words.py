"""What an adjustment comes to in a driller's words, the same on the page, in the terminal and to a client."""

from __future__ import annotations

import math
from typing import Final

from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import name_mistake, unit_of
from groundstation.survey.adjustment.least_found import LARGEST, unfound_across
from groundstation.survey.adjustment.reliability import Reliability

CM: Final = 100.0
NOTHING: Final = "nothing was surveyed below the collar yet"
LEFT_OUT: Final = "mistakes too small to find, and what turns or moves all tubes alike"
SOURCES: Final = {  # in the plural, and of one tube
    "force_noise": ("noise of the accelerometers", ""),
    "yaw_noise": ("noise of the yaws", ""),
    "play": ("tubes that lie askew in the hole", ""),
    "bias": ("accelerometers", ""),
    "tilt": ("mounts that are tilted", ""),
    "mount": ("mounts that are turned", ""),
    "joint": ("angles of the joints", "above "),
    "drive": ("angles of the joints to the drive head", ""),
    "string": ("angles of all joints", ""),
    "turn": ("other turns of the yaws", ""),
    "north": ("north, as it was told", ""),
    "gravity": ("gravity of the site", ""),
    "collar": ("direction at the collar", ""),
    "path": ("bends that no reading shows", ""),
    "legs": ("way of the hole between stations", ""),
    "depth": ("depths and lengths of tubes", ""),
    "blunder": ("mistakes found, whose size is not exact", ""),
}
WORTH_TURNING_CM, WORTH_TURNING_PART = 0.05, 0.05  # of the sigma at the toe
FAR: Final = 4.0  # decimal places of a chance
MOST_TURNED_DEG = 90.0  # of an angle that is a size from which on something is found


def say_fit(surveys: int, wrong: int, doubts: int) -> str:
    """Whether all surveys fit together."""
    readings = f"{surveys} reading{'' if surveys == 1 else 's'}"
    if doubts:
        return f"{readings} contradict each other: it may be one thing or another"
    if wrong:
        return f"{wrong} thing{' is' if wrong == 1 else 's are'} wrong, found among {readings} and put right"
    if surveys == 1:
        return "one reading: nothing to compare it with yet"
    return f"all {readings} fit together: nothing is wrong"


def say_second(sentence: str, decades: float, *, is_doubt: bool) -> str:
    """The second best explanation, and how much less likely it is than the best, in decimal places."""
    odds = "nearly as likely" if is_doubt else "some hundred times less likely" if decades < FAR else "far less likely"
    return f"{sentence} ({odds})"


def say_part(source: str, worst: str) -> str:
    """A source of errors; ``worst`` is the tube that gives most of it, empty where it is of none."""
    words, joined = SOURCES.get(source, (source.replace("_", " "), ""))
    return f"{words} (most: {joined}{worst})" if worst else words


def say_next_stop(turn_deg: float, sigma_cm: float, same_face_cm: float) -> str:
    """The angle of the next stop, and what it is worth."""
    gain = same_face_cm - sigma_cm
    if gain < max(WORTH_TURNING_CM, WORTH_TURNING_PART * same_face_cm):
        return f"any angle: a turn makes the toe no better known (sigma {shown_cm(same_face_cm)} cm)"
    turn, way = (turn_deg, "on") if turn_deg <= math.degrees(math.pi) else (360.0 - turn_deg, "back")
    known = f"sigma at the toe {shown_cm(sigma_cm)} cm, without a turn {shown_cm(same_face_cm)}"
    return f"turn the string {way} by {turn:.0f} deg: {known}"


def shown_cm(cm: float) -> str:
    """A few centimetres or less than one, with as many digits as are worth a look."""
    return f"{cm:.1f}" if cm >= 1.0 else f"{cm:.2f}"


def say_unfound(one: Reliability, tubes: tuple[str, ...]) -> str:
    """From which size on a mistake is found, and what one that is not found does at the toe."""
    kind = one.hypothesis.kind
    name, (unit, factor), size = name_mistake(one.hypothesis, tubes), unit_of(kind), size_found(one)
    moved = f"the toe {shown_cm(CM * unfound_across(one))} cm"
    if size is not None and one.smallest <= LARGEST[kind]:
        return f"{name} is found from {size:.2g} {unit} on; one not found moves {moved} at most"
    least = "" if size is None else f" below {size:.2g} {unit}"
    reason = "no other tube has read there" if kind is BlunderKind.BIAS_STEPPED else "too few other readings tell it"
    return f"{name} is not found{least}: {reason}; {LARGEST[kind] * factor:.2g} {unit} of it move {moved}"


def size_found(one: Reliability) -> float | None:
    """Size from which on a mistake is found, in its unit; None where nothing tells it, or not before all is askew."""
    unit, factor = unit_of(one.hypothesis.kind)
    size = one.smallest * factor
    return None if not math.isfinite(size) or (unit == "deg" and size > MOST_TURNED_DEG) else size
