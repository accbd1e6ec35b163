"""A string whose tubes are held by hand: the one string in this process, its readings set by the test."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.config import GroundConfig
from groundstation.service.orders.order_book import SentOrder
from groundstation.service.process.ground_process import GroundProcess
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube_settings import TubeSettings
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from sim.rig.in_process import Build, InProcessStepper
from sim.rig.scheduler import Scheduler
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, BlockSegment, BlockStatus, Side
from telemetry.parameters import ParameterBlock
from telemetry.transport.authentication import new_key, read_key

# readings here hold no noise: a stuck sensor looks like them
NOISELESS = SensorLimits(repeats_together=0, repeats_alone=0)
HELD_S = 50_000.0  # longer than any test lasts


class HandWorld(World):
    """A string that hangs complete and is not drilled; the test turns and leans every tube as it likes."""

    def __init__(self, tubes: int, seed: int, before_cycle: Callable[[], None], **medium: float) -> None:
        usual = {"latency_ms": 3.0, "jitter_ms": 0.0, "loss": 0.0, "duplicate": 0.0}
        tables: dict[str, Any] = {
            "rig": {"tubes": tubes, "tubes_at_start": tubes, "tube_length_m": 2.0},
            "path": {"straight": {}},
            "schedule": {"add_s": HELD_S, "blocks": 1},
            "clocks": {"offset_std_s": 0.0, "drift_std_ppm": 0.0},
            "medium": usual | medium,
        }
        super().__init__(scenario_of(tables), seed)
        self.rate = {tube: np.zeros(3) for tube in range(1, tubes + 1)}  # rad/s
        self.force = {tube: np.array([0.0, 0.0, -9.81]) for tube in range(1, tubes + 1)}  # m/s^2
        self._before_cycle = before_cycle

    def imu_sample(self, tube: int, cycle: int) -> list[float]:
        return [float(x) for x in (*self.rate[tube], *self.force[tube], 30.0)]

    def encoder_sample(self, t: float) -> tuple[int, float, int, float | None, tuple[float, ...]]:
        """The head stands; it is read first in every cycle."""
        self._before_cycle()
        return 0, t - 100.0, 1, None, ()


class Rig:
    """Surface end, drive head and tubes, top tube first, on one clock."""

    def __init__(self, folder: Path, tubes: list[int], seed: int = 0, **medium: float) -> None:
        assert tubes == list(range(len(tubes), 0, -1))
        self.folder = folder
        self.key_file = new_key(folder / "rig.key")
        self.sent: list[int] = []  # indices of the segments that left the ground station
        self.said: list[BlockStatus] = []
        self.world = HandWorld(len(tubes), seed, self.cycle, **medium)
        self.rate, self.force = self.world.rate, self.world.force
        builders: dict[int, Build] = {address: lambda a=address: self.build(a) for address in (BASE, ENCODER, *tubes)}  # type: ignore[misc]
        self.stepper = InProcessStepper(builders)
        self.scheduler = Scheduler(self.world, self.stepper, self.stepper.follow)
        self.processes = self.stepper.processes
        self.now = self.world.begin
        self.scheduler.begin()

    def build(self, address: int) -> GroundProcess | EncoderProcess | TubeProcess:
        """A process, in its folder."""
        folder = self.folder / str(address)
        if address == BASE:
            ground = GroundProcess(GroundConfig(folder=folder, key_file=self.key_file))
            self.watch(ground)
            return ground
        if address == ENCODER:
            return EncoderProcess(folder)
        return TubeProcess(TubeSettings(address, limits=NOISELESS), folder, key=read_key(self.folder / "rig.key"))

    def start(self, address: int) -> None:
        """Start a process once more, as after a power cut."""
        if address == BASE:
            self.ground.store.close()
        self.processes[address] = self.build(address)

    def part(self, upper: int, lower: int) -> None:
        """Open a joint: nothing passes between the two."""
        self.scheduler.channel.severed |= {(upper, Side.LOWER), (lower, Side.UPPER)}

    def join(self, upper: int, lower: int) -> None:
        """Close it again."""
        self.scheduler.channel.severed -= {(upper, Side.LOWER), (lower, Side.UPPER)}

    def cycle(self) -> None:
        """What happens before a cycle is read; for a subclass."""

    def watch(self, ground: GroundProcess) -> None:
        send, hear = ground.endpoint.mail.send_segment, ground.operator.on_block_status

        def sending(segment: BlockSegment) -> None:
            self.sent.append(segment.index)
            send(segment)

        def hearing(status: BlockStatus) -> None:
            self.said.append(status)
            hear(status)

        ground.endpoint.mail.send_segment = sending  # type: ignore[method-assign]
        ground.operator.on_block_status = hearing  # type: ignore[method-assign]

    @property
    def ground(self) -> GroundProcess:
        process = self.processes[BASE]
        assert isinstance(process, GroundProcess)
        return process

    def tube(self, tube: int) -> TubeProcess:
        process = self.processes[tube]
        assert isinstance(process, TubeProcess)
        return process

    def run(self, duration: float, until: Callable[[], bool] = lambda: False) -> None:
        """Let ``duration`` (s) of rig time pass, or less where ``until`` holds before."""
        end = self.now + duration
        self.scheduler.advance(end, until)
        self.now = max(self.now, min(end, self.scheduler.now)) if until() else end

    def upload(self, block: ParameterBlock, patience: float = 200.0) -> BlockStatus:
        """Upload a block and wait for the tube's last word on it."""
        order = self.ground.operator.upload(block)
        self.run(patience, lambda: order.ended)
        assert order.ended
        return next(status for status in reversed(self.said) if status.sequence == order.number)

    def order(self, tube: int, name: str, **arguments: float | str) -> SentOrder:
        """Order something of a tube and wait for its answer."""
        order = self.ground.operator.command(tube, name, arguments)
        self.run(60.0, lambda: order.answered)
        assert order.answered
        return order

    def codes(self, tube: int) -> list[str]:
        return [event.code for event in self.ground.model.string.events if event.tube == tube]
