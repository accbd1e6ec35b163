"""One tube below a turning drive head, with the sensors of the world and whatever is done to them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.string.direct_string import DirectString
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Event, NodeState

Sample = list[float]  # three rates (rad/s), three forces (m/s^2)
NUMBERS = 6  # of a sample
Spoil = Callable[[int, Sample], Sample]


class StringOfOne:
    """Rest, turn at 71 deg/s, rest, ... ; ``run`` goes cycle by cycle and keeps yaw, variance, flags and events."""

    def __init__(
        self,
        seed: int,
        spoil: Spoil = lambda _, sample: sample,
        blocks: int = 3,
        loss: float = 0.01,
        **changed: dict[str, object],
    ) -> None:
        tables = {
            "rig": {"tubes": 1, "tubes_at_start": 1, "tube_length_m": 1.0},
            "path": {"straight": {"inclination_deg": 2.0}},
            "schedule": {"add_s": 60.0, "stop_s": 60.0, "finish_s": 5.0, "blocks": blocks},
            "joints": {"reading_std_deg": 0.0, "mount_std_deg": 0.0},
            "accelerometer": {"bias_std_deg": 0.002},
            "clocks": {"joint_std_ms": 0.0, "wander_std_ms": 0.0, "stated_std_ms": 0.1},
            "medium": {"link": "off", "loss": loss},
            **changed,
        }
        self.world = World(scenario_of(tables), seed)
        self.motion, self.cycles = self.world.motion, self.world.cycles
        self.string, self._spoil = DirectString(self.world, state_every=1), spoil
        self.tube = self.string.tubes[1]
        self._steps, self._next = self.string.steps(), 0

    def turning(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the turning of a block, 0 its begin, 1 its end."""
        return self._cycle("drill", block, fraction)

    def resting(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the rest after the turning of a block."""
        return self._cycle("stop", block, fraction)

    def run(self) -> StringOfOne:
        """Every cycle."""
        return self.advance(self.cycles)

    def advance(self, cycles: int) -> StringOfOne:
        """So many cycles, or as many as are left."""
        for cycle in range(self._next, min(self._next + cycles, self.cycles)):
            reading = self.string.readings[cycle, 0, 0]
            reading[:NUMBERS] = self._spoil(cycle, reading[:NUMBERS].tolist())
            self._next = next(self._steps) + 1
        return self

    def shift_clock(self, seconds: float) -> None:
        """Move the node's clock from the next cycle on, against its first setting."""
        self.string.clock_shifts[1] = seconds

    @property
    def error(self) -> npt.NDArray[np.float64]:
        """Yaw error of every cycle so far, rad; NaN after."""
        return self.string.run.total_error[:, 0]

    @property
    def std(self) -> npt.NDArray[np.float64]:
        """Stated standard deviation of every cycle so far, rad; NaN after."""
        return np.sqrt(self.string.run.var[:, 0])

    @property
    def events(self) -> list[tuple[int, Event]]:
        """Events with their cycle."""
        return self.string.run.events

    @property
    def states(self) -> list[NodeState]:
        """One state a cycle."""
        return [state for _, state in self.string.run.states]

    def codes(self, begin: int = 0) -> list[str]:
        """Codes of the events from a cycle on."""
        return [event.code for cycle, event in self.events if cycle >= begin]

    def first(self, code: str, begin: int = 0) -> int:
        """Cycle of the first event of a code from a cycle on."""
        return next(cycle for cycle, event in self.events if event.code == code and cycle >= begin)

    def _cycle(self, kind: str, block: int, fraction: float) -> int:
        phase = [p for p in self.motion.phases if p.kind == kind][block]
        return math.floor((phase.start + fraction * (phase.end - phase.start) - self.world.begin) / PERIOD)
