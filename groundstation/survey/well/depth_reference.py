"""What depths count from, and how depths from one reference are brought to another.

A rotary table that lies ``height`` above the ground reads every depth by that much deeper: measured depth and true
vertical depth from the ground are less by it, for between the two the string hangs free and straight. Error models are
evaluated with the depths as they were read; the answer alone is brought to its reference. m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Depths = TypeVar("Depths", float, npt.NDArray[np.float64])
RIG = ("rotary-table", "kelly-bushing", "drill-floor")
GROUND = ("collar", "ground-level")
DEPTHS_FROM = (*GROUND, *RIG, "mean-sea-level", "height-datum")


@dataclass(frozen=True, slots=True)
class DepthReference:
    """References of the depths of a record and of those of the answer."""

    record: str = DEPTHS_FROM[0]
    answer: str = DEPTHS_FROM[0]
    height: float = 0.0  # of the record's above the answer's

    def to_answer(self, depth: Depths) -> Depths:
        """Convert a depth of the record to one of the answer, m."""
        return depth - self.height

    def to_record(self, depth: Depths) -> Depths:
        """Convert a depth of the answer to one of the record, m."""
        return depth + self.height


def depth_reference(record: str, answer: str | None = None, height: float | None = None) -> DepthReference:
    """References by their names; the answer's is that of the record where none is asked for.

    Raises
    ------
    SurveyError
        When a name is not known, the height of one above the other is missing, or contradicts what they are.
    """
    answer = record if answer is None else answer
    for name in (record, answer):
        if name not in DEPTHS_FROM:
            raise SurveyError(f"depth reference: expected one of {', '.join(DEPTHS_FROM)}, got {name!r}")
    if height is not None and not math.isfinite(height):
        raise SurveyError(f"depth reference: expected a finite height, got {height}")
    if record == answer:
        if height:
            raise SurveyError(
                f"depth reference: depths are read and given from the {record}, so its height is 0; got {height:g} m"
            )
        return DepthReference(record, answer)
    if height is None:
        raise SurveyError(
            f"depth reference: depths are read from the {record} and asked from the {answer}; expected the height "
            "of the one above the other"
        )
    if (record in RIG and answer in GROUND and height < 0.0) or (record in GROUND and answer in RIG and height > 0.0):
        high, low = (record, answer) if record in RIG else (answer, record)
        raise SurveyError(
            f"depth reference: the {high} lies above the {low}, yet the {record} is stated {height:g} m above the "
            f"{answer}; expected the other sign"
        )
    return DepthReference(record, answer, height)
