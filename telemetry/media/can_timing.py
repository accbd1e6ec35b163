"""How long a CAN frame occupies its bus: bits by ISO 11898-1, stuffed as badly as they can be.

Extended identifiers (29 bit) throughout. Of CAN FD the identifier travels at the nominal rate, the data and their
checksum at the data rate.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

CLASSIC_LARGEST, FD_LARGEST = 8, 64  # bytes of data in a frame
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)  # that a length code can say
TAIL = 13  # bits: delimiter of the checksum, acknowledgement and its delimiter, end of frame, pause
CLASSIC_HEAD = 39  # bits: start, identifier, SRR, IDE, RTR, two reserved, length code
CLASSIC_CHECKSUM = 15
FD_HEAD = 36  # bits: start, identifier, SRR, IDE, RRS, FDF, reserved, BRS
FD_CONTROL = 5  # bits: ESI, length code
ERROR_FRAME = 23  # bits: flags of both, delimiter, pause


@dataclass(frozen=True, slots=True)
class BitRates:
    """Bit rates of a bus, bit/s; of classic CAN the nominal one alone matters. 0: frames take no time."""

    nominal: float = 0.0
    data: float = 0.0

    @property
    def is_paced(self) -> bool:
        """Whether frames take time."""
        return self.nominal > 0.0

    @property
    def error_duration(self) -> float:
        """Duration of an error frame, s."""
        return ERROR_FRAME / self.nominal if self.is_paced else 0.0

    def duration(self, length: int, *, fd: bool) -> float:
        """Duration of a frame with ``length`` bytes of data, s, at the worst case of stuffing."""
        if not self.is_paced:
            return 0.0
        if not fd:
            return classic_bits(length) / self.nominal
        nominal, data = fd_bits(length)
        return nominal / self.nominal + data / (self.data or self.nominal)


def classic_bits(length: int) -> int:
    """Bits of a classic frame with ``length`` bytes of data."""
    stuffed = CLASSIC_HEAD + 8 * length + CLASSIC_CHECKSUM
    return stuffed + (stuffed - 1) // 4 + TAIL


def fd_bits(length: int) -> tuple[int, int]:
    """Bits of an FD frame at the nominal and at the data rate; ``length`` is one of ``FD_LENGTHS``.

    The checksum and the count of stuff bits before it have a fixed stuff bit each four bits.
    """
    checksum = 4 + (17 if length <= 16 else 21)
    stuffed = FD_CONTROL + 8 * length
    data = stuffed + stuffed // 4 + checksum + 1 + checksum // 4
    return FD_HEAD + (FD_HEAD - 1) // 4 + TAIL, data


def fd_length(length: int) -> int:
    """Smallest length of an FD frame that holds ``length`` bytes.

    Raises
    ------
    ValueError
        When none does.
    """
    if not 0 <= length <= FD_LARGEST:
        raise ValueError(f"data of an FD frame: expected at most {FD_LARGEST} bytes, got {length}")
    return FD_LENGTHS[bisect_left(FD_LENGTHS, length)]
