"""Numbers of what a process sends: one series for each start that has lost the series before."""

from __future__ import annotations

SERIES_SHIFT = 24  # of a sequence number: below it the count, above it the start at which the count began


class SequenceCounter:
    """Gives out numbers.

    Parameters
    ----------
    begun_at : number of the start that lost its numbers, so that none is given to a second message; 0 for the first

    Attributes
    ----------
    following : number of the next message
    """

    def __init__(self, begun_at: int) -> None:
        self.following = (begun_at << SERIES_SHIFT) + 1

    @property
    def newest(self) -> int:
        """Newest number given out, 0 before the first of this series."""
        return self.following - 1 if self.following & ((1 << SERIES_SHIFT) - 1) > 1 else 0

    def take(self) -> int:
        """Number of the next message, given out now."""
        sequence = self.following
        self.following += 1
        return sequence
