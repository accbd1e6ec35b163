"""The words of a verdict: of the hole, of what is not known, and of directions."""

from __future__ import annotations

import enum

WINDS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")


class Word(enum.StrEnum):
    """What a crew needs to know first; the later the worse."""

    ON_TARGET = "on_target"
    WATCH = "watch"
    STEER = "steer"
    OUT = "out"
    DONT_KNOW = "dont_know"


class VerdictDoubt(enum.StrEnum):
    """Reason of the verdict "don't know"."""

    NO_SURVEY = "no_survey"
    STALE = "stale"
    DEPTH = "depth"
    CLOCK = "clock"
    YAW = "yaw"
    UNCERTAIN = "uncertain"
    SETUP = "setup"
    UNCHECKED = "unchecked"
    CONTRADICTION = "contradiction"
