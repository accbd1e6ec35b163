"""How far a string twists below its drive head, in closed form: torque, stiffness, release, stick-slip.

A tube is a shaft: ``theta = T L / (G J)``, ``J = pi / 32 (D^4 - d^4)``. The torque of the bit is felt all the way up,
the wall's friction by what is above it. The torque comes with the start of the drive and goes after its stop by the
smooth step ``10 u^3 - 15 u^4 + 6 u^5``, so that rates and accelerations are derivatives. What friction traps stays
until the next tube is drilled.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sim.world.motion import Motion
from sim.world.scenario_file import TorsionSection

Array = npt.NDArray[np.float64]
Course = tuple[Array, Array, Array]  # a quantity in time and its two derivatives, (n,) each


def polar_moment(outer: float, inner: float) -> float:
    """J = pi / 32 (D^4 - d^4) of a tube, m^4, from its diameters in m."""
    return math.pi / 32.0 * (outer**4 - inner**4)


def torsional_stiffness(section: TorsionSection, tube_length: float) -> float:
    """G J / L of one tube, N m/rad."""
    moment = polar_moment(section.outer_diameter_m, section.inner_diameter_m)
    return section.shear_modulus_gpa * 1e9 * moment / tube_length


def smooth_step(t: Array, duration: float) -> Course:
    """From 0 at t = 0 to 1 at ``duration`` (s), with two continuous derivatives."""
    u = np.clip(t / duration, 0.0, 1.0)
    value = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    rate = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    return value, rate, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration**2


def product_rule(a: Course, b: Course) -> Course:
    """Product rule, twice."""
    return a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]


def blend_values(one: Course, other: Course, share: Course) -> Course:
    """``one`` (1 - share) + ``other`` share."""
    difference = (other[0] - one[0], other[1] - one[1], other[2] - one[2])
    moved = product_rule(difference, share)
    return one[0] + moved[0], one[1] + moved[1], one[2] + moved[2]


class StringTorsion:
    """Twist of every tube against the drive head.

    Parameters
    ----------
    section : of the scenario
    motion : of drive head and bit
    tube_length : m
    lengths : (blocks,) tubes in the string while each block of the motion is drilled
    trapped : (blocks,) part of the twist that stays after each
    """

    def __init__(
        self, section: TorsionSection, motion: Motion, tube_length: float, lengths: Array, trapped: Array
    ) -> None:
        self._section = section
        self._motion = motion
        self._length = tube_length
        self._tubes = np.asarray(lengths, float)
        self._trapped = np.asarray(trapped, float)
        self._compliance = 1.0 / (torsional_stiffness(section, tube_length) * tube_length)  # rad/(N m) a metre
        drills = [phase for phase in motion.phases if phase.kind == "drill"]
        self._starts = np.array([phase.start for phase in drills])
        self._ends = np.array([phase.end for phase in drills])
        self._depths = motion.depth(self._ends)[0]

    def twist(self, tube: int, t: Array) -> Course:
        """Angle (rad) by which the lower end of ``tube`` (1 is the lowest) lags the drive head at rig times (n,)."""
        block, started = self._block(t)
        loaded = self._loaded(tube, block, self._motion.depth(t))
        zero = np.zeros_like(t)
        before = self._left(tube, block - 1)
        kept = self._trapped[block]
        after = (kept * loaded[0], kept * loaded[1], kept * loaded[2])
        worn = blend_values(
            blend_values((before, zero, zero), loaded, self._wound(block, t)), after, self._released(block, t)
        )
        slip = product_rule(loaded, self._stick_slip(block, t))
        return started * (worn[0] + slip[0]), started * (worn[1] + slip[1]), started * (worn[2] + slip[2])

    def torque(self, t: Array) -> Array:
        """Torque of the drive (n,), N m: what its sensor reads."""
        block, started = self._block(t)
        section = self._section
        full = section.bit_torque_nm + section.wall_friction_nm_per_m * self._motion.depth(t)[0]
        wound, released = self._wound(block, t)[0], self._released(block, t)[0]
        return np.asarray(started * full * (wound * (1.0 - released) + self._stick_slip(block, t)[0]))

    def _block(self, t: Array) -> tuple[npt.NDArray[np.intp], Array]:
        index = np.searchsorted(self._starts, t, side="right") - 1
        return np.maximum(index, 0), (index >= 0).astype(float)

    def _wound(self, block: npt.NDArray[np.intp], t: Array) -> Course:
        return smooth_step(t - self._starts[block], self._section.wind_s)

    def _released(self, block: npt.NDArray[np.intp], t: Array) -> Course:
        section = self._section
        return smooth_step(t - self._ends[block] - section.release_after_s, section.release_s)

    def _loaded(self, tube: int, block: npt.NDArray[np.intp], depth: Course) -> Course:
        """Twist by the full torque with the bit at ``depth``: integral of T(s) / (G J) from the tube's end to the top.

        T(s) = T_bit + w min(s, depth), s from the bit; nothing for a tube that is not in the string yet.
        """
        d, speed, thrust = depth
        w, below = self._section.wall_friction_nm_per_m, (tube - 1) * self._length
        top = self._tubes[block] * self._length
        c = self._compliance * (self._tubes[block] >= tube)
        reached = np.maximum(d, below)
        inside = d > below
        torque_length = self._section.bit_torque_nm * (top - below)
        wall = w * (np.where(inside, 0.5 * (reached**2 - below**2), 0.0) + d * (top - reached))
        slope = w * (top - reached)
        bend = -w * inside
        return c * (torque_length + wall), c * slope * speed, c * (slope * thrust + bend * speed**2)

    def _left(self, tube: int, block: npt.NDArray[np.intp]) -> Array:
        """Twist trapped at the end of ``block``; none before the first."""
        known = np.maximum(block, 0)
        zero = np.zeros(len(known))
        loaded = self._loaded(tube, known, (self._depths[known], zero, zero))[0]
        return np.asarray((block >= 0) * self._trapped[known] * loaded)

    def _stick_slip(self, block: npt.NDArray[np.intp], t: Array) -> Course:
        """Swing of the torque while it is on, of its full size: a sin(2 pi f (t - start))."""
        amplitude, omega = self._section.stick_slip, 2.0 * math.pi * self._section.stick_slip_hz
        phase = omega * (t - self._starts[block])
        sine, cosine = amplitude * np.sin(phase), amplitude * np.cos(phase)
        done = self._released(block, t)
        on = product_rule(self._wound(block, t), (1.0 - done[0], -done[1], -done[2]))
        return product_rule((sine, omega * cosine, -(omega**2) * sine), on)
