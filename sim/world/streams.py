"""Streams of random numbers: whoever draws has one of its own, so that nothing else changes what it gets."""

from __future__ import annotations

import numpy as np


def stream(*key: int) -> np.random.Generator:
    """The stream of a seed and whatever parts it from others; the same in every process and on every machine."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(key)))
