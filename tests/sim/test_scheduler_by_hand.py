"""What the scheduler of a rig hands out and does: every step to processes that only note it, beside the schedule."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from seeded_worlds import SEED, STRING, figure_of

from node.kernels.arithmetic.formats import PERIOD
from sim.errors import RigError
from sim.rig.rig_progress import RigProgress
from sim.rig.scheduler import AFTER_END, Scheduler
from sim.rig.stepper import Acted, Answer, FrameEvent
from sim.studies.scenarios import change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, Side
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.runtime.stepped import Due, Sent

LATENCY = 0.004
TABLES = change_sections(
    {name: table for name, table in STRING.items() if name != "medium"},
    medium={"latency_ms": 1e3 * LATENCY, "jitter_ms": 0.0, "loss": 0.0, "duplicate": 0.0},
)
FAULTS = ("kill-node:1@60+7.5",)
KEPT = Path(__file__).parents[1] / "data" / "scheduled_steps.json"
NEXT = 0.4  # s, after its newest event each process wants to wake


class NotingStepper:
    """Processes that are there as soon as they are wanted; at a cycle each sends its name out of both ends."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.there: set[int] = set()
        self.steps: list[tuple[int, Due, float, Any, bytes]] = []
        self.wanted: list[tuple[str, tuple[int, ...]]] = []
        self.hung: list[int] = []
        self.rounds = 0

    def follow(self, progress: RigProgress) -> None:
        self.there = set(progress.wanted) - set(progress.kill)
        told = progress.phase, tuple(progress.wanted)
        if not self.wanted or self.wanted[-1] != told:
            self.wanted.append(told)

    def alive(self) -> list[int]:
        return sorted(self.there)

    def wait_for(self, address: int, *, alive: bool, timeout: float) -> bool:
        del timeout
        return (address in self.there) == alive

    def wait_for_cue(self, name: str, timeout: float) -> Acted:
        raise AssertionError(f"{name} {timeout}")

    def drain_hung(self) -> list[int]:
        hung, self.hung = self.hung, []
        return hung

    def drop(self, address: int) -> None:
        self.there.discard(address)

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        self.rounds += 1
        answers = {}
        for address, events in sorted(steps.items()):
            self.steps += [(address, event.kind, event.at, event.data, bytes(frame)) for event, frame in events]
            if address not in self.there:
                continue
            sent = [
                (Sent(side, event.at), f"{address} {side.name} {event.at:.3f}".encode())
                for event, _ in events
                if event.kind is Due.CYCLE
                for side in Side
            ]
            wake = events[-1][0].at + NEXT
            is_over = self.world.true_time(address, wake) > self.world.end - 2.0
            answers[address] = Answer(sent, math.inf if is_over else wake)
        return answers


def run_noted() -> tuple[World, NotingStepper, bool]:
    world = World(scenario_of(dict(TABLES), FAULTS), SEED)
    stepper = NotingStepper(world)
    finished = Scheduler(world, stepper, stepper.follow).run()  # type: ignore[arg-type]
    return world, stepper, finished


def figure_of_steps(stepper: NotingStepper) -> dict[str, float]:
    """Number of events, and one figure of all of them in their order."""
    rows = [(address, int(kind), at, len(frame)) for address, kind, at, _, frame in stepper.steps]
    return {"events": len(rows), "figure": figure_of(rows)}


@pytest.fixture(scope="module")
def run() -> tuple[World, NotingStepper, bool]:
    return run_noted()


def of_kind(stepper: NotingStepper, address: int, kind: Due) -> list[tuple[float, Any, bytes]]:
    return [(at, data, frame) for a, k, at, data, frame in stepper.steps if (a, k) == (address, kind)]


def test_every_cycle_is_handed_over_once_while_its_process_has_power(run: Any) -> None:
    world, stepper, finished = run
    assert finished
    cycles = {address: of_kind(stepper, address, Due.CYCLE) for address in (ENCODER, 1, 2, 3)}
    for address, rows in cycles.items():
        phase = 0.0 if address == ENCODER else world.phase(address)
        ends = [world.cycle_end(k) + phase for k in range(world.cycles)]
        added = next((p.start for p in world.phases if p.kind == "add" and p.tube == address), world.begin)
        on = [at for at in ends if at - phase >= added]
        if address == 1:
            on = [
                at for at in on if not world.begin + 60.0 <= at - phase < world.begin + 67.5 or at < world.begin + 60.0
            ]
        times = [world.true_time(address, at) for at, _, _ in rows]
        assert abs(len(times) - len(on)) <= 2, address  # the cycle in which the power comes or goes may count
        assert {round((t - phase - world.begin) / PERIOD, 6) for t in times} <= {
            float(k + 1) for k in range(world.cycles)
        }
        for at, data, _ in rows:
            assert at - data[0] == pytest.approx(PERIOD, rel=1e-4)
    assert len(cycles[ENCODER]) == world.cycles


def test_what_a_cycle_shows_is_what_the_world_reads_then(run: Any) -> None:
    world, stepper, _ = run
    for at, data, _ in of_kind(stepper, 1, Due.CYCLE)[10:40:7]:
        cycle = round((world.true_time(1, at) - world.phase(1) - world.begin) / PERIOD) - 1
        assert data[1:] == world.imu_sample(1, cycle)
    for at, data, _ in of_kind(stepper, ENCODER, Due.CYCLE)[5:60:9]:
        assert tuple(data[1:]) == world.encoder_sample(at)


def test_the_ground_station_has_the_depth_and_a_moment_each_cycle(run: Any) -> None:
    world, stepper, _ = run
    depths = [(at, decode_message(data)) for at, data, _ in of_kind(stepper, BASE, Due.DEPTH)]
    assert len(depths) == world.cycles
    assert [message.sequence for _, message in depths] == list(
        range(depths[0][1].sequence, depths[0][1].sequence + len(depths))
    )
    for k, (at, message) in enumerate(depths):
        rig = world.cycle_end(k)
        assert at == world.local_clock(BASE, rig)
        assert message.at == pytest.approx(rig)
        assert message.md == pytest.approx(max(world.measured_depth(rig), 0.0), abs=1e-9)


def test_frames_come_a_latency_later_at_the_end_that_faces(run: Any) -> None:
    """From the base down to the bit; while a tube is added none passes the head, and none leaves the lowest end."""
    world, stepper, _ = run
    below = defaultdict(set)
    for address, kind, at, _, frame in stepper.steps:
        if kind not in (Due.UPPER_FRAME, Due.LOWER_FRAME):
            continue
        sender, side, sent_at = frame.decode().split()
        sender_address = int(sender)
        rig_sent, rig_came = world.true_time(sender_address, float(sent_at)), world.true_time(address, at)
        assert rig_came - rig_sent == pytest.approx(LATENCY, abs=6e-4)
        assert (side, kind) in (("LOWER", Due.UPPER_FRAME), ("UPPER", Due.LOWER_FRAME))
        upper, lower = (sender_address, address) if side == "LOWER" else (address, sender_address)
        below[upper].add(lower)
        if ENCODER in (upper, lower) and BASE not in (upper, lower):
            opened = [p for p in world.phases if p.kind == "add" and p.start <= rig_sent - 1e-9 < p.joint_closed - 1e-9]
            assert opened == [], frame
    assert below == {ENCODER: {1, 2, 3}, 2: {1}, 3: {2}, BASE: {ENCODER}}


def test_who_wants_to_wake_is_woken_then_and_no_more_where_something_came_before(run: Any) -> None:
    world, stepper, _ = run
    newest: dict[int, float] = {}
    for address, kind, at, _, _ in stepper.steps:
        if kind is Due.TIMER and address != BASE:
            assert at == pytest.approx(newest[address] + NEXT, abs=1e-6)
        newest[address] = at
    timers = of_kind(stepper, ENCODER, Due.TIMER)
    assert len(timers) > 0.2 * world.cycles


def test_tubes_are_wanted_as_they_are_added_and_one_without_power_is_not(run: Any) -> None:
    _, stepper, _ = run
    order = [wanted for _, wanted in stepper.wanted]
    assert order[0] == (ENCODER, BASE)
    phases = [phase for phase, _ in stepper.wanted]
    assert phases[0] == "starting"
    assert list(dict.fromkeys(phases)) == [
        "starting", "hold tube 1", "drill tube 1", "stop tube 1", "add tube 2", "drill tube 2", "stop tube 2",
        "add tube 3", "drill tube 3", "stop tube 3", "finish tube 3",
    ]  # fmt: skip
    assert (ENCODER, BASE, 1) in order
    without = [wanted for wanted in order if 2 in wanted and 1 not in wanted]
    assert len(without) >= 1
    assert sorted(order[-1]) == [ENCODER, 1, 2, 3, BASE]


def test_the_whole_of_it_is_what_it_was(run: Any) -> None:
    """Beside the rest: one figure of every event in its order."""
    assert figure_of_steps(run[1]) == pytest.approx(json.loads(KEPT.read_text()), rel=1e-9)


def test_what_hangs_is_ended_once_and_a_stop_ends_after_the_round() -> None:
    world = World(scenario_of(dict(TABLES)), SEED)
    stepper = NotingStepper(world)
    killed: list[tuple[int, ...]] = []

    def follow(progress: RigProgress) -> None:
        if progress.kill:
            killed.append(tuple(progress.kill))
        stepper.follow(progress)

    scheduler = Scheduler(world, stepper, follow)  # type: ignore[arg-type]
    scheduler.begin()
    scheduler.advance(world.begin + 5.0)
    assert scheduler.now <= world.begin + 5.0
    stepper.hung = [1]
    scheduler.advance(world.begin + 6.0)
    assert killed == [(1,)]
    rounds = stepper.rounds
    scheduler.stop()
    scheduler.advance()
    assert stepper.rounds == rounds


class RestlessStepper(NotingStepper):
    """Processes that ask to be woken again and again, until so many s after the schedule."""

    lasts = math.inf

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        at = max(self.world.true_time(address, event.at) for address, events in steps.items() for event, _ in events)
        rests = at > self.world.end + self.lasts
        return {
            address: Answer([], math.inf if rests else events[-1][0].at + NEXT) for address, events in steps.items()
        }


@pytest.mark.parametrize("lasts", [AFTER_END - 4.0 * NEXT, math.inf])
def test_who_finds_no_rest_after_the_schedule_is_named(lasts: float) -> None:
    world = World(scenario_of(dict(TABLES)), SEED)
    stepper = RestlessStepper(world)
    stepper.lasts = lasts
    scheduler = Scheduler(world, stepper, stepper.follow)  # type: ignore[arg-type]
    scheduler.begin(world.end - 1.0)
    if math.isfinite(lasts):
        scheduler.advance()
        assert scheduler.now > world.end + lasts
        return
    with pytest.raises(RigError, match=r": expected rest within 120 s after the schedule, steps are still") as refused:
        scheduler.advance()
    assert sorted(str(refused.value).partition(":")[0].split(", ")) == ["1", "base", "encoder"]
    assert world.end + AFTER_END - 2.0 * NEXT < scheduler.now <= world.end + AFTER_END


if __name__ == "__main__":
    KEPT.write_text(json.dumps(figure_of_steps(run_noted()[1]), indent=1) + "\n", encoding="utf-8")
