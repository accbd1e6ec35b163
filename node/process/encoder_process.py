"""The encoder node as a process: the root of rig time and of the yaw reference."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.firmware.torque import TorqueSettings
from node.process.counter import BootCounter
from node.process.drivers.source import EncoderSource, SafeEncoder
from telemetry.application.endpoint import Endpoint
from telemetry.application.seal_watch import SealWatch
from telemetry.messages import ENCODER, Command, Event, Reply, Scalar, Severity, Side
from telemetry.runtime.disk import MACHINE, Disk
from telemetry.runtime.joint_watch import JointFault
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleStage, CycleTiming
from telemetry.unwritten import Content

if TYPE_CHECKING:
    from telemetry.application.seals import Seals


class EncoderProcess(Process):
    """Encoder node on the drive head: upper end to the base station, lower end to the top tube.

    Parameters
    ----------
    folder : where its starts are counted
    source : the node's own counter; without one a cycle brings its sample
    torque : what the crew knows of the drive's torque; the default is a rigid string
    timing : durations of its cycles with an own clock; None where it is stepped
    reach : tubes away that its radio hears, see ``TubeSettings``
    disk : that holds the folder
    seals : what it says and believes under keys; None: everybody is believed
    is_new : never heard before on this rig. Otherwise a start that cannot be counted gets a random number: an epoch
        that came before would mix the depths of two times
    lot : random number below its argument

    Raises
    ------
    SensorError
        When the counter is absent at the start.
    """

    def __init__(
        self,
        folder: Path,
        source: EncoderSource | None = None,
        torque: TorqueSettings | None = None,
        timing: CycleTiming | None = None,
        reach: int = 1,
        disk: Disk = MACHINE,
        seals: Seals | None = None,
        *,
        is_new: bool = True,
        lot: Callable[[int], int] = secrets.randbelow,
    ) -> None:
        self._timing = timing
        if source is not None:
            source.start()
        self._source = SafeEncoder(source, self._send_event) if source is not None else None
        self._now = 0.0
        counter = BootCounter(folder, lot, disk, is_new=is_new)
        self.endpoint = Endpoint(
            ENCODER, frozenset(Side), boot_count=counter.boots, is_clock_root=True, reach=reach, seals=seals
        )
        self._seal_watch = SealWatch(self.endpoint, self._send_event)
        # sequence numbers of a later boot are all larger, so a tube never takes a new measurement for an old one
        self.encoder = EncoderNode(counter.boots << 32, torque)
        if counter.fault:
            self._send_event(Severity.ERROR, "boot_counter_lost", {"detail": counter.fault[:200]})

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived at one end; the encoder refuses commands."""
        for received in self.endpoint.receive(side, frame, now, margin):
            if isinstance(received.message, Command):
                refusal = Reply(ENCODER, received.message.sequence, False, "the encoder node takes no commands")
                self.endpoint.mail.reply(refusal)

    def on_cycle(self, data: Any, now: float) -> None:
        """The counter was read: ``data`` is start (s), count, time of its last edge (s), 1 if it rose, torque, edges.

        The torque (N m) is nil where the drive has no sensor for it; the edges are the times of those before the last.
        Either may be left out.
        """
        self._now = now
        sample = self._source.read(now) if self._source is not None else sample_of(data)
        self._lap(CycleStage.READ)
        if sample is not None:
            self.endpoint.send_aiding(self.encoder.on_cycle(sample, now, self.endpoint.clock.epoch), now)
        if self._timing is None:  # an own clock advances time between the cycles
            self.endpoint.advance(now)
        self._seal_watch.look(now)
        self._lap(CycleStage.REPORT)

    def on_joint_fault(self, fault: JointFault, now: float) -> None:
        """Something went wrong at a joint: tell the crew."""
        self._now = now
        self._send_event(Severity.WARNING, "joint_fault", fault.arguments)

    def _lap(self, stage: CycleStage) -> None:
        if self._timing is not None:
            self._timing.lap(stage)

    def _send_event(self, severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        number, epoch = self.endpoint.mail.series.take(), self.endpoint.clock.epoch
        self.endpoint.mail.submit(Event(ENCODER, number, self._now, severity, code, arguments, epoch), self._now)


def sample_of(data: Any) -> EncoderSample | None:
    """Sample of a cycle; None if the data are invalid."""
    try:
        _, count, edge_at, rising, *more = data
        if len(more) > 2:
            return None
        torque = None if not more or more[0] is None else float(more[0])
        earlier = tuple(map(float, more[1])) if len(more) > 1 else ()
        sample = EncoderSample(int(count), float(edge_at), bool(rising), torque, earlier=earlier)
    except (TypeError, ValueError, OverflowError):
        return None
    return sample if math.isfinite(sample.edge_at) else None
