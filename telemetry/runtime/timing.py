"""Durations of the parts of a cycle and its start delay: statistics in constant memory.

A duration falls into one of 256 bins, 32 to a decade from 1 us to 100 s, so a quantile is at most one bin, 7.5 %,
above the true one and never below it; count, mean and largest are exact.
"""

from __future__ import annotations

import enum
import math
import time
from typing import Any

BINS_A_DECADE = 32
DECADES = 8
SHORTEST = 1e-6  # s, upper edge of the first bin
BIN_RATIO = 10.0 ** (1.0 / BINS_A_DECADE)


class CycleStage(enum.Enum):
    """Stages that are measured, each with the number of the execution cycle's event (node specification section 1)."""

    SYNCHRONISE = "synchronise"  # 1: neighbours, hello, time request
    START = "start"  # 2: how late the cycle starts behind its deadline
    AIDING = "aiding"  # 3 to 5: from the aiding's time of validity to its arrival
    FRAME = "frame"  # 5: one frame from a neighbour, handled
    READ = "read"  # 6: the sensor
    FILTER = "filter"  # 6: calibrate, integrate, filter
    REPORT = "report"  # 6: messages encoded and queued
    SAVE = "save"  # 6: state written to disk, when due
    SEND = "send"  # 6: frames handed to the bus
    CYCLE = "cycle"  # 6: all of it


class Durations:
    """Count, mean, largest and quantiles of durations (s) in constant memory; a negative one counts as none."""

    def __init__(self) -> None:
        self.count = 0
        self.largest = 0.0
        self._total = 0.0
        self._bins = [0] * (BINS_A_DECADE * DECADES)

    def add(self, seconds: float) -> None:
        """Count one duration (s)."""
        seconds = max(seconds, 0.0)
        self.count += 1
        self._total += seconds
        self.largest = max(self.largest, seconds)
        place = math.ceil(BINS_A_DECADE * math.log10(seconds / SHORTEST)) if seconds > SHORTEST else 0
        self._bins[min(place, len(self._bins) - 1)] += 1

    @property
    def mean(self) -> float:
        """Mean, s; 0 of none."""
        return self._total / self.count if self.count else 0.0

    def quantile(self, share: float) -> float:
        """Duration (s) that ``share`` (0..1) of all do not exceed, rounded up by at most a bin; 0 of none."""
        wanted = max(math.ceil(share * self.count), 1)
        seen = 0
        for place, number in enumerate(self._bins):
            seen += number
            if seen >= wanted:
                last = place == len(self._bins) - 1
                return self.largest if last else min(SHORTEST * BIN_RATIO**place, self.largest)
        return 0.0

    def summary_ms(self) -> dict[str, float]:
        """Figures for a report, ms."""
        return {
            "count": self.count,
            "mean": 1e3 * self.mean,
            "median": 1e3 * self.quantile(0.5),
            "p99": 1e3 * self.quantile(0.99),
            "max": 1e3 * self.largest,
        }


class CycleTiming:
    """Durations of every stage of one process, its cycles and its overruns."""

    def __init__(self) -> None:
        self.stages = {stage: Durations() for stage in CycleStage}
        self.cycles = 0
        self.overruns = 0  # cycles that had not ended when the next one was due
        self.missed = 0  # cycles that were therefore left out
        self.first_cycle_at = math.nan  # s, own clock, end of the first cycle
        self._mark = 0.0

    def begin(self) -> None:
        """Start the watch that ``lap`` reads."""
        self._mark = time.perf_counter()

    def lap(self, stage: CycleStage) -> None:
        """Count the time since the last ``begin`` or ``lap`` for ``stage``."""
        now = time.perf_counter()
        self.stages[stage].add(now - self._mark)
        self._mark = now

    def add_duration(self, stage: CycleStage, seconds: float) -> None:
        """Count a duration (s) that was measured elsewhere for ``stage``."""
        self.stages[stage].add(seconds)

    def end_cycle(self, seconds: float, missed: int, now: float) -> None:
        """Count a cycle that took ``seconds`` and ended at ``now`` (s, own clock), ``missed`` deadlines later."""
        self.stages[CycleStage.CYCLE].add(seconds)
        self.cycles += 1
        self.missed += missed
        self.overruns += missed > 0
        if self.cycles == 1:
            self.first_cycle_at = now

    def report(self) -> dict[str, Any]:
        """Everything, as JSON for a file."""
        return {
            "cycles": self.cycles,
            "overruns": self.overruns,
            "missed": self.missed,
            "first_cycle_at_s": self.first_cycle_at if self.cycles else None,
            "stages_ms": {stage.value: durations.summary_ms() for stage, durations in self.stages.items()},
        }
