"""The one string with one tube below a turning drive head, and whatever is done to its sensors."""

import math
from collections.abc import Callable
from itertools import islice

import numpy as np

from node.firmware.tube import Tube
from node.kernels.layout import PERIOD
from sim.rig.direct_string import DirectString
from sim.studies.epochs import resting
from sim.studies.scenarios import changed
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Event, NodeState

Sample = list[float]  # three rates (rad/s), three forces (m/s^2)
Spoil = Callable[[int, Sample], Sample]
EXACT = {
    "joints": {"reading_std_deg": 0.0, "mount_std_deg": 0.0},
    "clocks": {"joint_std_ms": 0.0, "wander_std_ms": 0.0, "stated_std_ms": 0.1},
}


class StringOfOne:
    """Rest, turn at 71 deg/s, rest, ... ; ``run`` goes cycle by cycle and keeps yaw, variance, flags and events."""

    def __init__(self, seed: int, spoil: Spoil = lambda _, sample: sample, blocks: int = 3, loss: float = 0.01) -> None:
        self.world = World(scenario_of(dict(changed(resting(1, blocks=blocks, loss=loss), **EXACT))), seed)
        self.cycles = self.world.cycles
        self.string = DirectString(self.world, state_every=1, spoil=lambda _, cycle, sample: spoil(cycle, [*sample]))
        self._steps = self.string.steps()

    @property
    def tube(self) -> Tube:
        """The firmware."""
        return self.string.tubes[1]

    @property
    def error(self) -> np.ndarray:
        """Yaw as estimated less the truth (cycles,), rad; NaN in the cycles to come."""
        return self.string.run.error[:, 0]

    @property
    def std(self) -> np.ndarray:
        """What the node says of it, rad."""
        return np.sqrt(self.string.run.var[:, 0])

    @property
    def events(self) -> list[tuple[int, Event]]:
        """With their cycle."""
        return self.string.run.events

    @property
    def states(self) -> list[NodeState]:
        """One a cycle."""
        return [state for _, state in self.string.run.states]

    def turning(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the turning of a block, 0 its begin, 1 its end."""
        return self._within("drill", block, fraction)

    def resting(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the rest after the turning of a block."""
        return self._within("stop", block, fraction)

    def _within(self, kind: str, block: int, fraction: float) -> int:
        phase = [p for p in self.world.phases if p.kind == kind][block]
        return math.floor((phase.start + fraction * (phase.end - phase.start) - self.world.begin) / PERIOD)

    def run(self) -> "StringOfOne":
        """Every cycle."""
        return self.advance(self.cycles)

    def advance(self, cycles: int) -> "StringOfOne":
        """The next cycles."""
        for _ in islice(self._steps, cycles):
            pass
        return self

    def codes(self, begin: int = 0) -> list[str]:
        """Codes of the events from a cycle on."""
        return [event.code for cycle, event in self.events if cycle >= begin]

    def first(self, code: str, begin: int = 0) -> int:
        """Cycle of the first event of a code from a cycle on."""
        return next(cycle for cycle, event in self.events if event.code == code and cycle >= begin)
