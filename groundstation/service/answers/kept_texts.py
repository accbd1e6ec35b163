"""Answers as they are sent, kept until the hole has changed: they are asked for far more often. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from groundstation.service.answers.row_texts import RowTexts
from groundstation.service.hole.surveyed_hole import SurveyedHole


class KeptTexts:
    """JSON of what is shown of a hole.

    Parameters
    ----------
    hole : of which they are

    Attributes
    ----------
    measurements : rows of every measurement
    """

    def __init__(self, hole: SurveyedHole) -> None:
        self.measurements = RowTexts(marks=2)
        self._hole = hole
        self._shown: dict[Hashable, tuple[int, bytes]] = {}

    def text_of(self, view: Hashable, render: Callable[[], bytes]) -> bytes:
        """What a view of the hole shows, as it is sent; rendered anew where a survey has come since.

        As objects what is shown of a long hole would take ten times the room.
        """
        version = self._hole.version
        if self._shown.get(view, (-1,))[0] != version:
            self._shown[view] = version, render()
        return self._shown[view][1]
