"""What was told of the setup, in the order of telling, and which joints the nodes know no angle of. No I/O.

Nothing that was told is forgotten: what is told again or taken back stays in the book, and the newest entry that was
not taken back stands. What the configuration of the ground station tells stands where no order did.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

from groundstation.config import GroundConfig
from groundstation.service.setup.told_value import (
    CHECK,
    CONFIGURATION,
    DRIVE,
    SetupKind,
    ToldValue,
    item_name,
)
from groundstation.service.string.doubled_numbers import DoubledNumbers, DoubledPlaces
from telemetry.messages import NodeFlag

UNTOLD_BITS = int(NodeFlag.LOWER_UNTOLD | NodeFlag.DRIVE_UNTOLD)
Pair = tuple[int, int]  # upper tube, or ``DRIVE``, and lower tube


class SetupBook:
    """The book of one rig.

    Parameters
    ----------
    config : of the ground station

    Attributes
    ----------
    entries : everything that orders told, the oldest first
    joints, lengths : what stands of the joints, and of the tubes
    north, stick_up : angle (rad) and height (m) that stand; zero where none does
    moves_depths : whether lengths or the stick-up were told
    doubled : numbers that two tubes give themselves
    version : grows with everything by which surveys mean something else
    revision : grows with everything that is entered, or that a node says anew of what it was told
    """

    def __init__(self, config: GroundConfig) -> None:
        self._by_config = {told.name: told for told in told_by_config(config)}
        self.entries: list[ToldValue] = []
        self.version = self.revision = 0
        self._standing: dict[str, ToldValue] = {}
        self.joints: dict[Pair, ToldValue] = {}
        self.lengths: dict[int, ToldValue] = {}
        self.north = self.stick_up = 0.0
        self.moves_depths = False
        self.doubled = DoubledNumbers()
        self._lowers: dict[int, bool] = {}  # by tube, whether its node was told the angle of the joint below it
        self._drives: dict[int, bool] = {}  # and that of the joint to the drive head, of each that hung from it
        self._lacked: set[int] = set()  # tubes whose joint below was not told once, less than zero: to the drive head
        self._stand()

    def standing(self, kind: SetupKind, subject: object = "") -> ToldValue | None:
        """What stands of an item; None where it was not told, or that was taken back."""
        return self._standing.get(item_name(kind, subject))

    def check_of(self, kind: SetupKind) -> ToldValue | None:
        """The second reading that checks an item; None where there is none."""
        return self._standing.get(item_name(kind, CHECK))

    def told_before(self, name: str) -> int:
        """How often an item was told by orders, also what does not stand any more."""
        return sum(entry.name == name and not entry.takes_back for entry in self.entries)

    def next_number(self) -> int:
        """Number of the next entry."""
        return self.entries[-1].number + 1 if self.entries else 1

    def newest(self) -> ToldValue | None:
        """The entry that would be taken back; None where none stands. What was found is not taken back."""
        gone = {entry.takes_back for entry in self.entries}
        told = (entry for entry in reversed(self.entries) if entry.kind is not SetupKind.DOUBLED)
        kept = (entry for entry in told if not entry.takes_back and entry.number not in gone)
        return next(kept, None)

    def add(self, entries: Iterable[ToldValue]) -> None:
        """Enter what was told, or is taken back."""
        self.entries += entries
        self._stand()
        self.version += 1
        self.revision += 1

    def _stand(self) -> None:
        """Find what stands."""
        gone = {entry.takes_back for entry in self.entries}
        self._standing = self._by_config | {
            entry.name: entry for entry in self.entries if not entry.takes_back and entry.number not in gone
        }
        standing = self._standing.values()
        self.joints = {pair_of(told.subject): told for told in standing if told.kind is SetupKind.JOINT}
        north, stick_up = self.standing(SetupKind.NORTH), self.standing(SetupKind.STICK_UP)
        self.north = 0.0 if north is None else north.values[0]
        self.stick_up = 0.0 if stick_up is None else stick_up.values[0]
        self.lengths = {int(told.subject): told for told in standing if told.kind is SetupKind.LENGTH}
        self.moves_depths = bool(self.lengths) or self.stick_up != 0.0
        self.doubled.begin_anew(
            [(int(entry.subject), places_of(entry)) for entry in self.entries if entry.kind is SetupKind.DOUBLED],
            {int(told.subject): bool(told.values[0]) for told in standing if told.kind is SetupKind.SAME_NUMBER},
        )

    def on_flags(self, tube: int, hops: int, flags: NodeFlag) -> None:
        """A node says, in a state or a measurement, which angles it was not told."""
        bits = int(flags)
        before = self._lowers.get(tube), self._drives.get(tube)
        self._lowers[tube] = not bits & int(NodeFlag.LOWER_UNTOLD)
        if hops == 1:
            self._drives[tube] = not bits & int(NodeFlag.DRIVE_UNTOLD)
        if bits & UNTOLD_BITS:
            self._lacked |= {
                key for key, flag in ((tube, NodeFlag.LOWER_UNTOLD), (-tube, NodeFlag.DRIVE_UNTOLD)) if bits & flag
            }
        if before != (self._lowers[tube], self._drives.get(tube)):
            self.revision += 1
            self.version += bool(self.joints)  # where an angle stands it matters what the node knows of it

    def node_knows(self, pair: Pair) -> bool | None:
        """Whether a node was told the angle of a joint; None where none has said so."""
        upper, lower = pair
        return self._drives.get(lower) if upper == DRIVE else self._lowers.get(upper)

    def was_untold(self, pair: Pair) -> bool:
        """Whether a node has said once that it was not told the angle of a joint, or has not spoken yet."""
        upper, lower = pair
        return self.node_knows(pair) is None or (-lower if upper == DRIVE else upper) in self._lacked

    def joints_of(self, tubes: Sequence[int]) -> list[Pair]:
        """Joints that surveys rest on: those of the string (tubes from the top down), and each to the drive head."""
        tops = [*tubes[:1], *(tube for tube in tubes[1:] if tube in self._drives)]
        return [*((DRIVE, tube) for tube in tops), *pairwise(tubes)]


def places_of(entry: ToldValue) -> DoubledPlaces:
    """Places of a doubled number, as they were found."""
    epoch, at, upper, lower = entry.values
    return DoubledPlaces(int(epoch), at, int(upper), int(lower))


def pair_of(subject: str) -> Pair:
    """Tubes of a joint's name, the inverse of ``joint_subject``."""
    upper, lower = subject.split("-")
    return DRIVE if upper == "drive" else int(upper), int(lower)


def told_by_config(config: GroundConfig) -> Iterable[ToldValue]:
    """What the configuration of a ground station tells."""

    def told(kind: SetupKind, sigma: float, *values: float, subject: str = "", checks: bool = False) -> ToldValue:
        return ToldValue(0, kind, subject, values, sigma, CONFIGURATION, "", checks=checks)

    rad = math.radians
    if config.north_std_deg is not None:
        yield told(SetupKind.NORTH, rad(config.north_std_deg), rad(config.north_deg))
    if config.collar_std_deg is not None:
        lean = rad(config.collar_inclination_deg or 0.0), rad(config.collar_azimuth_deg or 0.0)
        yield told(SetupKind.COLLAR, rad(config.collar_std_deg), *lean)
    if config.stick_up_std_m is not None:
        yield told(SetupKind.STICK_UP, config.stick_up_std_m, config.stick_up_m)
    if config.north_check_deg is not None and config.north_check_std_deg is not None:
        yield told(SetupKind.NORTH, rad(config.north_check_std_deg), rad(config.north_check_deg), checks=True)
    if config.stick_up_check_m is not None and config.stick_up_check_std_m is not None:
        yield told(SetupKind.STICK_UP, config.stick_up_check_std_m, config.stick_up_check_m, checks=True)
    for pair, angle_deg, std_deg in config.joints:
        yield told(SetupKind.JOINT, rad(std_deg), rad(angle_deg), subject=pair)
