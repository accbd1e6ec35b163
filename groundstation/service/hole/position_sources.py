"""Of what the variances along a trajectory are made, source by source. No I/O."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.survey.fusion.shared import KIND_NAMES, SharedErrors
from groundstation.survey.well.trajectory import Trajectory

Array = npt.NDArray[np.float64]
UNDONE = ("collar", "path")  # sources whose errors undo a part of each other: bends move collar and first legs apart
LEAST_VARIANCE = 1e-30  # m^2, of what nothing bends


def variances_by_source(
    drawn: Trajectory, shared: SharedErrors, examined: ExaminedHole | None, north_std: float
) -> dict[str, Array]:
    """Variances (n, 3) of the positions of a trajectory (m^2) by their sources, which add up to the whole.

    Parameters
    ----------
    shared : the errors that it shares
    examined : the adjustment from which it is drawn; None where stations are fused one by one
    north_std : rad, of the encoder's zero
    """
    found = _of_directions(drawn, shared, examined, north_std)
    for name, covs in (("depth", drawn.depth_covs), ("path", drawn.path_covs)):
        found[name] = found.get(name, 0.0) + np.diagonal(covs, axis1=1, axis2=2)
    names = [name for name in UNDONE if name in found]
    undone = np.diagonal(drawn.tied_covs, axis1=1, axis2=2)
    found |= zip(names, take_undone(np.array([found[name] for name in names]), undone), strict=True)
    rest = np.diagonal(drawn.covs, axis1=1, axis2=2) - sum(found.values())
    return {"random": np.maximum(rest, 0.0)} | found


def take_undone(parts: Array, undone: Array) -> Array:
    """Variances (q, ..., 3), m^2, of parts that undo some of each other, without it: ``undone`` (..., 3), 0 or below.

    Each has as much of it off as it is of them all.
    """
    left = 1.0 + undone / np.maximum(parts.sum(axis=0), LEAST_VARIANCE)
    return np.asarray(parts * np.maximum(left, 0.0))


def _of_directions(
    drawn: Trajectory, shared: SharedErrors, examined: ExaminedHole | None, north_std: float
) -> dict[str, Array]:
    """Variances (n, 3), m^2, by what directions have in common."""
    if examined is None:
        common = np.concatenate([shared.variances(columns) for columns in drawn.columns()])
        return dict(zip(KIND_NAMES, np.moveaxis(common, 1, 0), strict=True))
    turned = np.square(drawn.positions[:, 1::-1]) * north_std**2
    north = np.concatenate([turned, np.zeros((len(turned), 1))], axis=1)
    north += np.diagonal(drawn.swung_covs, axis1=1, axis2=2)
    return {"depth": drawn.shared_depth_vars, "north": north} | examined.position_variances


def depth_variance_at_toe(drawn: Trajectory) -> Array:
    """Variance (3,), m^2, of the last position by what is not known of depths."""
    return np.asarray(drawn.shared_depth_vars[-1] + np.diagonal(drawn.depth_covs[-1]))
