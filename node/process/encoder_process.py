"""The encoder node as a process: the root of rig time and of the yaw reference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from node.firmware.encoder import EncoderNode, EncoderSample
from node.process.counter import BootCounter
from telemetry.application.driven import Driven
from telemetry.application.station import Station
from telemetry.messages import ENCODER, Command, Reply, Side


class EncoderProcess(Driven):
    """Encoder node on the drive head: upper end to the base station, lower end to the top tube."""

    def __init__(self, folder: Path) -> None:
        counter = BootCounter(folder)
        self.station = Station(ENCODER, frozenset(Side), boot_count=counter.boots, is_clock_root=True)
        # sequence numbers of a later boot are all larger, so a tube never takes a new measurement for an old one
        self.encoder = EncoderNode(first_sequence=counter.boots << 32)

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived at one end; the encoder obeys no commands of its own."""
        for received in self.station.receive(side, frame, now):
            if isinstance(received.message, Command):
                refusal = Reply(ENCODER, received.message.sequence, False, "the encoder node takes no commands")
                self.station.reply(refusal, now)

    def on_cycle(self, data: Any, now: float) -> None:
        """The counter was read: ``data`` is start (s), count, time of its last edge (s), 1 if it rose."""
        _, count, edge_at, rising = data
        aiding = self.encoder.on_cycle(EncoderSample(int(count), edge_at, bool(rising)), now)
        self.station.send_aiding(aiding, now)
        self.station.advance(now)
