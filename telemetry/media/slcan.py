"""SLCAN (LAWICEL's orders and those of CAN FD) as a pure state machine: an adapter that a chip has for a controller.

The chip orders, this end obeys: ``S6`` and ``Y2`` set bit rates, ``O`` opens, ``C`` closes, ``T`` and ``B`` hand over
frames of 29 bits. A frame is answered with ``Z`` once it has been acknowledged on the bus, which SLCAN cannot say of
frames that others report as their own; every other order at once, with a bell where it is none. What comes
from the bus is told in the same letters.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from typing import Final, NamedTuple

from telemetry.media.can_timing import CLASSIC_LARGEST, FD_LENGTHS

END, BELL, ACKNOWLEDGED = b"\r", b"\a", b"Z\r"
VERSION, SERIAL, STATUS = b"V1013\r", b"NBC01\r", b"F00\r"
LONGEST: Final = 1 + 8 + 1 + 2 * FD_LENGTHS[-1]  # characters of an order
KEPT: Final = 40  # characters of garbage that are shown
CLASSIC, FD_SLOW, FD_FAST = b"T", b"D", b"B"  # a frame of 8 bytes, and of CAN FD without and with a faster data phase
FRAME: Final = re.compile(rb"([TDB])([01][0-9A-Fa-f]{7})([0-9A-Fa-f])((?:[0-9A-Fa-f]{2})*)")
SETTING: Final = re.compile(rb"S[0-8]|Y[0-9]|M[0-9A-Fa-f]{8}|m[0-9A-Fa-f]{8}|Z0")
SHOUTS: Final = 8  # lines of garbage that wait to be shown


class SlcanFrame(NamedTuple):
    """A frame of 29 bits."""

    identifier: int
    data: bytes


class SlcanAdapter:
    """One chip's adapter.

    Parameters
    ----------
    fd : whether the bus takes CAN FD

    Attributes
    ----------
    counters : what went wrong, by name
    garbage : the newest lines that were no orders, for the caller to take away
    """

    def __init__(self, *, fd: bool) -> None:
        self.counters: Counter[str] = Counter()
        self.garbage: deque[bytes] = deque(maxlen=SHOUTS)
        self.is_open = False
        self._fd = fd
        self._line = bytearray()
        self._is_overlong = False

    def take(self, received: bytes) -> tuple[list[SlcanFrame], bytes]:
        """Frames for the bus, and what is to be answered at once."""
        frames: list[SlcanFrame] = []
        answers = bytearray()
        *lines, rest = received.split(END)
        for line in lines:
            self._append(line)
            answers += self._obey(frames)
        self._append(rest)
        return frames, bytes(answers)

    def told(self, frame: SlcanFrame) -> bytes:
        """What the chip is told of a frame that came; nothing while it has not opened its side."""
        if not self.is_open:
            return b""
        letter = CLASSIC if not self._fd else FD_FAST
        length = FD_LENGTHS.index(len(frame.data))
        return b"%s%08X%X%s\r" % (letter, frame.identifier, length, frame.data.hex().upper().encode())

    def _append(self, part: bytes) -> None:
        """Keep what came of a line, of one that is too long its beginning."""
        room = LONGEST - len(self._line)
        self._is_overlong |= len(part) > room
        self._line += part[:room]

    def _obey(self, frames: list[SlcanFrame]) -> bytes:
        line, is_overlong = bytes(self._line), self._is_overlong
        self._line.clear()
        self._is_overlong = False
        if is_overlong:
            return self._refuse("garbage", line)
        if not line:
            return END  # by which a chip that begins ends what stood there before
        if (found := FRAME.fullmatch(line)) is not None:
            return self._send(line, *found.groups(), frames=frames)
        return self._order(line)

    def _send(
        self, line: bytes, letter: bytes, identifier: bytes, code: bytes, digits: bytes, *, frames: list[SlcanFrame]
    ) -> bytes:
        length, is_classic = FD_LENGTHS[int(code, 16)], letter == CLASSIC
        if 2 * length != len(digits) or (is_classic and length > CLASSIC_LARGEST):
            return self._refuse("garbage", line)
        if is_classic == self._fd:
            return self._refuse("other_frames", line)
        if not self.is_open:
            return self._refuse("not_open", line)
        frames.append(SlcanFrame(int(identifier, 16), bytes.fromhex(digits.decode())))
        return b""

    def _order(self, line: bytes) -> bytes:
        if line in (b"O", b"C"):
            self.is_open = line == b"O"
            return END
        if SETTING.fullmatch(line):
            return END  # the bus has the rates of its own controller
        known = {b"V": VERSION, b"N": SERIAL, b"F": STATUS}
        return known.get(line) or self._refuse("garbage", line)

    def _refuse(self, name: str, line: bytes) -> bytes:
        self.counters[name] += 1
        self.garbage.append(line[:KEPT])
        return BELL
