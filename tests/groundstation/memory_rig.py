"""A string in memory: ground station, encoder node and tubes as processes over joints with troubles, on one clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from groundstation.config import GroundConfig
from groundstation.service.orders import Order
from groundstation.service.process import GroundProcess
from node.firmware.sensor_faults import SensorLimits
from node.firmware.settings import TubeSettings
from node.kernels.layout import PERIOD
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from telemetry.media.memory import MemoryPort, joint
from telemetry.messages import BASE, ENCODER, BlockSegment, BlockStatus, Side
from telemetry.parameters import ParameterBlock
from telemetry.transport.authentication import new_key, read_key

STEP = 0.01


# readings here hold no noise: a stuck sensor looks like them
NOISELESS = SensorLimits(repeats_together=0, repeats_alone=0)


def arrived(port: MemoryPort, now: float) -> list[bytes]:
    """Frames that have come to a port by ``now``."""
    frames: list[bytes] = []
    port.listen(frames.append)
    port.advance(now)
    return frames


class Rig:
    """Surface end, drive head and tubes, top tube first, on one clock; the bench turns and leans the tubes."""

    def __init__(self, folder: Path, tubes: list[int], seed: int = 0, **troubles: float) -> None:
        self.folder = folder
        self.key_file = new_key(folder / "rig.key")
        self.addresses = [BASE, ENCODER, *tubes]
        self.joints = [joint(seed + k, **troubles) for k in range(len(self.addresses) - 1)]
        self.now = 1000.0
        self.rate = {tube: np.zeros(3) for tube in tubes}
        self.force = {tube: np.array([0.0, 0.0, -9.81]) for tube in tubes}
        self.processes: dict[int, GroundProcess | EncoderProcess | TubeProcess] = {}
        self.sent: list[int] = []  # indices of the segments that left the ground station
        self.said: list[BlockStatus] = []
        for address in self.addresses:
            self.start(address)

    def start(self, address: int) -> None:
        """Start a process, once more in its folder, as after a power cut."""
        folder = self.folder / str(address)
        if address == BASE:
            if BASE in self.processes:
                self.ground.store.close()
            self.processes[BASE] = GroundProcess(GroundConfig(folder=folder, key_file=self.key_file))
            self.watch()
        elif address == ENCODER:
            self.processes[ENCODER] = EncoderProcess(folder)
        else:
            self.processes[address] = TubeProcess(
                TubeSettings(address, limits=NOISELESS), folder, key=read_key(self.folder / "rig.key")
            )

    def watch(self) -> None:
        send, hear = self.ground.endpoint.send_segment, self.ground.operator.on_block_status

        def sending(segment: BlockSegment) -> None:
            self.sent.append(segment.index)
            send(segment)

        def hearing(status: BlockStatus) -> None:
            self.said.append(status)
            hear(status)

        self.ground.endpoint.send_segment = sending  # type: ignore[method-assign]
        self.ground.operator.on_block_status = hearing  # type: ignore[method-assign]

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
        end, cycle_at = self.now + duration, self.now
        while self.now < end and not until():
            if self.now >= cycle_at:
                cycle_at += PERIOD
                self.cycle()
            for place, address in enumerate(self.addresses):
                self.exchange(place, self.processes[address])
            self.now += STEP

    def cycle(self) -> None:
        for address, process in self.processes.items():
            if isinstance(process, TubeProcess):
                reading = [self.now - PERIOD, *self.rate[address], *self.force[address], 30.0]
                process.on_cycle([float(x) for x in reading], self.now)
            elif isinstance(process, EncoderProcess):
                process.on_cycle([self.now - PERIOD, 0, self.now - 100.0, 1], self.now)
            process.on_timer(self.now)

    def exchange(self, place: int, process: GroundProcess | EncoderProcess | TubeProcess) -> None:
        ports: dict[Side, MemoryPort] = {}
        if place > 0:
            ports[Side.UPPER] = self.joints[place - 1][1]
        if place < len(self.joints):
            ports[Side.LOWER] = self.joints[place][0]
        for side, port in ports.items():
            for frame in arrived(port, self.now):
                process.on_frame(side, frame, self.now)
        for side, frame in process.take_frames(self.now):
            if side in ports:
                ports[side].send(frame)

    def upload(self, block: ParameterBlock, patience: float = 200.0) -> BlockStatus:
        """Upload a block and wait for the tube's last word on it."""
        order = self.ground.operator.upload(block)
        self.run(patience, lambda: order.ended)
        assert order.ended
        return next(status for status in reversed(self.said) if status.sequence == order.number)

    def order(self, tube: int, name: str, **arguments: float | str) -> Order:
        """Order something of a tube and wait for its answer."""
        order = self.ground.operator.command(tube, name, arguments)
        self.run(60.0, lambda: order.answered)
        assert order.answered
        return order

    def codes(self, tube: int) -> list[str]:
        return [event.code for event in self.ground.model.events if event.tube == tube]
