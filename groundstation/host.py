"""What hosts the ground station, whether a launcher forked it or its command started it."""

from __future__ import annotations

import contextlib
from typing import Any

import msgpack

from groundstation.config import checked_config
from groundstation.service.process import GroundProcess
from node.kernels.layout import PERIOD
from telemetry import keys
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.hosting import Place, begin_process, joined, on_termination, reporting
from telemetry.runtime.own_clock import Inbox, OwnClock, serve_by_own_clock
from telemetry.runtime.process import Process
from telemetry.runtime.stepped import StepClient, serve, zenoh_ports
from telemetry.runtime.timing import CycleTiming


def run_ground(place: Place, settings: dict[str, Any], *, own_clock: bool = False) -> None:
    """Ground station: a stepper or its own clock drives its link, operators ask it at any time.

    ``settings`` are those of ``GroundConfig``.

    Raises
    ------
    ConfigurationError
        When a setting is outside its range; nothing was opened.
    """
    begin_process("ground")
    with reporting("ground"):
        # settings, key and database are looked at before half a minute is spent on a router that may be absent
        process = GroundProcess(checked_config(rig=place.rig, folder=place.folder, key_file=place.key_file, **settings))
        with joined(place) as bus, process.serving(bus):
            if own_clock:
                serve_ground(process, bus, place.rig)
                return
            ports = zenoh_ports(bus, place.rig, BASE, [Side.LOWER])
            client = StepClient(bus, place.rig, BASE, ports, hears_depth=True)
            on_termination(client.stop)
            serve(process, client)


def serve_ground(process: Process, bus: ZenohBus, rig: str) -> None:
    """Run the ground station by its own clock, below it the encoder."""
    inbox = Inbox()
    on_termination(inbox.stop)

    def hear_depth(_key: str, payload: bytes) -> None:
        with contextlib.suppress(ValueError, TypeError, msgpack.UnpackException):  # what is no depth is not heard
            rig_time, md = map(float, msgpack.unpackb(payload))
            inbox.put(lambda listener, _now: listener.on_depth(rig_time, md))

    bus.subscribe(keys.DEPTH.format(rig=rig), hear_depth)
    ports = neighbour_ports(bus, rig, BASE, {Side.LOWER: ENCODER})
    serve_by_own_clock(process, ports, inbox, OwnClock(), CycleTiming(), PERIOD)
