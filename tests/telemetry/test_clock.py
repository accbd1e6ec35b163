"""Rig time down a chain of clocks that differ, over exchanges whose delays jitter."""

import math

import numpy as np
import pytest

from telemetry.application.clock import ClockFilter
from telemetry.messages import TimeReply

HOPS, LATENCY, JITTER = 10, 3e-3, 0.3e-3


class Clocks:
    """Ten nodes one below the other, each asking the one above: every second at first, every ten later."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.offset = 20.0 * self.random.standard_normal(HOPS)
        self.drift = 10e-6 * self.random.standard_normal(HOPS)
        self.filters = [ClockFilter() for _ in range(HOPS)]
        self.root = ClockFilter(is_root=True)
        self.next = [1000.0 + 0.05 * k for k in range(HOPS)]

    def local(self, k: int, t: float) -> float:
        return t if k < 0 else t + self.offset[k] + self.drift[k] * (t - 1000.0)

    def clock(self, k: int) -> ClockFilter:
        return self.root if k < 0 else self.filters[k]

    def ask(self, k: int, t: float) -> None:
        there, back = LATENCY + JITTER * self.random.standard_exponential(2)
        above = self.clock(k - 1)
        if above.synchronised:
            at = self.local(k - 1, t + there)
            reply = TimeReply(self.local(k, t), at, at, above.rig_from_local(at), above.rig_rate, above.variance(at))
            self.filters[k].exchange(reply, self.local(k, t + there + back))

    def run(self, duration: float) -> tuple[np.ndarray, np.ndarray]:
        """Errors and stated deviations (n, hops), s."""
        errors, stated = [], []
        for t in np.arange(1000.0, 1000.0 + duration, 0.5):
            for k, node in enumerate(self.filters):
                if t >= self.next[k]:
                    self.next[k] = t + (1.0 if node.exchanges < 30 else 10.0)
                    self.ask(k, t)
            if all(node.synchronised for node in self.filters):
                errors.append([n.rig_from_local(self.local(k, t)) - t for k, n in enumerate(self.filters)])
                stated.append([math.sqrt(n.variance(self.local(k, t))) for k, n in enumerate(self.filters)])
        return np.array(errors), np.array(stated)


@pytest.mark.slow
def test_errors_add_up_down_the_chain_and_do_not_grow_beyond() -> None:
    runs = [Clocks(seed).run(1800.0) for seed in range(12)]
    errors, stated = np.array([r[0][60:] for r in runs]), np.array([r[1][60:] for r in runs])
    assert np.abs(errors).max() < 1e-3
    late = np.sqrt((errors[:, 600:] ** 2).mean(axis=(0, 1)))
    assert late[-1] < 0.2e-3
    assert late[-1] < 1.5 * math.sqrt(HOPS) * late[0]
    normalised = (errors**2 / stated**2).mean(axis=(0, 1))
    assert normalised.max() < 1.5


@pytest.mark.slow
def test_what_a_clock_says_of_its_steps_and_its_drift_accounts_for_all_that_dates_move() -> None:
    """The error of a date, less the steps that were told: what is left is a rate that is off, by as much as is said."""
    normalised = []
    for seed in range(40):
        clocks = Clocks(seed)
        clocks.run(60.0 + seed)
        for node in clocks.filters:
            assert math.isnan(node.take_step())  # unknown before the first exchange
        t = clocks.next[-1] if seed % 2 else 1060.0 + seed
        before = [node.rig_from_local(clocks.local(k, t)) - t for k, node in enumerate(clocks.filters)]
        for k in range(HOPS):
            clocks.ask(k, t)
        for k, (node, error) in enumerate(zip(clocks.filters, before, strict=True)):
            later = t + 10.0
            stepped = node.take_step()
            assert node.take_step() == 0.0
            back = node.rig_from_local(clocks.local(k, t)) - t
            assert back + stepped == pytest.approx(error, abs=1e-6)  # put right a delay before
            moved = node.rig_from_local(clocks.local(k, later)) - later - back
            normalised.append(moved / (10.0 * node.drift_std))
    # an exchange of this world is off by half of what a clock takes it to be
    assert 0.05 < np.mean(np.square(normalised)) < 1.0
    assert np.max(np.abs(normalised)) < 3.0


@pytest.mark.parametrize("epoch", [2, 3])
def test_of_rig_time_of_another_start_no_step_is_known(epoch: int) -> None:
    node = ClockFilter()
    for k in range(5):
        asked = 1000.0 + k
        node.exchange(TimeReply(asked, asked, asked, asked, 1.0, 0.0, 2), asked + 2 * LATENCY)
    node.take_step()
    node.exchange(TimeReply(1005.0, 1005.0, 1005.0, 9005.0, 1.0, 0.0, epoch), 1005.0 + 2 * LATENCY)
    assert math.isnan(node.take_step()) == (epoch == 3)


def test_a_clock_that_jumped_knows_no_step() -> None:
    clocks = Clocks(4)
    clocks.run(60.0)
    node = clocks.filters[0]
    node.take_step()
    node.doubt(0.3)
    clocks.ask(0, 1061.0)
    assert math.isnan(node.take_step())
    clocks.ask(0, 1062.0)
    assert math.isfinite(node.take_step())


def test_a_clock_that_is_wrong_because_frames_waited_says_so() -> None:
    """The first exchanges on a busy machine, where each way waits 0.3 s in the mean and much longer now and then."""
    random, offset = np.random.default_rng(5), 17.0
    normalised = []
    for _ in range(500):
        node, at = ClockFilter(), 1000.0
        for there, back in random.exponential(0.3, (12, 2)):
            asked, at = at, at + there + LATENCY
            node.exchange(TimeReply(asked - offset, at, at, at, 1.0, 0.0), at + LATENCY + back - offset)
            error = node.rig_from_local(at - offset) - at
            normalised.append(error / math.sqrt(node.variance(at - offset)))
            at += 1.0
    beyond = np.abs(normalised) > 3.0
    assert beyond.mean() < 0.01
    assert np.mean(np.square(normalised)[~beyond]) < 1.0


def test_a_joint_that_is_slow_but_steady_is_believed_from_the_third_exchange_on() -> None:
    node, latency = ClockFilter(), 0.2
    stated = []
    for asked in (1000.0, 1001.0, 1002.0):
        at = asked + latency
        node.exchange(TimeReply(asked, at, at, at, 1.0, 0.0), at + latency)
        stated.append(math.sqrt(node.variance(asked)))
    assert stated[0] == pytest.approx(0.19, abs=1e-3)
    assert stated[1] > 0.1
    assert stated[2] < 1e-3


def test_another_neighbour_is_compared_anew_and_rig_time_goes_on() -> None:
    clocks = Clocks(1)
    clocks.run(120.0)
    node, t = clocks.filters[0], 1120.0
    before = node.rig_from_local(clocks.local(0, t))
    node.change_neighbour()
    assert node.rig_from_local(clocks.local(0, t)) == before
    reply = TimeReply(clocks.local(0, t), t + 500.0 + LATENCY, t + 500.0 + LATENCY, t + LATENCY, 1.0, 0.0)
    node.exchange(reply, clocks.local(0, t + 2 * LATENCY))
    assert node.rig_from_local(clocks.local(0, t)) == pytest.approx(t, abs=1e-3)
    assert node.exchanges == 1


def test_one_liar_is_not_believed_and_a_lasting_change_is() -> None:
    clocks = Clocks(2)
    clocks.run(120.0)
    node, t = clocks.filters[0], 1120.0
    for k in range(3):
        asked = clocks.local(0, t + k)
        reply = TimeReply(asked, t + k + 5.0, t + k + 5.0, t + k + 5.0, 1.0, 0.0)
        node.exchange(reply, clocks.local(0, t + k + 2 * LATENCY))
        off = node.rig_from_local(clocks.local(0, t + k)) - (t + k)
        assert abs(off) < 1e-3 if k < 2 else off == pytest.approx(5.0, abs=0.01)


def test_a_root_is_never_moved() -> None:
    root = ClockFilter(is_root=True)
    root.exchange(TimeReply(0.0, 9.0, 9.0, 9.0, 1.0, 0.0), 1.0)
    assert root.rig_from_local(5.0) == 5.0
    assert root.variance(5.0) == 0.0


@pytest.mark.parametrize("jump", [-40.0, -0.3, 0.02, 14.6])
def test_a_clock_that_is_told_of_its_jump_says_so_and_believes_the_next_exchange(jump: float) -> None:
    clocks = Clocks(3)
    clocks.run(120.0)
    node, t = clocks.filters[0], 1121.0
    clocks.offset[0] += jump
    local = clocks.local(0, t)
    node.doubt(jump)
    assert abs(node.rig_from_local(local) - t) < 1.1 * math.sqrt(node.variance(local))
    clocks.ask(0, t)
    local = clocks.local(0, t + 1.0)
    assert abs(node.rig_from_local(local) - t - 1.0) < 5e-3
    assert math.sqrt(node.variance(local)) < 5e-3


def test_a_reply_of_long_ago_that_comes_again_tells_no_time() -> None:
    """A ground station that has just started knows nothing better, and half of seven seconds would make it wrong."""
    recorded = TimeReply(1006.0, 1006.003, 1006.003, 1006.003, 1.0, 0.0, 2)
    started = ClockFilter()
    started.exchange(recorded, 1014.8)
    assert not started.synchronised
    started.exchange(TimeReply(1015.0, 1015.003, 1015.003, 1015.003, 1.0, 0.0, 2), 1015.006)
    assert started.rig_from_local(1015.006) == pytest.approx(1015.006, abs=1e-3)
    before = started.rig_from_local(1016.0)
    for _ in range(5):
        started.exchange(recorded, 1016.0)
    assert started.rig_from_local(1016.0) == before
