"""A joint between two processes' endpoints on the kernel's own CAN: what is said arrives, and faults are survived.

Runs where there are two interfaces that are joined; ``make test-socketcan`` makes such a machine.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import can

from telemetry.application.endpoint import Endpoint
from telemetry.media.can_frame import ERROR_BUS_OFF, ERROR_CONTROLLER, RX_OVERFLOW
from telemetry.media.can_port import CanPort
from telemetry.media.media_table import open_medium
from telemetry.media.port import TubeEnd
from telemetry.messages import ENCODER, Aiding, Event, Severity, Side
from telemetry.presentation.can_native import rounded_message

PATIENCE = 60.0  # s
SETTINGS = ("frames=fd", "frames=classic", "frames=fd,profile=native", "frames=classic,profile=native")


class Talker:
    """An endpoint and its end of the joint, driven by the caller's turns."""

    def __init__(self, stack: contextlib.ExitStack, where: str, address: int, side: Side, neighbour: int) -> None:
        self.endpoint = Endpoint(address, frozenset({side}), boot_count=1, is_clock_root=address == ENCODER)
        self.side, self.heard = side, []
        port = stack.enter_context(open_medium(where)).open_port(TubeEnd("rig", address, side, neighbour))
        assert isinstance(port, CanPort)
        self.port = port
        self._arrived: list[bytes] = []
        self.endpoint.limit_bundles(side, port.bundle_limit)
        port.listen(self._arrived.append)

    def turn(self) -> None:
        """Take what has arrived and send what is due."""
        now = time.monotonic()
        while self._arrived:
            self.heard += [got.message for got in self.endpoint.receive(self.side, self._arrived.pop(0), now)]
        self.endpoint.advance(now)
        for _, frame in self.endpoint.take_frames(now):
            self.port.send(frame)
        self.port.flush()


class Joint:
    """Encoder above, tube 1 below."""

    def __init__(self, stack: contextlib.ExitStack, names: list[str], settings: str) -> None:
        upper, lower = (f"can:{name},{settings}" for name in names)
        self.encoder = Talker(stack, upper, ENCODER, Side.LOWER, 1)
        self.tube = Talker(stack, lower, 1, Side.UPPER, ENCODER)
        self._number = 0

    def until(self, what: str, holds: Callable[[], object]) -> None:
        """Let both talk until something holds."""
        deadline, tick = time.monotonic() + PATIENCE, threading.Event()
        while not holds():
            if time.monotonic() >= deadline:
                raise SystemExit(
                    f"waited {PATIENCE:g} s for {what}: {self.encoder.port.counters}, {self.tube.port.counters}"
                )
            self.encoder.turn()
            self.tube.turn()
            tick.wait(0.002)

    def talks(self) -> None:
        """An aiding goes down; an event goes up and is acknowledged."""
        self._number += 1
        encoder, tube = self.encoder, self.tube
        self.until("the clock", lambda: tube.endpoint.place.neighbours[Side.UPPER] and tube.endpoint.clock.synchronised)
        sent = rounded_message(Aiding(1.0, 1e-6, 0.0, 0.0, 0.1, 100.0 + self._number, self._number, 0, epoch=1))
        event = Event(1, tube.endpoint.mail.series.take(), 5.0, Severity.INFO, "booted", {"number": self._number})
        tube.endpoint.mail.submit(event, time.monotonic())
        sent_at = -1.0

        def is_heard() -> bool:  # what may be lost is sent again, as an encoder does
            nonlocal sent_at
            if (now := time.monotonic()) > sent_at + 0.5:
                sent_at = now
                encoder.endpoint.send_aiding(sent, now)
            return sent in tube.heard

        self.until("the aiding", is_heard)
        self.until("the acknowledgement", lambda: tube.endpoint.waiting == 0)


def inject(name: str, error_class: int, detail: int = 0) -> None:
    """Put an error frame on the bus, as a controller would report it to its computer."""
    data = bytes([0, detail, 0, 0, 0, 0, 0, 0])
    message = can.Message(arbitration_id=error_class, is_error_frame=True, is_extended_id=False, dlc=8, data=data)
    with can.Bus(name, interface="socketcan", ignore_config=True) as bus:
        bus.send(message)


def main(names: list[str]) -> None:
    """Every kind of joint talks; then one of them goes bus-off, overruns, and is taken down and up."""
    for settings in SETTINGS:
        with contextlib.ExitStack() as stack:
            joint = Joint(stack, names, settings)
            joint.talks()
            print(f"{settings}: aiding down, event up and acknowledged", flush=True)
    with contextlib.ExitStack() as stack:
        joint = Joint(stack, names, SETTINGS[0])
        joint.talks()
        counters = joint.tube.port.counters
        inject(names[0], ERROR_BUS_OFF)
        joint.until("bus-off", lambda: counters["bus_off"] == 1)
        joint.talks()
        print("bus-off: counted, opened again, talks", flush=True)
        inject(names[0], ERROR_CONTROLLER, RX_OVERFLOW)
        joint.until("an overrun", lambda: counters["receive_overruns"] == 1)
        print("receive overrun: counted", flush=True)
        subprocess.run(["ip", "link", "set", names[1], "down"], check=True)
        joint.until("the end", lambda: not joint.tube.port.is_up)
        subprocess.run(["ip", "link", "set", names[1], "up"], check=True)
        joint.talks()
        print("interface down and up: talks", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
