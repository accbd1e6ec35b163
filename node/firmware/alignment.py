"""Alignment: slow turns of the string show how each IMU sits against the tube's axis.

Ordered by the crew; the node waits for the string to turn slowly, follows the angle by its gyroscope, and ends with an
offset of pitch and roll, or with the reason why there is none. The offset in use stays until a new one is found.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.firmware.imu_settings import ImuSettings
from node.firmware.pending_event import PendingEvent
from node.kernels.alignment import (
    CIRCLE,
    EXTREMES,
    OFFSET,
    SWEEP,
    add_to_sweep,
    fit_circle,
    new_mount,
    take_extremes,
    to_tube,
)
from node.kernels.angles import wrap
from node.kernels.layout import DEG, PERIOD, Array
from telemetry.messages import Scalar, Severity, Value

METHODS: Final = {"circle": CIRCLE, "extremes": EXTREMES}
SLOWEST, FASTEST = 2.0 * DEG, 15.0 * DEG  # rad/s, of the turn
FEWEST, MOST = 1.0, 20.0  # turns
PATIENCE = 120.0  # s, for the turn to begin
STEADY_CYCLES = 3  # of turning, before the first that counts: those of the speeding up do not
STOOD_CYCLES = 4  # too slow in a row
LARGEST_GAP = 5.0  # s, between two cycles
LARGEST_STEP = 3.0 * DEG  # of the yaw in a cycle, beyond what the gyroscope turned
LEAST_LEAN = 20.0  # standard errors: with less the readings do not show that they turned with the tube
MOST_LEAN = 60.0 * DEG  # beyond it gravity's circle is wide and its middle near the centre, which determines no axis
SHAKING = 5.0  # times the noise of a sample at rest
LARGEST_OFFSET = 10.0 * DEG  # of a mount; a block of parameters can hold no larger one either


class Aligner:
    """At most one alignment at a time; between two it does nothing.

    Parameters
    ----------
    mount : record of dtype ``MOUNT``, saved by the caller
    imus : of the cluster
    noise : rad, of one sample of a force at rest, as a tilt
    """

    def __init__(self, mount: Any, imus: tuple[ImuSettings, ...], noise: float) -> None:
        self._mount = mount
        self._imus = imus
        self._noise = noise
        self._sweeps, self._offsets = np.zeros(len(imus), SWEEP), np.zeros(len(imus), OFFSET)
        self._method, self._wanted = "", 0.0
        self._angle = self._yaw = 0.0  # rad, turned so far, and the filter's yaw
        self._sense = 0.0  # of the turn, 1 or -1; 0 before it began
        self._ordered_at = self._last_end = math.nan
        self._steady = self._slow = 0
        self._force = np.zeros(3)
        self._pending: list[PendingEvent] = []

    @property
    def running(self) -> bool:
        """Whether an alignment is under way."""
        return bool(self._method)

    @property
    def idle(self) -> bool:
        """Whether there is nothing to follow and nothing to say."""
        return not self._method and not self._pending

    def drain_events(self) -> list[PendingEvent]:
        """Code, severity and arguments of the events since the last call."""
        said, self._pending = self._pending, []
        return said

    def start(self, method: object, turns: object) -> str:
        """Begin with the next cycle; returns why not, or nothing."""
        if not isinstance(method, str) or method not in METHODS:
            return f"method: expected {', '.join(METHODS)}, got {method!r:.40}"
        if isinstance(turns, bool) or not isinstance(turns, int | float) or not FEWEST <= turns <= MOST:
            return f"turns: expected {FEWEST:g}..{MOST:g}, got {turns!r:.40}"
        if self.running:
            return "an alignment is under way"
        self._method, self._wanted = method, float(turns)
        self._ordered_at = self._last_end = math.nan
        self._steady = self._slow = 0
        self._angle = self._sense = 0.0
        self._mount["aligning"] = 1
        self._pending.append(("alignment_begun", Severity.INFO, {"method": self._method, "turns": self._wanted}))
        return ""

    def stop(self, reason: str) -> None:
        """End the alignment under way without an offset."""
        self._pending.append(("alignment_refused", Severity.WARNING, {"reason": reason, "turns": self._turns}))
        self._end()

    def drop(self, reason: str) -> None:
        """Forget the offset in use, and end the alignment under way."""
        if self.running:
            self.stop(reason)
        if self._mount["method"]:
            for name in ("method", "axis", "std"):
                self._mount[name] = new_mount()[0][name]
            self._pending.append(("alignment_dropped", Severity.WARNING, {"reason": reason}))

    def on_turn_sample(self, forces: Array, rate: float, yaw: float, start: float, end: float, used: Array) -> bool:
        """Follow one cycle of the alignment under way; whether it ended with a new offset.

        Parameters
        ----------
        forces : (imus, 3) m/s^2, corrected but not turned into the tube's frame
        rate : rad/s about the tube's axis, without the bias
        yaw : rad, at the end of the cycle; NaN while the gyroscope alone knows it
        start, end : s, own clock
        used : (imus,) whether the IMU is healthy
        """
        if math.isnan(self._last_end):
            self._ordered_at = self._last_end = start
        gap, self._last_end = start - self._last_end, end
        turned, self._yaw = wrap(yaw - self._yaw), yaw
        if not -PERIOD < gap < LARGEST_GAP:
            self.stop("cycles were lost")
        elif not used.all():
            self.stop("a sensor is faulty")
        elif abs(rate) > FASTEST:
            self.stop(f"too fast: {abs(rate) / DEG:.3g} deg/s, expected at most {FASTEST / DEG:g}")
        elif self._sense == 0.0:
            self._wait(rate, end)
        elif rate * self._sense < -SLOWEST:
            self.stop("the string turned back")
        else:
            moved = rate * (max(gap, 0.0) + end - start)
            # an aided yaw knows the turn best; unaided it wobbles with the mount, and where it is set again it jumps
            followed = abs(wrap(turned - moved)) < LARGEST_STEP
            return self._sweep(forces, rate, turned if followed else moved, 0.5 * rate * (end - start))
        return False

    def _wait(self, rate: float, end: float) -> None:
        """Until the string turns steadily."""
        self._steady = self._steady + 1 if abs(rate) >= SLOWEST else 0
        if self._steady >= STEADY_CYCLES:
            self._sense = math.copysign(1.0, rate)
            self._sweeps[:] = np.zeros(1, SWEEP)
            self._pending.append(("alignment_turning", Severity.INFO, {"rate_dps": rate / DEG}))
        elif end - self._ordered_at > PATIENCE:
            self.stop(f"timed out: the string stood still for {PATIENCE:g} s")

    def _sweep(self, forces: Array, rate: float, turned: float, half: float) -> bool:
        """One cycle of the turn: ``turned`` (rad) since the last, ``half`` of it after the middle of the readings."""
        self._slow = self._slow + 1 if abs(rate) < SLOWEST else 0
        if self._slow >= STOOD_CYCLES:
            self.stop(f"too few turns: the string stood still after {self._turns:.2f} of {self._wanted:g}")
            return False
        if self._last_end - self._ordered_at > PATIENCE + self._wanted * math.tau / SLOWEST:
            self.stop(f"timed out after {self._turns:.2f} of {self._wanted:g} turns")
            return False
        self._angle += turned
        for sweep, force, imu in zip(self._sweeps, forces, self._imus, strict=True):
            self._force[:] = force
            self._force[:2] += rate * rate * np.array(imu.offset)  # the circle around the axis pulls inwards
            add_to_sweep(sweep, self._force, self._angle - half)
        return abs(self._angle) >= self._wanted * math.tau and self._finish()

    def _finish(self) -> bool:
        """Offsets of all IMUs, or why one of them has none."""
        estimate = fit_circle if METHODS[self._method] == CIRCLE else take_extremes
        for k, imu in enumerate(self._imus):
            offset = self._offsets[k]
            found = estimate(self._sweeps[k], offset)
            if reason := self._unfit(offset, self._noise * imu.noise) if found else "the turn determines no circle":
                self.stop(reason if len(self._imus) == 1 else f"IMU {k + 1}: {reason}")
                return False
        for k in range(len(self._imus)):
            offset = self._offsets[k]
            self._mount["axis"][k] = offset["axis"]
            self._mount["std"][k] = offset["pitch_std"], offset["roll_std"]
            self._pending.append(("aligned", Severity.INFO, self._account(k, offset)))
        self._mount["method"] = METHODS[self._method]
        self._end()
        return True

    def _unfit(self, offset: Array, noise: float) -> str:
        lean, size = float(offset["lean"]), math.hypot(offset["axis"][0], offset["axis"][1])
        if float(offset["noise"]) > SHAKING * noise:
            return f"the string shakes: {offset['noise'] / DEG:.3g} deg, expected at most {SHAKING * noise / DEG:.3g}"
        if lean < LEAST_LEAN * float(offset["lean_std"]):
            least = LEAST_LEAN * float(offset["lean_std"])
            return f"too little lean: {lean / DEG:.3g} deg, expected at least {least / DEG:.3g}"
        if lean > MOST_LEAN:
            return f"too much lean: {lean / DEG:.3g} deg, expected at most {MOST_LEAN / DEG:g}"
        if size > math.sin(LARGEST_OFFSET):
            return f"offset of {math.asin(min(size, 1.0)) / DEG:.3g} deg, expected at most {LARGEST_OFFSET / DEG:g}"
        return ""

    def _account(self, k: int, offset: Array) -> dict[str, Scalar]:
        """Arguments of the event."""
        said: dict[str, Scalar] = {"imu": k + 1, "method": self._method, "turns": self._turns}
        for name in ("pitch", "roll", "pitch_std", "roll_std", "lean", "noise"):
            said[f"{name}_deg"] = float(offset[name]) / DEG
        return said | {"samples": int(self._sweeps[k]["samples"])}

    @property
    def _turns(self) -> float:
        return abs(self._angle) / math.tau

    def _end(self) -> None:
        self._method = ""
        self._mount["aligning"] = 0


def alignment_in_use(mount: Any, imus: int) -> dict[str, Value]:
    """The alignment in use, for a reply: method, and of each IMU pitch, roll and their standard errors (rad)."""
    names = {number: name for name, number in METHODS.items()}
    if int(mount["method"]) not in names:
        return {"method": "none"}
    angles = [angles_of(axis) for axis in mount["axis"][:imus]]
    stds = mount["std"][:imus]
    return {
        "method": names[int(mount["method"])],
        "pitch": tuple(float(pitch) for pitch, _ in angles),
        "pitch_std": tuple(float(pitch) for pitch, _ in stds),
        "roll": tuple(float(roll) for _, roll in angles),
        "roll_std": tuple(float(roll) for _, roll in stds),
    }


def realign(state: Any, before: Array, after: Array) -> None:
    """Turn what a node's record holds in the tube's frame when the axes (imus, 3) change; fused by their mean.

    The covariance stays: turning it by so little changes it in the second order.
    """
    if np.array_equal(before, after):
        return
    turn = rotation(after.sum(axis=0)) @ rotation(before.sum(axis=0)).T
    for name in ("down", "now_down", "static_bias", "bias", "ring_rate", "ring_force"):
        state[name] = state[name] @ turn.T


def rotation(axis: Array) -> Array:
    """Matrix (3, 3) of ``to_tube``; the axis need not be of unit length."""
    unit, columns = axis / np.linalg.norm(axis), np.eye(3)
    for column in columns:
        to_tube(unit, column)
    return np.asarray(columns.T)


def angles_of(axis: Array) -> tuple[float, float]:
    """Pitch and roll (rad) of the tube's axis in an IMU's frame: (sin p, cos p sin r, cos p cos r)."""
    return math.asin(min(max(float(axis[0]), -1.0), 1.0)), math.atan2(float(axis[1]), float(axis[2]))
