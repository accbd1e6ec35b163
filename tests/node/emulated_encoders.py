"""Encoders as the kernel shows them: a counter's tree in a folder, and edges of two GPIO lines through a pipe."""

from __future__ import annotations

import fcntl
import math
import os
import struct
from collections.abc import Callable
from pathlib import Path

from node.process.drivers.gpio_lines import LineEdge, read_edges

LINES_A_TURN = 1024
GRAY = ((0, 0), (0, 1), (1, 1), (1, 0))


def levels_at(count: int, step: int = 1) -> tuple[int, int]:
    """Levels of lines A and B in a count; with ``step`` -1 the lines are exchanged against the turn."""
    return GRAY[step * count % 4]


class EmulatedCounter:
    """A counter of the kernel's subsystem: count, its settings, and the levels of its signals."""

    def __init__(self, folder: Path, begin: int = 0, step: int = 1) -> None:
        self.sysfs, self.step = folder, step
        self.device = folder / "counter0"
        self.place = self.device / "count0"
        for path in (self.place, self.device / "signal0", self.device / "signal1"):
            path.mkdir(parents=True)
        self.set("function", "quadrature x4")
        self.set("enable", "1")
        self.set("ceiling", str((1 << 32) - 1))
        self.stands = False
        self.turn_to(begin)

    def set(self, name: str, text: str) -> None:
        (self.place / name).write_text(text + "\n")

    def turn_to(self, count: int) -> None:
        """Turn the head to a count."""
        for k, level in enumerate(levels_at(count, self.step)):
            (self.device / f"signal{k}" / "signal").write_text("high\n" if level else "low\n")
        if not self.stands:
            self.set("count", str(count % (1 << 32)))

    def unplug(self) -> None:
        for path in sorted(self.device.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()


class EmulatedLines:
    """Lines A and B, and an index once a turn, of an encoder whose edges go through a pipe as the kernel's events.

    Parameters
    ----------
    lines : numbers of A, B and perhaps the index
    a_turn : counts of a turn
    """

    def __init__(self, lines: tuple[int, ...] = (17, 27), a_turn: int = 4 * LINES_A_TURN) -> None:
        self.lines, self.a_turn = lines, a_turn
        self.count, self.number = 0, 0
        self.ends = os.pipe2(os.O_NONBLOCK)
        fcntl.fcntl(self.ends[1], fcntl.F_SETPIPE_SZ, 1 << 20)
        self.dead: set[int] = set()
        self.drop = 0  # edges that are lost next
        self.swallow = 0  # edges that come without an event next, and without a number
        self.opened = 0
        self.gone = False

    def connect(self) -> EmulatedLines:
        self.opened += 1
        if self.gone:
            from node.errors import SensorError

            raise SensorError("gpio: /dev/gpiochip0: No such file or directory")
        return self

    def turn(self, at: Callable[[int], float], to: int) -> None:
        """Turn the head to a count; ``at`` gives the time (s) of the edge that begins or ends a count."""
        while self.count != to:
            step = 1 if to > self.count else -1
            before, after = levels_at(self.count), levels_at(self.count + step)
            line = next(k for k in range(2) if before[k] != after[k])
            when = at(self.count + (step > 0))
            self.count += step
            self.say(self.lines[line], after[line], when)
            if len(self.lines) > 2 and self.count % self.a_turn == 0:
                self.say(self.lines[2], 1, when)
                self.say(self.lines[2], 0, when)

    def say(self, line: int, level: int, when: float) -> None:
        """One event of the kernel: 48 bytes."""
        if line in self.dead:
            return
        if self.swallow:
            self.swallow -= 1
            return
        self.number += 1
        if self.drop:
            self.drop -= 1
            return
        kind = 1 if level else 2
        os.write(
            self.ends[1], struct.pack("=QIIII", round(when * 1e9), kind, line, self.number, self.number) + bytes(24)
        )

    def edges(self) -> list[LineEdge]:
        if self.gone:
            from node.errors import SensorError

            raise SensorError("gpio: /dev/gpiochip0: No such device: the chip is gone")
        return read_edges(self.ends[0])

    def levels(self) -> tuple[int, ...]:
        found = [
            0 if line in self.dead else level for line, level in zip(self.lines[:2], levels_at(self.count), strict=True)
        ]
        return (*found, *[0] * (len(self.lines) - 2))

    def close(self) -> None:
        pass


def turning(rate: float, seconds: float, ease: float) -> Callable[[float], float]:
    """Counts of a head at a time (s) that speeds up, turns at ``rate`` (rad/s) and slows down, ``ease`` s each."""

    def count_at(t: float) -> float:
        up = min(max(t, 0.0), ease)
        flat = min(max(t - ease, 0.0), seconds - 2.0 * ease)
        down = min(max(t - seconds + ease, 0.0), ease)
        angle = rate * (0.5 * up**2 / ease + flat + down - 0.5 * down**2 / ease)
        return angle * 4 * LINES_A_TURN / (2.0 * math.pi)

    return count_at
