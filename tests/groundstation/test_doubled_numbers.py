"""Two tubes of one number: which two is said, nothing of either is fused until one is told, one order undoes that."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hand_fed import COV
from hand_fed import Rig as HandFed
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SelectorError
from groundstation.service.string.doubled_numbers import NumberWatch
from telemetry.messages import EPOCH_UNKNOWN, ImuMean, NodeFlag, NodeMode, NodeState, SurveyMeasurement

TOP, MIDDLE, BOTTOM = 1, 2, 3  # places
UPPER_LEAN, LOWER_LEAN = 2.0, 6.0  # deg, by which the two of one number are told apart in what is fused


class Rig(HandFed):
    """Its tubes know the epoch of rig time."""

    def tell(self, tube: int, hops: int, scale: float = 0.0) -> None:
        del scale
        zero = (0.0, 0.0, 0.0)
        state = NodeState(
            tube, self.now, hops, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, zero, 0.0, 0.0, 1e-6, 0.1, 1e-8,
            NodeFlag.NONE, 5, 0, epoch=1,
        )  # fmt: skip
        self.tube.send_state(state, self.now)

    def measure(self, tube: int, sequence: int, hops: int, lean_deg: float) -> None:
        lean = math.radians(lean_deg)
        imus = (ImuMean((9.81 * math.sin(lean), 0.0, -9.81 * math.cos(lean)), COV),)
        yaw = 0.0, 1e-8, 1e-8
        message = SurveyMeasurement(tube, sequence, self.now, hops, imus, *yaw, 32, 20.0, NodeFlag.NONE, epoch=1)
        self.tube.mail.submit(message, self.now)
        self.run(2.0)
        self.read_depth(self.md)


def speak(rig: Rig, seconds: int = 8) -> None:
    """Two tubes of the number 2 with a tube 1 between them, a state of each a second."""
    for _ in range(seconds):
        for tube, hops in ((2, BOTTOM), (1, MIDDLE), (2, TOP)):
            rig.tell(tube, hops)
            rig.run(0.5)


def fused(rig: Rig) -> dict[float, float]:
    """Inclination (deg) by depth (m) of the stations that surveys made."""
    rows = rig.ask("stations")["stations"]
    return {row["md_m"]: round(row["inclination_deg"], 1) for row in rows if row["md_m"] > 0.0}


def alarm_of(rig: Rig) -> str:
    rig.run(1.0)
    return next((row["detail"] for row in rig.ask("alarms")["rig"] if row["code"] == "same_number"), "")


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig(tmp_path)
    rig.run(12.0)
    speak(rig)
    rig.depth(5.0)
    rig.measure(2, 1, BOTTOM, LOWER_LEAN)
    rig.measure(2, 1, TOP, UPPER_LEAN)
    rig.measure(1, 1, MIDDLE, 4.0)
    return rig


def tell(rig: Rig, which: str) -> None:
    rig.ground.operator.order("same_number", {"tube": "2", "which": which}, "anna")
    rig.run(2.0)


def test_it_is_told_which_two_and_nothing_of_either_is_fused(rig: Rig) -> None:
    told = alarm_of(rig)
    assert "tube 1 from the top" in told
    assert "tube 3 from the top" in told
    assert "same_number" in told
    assert fused(rig) == {3.0: 4.0}  # of the tube between them, by the place that it has among three
    verdict = rig.ask("verdict")
    assert verdict["verdict"] == "dont_know"
    assert any("shown as tube 1002" in why for why in verdict["why"])
    assert [row["tube"] for row in rig.ask("string")["tubes"]] == [1002, 1, 2]


@pytest.mark.parametrize(("which", "at", "lean"), [("upper", 1.0, UPPER_LEAN), ("lower", 5.0, LOWER_LEAN)])
def test_the_one_that_is_told_is_fused_at_its_place_and_one_order_undoes_it(
    rig: Rig, which: str, at: float, lean: float
) -> None:
    tell(rig, which)
    speak(rig, 3)
    assert fused(rig) == {3.0: 4.0, at: lean}
    assert alarm_of(rig) == ""
    assert [row["tube"] for row in rig.ask("string")["tubes"]] == ([2, 1, 1002] if which == "upper" else [1002, 1, 2])
    rig.ground.operator.order("setup", {"action": "undo"}, "anna")
    speak(rig, 3)
    assert fused(rig) == {3.0: 4.0}
    assert "tube 3 from the top" in alarm_of(rig)


def test_a_restart_forgets_neither_the_doubt_nor_what_was_told(rig: Rig, tmp_path: Path) -> None:
    rig.ground.close()
    again = Rig(tmp_path)
    assert fused(again) == {3.0: 4.0}
    again.run(12.0)
    assert "same_number" in again.alarms()
    tell(again, "lower")
    again.ground.close()
    assert fused(Rig(tmp_path)) == {3.0: 4.0, 5.0: LOWER_LEAN}


def test_what_was_surveyed_before_the_second_came_stays(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.run(12.0)
    for _ in range(4):
        rig.state(2, 1)
    rig.depth(2.0)
    rig.measure(2, 1, 1, 3.0)
    for _ in range(8):
        rig.state(2, 2)
        rig.state(2, 1)
    assert alarm_of(rig)
    assert fused(rig) == {2.0: 3.0}


def test_an_order_about_a_number_of_one_tube_is_refused(rig: Rig) -> None:
    with pytest.raises(SelectorError, match="tube 1: expected a number that two tubes give themselves"):
        rig.ground.operator.order("same_number", {"tube": "1", "which": "upper"}, "anna")


def test_what_both_number_is_no_gap_and_no_new_count(rig: Rig) -> None:
    rig.run(60.0)
    assert not {"numbers_missing", "tube_counts_anew"} & rig.alarms()


def state_at(at: float, hops: int, flags: NodeFlag = NodeFlag.NONE, epoch: int = 4) -> NodeState:
    zero = (0.0, 0.0, 0.0)
    return NodeState(
        7, at, hops, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, zero, 0.0, 0.0, 1e-6, 0.1, 1e-8, flags, 5, 0, epoch=epoch
    )


@given(
    st.lists(st.floats(0.1, 5.0), min_size=3, max_size=30),
    st.integers(1, 40),
    st.lists(st.integers(0, 29), max_size=3),
    st.randoms(use_true_random=False),
)
def test_a_string_that_grows_is_no_second_tube_however_its_states_come(
    waits: list[float], hops: int, added: list[int], order: object
) -> None:
    """Places grow by one where a tube was added, and states come late, twice and out of order."""
    times = [math.fsum(waits[: n + 1]) for n in range(len(waits))]
    states = [state_at(at, hops + sum(one <= n for one in added)) for n, at in enumerate(times)]
    states += states[::2]
    order.shuffle(states)  # type: ignore[attr-defined]
    watch = NumberWatch()
    assert [found for one in states if (found := watch.find_places(one))] == []


@given(st.integers(1, 40), st.integers(1, 5), st.floats(0.0, 1.0), st.floats(0.2, 2.0))
def test_two_that_speak_every_second_or_two_are_found_within_ten_states(
    hops: int, apart: int, shift: float, every: float
) -> None:
    watch, found = NumberWatch(), []
    for n in range(5):
        found += [
            watch.find_places(state_at(n * every, hops)),
            watch.find_places(state_at((n + shift) * every, hops + apart)),
        ]
    if 0.0 < shift < 1.0:
        assert [(one.upper, one.lower) for one in found if one][-1] == (hops, hops + apart)


@pytest.mark.parametrize("flags", [NodeFlag.CLOCK_UNSYNCHRONISED, NodeFlag.NONE])
def test_states_without_a_time_are_not_compared(flags: NodeFlag) -> None:
    watch, epoch = NumberWatch(), 4 if flags else EPOCH_UNKNOWN
    assert not any(watch.find_places(state_at(float(n), 1 + n % 2, flags, epoch)) for n in range(20))


@pytest.mark.parametrize(
    ("spoken", "left"),
    [
        (((2, 1), (1, 2)), [2, 1]),  # in its place hangs the right tube
        (((2, 1), (1, 2), (1, 3)), [2, 1001, 1]),  # one more was added above both
        (((2, 1),), [2, 1001, 1]),  # and nothing below it is heard
    ],
)
def test_what_was_hung_in_by_mistake_gives_way_to_the_tube_in_its_place(
    tmp_path: Path, spoken: tuple[tuple[int, int], ...], left: list[int]
) -> None:
    """A ground station that has lost its database met the stranger first: it has the place of no other tube."""
    rig = Rig(tmp_path)
    rig.run(12.0)
    for hops in (2, 1) * 8:
        rig.tell(1, hops)
        rig.run(0.5)
    rig.ground.operator.order("same_number", {"tube": "1", "which": "lower"}, "anna")
    assert rig.ground.model.string.tubes == [1001, 1]
    for _ in range(20):
        for tube, hops in spoken:
            rig.tell(tube, hops)
            rig.run(0.5)
    assert rig.ground.model.string.tubes == left
    rig.ground.close()
