"""Where the signals of a message lie: in one frame of CAN FD, or in several of 8 bytes on classic CAN.

Each frame holds a count, by which the parts of one message are told from those of the next.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from telemetry.errors import DecodeError
from telemetry.media.can_timing import FD_LARGEST, fd_length
from telemetry.presentation.can_signals import COUNT, Signal

FD_PART = 31  # part of a message that is whole in one frame


@dataclass(frozen=True, slots=True)
class Layout:
    """One frame of a message: its signals and the first bit of each, counted from the lowest of the first byte."""

    name: str
    part: int
    length: int  # bytes
    places: tuple[tuple[Signal, int], ...]


class Form:
    """A message in frames of one kind of CAN: packs and unpacks all its signals at once.

    ``places`` of the signals in their order: frame, first bit, largest raw number.
    """

    def __init__(self, layouts: tuple[Layout, ...], signals: Iterable[Signal]) -> None:
        self.layouts = layouts
        self._lengths = [layout.length for layout in layouts]
        found = {
            signal.name: (frame, start)
            for frame, layout in enumerate(layouts)
            for signal, start in layout.places
            if signal is not COUNT
        }
        self.places = [(*found[signal.name], signal.largest) for signal in signals]

    def pack(self, raws: Iterable[int], count: int) -> list[bytes]:
        """Data of each frame; ``raws`` in the order of the signals."""
        bits = [count & COUNT.largest] * len(self._lengths)
        for (frame, start, _), raw in zip(self.places, raws, strict=True):
            bits[frame] |= raw << start
        return [number.to_bytes(length, "little") for number, length in zip(bits, self._lengths, strict=True)]

    def unpack(self, frames: Sequence[bytes]) -> list[int]:
        """Raw numbers in the order of the signals.

        Raises
        ------
        DecodeError
            When a frame has another length.
        """
        for layout, data in zip(self.layouts, frames, strict=True):
            if len(data) != layout.length:
                raise DecodeError(f"{layout.name}: expected {layout.length} bytes, got {len(data)}")
        bits = [int.from_bytes(data, "little") for data in frames]
        return [bits[frame] >> start & largest for frame, start, largest in self.places]


def frame_groups(signals: list[Signal], bits: int) -> list[list[Signal]]:
    """Signals put into frames with room for ``bits``: each into the first that has room."""
    filled: list[list[Signal]] = []
    for signal in signals:
        for group in filled:
            if sum(s.bits for s in group) + signal.bits <= bits:
                group.append(signal)
                break
        else:
            filled.append([signal])
    return filled


def laid_out(name: str, part: int, signals: list[Signal], largest: int) -> Layout:
    """The count and the signals one after the other, from the lowest bit."""
    places, start = [], 0
    for signal in [COUNT, *signals]:
        places.append((signal, start))
        start += signal.bits
    length = (start + 7) // 8
    return Layout(name, part, fd_length(length) if largest == FD_LARGEST else length, tuple(places))
