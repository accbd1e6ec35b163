"""A tube under its own clock, its time told by the test: overruns, the account of its timing, its end."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.timed import TimedImu
from node.process.tube_process import TubeProcess
from telemetry.application.endpoint import Endpoint
from telemetry.media.memory import joined_ports
from telemetry.messages import BASE, Command, Event, NodeState, Reply, Side
from telemetry.runtime.own_clock import OwnClock, Schedule, run_cycle, send_due_frames
from telemetry.runtime.timing import CycleStage, CycleTiming

BEGIN = 500.0
STEP = 0.005  # s


@dataclass(frozen=True)
class ToldClock(OwnClock):
    """Shows the moments of a list, each once."""

    moments: tuple[float, ...] = ()

    def now(self) -> float:
        return next(self.shown)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shown", iter(self.moments))


class Pair:
    """A tube below a base station that hears all it says."""

    def __init__(self, folder: Path, timing: CycleTiming | None) -> None:
        times = BEGIN - 1.0 + 0.1 * np.arange(1200.0)
        np.save(folder / "imu.npy", np.column_stack([times, np.tile([0.0, 0.0, 0.01, 0.0, 0.3, -9.8], (1200, 1))]))
        source = TimedImu(folder / "imu.npy")
        self.process = TubeProcess(TubeSettings(1, state_every=1), folder, imus=[source], timing=timing)
        self.base = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1)
        self.timing = timing or CycleTiming()
        self.schedule = Schedule(BEGIN, PERIOD)
        self.began = BEGIN
        self.heard: list[object] = []
        self._on_the_wire: list[bytes] = []
        above, below = joined_ports(latency=0.0)
        above.listen(self._on_the_wire.append)
        self._ports = {Side.UPPER: below}

    def cycle(self, late: float, lasting: float) -> None:
        """One cycle, late by and lasting for the given times (s), and all frames that follow from it."""
        self.process.on_timer(self.schedule.halfway)
        start = self.schedule.due + late
        clock = ToldClock(moments=(start, start + lasting))
        self.began = run_cycle(self.process, self._ports, self.schedule, self.began, clock, self.timing)
        now = start + lasting
        self.base.advance(now)
        for _ in range(12):
            now += STEP
            for _, frame in self.base.take_frames(now):
                self.process.on_frame(Side.UPPER, frame.payload, now)
            send_due_frames(self.process, self._ports, now)
            for frame in self._on_the_wire:
                self.heard += [received.message for received in self.base.receive(Side.LOWER, frame, now)]
            self._on_the_wire.clear()

    def told(self, kind: type) -> list:
        return [message for message in self.heard if isinstance(message, kind)]


def test_an_overrun_is_counted_told_once_and_covered_by_the_next_reading(tmp_path: Path) -> None:
    pair = Pair(tmp_path, CycleTiming())
    for _ in range(4):
        pair.cycle(0.001, 0.02)
    assert (pair.timing.cycles, pair.timing.overruns) == (4, 0)
    pair.cycle(0.0, 2.5 * PERIOD)
    assert (pair.timing.overruns, pair.timing.missed) == (1, 2)
    assert pair.schedule.due == pytest.approx(BEGIN + 8 * PERIOD)
    pair.cycle(0.0, PERIOD)
    for _ in range(4):
        pair.cycle(0.0, 0.02)
    assert pair.timing.overruns == 2
    overruns = [event for event in pair.told(Event) if event.code == "overrun"]
    assert [event.arguments for event in overruns] == [{"missed": 2, "overruns": 1}]
    assert pair.told(NodeState)[-1].overruns == 2
    assert "clock_jumped" not in {event.code for event in pair.told(Event)}
    assert pair.timing.stages[CycleStage.START].largest == pytest.approx(0.001)


@pytest.mark.parametrize("measured", [True, False])
def test_the_timing_is_told_up_the_chain_only_by_a_node_that_measures(tmp_path: Path, measured: bool) -> None:
    pair = Pair(tmp_path, CycleTiming() if measured else None)
    pair.cycle(0.0, 0.02)
    pair.base.mail.command(Command(1, 77, "timing"), BEGIN + PERIOD)
    for _ in range(3):
        pair.cycle(0.0, 0.02)
    (reply,) = pair.told(Reply)
    assert reply.done is measured
    assert reply.detail == ("" if measured else "expected a node with a clock of its own")
    if measured:
        assert (reply.values["cycles"], reply.values["overruns"]) == (2, 0)
        for stage in ("start", "read", "filter", "report", "send", "cycle"):
            assert 0.0 <= reply.values[f"{stage}_p99"] <= reply.values[f"{stage}_max"]


def test_a_process_that_is_asked_to_end_keeps_its_newest_state(tmp_path: Path) -> None:
    pair = Pair(tmp_path, CycleTiming())
    for _ in range(5):
        pair.cycle(0.0, 0.02)
    pair.process.close()
    again = TubeProcess(TubeSettings(1), tmp_path)
    assert again.state[0]["now_yaw"] == pair.process.state[0]["now_yaw"] != 0
