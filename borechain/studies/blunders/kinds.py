"""Kinds of blunders in three sizes: what becomes of the scenario of a rig, and by which name it is to be found.

What is told of north and of the stick-up is in no reading, or hardly: all are the same, or are moved alike, whatever is
so. A crew checks it by a second reading, which errs as the first may; where it does not, it is told that nothing does.
The small step of the lowest tube at the last stop is in no other look, until the next stop.

The middle of the schedule is when the fifth tube has been drilled; what steps or slips does so then, in a tube that
passes half of the stations afterwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from borechain.studies.drawn_rigs import TUBES, change_tables
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from sim.studies.scenarios import Tables

MIDDLE_S: Final = 640.0  # after the start
LAST_S: Final = 1070.0  # likewise, while the last tube is drilled in
TUBE: Final = 4  # that something happens to; it is in the string at that time, and not at the bit
Change = Callable[[Tables, float], Tables]


@dataclass(frozen=True, slots=True)
class PlantedBlunder:
    """One kind.

    Attributes
    ----------
    name, unit : in words, and of its sizes
    sizes : three, the smallest first; one of what is not told at all, which has no size
    change : the scenario of a rig with it
    named : what the adjustment may call it, see ``groundstation.survey.adjustment``
    seen_by : the check by which alone it is seen, where it is in no reading
    is_drift : the encoder slips at every stop; what it may do unfound is told beside the sigma
    """

    name: str
    unit: str
    sizes: tuple[float, ...]
    change: Change
    named: tuple[str, ...] = ()
    seen_by: str = ""
    is_drift: bool = False


def of_disturbance(name: str, keys: Callable[[float], dict[str, Any]]) -> Change:
    """Change by a disturbance of one tube from the middle on."""

    def change(tables: Tables, size: float) -> Tables:
        own = {"tube": TUBE, "after_s": MIDDLE_S, **keys(size)}
        return change_tables(tables, disturbance={name: own})

    return change


def of_told(keys: Callable[[float], dict[str, Any]]) -> Change:
    """Change of what is told, upon what the draw tells wrongly."""

    def change(tables: Tables, size: float) -> Tables:
        told = tables["told"]
        return change_tables(tables, told={key: add_to(told.get(key), value) for key, value in keys(size).items()})

    return change


def add_to(before: Any, value: Any) -> Any:
    """A drawn error and a blunder together; lengths tube by tube."""
    if isinstance(value, tuple):
        return tuple(a + b for a, b in zip(before or (0.0,) * len(value), value, strict=True))
    return value if before is None or key_is_a_place(value) else before + value


def key_is_a_place(value: Any) -> bool:
    """Whether a value is the number of a tube, that adds to nothing."""
    return isinstance(value, int)


def of_section(section: str, keys: Callable[[float], dict[str, Any]]) -> Change:
    """Change of another section."""
    return lambda tables, size: change_tables(tables, **{section: keys(size)})


def of_tube(tube: int, size: float) -> tuple[float, ...]:
    """A length of one tube among all."""
    return tuple(size * (number == tube) for number in range(1, TUBES + 1))


def leave_unchecked(name: str, change: Change) -> Change:
    """The same, by a crew that takes no second reading of it."""
    return lambda tables, size: change_tables(change(tables, size), setup={"unchecked": (name,)})


def north_told(tables: Tables, deg: float) -> Tables:
    """North is told wrong."""
    return of_told(lambda size: {"north_deg": size})(tables, deg)


def stick_up_told(tables: Tables, m: float) -> Tables:
    """The stick-up is told too high."""
    return of_told(lambda size: {"depth_offset_m": -size})(tables, m)


def moved_stretch(size: float) -> dict[str, Any]:
    """A stretch of the hole about two stations leans over."""
    return {"moved": {"after_s": MIDDLE_S, "from_m": 5.5, "to_m": 8.5, "north_deg": size}}


def in_field(tables: Tables, **keys: dict[str, Any]) -> Tables:
    """The scenario with this of its rough world out of order."""
    return change_tables(tables, rough=keys)


K = BlunderKind
BIAS = (K.BIAS_STEPPED, K.BIAS_CREEPS, K.BIAS_WRONG, K.TILT_SLIPPED, K.TILT_WRONG)  # across a tube they look alike
MOUNT = (K.MOUNT_TURNED, K.MOUNT_MISREAD)
JOINT = (K.JOINT_MISREAD, K.JOINT_SLIPPED, K.MOUNT_MISREAD)
TURN = (K.ENCODER_SLIPPED, K.ENCODER_DRIFTS, K.JOINT_SLIPPED, K.JOINT_MISREAD)
AXES = (K.AXES_EXCHANGED,)
DEPTH = (K.DEPTH_WRONG_ONCE, K.DEPTH_WRONG_FROM)
KINDS: Final[tuple[PlantedBlunder, ...]] = (
    PlantedBlunder(
        "accelerometer steps across", "mg", (0.3, 3.0, 30.0),
        of_disturbance("force-step", lambda mg: {"step_mg": (mg, 0.0, 0.0)}), BIAS,
    ),
    PlantedBlunder(
        "accelerometer steps along", "mg", (0.3, 3.0, 30.0),
        of_disturbance("force-step", lambda mg: {"step_mg": (0.0, 0.0, mg)}), BIAS,
    ),
    PlantedBlunder(
        "accelerometer of the bit steps", "mg", (0.3, 3.0, 30.0),
        of_disturbance("force-step", lambda mg: {"tube": 1, "step_mg": (0.0, mg, 0.0)}), BIAS,
    ),
    PlantedBlunder(
        "accelerometer of the bit steps at the last stop", "mg", (0.3, 3.0, 30.0),
        of_disturbance("force-step", lambda mg: {"tube": 1, "after_s": LAST_S, "step_mg": (mg, mg, 0.0)}), BIAS,
        seen_by="the next stop",
    ),
    PlantedBlunder(
        "accelerometer creeps", "mg/s", (0.001, 0.01, 0.3),
        of_disturbance("force-step", lambda mg: {"creep_mg_per_s": (mg, 0.0, 0.0)}), BIAS,
    ),
    PlantedBlunder(
        "mount leans over", "deg", (0.05, 0.5, 5.0),
        of_disturbance("mount-slip", lambda deg: {"pitch_deg": deg}), BIAS,
    ),
    PlantedBlunder(
        "mount turns", "deg", (0.5, 5.0, 45.0),
        of_disturbance("mount-slip", lambda deg: {"turn_deg": deg}), MOUNT,
    ),
    PlantedBlunder(
        "mount was never as stated", "deg", (1.0, 3.0, 10.0),
        of_disturbance("mount-slip", lambda deg: {"after_s": 0.0, "pitch_deg": deg}), BIAS,
    ),
    PlantedBlunder(
        "axes exchanged, tube", "", (2.0, 4.0, 8.0),
        lambda tables, tube: change_tables(tables, disturbance={"axes-exchanged": {"tube": int(tube)}}), AXES,
    ),
    PlantedBlunder(
        "axes exchanged in the middle, tube", "", (2.0, 3.0, 5.0),
        lambda tables, tube: change_tables(
            tables, disturbance={"axes-exchanged": {"tube": int(tube), "after_s": MIDDLE_S}}
        ), AXES,
    ),
    PlantedBlunder(
        "tubes exchanged in the tally", "mg", (5.0, 20.0, 60.0),
        of_section("disturbance", lambda mg: {"calibration-exchanged": {"tubes": (3, 5), "raw_mg": mg}}),
        (*BIAS, K.TUBES_EXCHANGED),
    ),
    PlantedBlunder(
        "joint misread", "deg", (0.5, 5.0, 60.0),
        of_told(lambda deg: {"joint_tube": TUBE, "joint_deg": deg}), JOINT,
    ),
    PlantedBlunder(
        "joint to the head misread", "deg", (0.5, 5.0, 60.0),
        of_told(lambda deg: {"joint_tube": TUBE, "drive_deg": deg}), JOINT,
    ),
    PlantedBlunder(
        "last joint to the head misread", "deg", (0.5, 5.0, 60.0),
        of_told(lambda deg: {"joint_tube": TUBES, "drive_deg": deg}), JOINT,
    ),
    PlantedBlunder(
        "joints untold", "", (0.0,),
        of_section("setup", lambda _: {"untold": ("joints",)}), JOINT,
    ),
    PlantedBlunder("north wrong", "deg", (0.2, 1.0, 90.0), north_told, (K.COLLAR_WRONG,)),
    PlantedBlunder(
        "north wrong and unchecked", "deg", (0.2, 1.0, 90.0), leave_unchecked("north", north_told), (K.COLLAR_WRONG,)
    ),
    PlantedBlunder(
        "north untold", "", (0.0,), of_section("setup", lambda _: {"untold": ("north",)}), JOINT
    ),
    PlantedBlunder(
        "collar wrong", "deg", (0.5, 2.0, 8.0), of_told(lambda deg: {"collar_north_deg": deg}),
        (K.COLLAR_WRONG,),
    ),
    PlantedBlunder("stick-up told too high", "m", (0.02, 0.3, 2.0), stick_up_told, DEPTH),
    PlantedBlunder(
        "stick-up told too high and unchecked", "m", (0.02, 0.3, 2.0), leave_unchecked("stick-up", stick_up_told), DEPTH
    ),
    PlantedBlunder(
        "collar untold", "", (0.0,),
        of_section("setup", lambda _: {"untold": ("collar",)}),
    ),
    PlantedBlunder(
        "tube longer", "m", (0.002, 0.1, 0.5),
        of_told(lambda m: {"lengths_off_m": of_tube(TUBE, m)}), DEPTH,
    ),
    PlantedBlunder("depth scale", "", (0.002, 0.02, 0.1), of_told(lambda part: {"depth_scale": part}), DEPTH),
    PlantedBlunder("stick-up told too low", "m", (0.02, 0.3, 2.0), of_told(lambda m: {"depth_offset_m": m}), DEPTH),
    PlantedBlunder(
        "depth stuck", "s", (20.0, 60.0, 150.0),
        of_told(lambda s: {"depth_stuck_after_s": MIDDLE_S, "depth_stuck_s": s}), DEPTH,
    ),
    PlantedBlunder("depth errs at every stop", "m", (0.01, 0.05, 0.2), of_told(lambda m: {"depth_std_m": m}), DEPTH),
    PlantedBlunder(
        "hole moves at two stations", "deg", (0.02, 0.1, 1.0), of_section("path", moved_stretch), (K.HOLE_MOVED,)
    ),
    PlantedBlunder(
        "belt slips", "", (1e-4, 1e-3, 1e-2),
        lambda tables, part: in_field(tables, encoder={"belt_slip": part}), TURN, is_drift=True,
    ),
    PlantedBlunder(
        "encoder jumps", "deg", (0.5, 5.0, 60.0),
        lambda tables, deg: in_field(tables, encoder={"jump_deg": deg, "jump_s": MIDDLE_S}), TURN,
    ),
    PlantedBlunder(
        "joints slip at make-ups", "deg", (0.1, 1.0, 5.0),
        of_section("joints", lambda deg: {"unseen_std_deg": deg}), TURN,
    ),
    PlantedBlunder(
        "more play than stated", "deg", (0.05, 0.2, 1.0),
        of_section("disturbance", lambda deg: {"play": {"sigma_deg": deg}}),
    ),
    PlantedBlunder(
        "bias of a gyroscope steps", "deg/s", (0.01, 0.1, 1.0),
        of_section("gyroscope", lambda dps: {"bias_step_dps": dps}), TURN,
    ),
)  # fmt: skip
