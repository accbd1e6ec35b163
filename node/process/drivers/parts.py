"""The eighths of a window from the frames of a FIFO, each with its own mean."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.layout import PARTS

Array = npt.NDArray[np.float64]


def parts_of(rates: Array) -> tuple[float, ...]:
    """Mean rates of the eighths of a window by its frames ``rates`` (n,), of equal length; nothing of less than eight.

    A border inside a frame shares it: the turn is linear from one end of a frame to the other.
    """
    count = len(rates)
    if count < PARTS:
        return ()
    turned = np.concatenate([[0.0], np.cumsum(rates)])
    at = np.interp(np.arange(PARTS + 1) * (count / PARTS), np.arange(count + 1.0), turned)
    return tuple((np.diff(at) * (PARTS / count)).tolist())
