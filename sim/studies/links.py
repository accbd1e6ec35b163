"""When aiding passes: all the time, on and off, or one at a time. Source: the update modes of thesis 4.2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from node.kernels.layout import PERIOD

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class Link(Protocol):
    """When aiding passes."""

    @property
    def repeats(self) -> float:
        """Time after which it looks the same, s."""

    def passes(self, t: Array) -> Mask:
        """Whether an aiding measured at ``t`` (n,) s, one a cycle, is handed over."""


@dataclass(frozen=True, slots=True)
class OnOff:
    """Aiding every cycle for ``on`` s, then none for ``off`` s."""

    on: float = 20.0
    off: float = 0.0

    @property
    def repeats(self) -> float:
        """Time of both, s."""
        return self.on + self.off

    def passes(self, t: Array) -> Mask:
        """See ``Link``."""
        return np.asarray(np.mod(t, self.repeats) < self.on)


@dataclass(frozen=True, slots=True)
class Single:
    """One aiding at a time, ``every`` s."""

    every: float

    @property
    def repeats(self) -> float:
        """Time from one to the next, s."""
        return self.every

    def passes(self, t: Array) -> Mask:
        """See ``Link``: the first cycle of every interval."""
        number = np.floor(t / self.every + 1e-9)
        return np.asarray(np.diff(number, prepend=np.floor((t[0] - PERIOD) / self.every + 1e-9)) > 0.0)
