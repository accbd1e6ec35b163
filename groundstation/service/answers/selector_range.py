"""Ranges as an operator writes them: ``4..12``, ``4..``, ``..12`` or a single value."""

from __future__ import annotations

import math
from dataclasses import dataclass

from groundstation.errors import SelectorError
from groundstation.service.answers.streamed_rows import Parameters


@dataclass(frozen=True, slots=True)
class SelectorRange:
    """Closed interval of a selector's parameter."""

    low: float
    high: float
    single: bool

    @classmethod
    def parse(cls, name: str, text: str) -> SelectorRange:
        """Range of a parameter.

        Raises
        ------
        SelectorError
            When it is neither a number nor a range.
        """
        first, dots, last = text.partition("..")
        try:
            low = float(first) if first or not dots else -math.inf
            high = (float(last) if last else math.inf) if dots else low
        except ValueError:
            low = high = math.nan
        if not low <= high:
            raise SelectorError(f"parameter {name}: expected a number or a range such as {name}=4..12, got {text!r}")
        return cls(low, high, not dots)

    @classmethod
    def of_parameter(cls, name: str, p: Parameters) -> SelectorRange:
        """Range of a parameter, or all where it is not given; errors as ``parse``."""
        return cls.parse(name, p[name]) if name in p else EVERYTHING

    def holds(self, value: float) -> bool:
        """Whether ``value`` lies inside, to the last millimetre."""
        return self.low - 1e-3 <= value <= self.high + 1e-3


EVERYTHING = SelectorRange(-math.inf, math.inf, single=False)
