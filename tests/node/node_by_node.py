"""A string node by node, each stepped by itself as its process calls it: the oracle of the kernel of a string."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.firmware.inputs import RigContext
from node.kernels.arithmetic.angles import from_binary
from node.kernels.record.filter_record import Err, Scheme
from node.process.reading import reading_of
from sim.string.direct_string import DirectString
from sim.string.hops import record_hops
from sim.string.result import StringRun
from sim.string.schedule import SILENT_AFTER, aiding_passes
from sim.world.world import World
from telemetry.messages import Aiding, Message


def measure_by_firmware(world: World) -> list[Aiding]:
    """What the encoder node measures in every cycle of a world whose edges are timed."""
    encoder, measured = EncoderNode(torque=world.torque_settings()), []
    for cycle in range(world.cycles):
        end = world.cycle_end(cycle)
        count, edge_at, rising, torque, earlier = world.encoder_sample(end)
        aiding = encoder.on_cycle(EncoderSample(count, edge_at, bool(rising), torque, earlier=earlier), end)
        measured.append(replace(aiding, sequence=cycle) if world.scenario.file.aiding.renumbered else aiding)
    return measured


def drill_node_by_node(string: DirectString) -> StringRun:
    """Every cycle of a string, by the methods of its nodes."""
    driver = NodeByNode(string)
    for cycle in range(string.world.cycles):
        driver.step(cycle)
    return string.run


class NodeByNode:
    """Steps the nodes of a string that has not been drilled; ``sample_of`` a tube and a cycle is what its IMU reads."""

    def __init__(self, string: DirectString, sample_of: Callable[[int, int], Sequence[float]] | None = None) -> None:
        self._string, self._world = string, string.world
        self._sample_of = sample_of or self._world.imu_sample
        self._file = self._world.scenario.file
        self._clocks, self._lost = record_hops(self._world)
        self._measured = measure_by_firmware(self._world)
        t = self._world.ends - self._world.begin
        self._passes = aiding_passes(self._file.aiding, t, self._world.seed)
        self._adds = [phase for phase in self._world.phases if phase.kind == "add"]
        self._own: dict[int, Aiding] = {}  # what each node said in its cycle

    def step(self, cycle: int) -> None:
        """One cycle of every tube that is powered."""
        end = self._world.cycle_end(cycle)
        added = sum(phase.start <= end for phase in self._adds)
        tubes = list(range(self._file.rig.tubes_at_start + added, 0, -1))
        locked = self._file.encoder.phase == "locked"
        if not locked:
            self._relay(cycle, tubes)
        said = {tube: self._run_cycle(cycle, tube, tubes[0]) for tube in tubes}
        self._keep(cycle, tubes, said)
        if locked:  # cycles end with the encoder's, and what it measures then arrives after them
            self._relay(cycle, tubes)

    def _run_cycle(self, cycle: int, tube: int, top: int) -> Sequence[Message]:
        phase = self._world.phase(tube)
        begin, end = self._world.cycle_end(cycle - 1) + phase, self._world.cycle_end(cycle) + phase
        joints, hops = self._file.clocks.joint_std_ms, top - tube + 1
        stated = joints if self._file.clocks.stated_std_ms is None else self._file.clocks.stated_std_ms
        around = RigContext(self._is_joined(tube, top, end), hops, end, (1e-3 * stated) ** 2 * hops, True)
        reading = reading_of((begin, *self._sample_of(tube, cycle)), end)
        return self._string.tubes[tube].on_cycle(reading, around)

    def _is_joined(self, tube: int, top: int, end: float) -> bool:
        growing = self._is_open(end)
        return not (growing and (tube == top or (tube == top - 1 and self._is_open(end, SILENT_AFTER))))

    def _is_open(self, t: float, since: float = 0.0) -> bool:
        return any(phase.start + since < t < phase.joint_closed for phase in self._adds)

    def _relay(self, cycle: int, tubes: Sequence[int]) -> None:
        """Down the string: ``forward`` hands on what came, the others what each node said in its cycle."""
        is_sent = self._passes[cycle] and not self._is_open(self._world.cycle_end(cycle))
        aiding: Aiding | None = self._measured[cycle] if is_sent else None
        medium = self._file.medium
        for hop, tube in enumerate(tubes):
            node, passed = self._string.tubes[tube], None
            is_forward = node.settings.scheme is Scheme.FORWARD
            if aiding is not None and not self._lost[cycle, hop]:
                travelled = 1e-3 * medium.delay_ms + medium.latency * (hop + 1 if is_forward else 1)
                late = travelled if medium.dated_by == "arrival" else 0.0
                passed = node.on_aiding(aiding, aiding.valid_at + late + float(self._clocks[cycle, hop]))
            aiding = passed if is_forward else self._own.get(tube)

    def _keep(self, cycle: int, tubes: Sequence[int], said: dict[int, Sequence[Message]]) -> None:
        run, powered = self._string.run, np.s_[cycle, : len(tubes)]
        known = self._string.nodes["filter"][: len(tubes)]
        run.yaw[powered] = [from_binary(yaw) for yaw in known["now_yaw"].tolist()]
        run.var[powered] = known["now_P"][:, Err.YAW, Err.YAW]
        run.systematic_var[powered] = known["systematic_var"]
        run.gyro_bias[powered] = known["static_bias"][:, 2] + known["bias"][:, 2]
        self._string._set_beside_truth(cycle, cycle + 1)
        self._own = {}
        for tube, messages in said.items():
            self._string._keep_messages(cycle, tube - 1, messages)
            for message in messages:
                if isinstance(message, Aiding):
                    self._own[tube] = message
