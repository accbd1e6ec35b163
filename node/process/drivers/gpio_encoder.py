"""A quadrature encoder on two lines of a GPIO chip, decoded here; a third line may carry its index pulse.

Every edge has the time of its interrupt, so the encoder node knows the angle at the last one exactly, and by those
before it where in the count a head has stopped. Each read proves what it read: edges are numbered without a gap, each
is one step of the quadrature, levels afterwards are those of the lines, and between index pulses lie whole turns.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from node.errors import SensorCause, SensorError
from node.firmware.edge_interpolation import EDGES
from node.firmware.encoder_node import EncoderSample
from node.kernels.string.encoder_step import COUNTS_PER_TURN
from node.process.drivers.gpio_lines import GpioLines, LineEdge

ORDER: Final = {(0, 0): 0, (0, 1): 1, (1, 1): 2, (1, 0): 3}  # levels of both lines in turning order
WIDTH: Final = 8  # counts, of an index pulse and its play
ALONE: Final = 200  # edges of one line in a cycle without any of the other: a wire, not a head that shakes on an edge


class GpioEncoder:
    """One encoder.

    Parameters
    ----------
    connect : takes the lines
    lines : numbers of lines A and B, and perhaps of the index
    """

    def __init__(self, connect: Callable[[], GpioLines], lines: Sequence[int]) -> None:
        self._connect, self._lines = connect, tuple(lines)
        self._taken: GpioLines | None = None
        self._number: int | None = None  # of the last edge
        self._levels = [0, 0]
        self._count = 0
        self._rising = True
        self._edge_at = 0.0  # s, of the last edge
        self._edges: deque[float] = deque(maxlen=EDGES)  # s, of the last ones in one direction, the newest first
        self._index: int | None = None  # count at the last index pulse

    def start(self) -> None:
        """Take the lines; what the head turned while they were not taken is not known."""
        self.close()
        self._taken = self._connect()
        self._taken.edges()
        self._levels = list(self._taken.levels()[:2])
        self._number, self._index = None, None
        self._edges.clear()

    def read(self, now: float) -> EncoderSample:
        """Count since the first start with the times of its last edges (s, own clock)."""
        if self._taken is None:
            raise SensorError("gpio: not started")
        edges = self._taken.edges()
        for edge in edges:
            self._follow(edge)
        self._prove(edges)
        return EncoderSample(self._count, self._edge_at, self._rising, earlier=tuple(self._edges)[1:])

    def close(self) -> None:
        """Give the lines back."""
        if self._taken is not None:
            self._taken.close()
            self._taken = None

    def _follow(self, edge: LineEdge) -> None:
        """Count one edge."""
        if self._number is not None and edge.number != self._number + 1:
            raise SensorError(f"gpio: {edge.number - self._number - 1} edges were lost", SensorCause.OVERFLOW)
        self._number = edge.number
        if edge.line == self._lines[-1] and len(self._lines) > 2:
            self._pass_index(edge)
            return
        line = self._lines.index(edge.line)
        before = ORDER[(self._levels[0], self._levels[1])]
        if self._levels[line] == edge.level:
            raise SensorError(f"gpio: line {edge.line}: two edges to level {edge.level} in a row", SensorCause.COUNTER)
        self._levels[line] = edge.level
        rising = (ORDER[(self._levels[0], self._levels[1])] - before) % 4 == 1
        self._count += 1 if rising else -1
        if rising != self._rising:
            self._edges.clear()
        self._rising = rising
        self._edge_at = edge.at
        self._edges.appendleft(edge.at)

    def _pass_index(self, edge: LineEdge) -> None:
        """Compare the count at an index pulse with that at the last one."""
        if not edge.level:
            return
        if self._index is not None:
            off = (self._count - self._index + COUNTS_PER_TURN // 2) % COUNTS_PER_TURN - COUNTS_PER_TURN // 2
            if abs(off) > WIDTH:
                raise SensorError(
                    f"gpio: expected whole turns of {COUNTS_PER_TURN} counts between two index pulses, got "
                    f"{abs(self._count - self._index)}: another resolution, or edges were lost",
                    SensorCause.RESOLUTION,
                )
        self._index = self._count

    def _prove(self, edges: list[LineEdge]) -> None:
        """Check the levels against those of the lines, unless an edge came meanwhile, and that both lines count."""
        of_lines = [sum(edge.line == line for edge in edges) for line in self._lines[:2]]
        if max(of_lines) >= ALONE and min(of_lines) == 0:
            silent = self._lines[of_lines.index(0)]
            raise SensorError(f"gpio: line {silent} is silent beside {max(of_lines)} edges", SensorCause.COUNTER)
        if self._taken is None:
            return
        levels = list(self._taken.levels()[:2])
        if levels == self._levels:
            return
        for edge in self._taken.edges():  # it came between the edges and the levels
            self._follow(edge)
        if list(self._taken.levels()[:2]) != self._levels and not self._taken.edges():
            raise SensorError("gpio: the levels of the lines contradict the edges", SensorCause.COUNTER)
