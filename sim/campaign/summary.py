"""What a campaign shows: honesty of the filter hop by hop, accuracy station by station, with intervals over runs.

Epochs and tubes of one run share their joints, so an interval is that of the mean over runs, each counted once:
mean +- 1.96 standard errors. Chunks are read one by one and summed without rounding, so neither memory nor result
depends on how many there are or where one ends.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Hashable, Iterable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from sim.campaign.chunk import Columns
from sim.string.result import wrap_angles

Array = npt.NDArray[np.float64]
INTERVAL: Final = 1.959963984540054  # sigma, of 95 % of normal errors

HONESTY: Final = (
    ("state", "state"),
    ("hop", "hop"),
    ("count", "epochs"),
    ("yaw_rms_deg", "yaw rms (deg)"),
    ("nees", "NEES"),
    ("nees_low", "low"),
    ("nees_high", "high"),
    ("nees_total", "NEES with joints"),
    ("nees_total_low", "low"),
    ("nees_total_high", "high"),
    ("inside_95_percent", "inside 95 % (%)"),
    ("inside_low", "low"),
    ("inside_high", "high"),
)
ACCURACY: Final = (
    ("md_m", "depth (m)"),
    ("count", "surveys"),
    ("untrusted", "untrusted"),
    ("inclination_rms_deg", "inclination rms (deg)"),
    ("azimuth_rms_deg", "azimuth rms (deg)"),
    ("azimuth_low_deg", "low"),
    ("azimuth_high_deg", "high"),
)


class Sum:
    """A sum of floats without rounding error, so that their order does not matter. Source: Shewchuk 1997."""

    def __init__(self) -> None:
        self._parts: list[float] = []

    def add(self, value: float) -> None:
        """Add one."""
        parts, kept = self._parts, 0
        for part in parts:
            large, small = (value, part) if abs(value) >= abs(part) else (part, value)
            value = large + small
            if rest := small - (value - large):
                parts[kept] = rest
                kept += 1
        parts[kept:] = [value]

    @property
    def value(self) -> float:
        """The sum, rounded once."""
        return math.fsum(self._parts)


class OverRuns:
    """Mean of a quantity over runs, with its interval; a run counts once, by the mean of its rows."""

    def __init__(self) -> None:
        self.rows = self.runs = 0
        self._sum, self._squares, self._all = Sum(), Sum(), Sum()

    def add(self, run: npt.NDArray[np.int64], values: Array) -> None:
        """Take rows (n,) of some runs, all that there are of each."""
        if not len(run):
            return
        _, place = np.unique(run, return_inverse=True)
        sums = np.bincount(place, values)
        means = (sums / np.bincount(place)).tolist()
        self.rows += len(run)
        self.runs += len(means)
        for total, mean in zip(sums.tolist(), means, strict=True):
            self._all.add(total)
            self._sum.add(mean)
            self._squares.add(mean * mean)

    @property
    def of_rows(self) -> float:
        """Mean of all rows; NaN where there is none."""
        return self._all.value / self.rows if self.rows else math.nan

    @property
    def interval(self) -> tuple[float, float, float]:
        """Mean of the runs and both ends of its 95 % interval; NaN where there is none."""
        if not self.runs:
            return math.nan, math.nan, math.nan
        mean = self._sum.value / self.runs
        if self.runs == 1:
            return mean, math.nan, math.nan
        var = max(self._squares.value - self.runs * mean * mean, 0.0) / (self.runs - 1)
        half = INTERVAL * math.sqrt(var / self.runs)
        return mean, mean - half, mean + half


Groups = dict[Hashable, dict[str, OverRuns]]


def empty_groups() -> Groups:
    """Quantities by group, made when they are first asked for."""
    return defaultdict(lambda: defaultdict(OverRuns))


def honesty_rows(chunks: Iterable[Columns]) -> list[dict[str, Any]]:
    """NEES and coverage at every hop, at rest and turning, of nodes that know their yaw."""
    found: dict[Any, dict[str, OverRuns]] = empty_groups()
    for epochs in chunks:
        random = wrap_angles(epochs["yaw_error"] - epochs["systematic_error"])
        total = epochs["yaw_error"] ** 2 / (epochs["yaw_var"] + epochs["systematic_var"])
        for turning in (False, True):
            for hop in np.unique(epochs["hop"]).tolist():
                chosen = (epochs["turning"] == turning) & epochs["known"] & (epochs["hop"] == hop)
                run, of = epochs["run"][chosen], found[turning, hop]
                of["square"].add(run, random[chosen] ** 2)
                of["nees"].add(run, random[chosen] ** 2 / epochs["yaw_var"][chosen])
                of["nees_total"].add(run, total[chosen])
                of["inside"].add(run, 100.0 * (total[chosen] < INTERVAL**2))
    rows = []
    for (turning, hop), of in sorted(found.items()):
        nees, nees_total, inside = (of[name].interval for name in ("nees", "nees_total", "inside"))
        rows.append(
            {
                "state": "turning" if turning else "at rest",
                "hop": hop,
                "count": of["nees"].rows,
                "yaw_rms_deg": root_deg(of["square"].of_rows),
                **dict(zip(("nees", "nees_low", "nees_high"), nees, strict=True)),
                **dict(zip(("nees_total", "nees_total_low", "nees_total_high"), nees_total, strict=True)),
                **dict(zip(("inside_95_percent", "inside_low", "inside_high"), inside, strict=True)),
            }
        )
    return [row for row in rows if row["count"]]


def accuracy_rows(chunks: Iterable[Columns]) -> list[dict[str, Any]]:
    """Errors of the surveys at every depth, each node by itself; those whose yaw is not trusted are counted only."""
    found: dict[Any, dict[str, OverRuns]] = empty_groups()
    for surveys in chunks:
        depth = np.round(surveys["md"], 3)
        for md in np.unique(depth).tolist():
            here, of = depth == md, found[md]
            trusted = here & surveys["trusted"]
            good = trusted & np.isfinite(surveys["azimuth_error"])
            of["inclination"].add(surveys["run"][here], surveys["inclination_error"][here] ** 2)
            of["trusted"].add(surveys["run"][trusted], np.ones(int(trusted.sum())))
            of["azimuth"].add(surveys["run"][good], surveys["azimuth_error"][good] ** 2)
    rows = []
    for md, of in sorted(found.items()):
        square, low, high = of["azimuth"].interval
        rows.append(
            {
                "md_m": md,
                "count": of["inclination"].rows,
                "untrusted": of["inclination"].rows - of["trusted"].rows,
                "inclination_rms_deg": root_deg(of["inclination"].of_rows),
                "azimuth_rms_deg": root_deg(square),
                "azimuth_low_deg": root_deg(low),
                "azimuth_high_deg": root_deg(high),
            }
        )
    return rows


def root_deg(square: float) -> float:
    """Root of a mean square (rad^2) in degrees."""
    return math.degrees(math.sqrt(max(square, 0.0))) if math.isfinite(square) else math.nan
