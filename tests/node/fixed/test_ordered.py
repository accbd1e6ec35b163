"""What is ordered, in integers and in floats on the same readings: a whole alignment, and a whole static record."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from one_node import events_since, node_of

from node.firmware.alignment_orders import tube_rotation
from node.firmware.static_record import MOVED, begin_record
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.node_record import READING, SATURATED
from node.kernels.sensors.aligner import Reason, begin_alignment, drop_alignment
from node.kernels.sensors.alignment import CIRCLE, EXTREMES
from node.kernels.sensors.static_average import has_moved
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.node_step import SAY_RECORD, node_aiding, node_step

G = 9.81
NOISE = 0.02 * DEG
NOTHING_MORE = [0.0] * (READING - SATURATED)  # nothing at its range, nothing late, no parts
MOUNTS = (0.01, -0.02), (-0.03, 0.005), (0.02, 0.03)  # pitch and roll of each IMU


class Pair:
    """One node in floats and one in integers that read and hear the same."""

    def __init__(self, imus: int, lean: float = 4.0 * DEG, mount: tuple[float, float] = MOUNTS[0]) -> None:
        self.random = np.random.default_rng(imus)
        self.floats, self.fixed = node_of(imus, 0, self.random), FixedNode()
        record, parameters = self.floats[1][0], self.floats[2]
        parameters["identity"], record["noise"], record["weight"] = 1, 1.0, 1.0
        record["tilt_noise"], record["drive_angle"] = NOISE, 0.0
        record["place"][:3] = (0.02, 0.01), (-0.03, 0.0), (0.0, 0.05)
        self.integers = tuple(part.copy() for part in self.floats)
        angles = (mount, *MOUNTS[1:])[:imus]
        axes = [(math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)) for p, r in angles]
        self.imus = [tube_rotation(np.array(axis)).T for axis in axes]
        self.lean, self.noise, self.yaw, self.now, self.sequence = lean, NOISE, 0.3, 1000.0, 0
        self.told: list[tuple[Any, ...]] = []
        self.said = 0

    @property
    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Both records, floats first."""
        return self.floats[0], self.integers[0]

    def both(self, order: Callable[[Any], object]) -> None:
        """Give both the same order."""
        assert order(self.floats[0][0]) == order(self.integers[0][0])

    def read(self, spin: float) -> np.ndarray:
        """What the IMUs read in a cycle of this spin (rad/s) that ends now."""
        middle = self.yaw - 0.5 * spin * PERIOD
        down = np.array([math.cos(middle), -math.sin(middle), 0.0]) * math.sin(self.lean)
        down[2] = math.cos(self.lean)
        rows = []
        for k, imu in enumerate(self.imus):
            pull = -G * down
            pull[:2] -= spin * spin * self.floats[1][0]["place"][k]
            rate = imu @ np.array([0.0, 0.0, spin]) + self.random.normal(0.0, 1.6e-4, 3)
            rows.append([*rate, *(imu @ pull + self.random.normal(0.0, G * self.noise, 3)), 30.0, *NOTHING_MORE])
        return np.array(rows)

    def cycle(self, spin: float = 0.0, *, aided: bool = True) -> None:
        """One cycle, and an aiding after it; all that both say and tell has to be the same."""
        self.now, self.yaw = self.now + PERIOD, self.yaw + spin * PERIOD
        readings, moment = self.read(spin), np.array([self.now - PERIOD, self.now, 1.0, 1.0, 1e-6, 1.0, 0.0, 0.0])
        says = node_step(*self.floats, readings.copy(), moment), self.fixed.step(*self.integers, readings, moment)
        assert says[0] == says[1]
        self.said = says[0]
        one, other = (events_since(node, int(node[0]["events"]["said"])) for node in self.nodes)
        assert [event[0] for event in one] == [event[0] for event in other]
        for (name, *a), (_, *b) in zip(one, other, strict=True):
            np.testing.assert_allclose(b, a, rtol=1e-3, atol=2e-4, err_msg=name)
        self.told += one
        if aided:
            self.sequence += 1 if spin != 0.0 else 0
            heard = self.yaw % math.tau, 2e-8, 1e-6, 0.0, spin, self.now, self.sequence, 1.0, 20.0, 1e-8, 0.0, 1e-6
            gates = (
                node_aiding(*self.floats[:2], np.array(heard)),
                self.fixed.aiding(*self.integers[:2], np.array(heard)),
            )
            assert gates[0] == gates[1]

    def cycles(self, count: int, spin: float = 0.0, *, aided: bool = True) -> "Pair":
        """So many cycles."""
        for _ in range(count):
            self.cycle(spin, aided=aided)
        return self

    def numbers_of(self, name: str) -> list[Any]:
        """Numbers of the one event of this name."""
        (found,) = [event[1:] for event in self.told if event[0] == name]
        return list(found)

    def agree(self) -> None:
        """The alignment in use, and what the filter holds in the tube's frame, are the same in both."""
        one, other = (node[0] for node in self.nodes)
        for name in ("method", "aligning"):
            assert one["mount"][name] == other["mount"][name]
        np.testing.assert_allclose(other["mount"]["axis"], one["mount"]["axis"], atol=2e-7)
        np.testing.assert_allclose(other["mount"]["std"], one["mount"]["std"], rtol=2e-3, atol=1e-10)
        for name, near in {"down": 1e-6, "now_down": 1e-6, "bias": 1e-7, "static_bias": 1e-7}.items():
            np.testing.assert_allclose(other["filter"][name], one["filter"][name], atol=near, err_msg=name)
        np.testing.assert_allclose(other["filter"]["ring_rate"], one["filter"]["ring_rate"], atol=1e-7)
        np.testing.assert_allclose(other["filter"]["ring_force"], one["filter"]["ring_force"], atol=1e-5)


def ordered(imus: int = 1, method: int = CIRCLE, turns: float = 1.0, **built: Any) -> Pair:
    """Both nodes, at rest for a while and then ordered to align."""
    pair = Pair(imus, **built).cycles(120)
    pair.both(lambda node: begin_alignment(node, method, turns))
    return pair.cycles(3)


@pytest.mark.parametrize("spin", [5.0 * DEG, -9.0 * DEG])
@pytest.mark.parametrize(("imus", "method"), [(1, CIRCLE), (1, EXTREMES), (3, CIRCLE)])
def test_an_alignment_finds_the_same_mounts(imus: int, method: int, spin: float) -> None:
    pair = ordered(imus, method, 2.0)
    while pair.nodes[0][0]["aligner"]["method"]:
        pair.cycle(spin, aided=pair.random.random() < 0.8)
    assert [event[0] for event in pair.told].count("ALIGNED") == imus
    for node in pair.nodes:
        found = node[0]["mount"]["axis"][:imus]
        assert np.abs(found - [imu[:, 2] for imu in pair.imus]).max() < (3e-4 if method == EXTREMES else 1e-4)
    pair.agree()
    pair.cycles(10, spin).cycles(80)
    pair.both(lambda node: drop_alignment(node, pair.floats[1][0], int(Reason.ORDERED)))
    pair.cycles(40)
    pair.agree()
    assert pair.nodes[1][0]["mount"]["method"] == 0
    assert pair.fixed.overflows == 0


def stands(pair: Pair) -> None:
    pair.cycles(20, 5.0 * DEG).cycles(10)


def turns_back(pair: Pair) -> None:
    pair.cycles(20, 5.0 * DEG).cycles(2, -5.0 * DEG)


def loses_cycles(pair: Pair) -> None:
    pair.cycles(20, 5.0 * DEG)
    pair.now += 10.0
    pair.cycle(5.0 * DEG)


def never_turns(pair: Pair) -> None:
    pair.now += 0.1  # or the patience is a whole number of cycles, and the last bit says whether it is over
    pair.cycles(240)


def shakes(pair: Pair) -> None:
    pair.noise = 0.2 * DEG
    pair.cycles(200, 5.0 * DEG)


def turns(pair: Pair) -> None:
    pair.cycles(200, 5.0 * DEG)


REFUSED: dict[str, tuple[Callable[[Pair], object], Reason, dict[str, Any]]] = {
    "a stop": (stands, Reason.TOO_FEW_TURNS, {}),
    "too fast": (lambda pair: pair.cycles(8, 5.0 * DEG).cycles(1, 20.0 * DEG), Reason.TOO_FAST, {}),
    "a turn back": (turns_back, Reason.TURNED_BACK, {}),
    "lost cycles": (loses_cycles, Reason.CYCLES_LOST, {}),
    "no turn": (never_turns, Reason.NEVER_TURNED, {}),
    "shaking": (shakes, Reason.SHAKES, {}),
    "a plumb hole": (turns, Reason.LITTLE_LEAN, {"lean": 0.002 * DEG}),
    "a level hole": (turns, Reason.MUCH_LEAN, {"lean": 63.0 * DEG}),
    "a mount askew": (turns, Reason.LARGE_OFFSET, {"mount": (9.0 * DEG, 6.0 * DEG)}),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_alignment_is_refused_for_the_same_reason(case: str) -> None:
    happens, reason, built = REFUSED[case]
    pair = ordered(**built)
    happens(pair)
    assert pair.numbers_of("ALIGNMENT_REFUSED")[0] == reason
    assert [int(node[0]["aligner"]["method"]) for node in pair.nodes] == [0, 0]
    pair.agree()


def test_an_order_taken_back_before_its_first_cycle_can_be_given_again() -> None:
    """The integers have to see it although its bytes are those that they saw last."""
    pair = Pair(1).cycles(20)
    for _ in range(2):
        pair.both(lambda node: begin_alignment(node, CIRCLE, 1.0))
        heard = np.zeros(12)
        node_aiding(*pair.floats[:2], heard)
        pair.fixed.aiding(*pair.integers[:2], heard)
        pair.both(lambda node: drop_alignment(node, pair.floats[1][0], int(Reason.ORDERED)))
        node_aiding(*pair.floats[:2], heard)
        pair.fixed.aiding(*pair.integers[:2], heard)
    pair.both(lambda node: begin_alignment(node, CIRCLE, 1.0))
    pair.cycles(160, 5.0 * DEG)
    assert len(pair.numbers_of("ALIGNED")) == 10


@pytest.mark.parametrize("imus", [1, 3])
@pytest.mark.parametrize("disturbed", [False, True])
def test_a_static_record_is_the_same(imus: int, disturbed: bool) -> None:
    pair = Pair(imus)
    for command in (7, 8):
        pair.cycles(120)
        pair.both(lambda node, command=command: begin_record(node["recording"], 60.0, command, standing=True))
        pair.cycles(50)
        while not pair.said & SAY_RECORD:
            pair.cycle(0.5 * DEG if disturbed else 0.0)  # one that moves ends
        one, other = (node[0]["recording"] for node in pair.nodes)
        assert [one[name] for name in ("running", "command")] == [0, command]
        assert [other[name] for name in ("running", "command", "seconds")] == [0, command, 60.0]
        assert other["begun"] == pytest.approx(one["begun"], abs=1e-8)
        one, other = one["sums"], other["sums"]
        assert (other["samples"], other["moved"]) == (one["samples"], one["moved"])
        assert one["samples"] == (51 if disturbed else math.ceil(60.0 / PERIOD))
        assert has_moved(other, MOVED) == has_moved(one, MOVED) == int(disturbed)
        np.testing.assert_allclose(other["mean"], one["mean"], atol=2e-7)
        np.testing.assert_allclose(other["steps"], one["steps"], rtol=1e-3)
        scale = np.sqrt(np.outer(np.diag(one["scatter"]), np.diag(one["scatter"])))
        np.testing.assert_allclose(other["scatter"] / scale, one["scatter"] / scale, atol=1e-3)
        assert other["temperature"] == pytest.approx(30.0, abs=1e-4)
