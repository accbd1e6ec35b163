"""Constants of a disturbance that are drawn anew for every seed: what a rule of the node rests on is nowhere fixed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.studies.scenarios import Tables
from sim.world.random_streams import RandomStream, random_stream


@dataclass(frozen=True, slots=True)
class Between:
    """A constant of a scenario, drawn between two: evenly in its logarithm if both are above 0, else evenly.

    Of two whole numbers it is a whole number, either end among them.
    """

    least: float
    most: float

    def draw(self, random: np.random.Generator) -> float:
        """One of them."""
        if isinstance(self.least, int) and isinstance(self.most, int):
            return int(random.integers(self.least, self.most + 1))
        if self.least > 0.0:
            return math.exp(random.uniform(math.log(self.least), math.log(self.most)))
        return float(random.uniform(self.least, self.most))


def draw_constants(tables: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """A scenario with every ``Between`` drawn, each from the stream of its own key."""
    return {key: _drawn(value, seed, (key,)) for key, value in tables.items()}


def _drawn(value: Any, seed: int, path: tuple[str, ...]) -> Any:
    if isinstance(value, Between):
        name = tuple(".".join(path).encode())
        return value.draw(random_stream(seed, RandomStream.FIELD, 0, *name))
    if isinstance(value, Mapping):
        return {key: _drawn(inner, seed, (*path, key)) for key, inner in value.items()}
    return value


def draw_some(mild: Sequence[Tables], least: int, most: int, seed: int) -> Iterator[Tables]:
    """Some of the disturbances: how many and which, by one integer."""
    random = random_stream(seed, RandomStream.FIELD, 1)
    for k in sorted(random.permutation(len(mild))[: random.integers(least, most + 1)].tolist()):
        yield mild[k]


def merge_tables(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Both scenarios at once, table by table; where both have a key it is that of the second."""
    both = dict(first)
    for key, value in second.items():
        before = both.get(key)
        both[key] = merge_tables(before, value) if isinstance(before, Mapping) and isinstance(value, Mapping) else value
    return both
