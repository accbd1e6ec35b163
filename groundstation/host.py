"""What hosts the ground station, whether a launcher forked it or its command started it."""

from __future__ import annotations

import contextlib
from functools import partial
from typing import Any

import msgpack

from groundstation.config import checked_config
from groundstation.service.process import GroundProcess
from node.kernels.layout import PERIOD
from telemetry import keys
from telemetry.media.neighbours import neighbour_ports, stepped_ports
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.event_loop import run, stop_on_signals
from telemetry.runtime.hosting import Place, begin_process, complain, joined, on_termination, reporting
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process import Process
from telemetry.runtime.step_client import StepClient, serve
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
                run(serve_ground(process, bus, place.rig))
                return
            ports = stepped_ports(ZenohMedium(bus), place.rig, BASE, [Side.LOWER])
            client = StepClient(bus, place.rig, BASE, ports, hears_depth=True)
            on_termination(client.stop)
            serve(process, client, partial(complain, "ground"))


async def serve_ground(process: Process, bus: ZenohBus, rig: str) -> None:
    """Run the ground station by its own clock, below it the encoder."""
    ports = neighbour_ports(ZenohMedium(bus), rig, BASE, {Side.LOWER: ENCODER})
    loop = OwnClockLoop(process, ports, OwnClock(), CycleTiming(), PERIOD, partial(complain, "ground"))
    stop_on_signals(loop.stop)

    def hear_depth(_key: str, payload: bytes) -> None:
        with contextlib.suppress(ValueError, TypeError, msgpack.UnpackException):  # anything else is no depth
            rig_time, md = map(float, msgpack.unpackb(payload))
            loop.call(lambda listener, _now: listener.on_depth(rig_time, md))

    bus.subscribe(keys.DEPTH.format(rig=rig), hear_depth)
    await loop.run()
