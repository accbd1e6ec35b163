"""A hole as the ground station knows it beside the truth: errors and what is stated of them, station by station.

What a station says of a depth that was measured wrongly is judged at the true one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.surveyed_hole import SurveyedHole
from sim.world.world import World

Array = npt.NDArray[np.float64]
INSIDE_1, INSIDE_2, INSIDE_3 = 3.841, 5.991, 7.815  # 95 % points of chi-square with 1, 2 and 3 degrees of freedom
AXES: Final = ("north", "east", "vertical")


@dataclass(frozen=True, slots=True)
class JudgedHole:
    """Stations from the collar down, of one rig.

    Attributes
    ----------
    md : (s,) m, as it is told
    lean_error, lean_cov : (s, 2) and (s, 2, 2) rad, of the horizontal part of the unit vector
    error, cov : (s, 3) and (s, 3, 3) m, of the position: north, east, down
    unfound : rad and m, by which the last station's direction and place may be off beside, as is told, while one tube
        alone has read it
    lean_drift, drift : (s, 2) rad and (s, 3) m, as ``lean_error`` and ``error``, of a drift of the encoder that is just
        not found, as is told
    """

    md: Array
    lean_error: Array
    lean_cov: Array
    error: Array
    cov: Array
    unfound: tuple[float, float] = (0.0, 0.0)
    lean_drift: Array | None = None
    drift: Array | None = None

    def without_drift(self) -> JudgedHole:
        """The hole less as much of the drift that is told to be unfound as it seems to have, and no more than all."""
        if self.lean_drift is None or self.drift is None:
            return self
        weighed = np.linalg.solve(self.lean_cov, self.lean_drift[:, :, None])[:, :, 0]
        squares = float(np.sum(weighed * self.lean_drift))
        part = float(np.clip(np.sum(weighed * self.lean_error) / squares, -1.0, 1.0)) if squares > 0.0 else 0.0
        return replace(self, lean_error=self.lean_error - part * self.lean_drift, error=self.error - part * self.drift)

    @property
    def direction_squares(self) -> Array:
        """Squares (s,) of the direction's error in its own standard deviations, of two degrees of freedom."""
        return quadratic_forms(self.lean_error, self.lean_cov)

    @property
    def ellipsoid_squares(self) -> Array:
        """Likewise (s,) of the position's, of three."""
        return quadratic_forms(self.error, self.cov)

    def worst_sigmas(self) -> tuple[float, float]:
        """Worst direction, and worst position or direction, beyond what is told to be unfound, as of a normal number.

        A direction has two degrees of freedom and a position three.
        """
        if not len(self.md):
            return 0.0, 0.0
        found = []
        for squares, error, told, freedom in (
            (self.direction_squares, self.lean_error, self.unfound[0], 2.0),
            (self.ellipsoid_squares, self.error, self.unfound[1], 3.0),
        ):
            sigmas = np.sqrt(squares / freedom)
            off = float(np.linalg.norm(error[-1]))
            sigmas[-1] *= max(1.0 - told / off, 0.0) if off > 0.0 else 0.0
            found.append(float(sigmas.max()))
        return found[0], max(found)

    @property
    def axis_squares(self) -> Array:
        """Likewise (s, 3) of each axis of the position by itself."""
        return np.asarray(self.error**2 / np.diagonal(self.cov, axis1=1, axis2=2))


def judge_hole_of(world: World, hole: SurveyedHole) -> JudgedHole:
    """A hole at the end of a run beside the truth of its world; without a station where nothing could be placed."""
    true_hole = world.scenario.hole if world.moved_hole is None else world.moved_hole.hole
    stations = [station for station in hole.stations if station.md > 0.0]
    depths = np.array([true_depth(world, station) for station in stations], np.float64)
    directions = [hole.direction_of(station) for station in stations]
    places = [hole.place_of(station) for station in stations]
    lean = np.reshape([one.lean for one in directions], (-1, 2)) - true_hole.tangent(depths)[0][:, :2]
    true_positions = np.reshape([true_hole.position(float(md)) for md in depths], (-1, 3))
    return JudgedHole(
        np.array([station.md for station in stations]),
        lean,
        np.reshape([one.total_cov for one in directions], (-1, 2, 2)),
        hole.trajectory.positions[places] - true_positions,
        hole.trajectory.covs[places],
        unfound_of(hole),
        *drift_of(hole),
    )


def unfound_of(hole: SurveyedHole) -> tuple[float, float]:
    """What is told of the last station, rad and m, beside its sigma."""
    examined = hole.examined if hole.is_adjusted else None
    alone = None if examined is None else examined.last_look
    return (0.0, 0.0) if alone is None else (alone.direction, alone.toe)


def drift_of(hole: SurveyedHole) -> tuple[Array, Array] | tuple[None, None]:
    """What is told of a drift of the encoder that is not found: of directions and of places, without the collar's."""
    examined = hole.examined if hole.is_adjusted else None
    drift = None if examined is None else examined.unseen_drift
    return (None, None) if drift is None else (drift.tangents[1:, :2], drift.positions[1:])


def true_depth(world: World, station: SurveyStation) -> float:
    """True depth (m) along the hole at which a station is: as told, less what its readings were told off on the mean.

    It has the depth of its first reading; those of later tubes were told some millimetres off that one.
    """
    tubes, times, told = (station.stops.column(name).tolist() for name in ("tube", "at", "md"))
    true = [world.bit_depth(at) - world.below(tube) for tube, at in zip(tubes, times, strict=True)]
    return station.md - float(np.mean(np.subtract(told, true)))


def quadratic_forms(error: Array, cov: Array) -> Array:
    """``error^T cov^-1 error`` (s,) of errors (s, n)."""
    return np.asarray(np.einsum("sa,sa->s", error, np.linalg.solve(cov, error[:, :, None])[:, :, 0]))
