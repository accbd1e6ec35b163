"""The rate that the encoder reports with its aidings, and how long it is good for."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.quantity import time_quantity

RATE_AGE: Final = time_quantity(3.0)  # s, of an encoder's rate that may stand for the gyroscope


@kernel
def is_heard(node: Any) -> bool:
    """Whether the encoder reported its rate lately."""
    return bool(abs(node.filter.now - node.guard.rate_at) <= RATE_AGE)
