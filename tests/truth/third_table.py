"""What a third world found, in the second world: its rows, whose constants each seed draws for itself.

The ranges are not those of the study: what a rule of the node rests on is to hold in both.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from second_table import MPU, Seen, drill
from second_world import BEGIN, DRILL, HERTZ, HOLD, Disturbance, SecondWorld

from telemetry.messages import Aiding

Array = npt.NDArray[np.float64]
CLEAN = Disturbance()
Draw = Callable[[np.random.Generator], "Befalls"]


@dataclass(frozen=True, slots=True)
class Befalls:
    """What befalls a string beside the disturbances of ``second_world``; all zero is nothing."""

    plain: Disturbance = CLEAN
    stands_s: float = 0.0  # of the counter, in the first turning
    lost_share: float = 0.0  # of the counts, faster than ``lost_above``
    lost_above: float = 0.0  # rad/s
    stuck_bit: int = -1  # of the counter
    creep: float = 0.0  # rad/s, of the string under a head at rest
    wound: float = 0.0  # rad, of a slow twist
    wind_s: float = 30.0
    let_go_s: float = 20.0
    slip: float = 0.0  # rad, of a joint after each stop
    run_on_s: float = 0.3
    late: float = 0.0  # s, of the sensor's filter beyond what the driver knows
    exchanged: bool = False  # x and y of the sensor, in the first turning
    whirl: tuple[float, float] = (0.0, 5.0)  # rad and Hz
    lost_cycle: bool = False  # on the first ramp
    stamp_step: float = 0.0  # s, of all time stamps, in the first turning
    swing_hertz: float = 0.0  # of a drive that sticks and slips, or ripples
    swing_share: float = 0.0
    unaided_s: float = 0.0  # from about the first stop on


class ThirdWorld(SecondWorld):
    """One seed of one row."""

    def __init__(self, befalls: Befalls, seed: int) -> None:
        self.befalls, draws = befalls, np.random.default_rng([20261127, seed])
        self.moment = BEGIN + HOLD + float(draws.uniform(23.0, 40.0))  # s, in the first turning
        self.unaided = BEGIN + HOLD + DRILL + float(draws.uniform(-10.0, 5.0))  # s, for ``unaided_s``
        self.run_on = befalls.run_on_s
        super().__init__(befalls.plain, seed)
        if befalls.lost_cycle:
            on_ramp = BEGIN + HOLD + float(draws.uniform(0.4, 1.9))
            self.lost = frozenset({int(np.searchsorted(self.ends, on_ramp))})

    def _swing(self, u: Array) -> Array:
        befalls = self.befalls
        if befalls.swing_hertz == 0.0:
            return super()._swing(u)
        return np.asarray(1.0 - befalls.swing_share * np.cos(math.tau * befalls.swing_hertz * u))

    def _lag(self) -> Array:
        befalls, lag = self.befalls, super()._lag()
        for start in self.starts:
            since, rest = self.t - start, self.t - start - DRILL
            grown = np.clip(np.minimum(since, DRILL) / befalls.wind_s, 0.0, 1.0)
            lag = lag + befalls.wound * grown * (1.0 - np.clip((rest - 4.0) / befalls.let_go_s, 0.0, 1.0))
            again = self.starts[self.starts > start + DRILL]
            most = float(again[0] - start - DRILL) if len(again) else math.inf
            back = np.clip((rest - most) / befalls.wind_s, 0.0, 1.0) if len(again) else 0.0
            lag = lag - befalls.creep * np.clip(rest, 0.0, most) * (1.0 - back)
            lag = lag - befalls.slip * np.clip((rest - 3.0) / 0.4, 0.0, 1.0)
        return np.asarray(lag)

    def _build_disc(self) -> None:
        """The counter of a disc that is held, or too slow, or one bit of which is stuck."""
        befalls, head = self.befalls, self.head
        steps = np.diff(head)
        gone = (self.t[1:] > self.moment) & (self.t[1:] <= self.moment + befalls.stands_s)
        fast = np.abs(steps) * HERTZ > befalls.lost_above
        counted = np.where(gone, 0.0, np.where(fast, (1.0 - befalls.lost_share) * steps, steps))
        self.head = head[0] + np.concatenate([[0.0], np.cumsum(counted)])
        super()._build_disc()
        self.head = head
        if befalls.stuck_bit >= 0:
            self._after, self._first = self._after | 1 << befalls.stuck_bit, self._first | 1 << befalls.stuck_bit

    def encoder(self) -> list[Aiding | None]:
        """What the encoder node makes of its counter in every cycle that the node hears of."""
        last = self.unaided + self.befalls.unaided_s
        heard = zip(self.ends.tolist(), super().encoder(), strict=True)
        return [None if self.unaided < end <= last else aiding for end, aiding in heard]

    def _with_errors(self, rate: Array, force: Array) -> tuple[Array, npt.NDArray[np.int64], Array]:
        """Of a tube that whirls, or of a sensor whose axes are exchanged."""
        lean, hertz = self.befalls.whirl
        around, driven = math.tau * hertz, (self.driven > 0.0)[:, None]
        c, s = np.cos(around * self.t), np.sin(around * self.t)
        cone = np.stack([-lean * around * c, -lean * around * s, 0.0 * c + around * (1.0 - math.cos(lean))], axis=1)
        rate = rate + np.where(driven, cone, 0.0)
        force = force + np.where(driven, 200.0 * lean * np.stack([c, s, 0.0 * c], axis=1), 0.0)
        if self.befalls.exchanged:
            later = (self.t > self.moment)[:, None]
            rate = np.where(later, rate[:, [1, 0, 2]], rate)
            force = np.where(later, force[:, [1, 0, 2]], force)
        return super()._with_errors(rate, force)

    def _exact(self, values: Array, ends: Array) -> tuple[Array, Array, Array, Array]:
        """Of readings that are taken later than they state."""
        return super()._exact(values, ends + np.where(ends > self.moment, self.befalls.stamp_step, 0.0))

    def _in_frames(self, values: Array, ends: Array) -> tuple[Array, Array, Array, Array]:
        """Of a filter that delays by more than the driver knows."""
        later = [np.interp(self.t - self.befalls.late, self.t, value) for value in values.T]
        return super()._in_frames(np.stack(later, axis=1), ends)


def log_uniform(random: np.random.Generator, least: float, most: float) -> float:
    """A constant that is drawn evenly in its logarithm."""
    return math.exp(random.uniform(math.log(least), math.log(most)))


def _play(random: np.random.Generator, least: float, most: float) -> Befalls:
    return Befalls(Disturbance(backlash_deg=0.1), run_on_s=log_uniform(random, least, most))


def _twist(random: np.random.Generator) -> Befalls:
    size, wind, let_go = log_uniform(random, 0.1, 1.0), random.uniform(10.0, 55.0), random.uniform(4.0, 32.0)
    return Befalls(wound=math.radians(size), wind_s=wind, let_go_s=let_go)


def _swing(random: np.random.Generator, share: float, least: float, most: float) -> Befalls:
    return Befalls(Disturbance(increments=False), swing_hertz=1.0 / random.uniform(least, most), swing_share=share)


def _slow_counter(random: np.random.Generator) -> Befalls:
    return Befalls(lost_share=log_uniform(random, 2e-4, 5e-3), lost_above=math.radians(random.uniform(35.0, 66.0)))


def bad_day(random: np.random.Generator, rigid: bool = False) -> Befalls:
    """Five to eight mild disturbances, by one integer; of a ``rigid`` string, which neither winds slowly nor creeps."""
    plain = {
        "ripple": random.uniform(0.03, 0.3),
        "eccentricity_deg": random.uniform(0.01, 0.05),
        "backlash_deg": random.uniform(0.02, 0.2),
        "outliers": random.uniform(0.005, 0.05),
        "jitter_ms": random.uniform(0.2, 2.0),
        "pull_dps_per_g": random.uniform(0.01, 0.1),
        "warm_up_dps": random.uniform(0.05, 0.3),
        "turning_g": random.uniform(0.2, 2.0),
        "torsional_dps": random.uniform(1.0, 10.0),
        "turns_back_deg": random.uniform(1.0, 10.0),
        "lean_deg": random.uniform(0.01, 0.05),
    }
    slow = {"wound": math.radians(random.uniform(0.05, 0.3)), "creep": math.radians(random.uniform(0.001, 0.005))}
    other = {**({} if rigid else slow), "run_on_s": log_uniform(random, 0.1, 2.0)}
    chosen = random.permutation([*plain, *other])[: random.integers(5, 9)].tolist()
    kept = {name: value for name, value in plain.items() if name in chosen}
    made = Befalls(Disturbance(**kept))
    return replace(made, **{name: value for name, value in other.items() if name in chosen})


LEANING = Disturbance(inclination_deg=30.0)
LATE = Disturbance(crystal=0.01, **MPU)
THIRD_ROWS: dict[str, Draw] = {
    "encoder stands for 1.2 s": lambda _: Befalls(stands_s=1.2),
    "encoder stands for 3 s": lambda _: Befalls(stands_s=3.0),
    "encoder stands for 20 s": lambda _: Befalls(stands_s=20.0),
    "axes x and y exchanged": lambda _: Befalls(exchanged=True),
    "string creeps at rest, 0.005 to 0.02 deg/s": lambda r: Befalls(creep=math.radians(log_uniform(r, 0.004, 0.025))),
    "the same at 30 deg of lean": lambda r: Befalls(LEANING, creep=math.radians(log_uniform(r, 0.004, 0.025))),
    "wound up slowly, 0.1 to 1 deg, let go at rest": _twist,
    "wound up slowly, let go at rest, at 30 deg of lean": lambda r: replace(_twist(r), plain=LEANING),
    "backlash 0.1 deg, run-on within 0.1 to 3 s": lambda r: _play(r, 0.08, 4.0),
    "backlash 0.1 deg, run-on within 1 s": lambda r: _play(r, 1.0, 1.001),
    "backlash 0.1 deg, run-on within 3 s": lambda r: _play(r, 3.0, 3.001),
    "a cycle lost on a ramp": lambda _: Befalls(lost_cycle=True),
    "low-pass 0.5 ms off its data sheet": lambda _: Befalls(LATE, late=5e-4),
    "low-pass 1 ms off its data sheet": lambda _: Befalls(LATE, late=1e-3),
    "counts lost above 40 to 65 deg/s, 2e-4 to 5e-3 of them": _slow_counter,
    "joint slips 0.1 to 1 deg at each turn back": lambda r: Befalls(
        Disturbance(turns_back_deg=r.uniform(1.0, 12.0)), slip=math.radians(log_uniform(r, 0.1, 1.0))
    ),
    "stick-slip of 0.45 to 0.62 s, means alone": lambda r: _swing(r, 1.0, 0.43, 0.64),
    "ripple of 30 %, 0.48 to 0.58 s, means alone": lambda r: _swing(r, 0.3, 0.46, 0.6),
    "forward whirl of 2 to 8 Hz": lambda r: Befalls(
        whirl=(math.radians(log_uniform(r, 0.05, 0.3)), r.uniform(1.5, 9.0))
    ),
    "one bit of the counter stuck": lambda r: Befalls(stuck_bit=int(r.integers(2, 7))),
    "time stamps step by 20 ms": lambda _: Befalls(Disturbance(increments=False), stamp_step=0.02),
    "untold twist of 1.5 to 3 deg, 30 s without aiding": lambda r: Befalls(
        Disturbance(twist_deg=r.uniform(1.4, 3.2)), unaided_s=30.0
    ),
    "a bad day: five to eight mild ones": bad_day,
    "a bad day of a string that neither winds nor creeps": lambda r: bad_day(r, rigid=True),
}


def drill_third(name: str, seed: int) -> Seen:
    """Take a node through a row's world of one seed."""
    befalls = THIRD_ROWS[name](np.random.default_rng([20261128, seed]))
    return drill(name, seed, ThirdWorld(befalls, seed))
