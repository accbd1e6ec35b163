"""A clock that may step back, as that of a restored machine, read as one that never does. No I/O."""

from __future__ import annotations

import math

STEPS_FROM = 1.0  # s back; events on their way from one thread to another come less out of order


class SteadyTime:
    """Time that stands still where its clock steps back, and goes on with it from there.

    Attributes
    ----------
    back : s by which the clock has stepped back, all steps together
    """

    def __init__(self) -> None:
        self.back = 0.0
        self._shown = -math.inf  # s, newest time of the clock since its last step

    def follow(self, shown: float) -> float:
        """Time (s) that it is when the clock shows ``shown`` (s)."""
        if shown < self._shown - STEPS_FROM:
            self.back += self._shown - shown
            self._shown = shown
        self._shown = max(self._shown, shown)
        return shown + self.back

    def shown_at(self, at: float) -> float:
        """What the clock shows at a time (s)."""
        return at - self.back
