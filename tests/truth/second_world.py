"""A second world for a node: truth of its own at 1 kHz, sensors and encoder of its own, nothing of the simulator's.

The rates of head and string are laid down sample by sample and integrated; frames are carried along the hole by
products of rotations, edges of the disc are found where the sampled angle passes a line. Only the node's public objects
are common to this world and the other: its tubes, its encoder, the clock of its driver.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.process.drivers.fifo_window import parts_of, window_std
from node.process.drivers.frame_clock import FrameClock
from telemetry.messages import Aiding

Array = npt.NDArray[np.float64]
HERTZ, PERIOD, BEGIN = 1000.0, 1.0 / 1.9, 1000.0
HOLD, STOP, FINISH, BLOCKS = 55.0, 40.0, 5.0, 2  # s
SPEED, RAMP, TURNED = np.radians([71.0, 35.0, 12 * 360.0])  # rad/s, rad/s^2, rad a block
DRILL = float(TURNED / SPEED + SPEED / RAMP)  # s
G, LEVER = 9.81, 0.02  # m/s^2; m, of the IMU from the axis
GYRO_WHITE = np.radians([8.538e-3, 6.799e-3, 7.313e-3])  # rad/s/sqrt(Hz); thesis Table V.1, as the next two
GYRO_WANDER, WANDER_TAU = np.radians([1.2545e-2, 5.869e-3, 4.941e-3]), 15.87  # rad/s, s
FORCE_WHITE = G * math.radians(0.02) * math.sqrt(PERIOD)  # m/s^2/sqrt(Hz)
LINES, LINE_STD = 4096, math.radians(0.003)


@dataclass(frozen=True, slots=True)
class Disturbance:
    """What is out of order; all zero is a clean world."""

    inclination_deg: float = 2.0
    azimuth_turn_deg: float = 0.0  # of the hole under a tube, per block
    ripple: float = 0.0  # of the rate, in 4 s
    stick_slip: bool = False
    dead_stop_dps: float = 0.0
    turns_back_deg: float = 0.0
    backlash_deg: float = 0.0
    twist_deg: float = 0.0
    hold_s: float = 2.0
    unwind_s: float = 3.0
    wrong_mark_deg: float = 0.0
    eccentricity_deg: float = 0.0
    belt_slip: float = 0.0
    jump_deg: float = 0.0  # 85 s after the start
    index: bool = False
    reversed: bool = False
    outliers: float = 0.0
    turning_g: float = 0.0
    resting_g: float = 0.0
    torsional_dps: float = 0.0
    frames_hz: float = 0.0
    low_pass_hz: float = 0.0
    crystal: float = 0.0
    jitter_ms: float = 0.0
    pull_dps_per_g: float = 0.0
    asymmetry: float = 0.0  # of the gyroscope's scale between the two directions
    earth: float = 0.0  # rad/s, of its turn at 50 deg of latitude
    lean_deg: float = 0.0  # of the gyroscope's axes
    warm_up_dps: float = 0.0
    warm_up_c: float = 0.0
    force_bias_g: float = 0.0
    locked: bool = False
    increments: bool = True  # the sensor tells the inside of its cycles


@dataclass(frozen=True, slots=True)
class Cycles:
    """What one sensor gives, cycle by cycle."""

    rate: Array  # (m, 3) rad/s
    force: Array  # (m, 3) m/s^2
    clipped: npt.NDArray[np.int64]
    late: Array  # s
    late_std: Array  # s
    parts: Array  # (m, 9) rad/s; NaN where the inside of a cycle is not told
    temperature: Array  # C


class SecondWorld:
    """One seed of one disturbance.

    Attributes
    ----------
    t : (n,) s, samples
    head, string : (n,) rad, unwrapped, of the head and of the string below play and twist
    shown : (n,) rad, yaw of the string against the reference for a joint of 0: what a node is judged by
    ends : (m,) s, of the encoder's cycles
    """

    run_on, lost = 0.3, frozenset[int]()  # s, into the play; cycles that no node runs

    def __init__(self, what: Disturbance, seed: int) -> None:
        self.what, self.random = what, np.random.default_rng([20261122, seed])
        length = BLOCKS * (HOLD + DRILL + STOP) + FINISH
        self.t = BEGIN - 1.0 + np.arange(int((length + 2.0) * HERTZ)) / HERTZ
        self.starts = BEGIN + HOLD + np.arange(BLOCKS) * (HOLD + DRILL + STOP)
        self.ends = BEGIN + PERIOD * np.arange(1, int(length / PERIOD))
        rate, self.driven = self._head_rate()
        self.head = self.random.uniform(0.0, math.tau) + integral(rate)
        self.string = self._followed(self.head) - self._lag() + self._shaken()
        self._carry()
        self._build_disc()

    def yaw(self, t: Array) -> Array:
        """Of a tube whose joint to the head is 0 (k,), rad."""
        return np.asarray(np.interp(t, self.t, self.shown))

    def is_turning(self, t: Array, settled: float) -> npt.NDArray[np.bool_]:
        """Cycles in which the head has been driven for ``settled`` s and still is."""
        since = t[:, None] - self.starts
        return np.any((since > settled) & (since <= DRILL), axis=1)

    def is_resting(self, t: Array, settled: float) -> npt.NDArray[np.bool_]:
        """Cycles of a stop that has lasted for ``settled`` s."""
        since = t[:, None] - self.starts - DRILL
        return np.any((since > settled) & (since <= STOP), axis=1)

    def _head_rate(self) -> tuple[Array, Array]:
        rate, driven = np.zeros((2, len(self.t)))
        for start in self.starts:
            u = self.t - start
            inside = (u >= 0.0) & (u <= DRILL)
            even = np.clip(np.minimum(RAMP * u, RAMP * (DRILL - u)), 0.0, SPEED)
            even = even * self._swing(u)
            even[(u > 0.5 * DRILL) & (RAMP * (DRILL - u) < math.radians(self.what.dead_stop_dps))] = 0.0
            back = u - DRILL - 2.0
            bump = np.where((back > 0.0) & (back < 3.0), np.sin(math.pi * back / 3.0) ** 2 / 1.5, 0.0)
            rate += even - math.radians(self.what.turns_back_deg) * bump
            driven += inside
        return rate, driven

    def _swing(self, u: Array) -> Array:
        stuck = 8.0 / 3.0 * np.sin(math.pi * u / 5.0) ** 4
        return np.asarray(stuck if self.what.stick_slip else 1.0 + self.what.ripple * np.sin(math.tau * u / 4.0))

    def _followed(self, head: Array) -> Array:
        """Through the play: driven at one flank, it runs on at a stop, and waits there for the head."""
        play = math.radians(self.what.backlash_deg)
        if play == 0.0:
            return head
        coast = np.zeros_like(head)
        for start in self.starts:
            u = self.t - start - DRILL
            coast[(u > 0.0) & (u < self.run_on)] = play * self.random.random() / (self.run_on * HERTZ)
        followed = head.copy()
        for k in range(1, len(head)):
            followed[k] = min(max(followed[k - 1] + coast[k], head[k]), head[k] + play)
        return followed

    def _lag(self) -> Array:
        """Twist (n,) rad, wound up in 2 s; steadily let go after each stop."""
        lag = np.zeros_like(self.t)
        for start in self.starts:
            end = start + DRILL + self.what.hold_s
            lag += np.interp(self.t, [start, start + 2.0, end, end + self.what.unwind_s], [0.0, 1.0, 1.0, 0.0])
        return np.asarray(math.radians(self.what.twist_deg) * lag)

    def _shaken(self) -> Array:
        if self.what.torsional_dps == 0.0:
            return np.zeros_like(self.t)
        angle = integral(self._band())
        return np.asarray(math.radians(self.what.torsional_dps) * self.driven * (angle - angle.mean()))

    def _band(self) -> Array:
        """Noise of rms 1 between 20 and 300 Hz (n,)."""
        from scipy.signal import butter, sosfilt  # a second, which only a world with vibration or a filter pays

        sections = butter(4, [20.0, 300.0], "bandpass", fs=HERTZ, output="sos")
        noise = sosfilt(sections, self.random.standard_normal(len(self.t)))
        return np.asarray(noise / noise.std())

    def _carry(self) -> None:
        """Direction of the hole at the tube, and what its frame turns by against the smallest rotation from down."""
        lean, share = math.radians(self.what.inclination_deg), (self.head - self.head[0]) / TURNED
        self.azimuth = 0.7 + math.radians(self.what.azimuth_turn_deg) * share
        coarse = slice(None, None, 50)
        axis = np.stack([math.sin(lean) * np.cos(self.azimuth), math.sin(lean) * np.sin(self.azimuth)], axis=1)
        axis = np.concatenate([axis, np.full((len(axis), 1), math.cos(lean))], axis=1)
        least = smallest(np.broadcast_to([0.0, 0.0, 1.0], axis[coarse].shape), axis[coarse])
        step = smallest(axis[coarse][:-1], axis[coarse][1:])
        carried = np.einsum("kji,kjl,klm->kim", least[1:], step, least[:-1])  # turns about the axis itself
        gamma = np.concatenate([[0.0], np.cumsum(np.arctan2(carried[:, 1, 0], carried[:, 0, 0]))])
        self.shown = self.string + np.interp(self.t, self.t[coarse], gamma)
        across = np.cross(axis, np.gradient(axis, 1.0 / HERTZ, axis=0)) if self.what.azimuth_turn_deg else 0.0 * axis
        cos, sin = np.cos(self.shown), np.sin(self.shown)
        grid = [np.interp(self.t, self.t[coarse], least[:, i, j]) for i in range(3) for j in range(2)]
        xs, ys = np.stack(grid[::2], axis=1), np.stack(grid[1::2], axis=1)
        self._frame = (xs * cos[:, None] + ys * sin[:, None], ys * cos[:, None] - xs * sin[:, None], axis)
        self._across = across

    def sensor(self, joint: float, phase: float) -> Cycles:
        """An IMU in a tube whose joint to the head is ``joint`` (rad), its cycles ``phase`` (s) after the encoder's."""
        what, random, n = self.what, self.random, len(self.t)
        x, y, z = self._frame
        c, s = math.cos(joint), math.sin(joint)
        frame = (c * x + s * y, c * y - s * x, z)
        spin = np.gradient(self.string, 1.0 / HERTZ)
        rate = np.stack([np.sum(a * self._across, axis=1) for a in frame[:2]] + [spin], axis=1)
        rate = rate + what.earth * np.stack([0.6428 * a[:, 0] - 0.766 * a[:, 2] for a in frame], axis=1)
        force = np.stack([-G * a[:, 2] for a in frame], axis=1)
        force[:, 0] -= LEVER * spin**2
        force[:, 1] += LEVER * np.gradient(spin, 1.0 / HERTZ)
        shake = np.where(self.driven > 0.0, what.turning_g, what.resting_g)
        if np.any(shake > 0.0):
            force = force + 9.80665 * shake[:, None] * np.stack([self._band() for _ in range(3)], axis=1)
        values, cut, heat = self._with_errors(rate, force)
        ends = self.ends + phase
        if what.frames_hz:
            mean, late, std, parts = self._in_frames(values, ends)
        else:
            noise = np.concatenate([np.tile(GYRO_WHITE, (n, 1)), np.full((n, 3), FORCE_WHITE)], axis=1)
            measured = values + math.sqrt(HERTZ) * noise * random.standard_normal((n, 6))
            mean, late, std, parts = self._exact(measured, ends)
        borders = np.searchsorted(self.t, np.concatenate([[ends[0] - PERIOD], ends]))
        bits = [np.bitwise_or.reduce(cut[a:b]) for a, b in itertools.pairwise(borders)]
        return Cycles(mean[:, :3], mean[:, 3:], np.array(bits), late, std, parts, np.interp(ends, self.t, heat))

    def _with_errors(self, rate: Array, force: Array) -> tuple[Array, npt.NDArray[np.int64], Array]:
        """What the converters give but for white noise (n, 6), bits of what they clip, and how warm (C) they are."""
        what, random = self.what, self.random
        matrix = math.radians(what.lean_deg) * random.standard_normal((3, 3))
        np.fill_diagonal(matrix, 1.0 + 1e-3 * random.standard_normal(3))
        pull = math.radians(what.pull_dps_per_g) / G * random.standard_normal((3, 3))
        warm = 1.0 - np.exp(-np.maximum(self.t - BEGIN, 0.0) / 120.0)
        rate = rate + 0.5 * what.asymmetry * np.abs(rate)
        rate = rate @ matrix.T + force @ pull.T + math.radians(what.warm_up_dps) * warm[:, None]
        limits = math.radians(500.0), 8.0 * 9.80665
        cut = np.any(np.abs(rate) >= limits[0], axis=1) + 2 * np.any(np.abs(force) >= limits[1], axis=1)
        rate, force = np.clip(rate, -limits[0], limits[0]), np.clip(force, -limits[1], limits[1])
        constant = np.radians([0.02, -0.01, -0.02] + 0.005 * random.standard_normal(3))
        phi = math.exp(-1.0 / (HERTZ * WANDER_TAU))
        kicks = random.standard_normal(rate.shape)
        kicks[1:] *= math.sqrt(1.0 - phi * phi)
        from scipy.signal import lfilter

        wander = GYRO_WANDER * lfilter([1.0], [1.0, -phi], kicks, axis=0)
        offset = G * (what.force_bias_g or math.radians(0.002)) * random.standard_normal(3)
        return np.concatenate([rate + constant + wander, force + offset], axis=1), cut, 25.0 + what.warm_up_c * warm

    def _exact(self, values: Array, ends: Array) -> tuple[Array, Array, Array, Array]:
        """Means over the cycles and their eighths as their time stamps have them, and that nothing is late."""
        stamps, nothing = self._read_times(ends), np.zeros(len(ends))
        fine = np.interp(np.arange(8 * len(ends) + 1) / 8.0, np.arange(len(stamps)), stamps)
        summed = np.stack([np.interp(fine, self.t, integral(v)) for v in values.T], axis=1)
        parts = np.pad((np.diff(summed[:, 2]) / np.diff(fine)).reshape(-1, 8), ((0, 0), (1, 0)))
        parts *= 1.0 if self.what.increments else np.nan
        return np.diff(summed[::8], axis=0) / np.diff(stamps)[:, None], nothing, nothing, parts

    def _read_times(self, ends: Array) -> Array:
        """When a sensor is really read (m + 1,), s, whose node believes the ``ends`` of its cycles."""
        return np.append(ends[0] - PERIOD, ends) + self.what.jitter_ms / 1e3 * self.random.normal(size=len(ends) + 1)

    def _in_frames(self, values: Array, ends: Array) -> tuple[Array, Array, Array, Array]:
        """Means of the frames that a driver finds in a cycle, how late it says they are (s), its error, their parts."""
        what, delay = self.what, 0.0
        if what.low_pass_hz:
            from scipy.signal import butter, sosfilt, sosfilt_zi

            sections = butter(2, what.low_pass_hz, fs=HERTZ, output="sos")
            start = sosfilt_zi(sections)[:, :, None] * values[0]
            values = sosfilt(sections, values, axis=0, zi=start)[0]
            delay = 1.0 / (math.sqrt(2.0) * math.pi * what.low_pass_hz)
        step = 1.0 / (what.frames_hz * (1.0 + what.crystal))
        at = np.arange(self.t[0] + step * self.random.random(), self.t[-1], step)
        white = self.random.standard_normal((len(at), 6)) * np.concatenate([GYRO_WHITE, np.full(3, FORCE_WHITE)])
        frames = np.stack([np.interp(at, self.t, v) for v in values.T], axis=1) + math.sqrt(what.frames_hz) * white
        clock, mean, late = FrameClock(what.frames_hz), np.zeros((len(ends), 6)), np.zeros((len(ends), 2))
        parts = np.full((len(ends), 9), np.nan)
        borders = np.searchsorted(at, self._read_times(ends), side="right")
        for k, end in enumerate(ends):
            clock.on_read(float(end), int(borders[k + 1] - borders[k]))
            found, shown = frames[borders[k] : borders[k + 1]], clock.end - delay
            mean[k], late[k] = found.mean(axis=0), (end - shown, window_std(clock.std, delay))
            if k and (told := parts_of(found[:, 2], (shown - len(found) * clock.period, shown), end - PERIOD, end)):
                parts[k] = told
        return mean, late[:, 0], late[:, 1], parts

    def _build_disc(self) -> None:
        """Find every passage of a line, forward or backward."""
        what, turned = self.what, self.head - self.head[0]
        slip = what.belt_slip * turned
        wobble = math.radians(what.eccentricity_deg) * np.sin(self.head + self.random.uniform(0.0, math.tau))
        angle = self.head + wobble - slip
        if what.reversed:
            angle = 2.0 * self.head[0] - angle
        self._places = LINE_STD * self.random.standard_normal(LINES)
        lowest, highest = math.floor(angle.min() * LINES / math.tau) - 1, math.ceil(angle.max() * LINES / math.tau) + 1
        lines = np.arange(lowest, highest + 1)
        place = lines * math.tau / LINES + self._places[lines % LINES]
        passed = np.searchsorted(place, angle, side="right")  # lines below the disc's angle
        steps = np.diff(passed)
        k = np.repeat(np.arange(len(steps)), np.abs(steps))
        nth = np.arange(len(k)) - np.searchsorted(k, k)  # of the lines passed between two samples
        up = steps[k] > 0
        line = np.where(up, passed[k] + nth, passed[k] - 1 - nth)
        self._edges = self.t[k] + (place[line] - angle[k]) / (angle[k + 1] - angle[k]) / HERTZ
        self._after, self._up, self._first = lowest + np.where(up, line, line - 1), up, lowest + int(passed[0]) - 1

    def encoder(self) -> list[Aiding]:
        """What the encoder node makes of its counter in every cycle."""
        node, what, said = EncoderNode(), self.what, []
        for now in self.ends:
            k = int(np.searchsorted(self._edges, now, side="right")) - 1
            off = round(what.jump_deg / 360.0 * LINES) if now >= BEGIN + 85.0 else 0
            if what.index and now >= BEGIN + 85.0:
                turns = np.floor(np.interp([BEGIN + 85.0, now], self.t, self.head) / math.tau)
                off = off if turns[0] == turns[1] else 0
            if self.random.random() < what.outliers:
                off += round(self.random.standard_normal() / 360.0 * LINES)
            if k < 0:
                sample = EncoderSample(self._first + off, BEGIN, rising=True)
            else:
                since = k
                while since > max(k - 11, 0) and self._up[since - 1] == self._up[k]:
                    since -= 1
                before = tuple(self._edges[since:k][::-1].tolist())
                count, edge = int(self._after[k]) + off, float(self._edges[k])
                sample = EncoderSample(count, edge, bool(self._up[k]), earlier=before)
            said.append(node.on_cycle(sample, float(now)))
        return said


def integral(rate: Array) -> Array:
    """Integral (n,) of samples by trapezoids, from 0."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) / HERTZ)])


def smallest(a: Array, b: Array) -> Array:
    """Smallest rotations (k, 3, 3) that take the unit vectors ``a`` (k, 3) to ``b``: I + [v] + [v]^2 / (1 + a b)."""
    v, c = np.cross(a, b), np.sum(a * b, axis=1)
    skew = np.zeros((len(v), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    skew -= skew.transpose(0, 2, 1)
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + c)[:, None, None])
