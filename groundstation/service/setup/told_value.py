"""One value of the setup as it was told: by an order, kept as text, or by the configuration of the ground station."""

from __future__ import annotations

import enum
import json
import math
import re
from dataclasses import asdict, dataclass
from typing import Any, Final

from groundstation.errors import GroundError

CONFIGURATION = "configuration"  # tells what stands in the options of the ground station
NO_SUBJECT: Final = re.compile("")
CHECK = "check"  # in the place of a subject
DRIVE = 0  # stands for the drive head among the tubes of a pair


class SetupKind(enum.StrEnum):
    """What is known of a setup; the first five and the last can be told."""

    NORTH = "north"
    COLLAR = "collar"
    JOINT = "joint"
    LENGTH = "length"
    STICK_UP = "stick_up"
    MOUNT = "mount"
    MOUNT_TURN = "mount_turn"
    DEPTH_SCALE = "depth_scale"
    ACCELEROMETER = "accelerometer"
    GYROSCOPE = "gyroscope"
    PLAY = "play"
    PATH = "path"
    GRAVITY = "gravity"
    DOUBLED = "doubled"  # found: a number of two tubes, with epoch, rig time (s) and both places
    SAME_NUMBER = "same_number"  # told: 1 where the upper of both is the tube, 0 where the lower is


class SetupSource(enum.StrEnum):
    """Where the value of an item is from."""

    TOLD = "told"  # by an order, the configuration, or to a node
    MEASURED = "measured"
    DESIGN = "design"  # of the hole or of the tubes
    DEFAULT = "default"  # of this program


SUBJECTS: Final = {
    SetupKind.JOINT: re.compile(r"([0-9]{1,3}|drive)-[0-9]{1,3}"),
    SetupKind.LENGTH: re.compile(r"[0-9]{1,3}"),
    SetupKind.DOUBLED: re.compile(r"[0-9]{1,3}"),
    SetupKind.SAME_NUMBER: re.compile(r"[0-9]{1,3}"),
}


class DamagedSetupError(GroundError, ValueError):
    """A stored text is no value of a setup."""


@dataclass(frozen=True, slots=True)
class ToldValue:
    """A value with its standard deviation, and who told it; SI and rad.

    Parameters
    ----------
    number : from 1 in the order of telling; 0 of the configuration
    kind, subject : what it is, and of which tube or joint, such as ``3`` and ``4-3``
    values : one, or of the collar inclination and azimuth; none in an entry that takes another back
    sigma : of each, larger than zero
    used : rad, angle by which the node computed; None where it was told none
    by, utc : who told it and when
    takes_back : number of the entry that does not stand any more
    checks : it is a second reading, which checks what is told and does not take its place
    """

    number: int
    kind: SetupKind
    subject: str
    values: tuple[float, ...]
    sigma: float
    by: str
    utc: str
    used: float | None = None
    takes_back: int = 0
    checks: bool = False

    @property
    def name(self) -> str:
        """Name of the item that it tells, or checks: ``north`` and ``north.check``."""
        return item_name(self.kind, CHECK if self.checks else self.subject)

    @property
    def correction(self) -> float:
        """Angle (rad) to be added to a yaw below a joint."""
        return self.values[0] - (self.used or 0.0)


def item_name(kind: SetupKind, subject: object = "") -> str:
    """Name of an item, such as ``north``, ``length.3`` and ``joint.4-3``."""
    return f"{kind.value}.{subject}" if subject != "" else kind.value


def joint_subject(upper: int, lower: int) -> str:
    """A joint by its tubes, such as ``4-3``, or ``drive-4``."""
    return f"{'drive' if upper == DRIVE else upper}-{lower}"


def shown_value(told: ToldValue) -> str:
    """A value with its standard deviation and unit, for people."""
    if told.kind is SetupKind.SAME_NUMBER:
        return "the upper of both" if told.values[0] else "the lower of both"
    is_length = told.kind in (SetupKind.LENGTH, SetupKind.STICK_UP)
    scale, unit = (1.0, "m") if is_length else (math.degrees(1.0), "deg")
    values = " to ".join(f"{scale * value:g}" for value in told.values)
    return f"{values} ± {scale * told.sigma:g} {unit}"


def told_to_text(told: ToldValue) -> str:
    """The value as it is stored."""
    return json.dumps(asdict(told))


def told_of_text(text: str) -> ToldValue:
    """The value of a stored text.

    Raises
    ------
    DamagedSetupError
        When it is none.
    """
    try:
        row: dict[str, Any] = json.loads(text)
        told = ToldValue(**row | {"kind": SetupKind(row["kind"]), "values": tuple(map(float, row["values"]))})
    except (ValueError, TypeError, KeyError) as error:
        raise DamagedSetupError(f"expected a value of the setup, got {text:.60}") from error
    if SUBJECTS.get(told.kind, NO_SUBJECT).fullmatch(told.subject) is None or not (told.values or told.takes_back):
        raise DamagedSetupError(f"expected a value of the setup, got {text:.60}")
    if not all(map(math.isfinite, (*told.values, told.sigma, told.used or 0.0))):
        raise DamagedSetupError(f"expected finite numbers of the setup, got {text:.60}")
    return told
