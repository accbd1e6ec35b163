"""Every item of a setup: its value, how well it is known, from where, and how long ago. No I/O.

What was not told has a default that is wide enough to be true: a yaw below a joint that was not told may be any, and so
may all yaws while the encoder's zero was not compared with north; the collar leans like the design as well as a rig is
set up, and an IMU sits in its tube as well as it was mounted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from groundstation.config import SENSOR_BIAS_DEG, GroundConfig
from groundstation.service.setup.setup_book import Pair, SetupBook
from groundstation.service.setup.setup_checks import (
    CHECKED,
    STICK_UP_STD,
    counted_std,
    is_unchecked,
    least_slip,
    say_check,
)
from groundstation.service.setup.told_value import (
    CONFIGURATION,
    DRIVE,
    SetupKind,
    SetupSource,
    ToldValue,
    item_name,
    joint_subject,
)
from groundstation.service.string.known_string import KnownString
from telemetry.messages import UNKNOWN_YAW_STD

DEG = math.radians(1.0)
COLLAR_STD = 1.0 * DEG  # each way, of a rig that is set up by eye and level
MOUNT_TILT_STD = 0.5 * DEG  # of an IMU as it is mounted in its tube, until an alignment has found it
JOINT_STD = 0.05 * DEG  # of a scribe mark that a node was told; the ground station does not hear its own
GRAVITY_STD = 2e-3  # m/s^2, of what is entered for the site
ALONG = (SetupKind.LENGTH, SetupKind.STICK_UP, SetupKind.DEPTH_SCALE)  # errors of the depth
BARE = "bare sensor"
GYROSCOPE_BIAS_STD = 0.02 * DEG  # rad/s; a node measures its own at rest


@dataclass(frozen=True, slots=True)
class SetupItem:
    """What is known of one item; SI and rad.

    Parameters
    ----------
    kind, subject : what it is, and of which tube or joint
    values : mean, of the collar inclination and azimuth; none where it may be any
    sigma : standard deviation of each
    unit : of both: rad, m, m/s^2, rad/s, rad/m or 1
    source, detail : where it is from, and that in words
    by, utc : who told it and when; empty where it was not told, or not by an order
    is_needed : without it no azimuth is known, so that it is missing where it was not told
    times_told : by orders
    check : what checks it, in words; empty of what readings show, or what was not told
    is_unchecked : it was told once, no reading shows a slip, and nothing checks it
    least_slip : smallest slip that its check shows; None where nothing does, or where readings do
    """

    kind: SetupKind
    subject: str
    values: tuple[float, ...]
    sigma: float
    unit: str
    source: SetupSource
    detail: str
    by: str = ""
    utc: str = ""
    is_needed: bool = False
    times_told: int = 0
    check: str = ""
    is_unchecked: bool = False
    least_slip: float | None = None

    @property
    def name(self) -> str:
        """Name, such as ``north`` and ``joint.4-3``."""
        return item_name(self.kind, self.subject)

    @property
    def is_told(self) -> bool:
        """Whether it was told or measured."""
        return self.source in (SetupSource.TOLD, SetupSource.MEASURED)

    @property
    def is_missing(self) -> bool:
        """Whether the hole cannot be known without it, and it was not told."""
        return self.is_needed and not self.is_told


def setup_items(config: GroundConfig, book: SetupBook, string: KnownString) -> list[SetupItem]:
    """All items of a rig as they stand; those of tubes from the top down."""
    return [*_items_of_rig(config, book), *_joint_items(book, string.tubes), *_items_of_tubes(config, book, string)]


def shown_marks(book: SetupBook, string: KnownString) -> tuple[object, ...]:
    """What the items of a rig stand for: others once what is shown of them is another."""
    states = (string.states.newest[tube] for tube in string.tubes if tube in string.states.newest)
    return (book.revision, *string.tubes, *((state.alignment, state.parameters_version) for state in states))


def missing_names(items: list[SetupItem]) -> list[str]:
    """Names of the items without which the hole cannot be known."""
    return [item.name for item in items if item.is_missing]


def _items_of_rig(config: GroundConfig, book: SetupBook) -> Iterator[SetupItem]:
    design = config.design.inclination, config.design.azimuth
    for kind, unit, needed, values, sigma, source, detail in (
        (SetupKind.NORTH, "rad", True, (), UNKNOWN_YAW_STD, SetupSource.DEFAULT, "not told: any azimuth may be"),
        (SetupKind.COLLAR, "rad", False, design, COLLAR_STD, SetupSource.DESIGN, "not told: as the design"),
        (SetupKind.STICK_UP, "m", False, (0.0,), untold_stick_up_std(config), SetupSource.DEFAULT, "not told"),
    ):
        told = book.standing(kind)
        if told is None:
            yield SetupItem(
                kind, "", values, sigma, unit, source, detail, "", "", needed, book.told_before(item_name(kind))
            )
        else:
            yield _told_item(told, unit, book, is_needed=needed)
    default, rules = SetupSource.DEFAULT, ("not told", "until the residuals of the hole show it")
    for kind, values, sigma, unit, detail in (
        (SetupKind.DEPTH_SCALE, (1.0,), config.depth_scale_std, "1", rules[0]),
        (SetupKind.PLAY, (0.0,), math.radians(config.play_std_deg), "rad", rules[1]),
        (SetupKind.PATH, (0.0,), math.radians(config.curvature_std_deg_per_m), "rad/m", rules[1]),
        (SetupKind.GRAVITY, (config.gravity,), GRAVITY_STD, "m/s^2", CONFIGURATION),
    ):
        yield SetupItem(kind, "", values, sigma, unit, default, detail)


def _joint_items(book: SetupBook, tubes: list[int]) -> Iterator[SetupItem]:
    for pair in book.joints_of(tubes):
        if (item := joint_item(book, pair)) is not None:
            yield item


def joint_item(book: SetupBook, pair: Pair) -> SetupItem | None:
    """What is known of a joint; None before its node has said whether it was told an angle."""
    kind, subject, knows = SetupKind.JOINT, joint_subject(*pair), book.node_knows(pair)
    if (told := book.standing(kind, subject)) is not None:
        return _told_item(told, "rad", book, is_needed=True)
    times = book.told_before(item_name(kind, subject))
    if knows is None:
        return None
    node = f"the node of tube {pair[1] if pair[0] == DRIVE else pair[0]}"
    if knows:
        detail = f"to {node}, which keeps the angle"
        return SetupItem(kind, subject, (), JOINT_STD, "rad", SetupSource.TOLD, detail, "", "", True, times)
    detail = f"{node} was not told: the yaw below may be any"
    return SetupItem(kind, subject, (), UNKNOWN_YAW_STD, "rad", SetupSource.DEFAULT, detail, "", "", True, times)


def _items_of_tubes(config: GroundConfig, book: SetupBook, string: KnownString) -> Iterator[SetupItem]:
    for tube in string.tubes:
        yield _length_item(config, book, tube)
        yield _mount_item(config, string, tube)
        subject, design = str(tube), SetupSource.DESIGN
        yield SetupItem(
            SetupKind.MOUNT_TURN, subject, (0.0,), math.radians(config.mount_std_deg), "rad", design, CONFIGURATION
        )
        state = string.states.newest.get(tube)
        block = "" if state is None or not state.parameters_version else f"block {state.parameters_version}"
        source, detail = (SetupSource.MEASURED, block) if block else (design, BARE)
        gyroscope = SetupItem(SetupKind.GYROSCOPE, subject, (0.0,), GYROSCOPE_BIAS_STD, "rad/s", source, detail)
        if not block and config.accelerometer_bias_std_deg != SENSOR_BIAS_DEG:
            source, detail = SetupSource.TOLD, CONFIGURATION
        yield SetupItem(SetupKind.ACCELEROMETER, subject, (0.0,), accelerometer_std(config), "m/s^2", source, detail)
        yield gyroscope


def _length_item(config: GroundConfig, book: SetupBook, tube: int) -> SetupItem:
    if (told := book.standing(SetupKind.LENGTH, tube)) is not None:
        return _told_item(told, "m", book)
    values = (config.tube_length,)
    return SetupItem(
        SetupKind.LENGTH, str(tube), values, config.tube_length_std, "m", SetupSource.DESIGN, "as it is made",
        times_told=book.told_before(item_name(SetupKind.LENGTH, tube)),
    )  # fmt: skip


def _mount_item(config: GroundConfig, string: KnownString, tube: int) -> SetupItem:
    """Tilt of the IMU against the tube's axis: pitch and roll."""
    kind, subject, state = SetupKind.MOUNT, str(tube), string.states.newest.get(tube)
    if state is not None and (std := state.alignment[2]) > 0.0:
        return SetupItem(
            kind, subject, state.alignment[:2], std, "rad", SetupSource.MEASURED, "aligned by turning the string"
        )
    std = mount_tilt_std(config)
    if config.mount_tilt_std_deg is not None:
        return SetupItem(kind, subject, (0.0, 0.0), std, "rad", SetupSource.TOLD, CONFIGURATION, CONFIGURATION)
    detail = "not aligned: as it is mounted"
    return SetupItem(kind, subject, (0.0, 0.0), std, "rad", SetupSource.DESIGN, detail)


def untold_stick_up_std(config: GroundConfig) -> float:
    """Standard deviation (m) of a stick-up that was not told."""
    return max(config.depth_offset_std, STICK_UP_STD)


def accelerometer_std(config: GroundConfig) -> float:
    """Standard deviation (m/s^2) of the bias of an accelerometer on each axis."""
    return math.radians(config.accelerometer_bias_std_deg) * config.gravity


def mount_tilt_std(config: GroundConfig) -> float:
    """Standard deviation (rad) of the tilt of a mount that was not aligned, each way."""
    told = config.mount_tilt_std_deg
    return MOUNT_TILT_STD if told is None else math.radians(told)


def _told_item(told: ToldValue, unit: str, book: SetupBook, *, is_needed: bool = False) -> SetupItem:
    detail = CONFIGURATION if told.number == 0 else f"by {told.by}"
    if told.used is not None:
        detail += f", its node computes by {math.degrees(told.used):g} deg"
    found = SetupItem(
        told.kind, told.subject, told.values, counted_std(book, told), unit, SetupSource.TOLD, detail, told.by,
        told.utc, is_needed, book.told_before(told.name),
    )  # fmt: skip
    if told.kind not in CHECKED:
        return found
    check = book.check_of(told.kind)
    slip = None if check is None else least_slip(told, check)
    return replace(found, check=say_check(book, told.kind), is_unchecked=is_unchecked(book, told.kind), least_slip=slip)
