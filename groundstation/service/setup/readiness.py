"""Whether a rig is set up to drill: what is missing by name, and what to do next. No I/O."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from groundstation.service.setup.setup_items import ALONG, SetupItem, missing_names
from groundstation.service.setup.told_value import SetupKind

MOST_NAMED = 3  # joints in a line of the verdict
LEAST_TOLD = 0.001  # m at the toe, below which no cost is worth a word
WORTH_TELLING = 0.005  # m at the toe, from which on what was not told is the next thing to tell
WORDS = {
    SetupKind.STICK_UP: "stick-up",
    SetupKind.MOUNT: "tilt of the mount",
    SetupKind.MOUNT_TURN: "turn of the mount",
    SetupKind.PLAY: "tubes askew in the hole",
    SetupKind.PATH: "bends of the hole",
}  # of the other kinds their own name
ORDERS = {
    SetupKind.NORTH: "tell north: cmd/north?action=tell;angle_deg=..;sigma_deg=..",
    SetupKind.COLLAR: "tell the collar: cmd/collar?action=tell;inclination_deg=..;azimuth_deg=..;sigma_deg=..",
    SetupKind.STICK_UP: "tell the stick-up: cmd/stick_up?action=tell;height_m=..;sigma_m=..",
    SetupKind.MOUNT: "align tube {tube} in slow turns: cmd/align?tube={tube}",
    SetupKind.ACCELEROMETER: "calibrate tube {tube}: cmd/recalibrate?action=begin;tubes={tube}",
    SetupKind.LENGTH: "measure tube {tube}: cmd/length?tube={tube};length_m=..;sigma_m=..",
}


CHECK_ORDERS = {
    SetupKind.NORTH: "check north: cmd/north?action=check;angle_deg=..;sigma_deg=..",
    SetupKind.STICK_UP: "check the stick-up: cmd/stick_up?action=check;height_m=..;sigma_m=..",
}


def told_briefly(names: Sequence[str]) -> str:
    """Names of what is missing as a crew says them: ``north, joints 4-3, 3-2 and 2 more``."""
    joints = [name.partition(".")[2] for name in names if name.startswith(f"{SetupKind.JOINT}.")]
    others = [name for name in names if not name.startswith(f"{SetupKind.JOINT}.")]
    if not joints:
        return ", ".join(others)
    more = f" and {len(joints) - MOST_NAMED} more" if len(joints) > MOST_NAMED else ""
    return ", ".join([*others, f"joint{'s' if len(joints) > 1 else ''} {', '.join(joints[:MOST_NAMED])}{more}"])


def say_hold(missing: Sequence[str], unchecked: Sequence[str], contradicted: Sequence[str]) -> str:
    """Why a rig is not ready to drill: what is not told, not checked, or told one way and checked another."""
    told = [f"not told: {', '.join(missing)}"] * bool(missing)
    return "; ".join([*told, *[f"not checked: {', '.join(unchecked)}"] * bool(unchecked), *contradicted])


def words_of(item: SetupItem) -> str:
    """Name of an item for people: ``accelerometer of tube 3``."""
    words = WORDS.get(item.kind, item.kind.value.replace("_", " "))
    if item.kind is SetupKind.JOINT:
        return f"{words} {item.subject}"
    return f"{words} of tube {item.subject}" if item.subject else words


def say_worst(items: Sequence[SetupItem], costs: Mapping[str, float]) -> str:
    """Which item costs most at the toe, across the hole, and how much."""
    worst = max(items, key=lambda item: (item.kind not in ALONG, costs.get(item.name, 0.0)))
    cm = 100.0 * costs.get(worst.name, 0.0)
    if cm < 100.0 * LEAST_TOLD and not worst.is_missing:
        return "no item costs as much as a millimetre"
    return f"{words_of(worst)}, {cm:.1f} cm"


def next_step(items: Sequence[SetupItem], costs: Mapping[str, float]) -> str:
    """The one thing to do next: tell what is missing, check what was told once, then what costs most at the toe.

    What moves the toe across the hole comes before what moves it along.
    """
    if missing := missing_names(list(items)):
        return order_of(next(item for item in items if item.name == missing[0]))
    if unchecked := [item for item in items if item.is_unchecked]:
        return CHECK_ORDERS[unchecked[0].kind]
    guessed = [item for item in items if not item.is_told and item.kind in ORDERS]
    worth = [item for item in guessed if costs.get(item.name, 0.0) >= WORTH_TELLING]
    if not worth:
        return "nothing: the setup is told"
    return order_of(max(worth, key=lambda item: (item.kind not in ALONG, costs.get(item.name, 0.0))))


def order_of(item: SetupItem) -> str:
    """How an item is told or measured."""
    if item.kind is SetupKind.JOINT:
        upper, lower = item.subject.split("-")
        drive = ";upper=0" if upper == "drive" else ""
        return f"tell joint {item.subject}: cmd/joint?tube={lower};angle_deg=..;sigma_deg=..{drive}"
    return ORDERS[item.kind].format(tube=item.subject)
