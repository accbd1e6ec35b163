"""Rig time on a chip: exchanges with a neighbour whose crystal, account and delays are drawn; the truth is known."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from c_library import load_checked
from needed_programs import needs_gcc

from telemetry.application.clock import ClockFilter
from telemetry.messages import TimeReply

FIRMWARE = Path(__file__).parents[2] / "firmware"
UNKNOWN = 2**63 - 1
pytestmark = needs_gcc
FIELDS = ("asked_us", "received_us", "replied_us", "rig_us", "rig_var", "rig_rate")


class Reply(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_int64) for name in FIELDS), ("epoch", ctypes.c_uint32)]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    loaded = load_checked(tmp_path_factory.mktemp("clock"), [FIRMWARE / "chip_clock.c"], f"-I{FIRMWARE}")
    for name in ("rig_from_local", "local_from_rig", "variance", "rig_rate", "take_step", "drift_std"):
        getattr(loaded, f"clock_{name}").restype = ctypes.c_int64
    return loaded


def told_reply(reply: Reply) -> TimeReply:
    """The same reply as Python's filter takes it."""
    times = [getattr(reply, name) / 1e6 for name in FIELDS[:4]]
    return TimeReply(*times, reply.rig_rate / 1e9, reply.rig_var / 1e12, reply.epoch)


class Pair:
    """A chip and its neighbour: two crystals, and rig time as the neighbour knows it."""

    def __init__(self, library: ctypes.CDLL, seed: int, begin_us: int = 0, epoch: int = 4) -> None:
        self._library, self._state = library, (ctypes.c_uint64 * 64)()
        self.random = np.random.default_rng(seed)
        self.own_rate, self.other_rate = 1.0 + 50e-6 * self.random.normal(size=2)
        self.own_offset, self.other_offset = self.random.uniform(-1e12, 1e12, 2)
        self.told_off = self.random.normal(0.0, 500.0)  # us, of the neighbour's own account
        self.tell: Callable[[TimeReply, float], object] = lambda reply, back: None
        self.now, self.epoch, self.least, self.queue = float(begin_us), epoch, 800.0, 1500.0

    def own(self, at: float) -> int:
        return round(at * self.own_rate + self.own_offset)

    def other(self, at: float) -> int:
        return round(at * self.other_rate + self.other_offset)

    def exchange(self, wait_s: float) -> None:
        """One question and its answer after a while."""
        self.now += wait_s * 1e6
        there, back = self.least + self.random.exponential(self.queue, 2)
        received, replied = self.now + there, self.now + there + 300.0
        reply = Reply(
            self.own(self.now), self.other(received), self.other(replied), round(replied + self.told_off),
            500**2, round(1e9 / self.other_rate), self.epoch,
        )  # fmt: skip
        self.now = replied + back
        self.tell(told_reply(reply), self.own(self.now) / 1e6)
        self._library.clock_exchange(self._state, ctypes.byref(reply), ctypes.c_int64(self.own(self.now)))

    def ask(self, name: str, *given: int) -> int:
        return int(getattr(self._library, f"clock_{name}")(self._state, *map(ctypes.c_int64, given)))

    def error(self) -> tuple[float, float]:
        """Error of rig time now (us), and its stated standard deviation."""
        return self.ask("rig_from_local", self.own(self.now)) - self.now, self.ask(
            "variance", self.own(self.now)
        ) ** 0.5


def followed(pair: Pair) -> Iterator[float]:
    """Errors in sigmas, over a quick start and an hour at the slow pace."""
    for k in range(400):
        pair.exchange(1.0 if k < 30 else 10.0)
        error, std = pair.error()
        yield error / std


def test_rig_time_is_as_good_as_it_says(library: ctypes.CDLL) -> None:
    """From the tenth exchange on, when the shortest trip is known; before it the first ones may have waited one way."""
    ratios = np.array([list(followed(Pair(library, seed)))[10:] for seed in range(40)])
    assert np.abs(ratios).max() < 5.0
    assert 0.7 < (ratios**2).mean() < 1.4
    for seed in range(10):
        pair = Pair(library, seed)
        for _ in followed(pair):
            pass
        error, std = pair.error()
        assert abs(error) < 2500.0
        assert std < 800.0  # the neighbour's own 500 and the queues


def test_it_is_the_filter_that_python_has(library: ctypes.CDLL) -> None:
    """Of the same exchanges, rounded as signals round them: time, its deviation, and what it was put right by."""
    for seed in range(20):
        pair = Pair(library, seed)
        beside = ClockFilter()
        pair.tell = lambda reply, back, beside=beside: beside.exchange(reply, back)
        for k in range(200):
            pair.exchange(1.0 if k < 30 else 10.0)
            local = pair.own(pair.now)
            ours, theirs = pair.ask("rig_from_local", local), beside.rig_from_local(local / 1e6) * 1e6
            assert abs(ours - theirs) < 50.0, (seed, k)  # of a deviation of 500
            std = math.sqrt(beside.variance(local / 1e6)) * 1e6
            assert pair.ask("variance", local) ** 0.5 == pytest.approx(std, rel=0.02, abs=3.0)
            assert pair.ask("drift_std") == pytest.approx(1e9 * math.sqrt(beside._p[2]), rel=0.02, abs=3.0)
            stepped, told = pair.ask("take_step"), beside.take_step()
            assert stepped == UNKNOWN if math.isnan(told) else stepped == pytest.approx(1e6 * told, abs=50.0)


@pytest.mark.parametrize("seed", range(4))
def test_rig_time_runs_at_the_rate_that_is_told(library: ctypes.CDLL, seed: int) -> None:
    """Over an hour, before and after now: a rate has steps of 1e-9, a time of 1 us."""
    pair = Pair(library, seed)
    for _ in followed(pair):
        pass
    local, hour = pair.own(pair.now), 3_600_000_000
    told = round(1e9 / pair.other_rate) / 1e9
    drift = pair.ask("rig_rate") / 1e9 - told  # of the neighbour's clock against the own
    assert min(abs(drift), abs(told - 1.0)) > 1e-6
    rate = (1.0 + drift) * told
    now = pair.ask("rig_from_local", local)
    for apart in (hour, -hour):
        assert pair.ask("rig_from_local", local + apart) - now == pytest.approx(apart * rate, abs=hour * 1.5e-9 + 3.0)


def test_time_is_carried_between_exchanges_with_the_drift_that_was_seen(library: ctypes.CDLL) -> None:
    pair = Pair(library, 3)
    for _ in followed(pair):
        pass
    before = pair.error()
    pair.now += 120e6
    after = pair.error()
    assert abs(after[0] - before[0]) < 200.0  # of 6000 us that 50 ppm are
    assert after[1] < 1500.0


def test_there_and_back_is_the_same_time(library: ctypes.CDLL) -> None:
    pair = Pair(library, 5)
    for _ in range(50):
        pair.exchange(10.0)
    for ahead in (-3e8, -1.0, 0.0, 7.0, 4e9):
        rig = round(pair.now + ahead)
        assert abs(pair.ask("rig_from_local", pair.ask("local_from_rig", rig)) - rig) <= 2


def test_nothing_is_known_before_and_a_step_is_told_once(library: ctypes.CDLL) -> None:
    pair = Pair(library, 7)
    assert pair.ask("variance", 0) == UNKNOWN
    pair.exchange(1.0)
    assert pair.ask("take_step") == UNKNOWN  # rig time is known since now
    assert pair.ask("take_step") == 0
    pair.exchange(1.0)
    pair.ask("take_step")
    pair.told_off += 900.0  # the neighbour has put its own account right
    pair.exchange(1.0)
    assert 0 < abs(pair.ask("take_step")) < 5000
    assert pair.ask("take_step") == 0
    pair.epoch = 5
    pair.exchange(1.0)
    assert pair.ask("take_step") == UNKNOWN


def test_a_neighbour_that_has_started_anew_is_followed_at_the_third_exchange(library: ctypes.CDLL) -> None:
    pair = Pair(library, 9)
    for _ in range(60):
        pair.exchange(10.0)
    pair.other_offset += 5e9
    errors = []
    for _ in range(4):
        pair.exchange(1.0)
        errors.append(abs(pair.error()[0]))
    assert errors[-1] < 10_000.0


@pytest.mark.parametrize(("trip", "counts"), [(-5e3, 0), (2.5e6, 0)])
def test_an_impossible_trip_is_ignored(library: ctypes.CDLL, trip: float, counts: int) -> None:
    pair = Pair(library, 11)
    pair.least, pair.queue = trip / 2.0, 1e-9
    pair.exchange(1.0)
    assert (pair.ask("variance", 0) != UNKNOWN) == counts
