"""The motion of the string in closed form: schedule, turning of the drive head, depth of the bit.

The schedule is a row of blocks: a tube is added (or the string is held, where none is), turned with one trapezoid of
rotation (ramp up, constant rate, ramp down), and stands still. The bit advances in proportion to the turning. Rig time;
angles in rad.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SchedulePhase:
    """One item of the schedule: ``add`` or ``hold``, ``drill`` and ``stop`` of a block, or the final ``finish``.

    ``tube`` is the top tube.
    """

    kind: str
    tube: int
    start: float
    end: float
    joint_closed: float = 0.0  # of an ``add``


@dataclass(frozen=True)
class Trapezoid:
    """Turning by ``angle`` (rad) at up to ``rate`` (rad/s) with ramps of ``acceleration`` (rad/s^2)."""

    angle: float
    rate: float
    acceleration: float

    @cached_property
    def ramp(self) -> float:
        """Duration of a ramp, s; a turn too short for the full rate is all ramp."""
        return float(min(self.rate / self.acceleration, np.sqrt(self.angle / self.acceleration)))

    @cached_property
    def duration(self) -> float:
        """Duration of the whole, s."""
        return 2.0 * self.ramp + (self.angle - self.acceleration * self.ramp**2) / (self.acceleration * self.ramp)

    def turned(self, u: Array) -> tuple[Array, Array, Array]:
        """Angle, rate and acceleration at the times ``u`` (s) after its start."""
        a, r, d = self.acceleration, self.ramp, self.duration
        u = np.clip(u, 0.0, d)
        up, down = np.minimum(u, r), np.maximum(u - (d - r), 0.0)
        flat = np.clip(u - r, 0.0, d - 2.0 * r)
        angle = 0.5 * a * up**2 + a * r * flat + a * r * down - 0.5 * a * down**2
        inside = (u > 0.0) & (u < d)
        rate = np.where(inside, a * (up - down), 0.0)
        acceleration = np.where(inside & (u < r), a, 0.0) - np.where(inside & (u > d - r), a, 0.0)
        return angle, rate, acceleration

    def time_of(self, angle: float) -> float:
        """Time (s after its start) at which ``angle`` was reached, the inverse of ``turned``."""
        a, r, d = self.acceleration, self.ramp, self.duration
        ramp_angle = 0.5 * a * r * r
        if angle <= ramp_angle:
            return math.sqrt(2.0 * max(angle, 0.0) / a)
        if angle <= self.angle - ramp_angle:
            return float(r + (angle - ramp_angle) / (a * r))
        return d - math.sqrt(2.0 * max(self.angle - angle, 0.0) / a)

    def times_of(self, angles: Array) -> Array:
        """``time_of`` of (n,) angles."""
        a, r, d = self.acceleration, self.ramp, self.duration
        ramp_angle = 0.5 * a * r * r
        up = np.sqrt(2.0 * np.maximum(angles, 0.0) / a)
        flat = r + (angles - ramp_angle) / (a * r)
        down = d - np.sqrt(2.0 * np.maximum(self.angle - angles, 0.0) / a)
        return np.where(angles <= ramp_angle, up, np.where(angles <= self.angle - ramp_angle, flat, down))


class Motion:
    """Drive head and bit over the whole schedule.

    Parameters
    ----------
    begin, add, joint, stop, finish : s, see the scenario's schedule
    turn : of each tube
    tubes, tube_length : number at the end, and m
    first_angle : rad, of the drive head at the start
    at_start : tubes in the hole at the start, one is added before each block after the first; with none the first
        block begins with the first tube
    blocks : number of them; as many as it takes to add every tube if absent
    advance : m of the bit in one block; a tube's length if absent
    depth_at_start : m of the bit; that of all tubes at the start if absent
    longer : m, by which tubes from the bit up are longer than others, none of the rest: each is added at the height of
        those before, so the bit goes so much further with it
    """

    def __init__(
        self,
        begin: float,
        add: float,
        joint: float,
        stop: float,
        finish: float,
        turn: Trapezoid,
        tubes: int,
        tube_length: float,
        first_angle: float,
        *,
        at_start: int = 0,
        blocks: int | None = None,
        advance: float | None = None,
        depth_at_start: float | None = None,
        longer: Sequence[float] = (),
    ) -> None:
        self.begin = begin
        self._turn = turn
        self._advance = tube_length if advance is None else advance
        self._depth_at_start = at_start * tube_length if depth_at_start is None else depth_at_start
        self._first_angle = first_angle
        self._at_start = at_start
        first = max(at_start, 1)
        count = tubes - first + 1 if blocks is None else blocks
        self.lengths = np.minimum(first + np.arange(count), tubes)  # tubes in the string in each block
        off = np.zeros(tubes)
        off[: len(longer)] = longer
        self._further = np.where(np.diff(self.lengths, prepend=at_start) > 0, off[self.lengths - 1], 0.0)
        phases: list[SchedulePhase] = []
        at, before = begin, at_start
        for tube in self.lengths.tolist():
            added = tube > before
            phases.append(SchedulePhase("add" if added else "hold", tube, at, at + add, at + joint if added else 0.0))
            phases.append(SchedulePhase("drill", tube, at + add, at + add + turn.duration))
            phases.append(SchedulePhase("stop", tube, phases[-1].end, phases[-1].end + stop))
            at, before = phases[-1].end, tube
        phases.append(SchedulePhase("finish", tubes, at, at + finish))
        self.phases = tuple(phases)
        self.end = at + finish
        self._starts = np.array([phase.start for phase in phases if phase.kind == "drill"])
        self.make_ups = np.array([phase.joint_closed for phase in phases if phase.kind == "add"])

    def starting_at(self, first_angle: float) -> Motion:
        """The same motion of a head that starts at another angle (rad)."""
        moved = copy.copy(self)
        moved._first_angle = first_angle
        return moved

    def drive(self, t: Array) -> tuple[Array, Array, Array]:
        """Angle (rad, unwrapped), rate and acceleration of the drive head at rig times ``t`` (n,)."""
        k = np.maximum(np.searchsorted(self._starts, t, side="right") - 1, 0)
        angle, rate, acceleration = self._turn.turned(t - self._starts[k])
        return self._first_angle + k * self._turn.angle + angle, rate, acceleration

    def depth(self, t: Array) -> tuple[Array, Array, Array]:
        """Measured depth of the bit (m) and its two derivatives at rig times ``t`` (n,)."""
        angle, rate, acceleration = self.drive(t)
        pitch = self._advance / self._turn.angle
        depth = self._depth_at_start + (angle - self._first_angle) * pitch
        if not self._further.any():
            return depth, rate * pitch, acceleration * pitch
        block, part = np.divmod(np.maximum(angle - self._first_angle, 0.0) / self._turn.angle, 1.0)
        k = np.minimum(block.astype(np.intp), len(self._further) - 1)
        whole = np.concatenate([[0.0], np.cumsum(self._further)])
        depth += np.where(block < len(self._further), whole[k] + part * self._further[k], whole[-1])
        pitch_there = pitch + self._further[k] / self._turn.angle
        return depth, rate * pitch_there, acceleration * pitch_there

    def time_of_angle(self, angle: float) -> float:
        """Rig time at which the drive head reached ``angle``; the start for what it never had to reach."""
        turned = angle - self._first_angle
        if turned <= 0.0:
            return self.begin
        k = min(math.ceil(turned / self._turn.angle - 1e-12) - 1, len(self._starts) - 1)
        return float(self._starts[k]) + self._turn.time_of(turned - k * self._turn.angle)

    def times_of_angles(self, angles: Array) -> Array:
        """``time_of_angle`` of (n,) angles."""
        turned = angles - self._first_angle
        k = np.clip(np.ceil(turned / self._turn.angle - 1e-12) - 1, 0, len(self._starts) - 1).astype(np.int64)
        times = self._starts[k] + self._turn.times_of(np.maximum(turned - k * self._turn.angle, 0.0))
        return np.where(turned <= 0.0, self.begin, times)

    def top(self, t: float) -> int:
        """Number of the tube that the drive head holds at ``t``; 1 before the first joint is closed."""
        return int(self.tops(np.array([t]))[0])

    def tops(self, t: Array) -> npt.NDArray[np.intp]:
        """``top`` at the times ``t`` (n,)."""
        return np.asarray(np.maximum(self._at_start + np.searchsorted(self.make_ups, t, side="right"), 1))
