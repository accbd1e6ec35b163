"""A blunder in a driller's words: what, how large with its +-, from where on, and what else it may be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunders import Blunder, Explanation
from groundstation.survey.adjustment.hypotheses import BY_DEPTH, OF_FORCE, Hypothesis
from groundstation.survey.adjustment.run_of_stops import RunOfStops

Array = npt.NDArray[np.float64]
STANDARD_GRAVITY = 9.80665
HOUR = 3600.0
K = BlunderKind
SENTENCES: Mapping[BlunderKind, str] = {
    K.BIAS_STEPPED: "accelerometer of tube {tube} steps by {size} from the stop at {depth} on",
    K.BIAS_CREEPS: "accelerometer of tube {tube} creeps by {size} since the stop at {depth}",
    K.BIAS_WRONG: "accelerometer of tube {tube} is off by {size}, more than was told of it",
    K.TILT_SLIPPED: "mount of tube {tube} tilted by {size} from the stop at {depth} on",
    K.TILT_WRONG: "mount of tube {tube} is tilted by {size}, more than was told of it",
    K.MOUNT_TURNED: "mount of tube {tube} turned by {size} from the stop at {depth} on",
    K.MOUNT_MISREAD: "turn of the mount of tube {tube} is off by {size}, more than was told of it",
    K.JOINT_SLIPPED: "joint above tube {tube} slipped by {size} from the stop at {depth} on",
    K.JOINT_MISREAD: "angle of the joint above tube {tube} is off by {size}, more than was told of it",
    K.ENCODER_SLIPPED: "encoder slipped by {size} from the stop at {depth} on",
    K.ENCODER_DRIFTS: "encoder slips by {size} at every stop",
    K.HOLE_MOVED: "hole moved by {size} between {first} and {last} before the stop at {depth}",
    K.DEPTH_WRONG_ONCE: "depth at the stop at {depth} is off by {size}",
    K.DEPTH_WRONG_FROM: "depth is off by {size} from the stop at {depth} on",
    K.AXES_EXCHANGED: "x and y of tube {tube} are exchanged from the stop at {depth} on",
    K.TUBES_EXCHANGED: "tubes {tube} and {other} are exchanged",
    K.LOOK_WRONG: "reading of tube {tube} at the stop at {depth} is off by {size}",
    K.COLLAR_WRONG: "direction at the collar is off by {size}, more than was told of it or of north",
}

AGAIN = "survey again, the string turned to another angle: the readings do not tell which of the two it is"
ADVICE: Mapping[BlunderKind, str] = {
    **dict.fromkeys(
        (K.BIAS_STEPPED, K.BIAS_CREEPS, K.BIAS_WRONG),
        "go on, it is put right; calibrate tube {tube} or change it when it is out",
    ),
    **dict.fromkeys((K.TILT_SLIPPED, K.TILT_WRONG), "go on, it is put right; align tube {tube} by slow turns"),
    **dict.fromkeys((K.MOUNT_TURNED, K.MOUNT_MISREAD), "go on, it is put right; look at the mount of tube {tube}"),
    **dict.fromkeys((K.JOINT_SLIPPED, K.JOINT_MISREAD), "read the mark above tube {tube} again and tell that joint"),
    K.ENCODER_SLIPPED: "look at belt and counter of the encoder, and tell north again",
    K.ENCODER_DRIFTS: "stop, tighten the belt of the encoder, and tell north again",
    K.HOLE_MOVED: "survey again: what was read there before counts as of then",
    K.COLLAR_WRONG: "measure the direction at the collar and north again, and tell them",
    K.DEPTH_WRONG_ONCE: "go on, it is put right; measure the depth by hand at the next stop",
    K.DEPTH_WRONG_FROM: "measure the depth by hand, and put its source right",
    K.AXES_EXCHANGED: "go on, it is put right; look at the sensor of tube {tube} when it is out",
    K.TUBES_EXCHANGED: "look which of tubes {tube} and {other} hangs where",
    K.LOOK_WRONG: "go on, it is put right; survey again with tube {tube}",
}


MISTAKES: Mapping[BlunderKind, str] = {
    K.BIAS_STEPPED: "a step of the accelerometer of tube {tube}",
    K.TILT_SLIPPED: "a mount of tube {tube} that tilts",
    K.MOUNT_TURNED: "a mount of tube {tube} that turns",
    K.JOINT_SLIPPED: "a slip of the joint above tube {tube}",
    K.ENCODER_SLIPPED: "a slip of the encoder",
    K.ENCODER_DRIFTS: "a slip of the encoder at every stop",
    K.DEPTH_WRONG_ONCE: "a wrong depth at this stop",
}


def name_mistake(one: Hypothesis, tubes: Sequence[str]) -> str:
    """What may go wrong at a stop, for a crew."""
    return MISTAKES[one.kind].format(tube=tubes[one.subject[0]] if one.subject else "")


def advise_crew(blunder: Blunder, tubes: Sequence[str]) -> str:
    """What is to be done about a blunder."""
    if blunder.is_doubt:
        return AGAIN
    one = blunder.best.hypothesis
    return ADVICE[one.kind].format(**name_tubes(one, tubes))


def name_tubes(one: Hypothesis, tubes: Sequence[str]) -> dict[str, str]:
    """Names of the tubes that an explanation is about; none where it is about the hole, whose stations it counts."""
    if not one.subject or one.kind is K.HOLE_MOVED:
        return {}
    return {"tube": tubes[one.subject[0]], "other": tubes[one.subject[-1]]}


def say_blunder(blunder: Blunder, run: RunOfStops, tubes: Sequence[str]) -> str:
    """A blunder as a sentence; of a doubt both explanations.

    Parameters
    ----------
    run : gives the depth of stops and stations
    tubes : names of tubes by their places
    """
    best = say_explanation(blunder.best, run, tubes)
    if blunder.second is None or not blunder.is_doubt:
        return best
    return f"{best}, or {say_explanation(blunder.second, run, tubes)}: the readings do not tell which"


def say_explanation(one: Explanation, run: RunOfStops, tubes: Sequence[str]) -> str:
    """One explanation as a sentence."""
    kind, subject = one.hypothesis.kind, one.hypothesis.subject
    words = {"size": say_size(one), "depth": f"{run.md[one.hypothesis.stop]:.1f} m"} | name_tubes(one.hypothesis, tubes)
    if kind is K.HOLE_MOVED:
        words |= {"first": f"{run.station_md[subject[0]]:.1f} m", "last": f"{run.station_md[subject[1]]:.1f} m"}
    return SENTENCES[kind].format(**words)


def say_size(one: Explanation) -> str:
    """Size of a blunder with its standard deviation and unit, such as "17.0 ± 0.2 mg"; nothing where it is known."""
    if not len(one.size):
        return ""
    size, std = length_of(one.size, one.cov)
    unit, factor = unit_of(one.hypothesis.kind)
    size, std = size * factor, std * factor
    digits = min(6, max(0, 1 - math.floor(math.log10(std)))) if std > 0.0 else 3
    return f"{size:.{digits}f} ± {std:.{digits}f} {unit}"


def unit_of(kind: BlunderKind) -> tuple[str, float]:
    """Unit that a blunder is told in, and how many of it are one of SI."""
    if kind is K.BIAS_CREEPS:
        return "mg an hour", HOUR * 1e3 / STANDARD_GRAVITY
    if kind in OF_FORCE:
        return "mg", 1e3 / STANDARD_GRAVITY
    if kind in BY_DEPTH:
        return "m", 1.0
    return "deg", 180.0 / math.pi


def length_of(size: Array, cov: Array) -> tuple[float, float]:
    """Length of a blunder and its standard deviation along it; of one number, with its sign."""
    if len(size) == 1:
        return float(size[0]), math.sqrt(float(cov[0, 0]))
    length = float(np.linalg.norm(size))
    along = size / length if length > 0.0 else np.eye(len(size))[0]
    return length, math.sqrt(float(along @ cov @ along))
