"""The hole as drilled: stations joined by circular arcs, tangent and position in closed form at every depth.

Between two stations the tangent turns in their common plane at a constant rate (minimum curvature), so direction,
curvature and position are analytic. Frame: north, east, down.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.errors import ScenarioError
from telemetry.bounded_bytes import bounded_text

Array = npt.NDArray[np.float64]
STRAIGHT = 1e-12  # rad, below which an arc is a line
SPIRAL_STATIONS = 61
LARGEST_TURN = math.radians(90.0)  # between two stations; beyond, the path turns back


class Borehole:
    """Minimum-curvature path through stations.

    Parameters
    ----------
    md, inclination, azimuth : (n,) m, rad, rad; strictly increasing depths from 0
    where : file, for messages

    Raises
    ------
    ScenarioError
        When the path turns back, has too few stations or values that cannot be.
    """

    def __init__(self, md: Array, inclination: Array, azimuth: Array, where: str = "path") -> None:
        self.md = md
        self._check(inclination, azimuth, where)
        sin_i = np.sin(inclination)
        self._tangents = np.stack([sin_i * np.cos(azimuth), sin_i * np.sin(azimuth), np.cos(inclination)], axis=1)
        # the angle by its sine: the cosine loses half the digits of a small one
        cross = np.cross(self._tangents[:-1], self._tangents[1:])
        dot = np.sum(self._tangents[:-1] * self._tangents[1:], axis=1)
        self._bend = np.arctan2(np.linalg.norm(cross, axis=1), dot)
        if np.any(self._bend >= LARGEST_TURN):
            at = int(np.argmax(self._bend >= LARGEST_TURN)) + 1
            turned = math.degrees(self._bend[at - 1])
            raise ScenarioError(
                f"{where}: station {at} at {md[at]:g} m: the path turns back, {turned:.0f} deg from the station before"
            )
        steps = np.diff(md)[:, None]
        factor = np.where(self._bend < 1e-6, 1.0 + self._bend**2 / 12.0, _ratio_factor(self._bend))[:, None]
        legs = 0.5 * steps * (self._tangents[:-1] + self._tangents[1:]) * factor
        self._positions = np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])

    @classmethod
    def straight(cls, inclination: float, azimuth: float = 0.0, length: float = 1000.0) -> Borehole:
        """A hole of ``length`` (m) in one direction (rad)."""
        return cls(np.array([0.0, length]), np.full(2, inclination), np.full(2, azimuth))

    @classmethod
    def spiral(cls, inclination: float, azimuth: float, turn: float, length: float, build: float = 0.0) -> Borehole:
        """A hole of ``length`` (m) whose azimuth goes on by ``turn`` and its inclination by ``build`` (rad) evenly."""
        md = np.linspace(0.0, length, SPIRAL_STATIONS)
        return cls(md, inclination + build * md / length, azimuth + turn * md / length)

    def _check(self, inclination: Array, azimuth: Array, where: str) -> None:
        if len(self.md) < 2:
            raise ScenarioError(f"{where}: expected at least two stations, got {len(self.md)}")
        for k in range(len(self.md)):
            if not math.isfinite(self.md[k]):
                raise ScenarioError(f"{where}: station {k}: expected a finite measured depth, got {self.md[k]:g}")
            # straight up the smallest rotation from down is not defined
            if not (math.isfinite(azimuth[k]) and 0.0 <= inclination[k] < math.pi):
                raise ScenarioError(
                    f"{where}: station {k}: expected an inclination of 0 to below 180 deg and an azimuth, "
                    f"got {math.degrees(inclination[k]):g} and {math.degrees(azimuth[k]):g} deg"
                )
        if self.md[0] != 0.0:
            raise ScenarioError(f"{where}: station 0: expected measured depth 0, got {self.md[0]:g} m")
        back = np.flatnonzero(~(np.diff(self.md) > 0.0))
        if len(back):
            k = int(back[0]) + 1
            raise ScenarioError(
                f"{where}: station {k}: the path turns back, measured depth {self.md[k]:g} m after {self.md[k - 1]:g} m"
            )

    @property
    def length(self) -> float:
        """Measured depth of the last station, m."""
        return float(self.md[-1])

    def tangent(self, md: Array) -> tuple[Array, Array]:
        """Tangent (n, 3) and its derivative along the path (n, 3, 1/m) at the depths ``md`` (n,)."""
        k, f, step = self._locate(md)
        t1, t2, bend = self._tangents[k], self._tangents[k + 1], self._bend[k][:, None]
        straight = bend < STRAIGHT
        if straight.all():
            return (1.0 - f[:, None]) * t1 + f[:, None] * t2, np.zeros_like(t1)
        sine = np.where(straight, 1.0, np.sin(bend))
        f, step = f[:, None], step[:, None]
        w1 = np.where(straight, 1.0 - f, np.sin((1.0 - f) * bend) / sine)
        w2 = np.where(straight, f, np.sin(f * bend) / sine)
        d1 = np.where(straight, 0.0, -bend * np.cos((1.0 - f) * bend) / sine)
        d2 = np.where(straight, 0.0, bend * np.cos(f * bend) / sine)
        return w1 * t1 + w2 * t2, (d1 * t1 + d2 * t2) / step

    def position(self, md: float) -> Array:
        """North, east, down (3, m) at one depth."""
        k, f, step = self._locate(np.array([md]))
        leg, bend = int(k[0]), float(self._bend[k[0]] * f[0])
        here = self.tangent(np.array([md]))[0][0]
        factor = 1.0 + bend**2 / 12.0 if bend < 1e-6 else 2.0 / bend * math.tan(0.5 * bend)
        moved: Array = 0.5 * f[0] * step[0] * (self._tangents[leg] + here) * factor
        return np.asarray(self._positions[leg] + moved)

    def direction(self, md: float) -> tuple[float, float]:
        """Inclination and azimuth (rad, azimuth in [0, 2 pi)) at one depth."""
        t = self.tangent(np.array([md]))[0][0]
        return math.atan2(math.hypot(t[0], t[1]), t[2]), math.atan2(t[1], t[0]) % (2.0 * math.pi)

    def _locate(self, md: Array) -> tuple[npt.NDArray[np.intp], Array, Array]:
        k = np.clip(np.searchsorted(self.md, md, side="right") - 1, 0, len(self.md) - 2)
        step = self.md[k + 1] - self.md[k]
        return k, (md - self.md[k]) / step, step


def _ratio_factor(bend: Array) -> Array:
    safe = np.where(bend < 1e-6, 1.0, bend)
    return np.asarray(2.0 / safe * np.tan(0.5 * safe))


def read_displacements(path: Path) -> tuple[Array, Array, Array]:
    """Path from lateral displacements: I = asin(hypot(a, b) / L) over the interval before, A = atan2(a, -b).

    North is -B and east is +A, as on the record of thesis Table 4.1; the first row is the collar.
    """
    md, a_cm, b_cm = _columns(path, ("md_m", "a_cm", "b_cm"))
    length = np.concatenate([[1.0], np.diff(md)])
    lateral = np.hypot(a_cm, b_cm) / 100.0
    with np.errstate(invalid="ignore", divide="ignore"):
        sine = lateral / length
    wrong = np.flatnonzero(~(sine < 1.0) & (length > 0.0))
    if len(wrong):
        k = int(wrong[0])
        raise ScenarioError(f"{path}: row {k}: a displacement of {lateral[k]:g} m over {length[k]:g} m cannot be")
    return md, np.arcsin(np.clip(sine, 0.0, 1.0)), np.mod(np.arctan2(a_cm, -b_cm), 2.0 * math.pi) * (lateral > 0.0)


def read_stations(path: Path) -> tuple[Array, Array, Array]:
    """Path from stations: depth, inclination and azimuth."""
    md, inclination_deg, azimuth_deg = _columns(path, ("md_m", "inclination_deg", "azimuth_deg"))
    return md, np.radians(inclination_deg), np.radians(azimuth_deg)


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    try:
        lines = bounded_text(path).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ScenarioError(f"{path}: {reason}; expected a CSV file with {', '.join(names)}") from error
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    reader: Any = csv.DictReader([line for _, line in numbered])
    if reader.fieldnames is None or not set(names) <= set(reader.fieldnames):
        raise ScenarioError(
            f"{path}: expected the columns {', '.join(names)}, got {', '.join(reader.fieldnames or ['none'])}"
        )
    rows: list[list[float]] = []
    for (number, _), row in zip(numbered[1:], reader, strict=False):
        try:
            rows.append([float(row[name]) for name in names])
        except (TypeError, ValueError):
            raise ScenarioError(f"{path}: line {number}: expected numbers in {', '.join(names)}") from None
    table = np.array(rows).reshape(-1, len(names))
    return [table[:, k] for k in range(len(names))]
