"""What is known of tubes and their joints before any look of them counts. No I/O.

A node reports the variance of all constant errors of its yaw as one number: its mount and every joint above it. What a
tube has more than the one above it is the joint between them; where that one is not known the joints count alike.

The turn of a tube's yaw is that of its mount and of all joints up to the drive head. A tube that is added on top turns
them all by another joint and takes the drive head with it: so it is the sum of a turn of the tube, against the joints
below it, and of one of the make-up, which is named after the topmost tube.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from groundstation.config import GroundConfig
from groundstation.service.setup.setup_items import GRAVITY_STD, accelerometer_std, mount_tilt_std
from groundstation.survey.adjustment.looks import StringPrior
from groundstation.survey.adjustment.run_of_stops import JOINT, MOUNT, TurnCauses

Chain = tuple[int, tuple[int, ...] | None]  # a tube, and those above it, lowest first, where their order is known
Joint = tuple[int, ...]
Hung = tuple[int, int]  # a tube in the string as it was hung at first, or once it was hung otherwise
LEAST_VAR = 1e-10  # rad^2, of a turn: marks are not read finer
LEAST_STD = 1e-7  # rad and m/s^2, of what is stated as known
DRIVE = 0  # above the topmost tube
DRIVE_HEAD = "drive"  # cause of a turn: the joint of the topmost tube with the drive head
OF_MOUNT = 2  # numbers in the name of a mount: when, and its tube; that of a joint has another


@dataclass(slots=True)
class Hanging:
    """Which tube hung below which, chain by chain as they came.

    A tube that comes to hang under another one than before begins anew, with all others: what joints they have in
    common with those before is not followed.

    Attributes
    ----------
    tubes, make_ups : in the order in which they were met
    """

    tubes: dict[Hung, int] = field(default_factory=dict)
    make_ups: dict[Hung, int] = field(default_factory=dict)
    upper: dict[Hung, Hung] = field(default_factory=dict)
    _lower: dict[Hung, Hung] = field(default_factory=dict)
    _time: int = 0
    _known: set[tuple[int, ...]] = field(default_factory=set)  # chains that hang so by now, from their lowest tube up

    def add_chain(self, chain: Chain) -> tuple[int, int]:
        """Places of the tube of a chain and of its make-up."""
        tube, above = chain
        if above is None:
            return self._place(self.tubes, (self._time, tube)), self._place(self.make_ups, (self._time, -tube))
        if (names := (tube, *above)) not in self._known:
            self._hang(names)
        return self._place(self.tubes, (self._time, tube)), self._place(self.make_ups, (self._time, names[-1]))

    def _hang(self, names: tuple[int, ...]) -> None:
        """Hang tubes, from the lowest up, below each other."""
        pairs = list(pairwise(names))
        if not all(self._fits((self._time, lower), (self._time, upper)) for lower, upper in pairs):
            self._time += 1
            self._known.clear()
        for lower, upper in pairs:
            self.upper[self._time, lower] = self._time, upper
            self._lower[self._time, upper] = self._time, lower
        self._known |= {names[place:] for place in range(len(names))}

    def _fits(self, lower: Hung, upper: Hung) -> bool:
        return self.upper.get(lower, upper) == upper and self._lower.get(upper, lower) == lower

    @staticmethod
    def _place(places: dict[Hung, int], hung: Hung) -> int:
        return places.setdefault(hung, len(places))

    def joints_below(self, hung: Hung) -> list[Hung]:
        """Tubes below one, whose joints upwards are between it and the lowest."""
        found = []
        while (lower := self._lower.get(hung)) is not None:
            found.append(lower)
            hung = lower
        return found


def prior_of_string(config: GroundConfig, count: int, causes: TurnCauses) -> StringPrior:
    """Prior of so many tubes, whose turns have these causes."""
    cov = causes.cov
    return StringPrior(
        np.full(count, max(accelerometer_std(config), LEAST_STD)),
        np.full(count, max(mount_tilt_std(config), LEAST_STD)),
        np.zeros(len(cov)),
        cov + LEAST_VAR * np.eye(len(cov)),
        config.gravity,
        GRAVITY_STD,
        math.radians(config.play_std_deg),
    )


def causes_of_turns(
    hanging: Hanging, chains: Sequence[Chain], systematic_vars: Sequence[float], mount_var: float
) -> TurnCauses:
    """Causes of the turns of tubes that hang so, of which chains have reported these variances (rad^2) last."""
    own = dict(zip(chains, systematic_vars, strict=True))
    totals = {chain: max(total - mount_var, 0.0) for chain, total in own.items()}
    joints: dict[Joint, float] = {}
    for chain in reversed(chains):  # a joint is known as the newest chain that has it says
        if not all(name in joints for name in joints_of(chain)):
            joints = joint_variances(chain, totals) | joints
    mounts = {chain[0]: min(mount_var, total) for chain, total in own.items()}
    rows = [errors_of_mount(hanging, hung) for hung in hanging.tubes] + [
        errors_of_make_up(hanging, hung) for hung in hanging.make_ups
    ]
    names = list(dict.fromkeys(name for row in rows for name, _ in row))
    place = {name: number for number, name in enumerate(names)}
    columns = np.zeros((len(names), len(rows)))
    for number, parts in enumerate(rows):
        for name, sign in parts:
            columns[place[name], number] += sign
    stds = np.sqrt([mounts[name[1]] if len(name) == OF_MOUNT else joints[name[1:]] for name in names])
    count = len(hanging.tubes)
    return TurnCauses(tuple(name_cause(hanging, name) for name in names), columns[:, :count], columns[:, count:], stds)


def name_cause(hanging: Hanging, name: Joint) -> tuple[str, int]:
    """Kind of a cause and the place of its tube: of a joint the one below it."""
    time, tube = name[:2]
    kind = MOUNT if len(name) == OF_MOUNT else (DRIVE_HEAD if name[-1] == DRIVE else JOINT)
    return kind, hanging.tubes.get((time, tube), -1)


def errors_of_mount(hanging: Hanging, hung: Hung) -> list[tuple[Joint, float]]:
    """Errors in the turn of a tube, with their signs: its mount, less the joints below it."""
    time, _ = hung
    below = [hung, *hanging.joints_below(hung)]
    return [(hung, 1.0), *(((time, lower[1], upper[1]), -1.0) for upper, lower in pairwise(below))]


def errors_of_make_up(hanging: Hanging, hung: Hung) -> list[tuple[Joint, float]]:
    """Errors in the turn of a make-up: all joints below its topmost tube, and the drive head on it."""
    time, top = hung
    if top < 0:
        return [((time, -top, DRIVE, DRIVE), 1.0)]
    below = [hung, *hanging.joints_below(hung)]
    return [((time, top, DRIVE), 1.0), *(((time, lower[1], upper[1]), 1.0) for upper, lower in pairwise(below))]


def joints_of(chain: Chain) -> Iterable[Joint]:
    """Names of the joints above a tube, each by its lower and upper tube."""
    tube, above = chain
    return [(tube, DRIVE, DRIVE)] if above is None else pairwise((tube, *above, DRIVE))


def joint_variances(chain: Chain, totals: Mapping[Chain, float]) -> dict[Joint, float]:
    """Variance (rad^2) of every joint above a tube, by its lower and upper tube.

    Parameters
    ----------
    chain : the tube and those above it
    totals : rad^2, sum of the joints of every chain that has reported
    """
    tube, above = chain
    if above is None:
        return {(tube, DRIVE, DRIVE): totals[chain]}
    names = list(joints_of(chain))
    found: dict[Joint, float] = {}
    known = totals[chain]
    waiting = [names[0]]
    for place in range(1, len(names)):
        upper = totals.get((above[place - 1], above[place:]))
        if upper is not None:
            found |= dict.fromkeys(waiting, max(known - upper, 0.0) / len(waiting))
            known, waiting = upper, []
        waiting.append(names[place])
    return found | dict.fromkeys(waiting, known / len(waiting))
