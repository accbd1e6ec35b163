"""A chip on a serial line as one end of a CAN joint: the bridge stands on the segment as the chip's controller.

SLCAN does not report own frames. The bridge sees on the bus that a frame of the chip was acknowledged, and
tells the chip by ``Z``: so a chip finds an open joint as a node with a controller does.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable

import can

from telemetry.errors import MediumError
from telemetry.media.can_controller import CanController
from telemetry.media.can_frame import ERROR, EXTENDED, IDENTIFIER, OWN_FRAME
from telemetry.media.serial_line import SerialLine
from telemetry.media.slcan import ACKNOWLEDGED, SlcanAdapter, SlcanFrame

PATIENCE = 0.05  # s, between two looks whether it is to end
SILENCE = 5.0  # s without a byte of the chip, which is told
TELL_EVERY = 10.0  # s between two lines about the same thing


class ChipBridge:
    """One chip's bridge.

    Parameters
    ----------
    line : to the chip
    controller : on the segment; it reports own frames
    fd : whether the segment has frames of CAN FD
    tell : takes a line for the operator

    Attributes
    ----------
    counters : frames both ways, and what went wrong, by name
    """

    def __init__(self, line: SerialLine, controller: CanController, *, fd: bool, tell: Callable[[str], object]) -> None:
        self._line, self._controller, self._tell = line, controller, tell
        self._adapter = SlcanAdapter(fd=fd)
        self._lock = threading.Lock()  # of the adapter and of what is written
        self._is_ending = False
        self._failure: MediumError | None = None
        self._told_at: dict[str, float] = {}
        self.counters: Counter[str] = self._adapter.counters

    def run(self) -> None:
        """Carry frames both ways until ``stop``.

        Raises
        ------
        MediumError
            When the chip or the bus is gone.
        """
        listener = threading.Thread(target=self._listen, name="chip bridge", daemon=True)
        listener.start()
        try:
            self._obey()
        finally:
            self._is_ending = True
            listener.join()
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """End ``run`` soon."""
        self._is_ending = True

    def _obey(self) -> None:
        """From the chip to the bus."""
        heard_at = time.monotonic()
        while not self._is_ending:
            received = self._line.receive(PATIENCE)
            now = time.monotonic()
            if received:
                heard_at = now
                with self._lock:
                    frames, answers = self._adapter.take(received)
                    self._write(answers)
                self._hand_over(frames)
                self._show_garbage(now)
            elif now - heard_at > SILENCE:
                self._tell_once(
                    "silent", f"nothing heard from the chip for {SILENCE:g} s; is it on, at this speed?", now
                )

    def _hand_over(self, frames: list[SlcanFrame]) -> None:
        for frame in frames:
            try:
                self._controller.send(frame.identifier, frame.data)
            except (can.CanError, OSError, ValueError):
                self.counters["refused_by_controller"] += 1
                continue
            self.counters["from_chip"] += 1

    def _listen(self) -> None:
        """From the bus to the chip."""
        while not self._is_ending:
            try:
                arrival = self._controller.receive()
                if arrival is not None:
                    self._on_arrival(*arrival)
            except (can.CanError, OSError, ValueError) as error:
                self._fail(MediumError(f"bus: expected frames, it is lost: {error}"))
            except MediumError as error:
                self._fail(error)

    def _on_arrival(self, identifier: int, data: bytes) -> None:
        kind = identifier & ~IDENTIFIER
        with self._lock:
            if kind & ERROR:
                self.counters["bus_errors"] += 1
            elif kind & OWN_FRAME:
                self._write(ACKNOWLEDGED)
            elif kind == EXTENDED:
                told = self._adapter.told(SlcanFrame(identifier & IDENTIFIER, data))
                self.counters["to_chip" if told else "not_open"] += 1
                self._write(told)

    def _write(self, content: bytes) -> None:
        if content and not self._line.send(content):
            self.counters["not_taken"] += 1
            self._tell_once("not_taken", "the chip does not read what it is told", time.monotonic())

    def _fail(self, error: MediumError) -> None:
        self._failure = self._failure or error
        self._is_ending = True

    def _show_garbage(self, now: float) -> None:
        if self._adapter.garbage:
            newest = self._adapter.garbage[-1]
            self._adapter.garbage.clear()
            wrong = sum(self.counters[name] for name in ("garbage", "other_frames", "not_open"))
            self._tell_once("garbage", f"expected an order of SLCAN, got {newest!r} ({wrong} so far)", now)

    def _tell_once(self, about: str, line: str, now: float) -> None:
        if now - self._told_at.get(about, -TELL_EVERY) >= TELL_EVERY:
            self._told_at[about] = now
            self._tell(line)
