"""Columns as built, cut by planes across them: where their centres are, how well that is known, and where it is not.

What is not known is never left out: within its design length a column is surveyed, unsurveyed (drilled, but below its
last survey) or missing. Frame: two axes in the plane (north and east where the columns are vertical); m.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.plane_errors import PlaneErrors

Array = npt.NDArray[np.float64]
TOE = 0.05  # m, by which a column may end above the depth asked for: its last leg goes on


@dataclass(frozen=True, slots=True)
class Columns:
    """Columns at common depths: (columns, depths, ...).

    Errors of a centre are columns of one standard deviation each: ``own`` errs alone, ``shared`` alike in all columns.
    """

    names: list[str]
    depths: Array  # (depths,) m, along the normal of the planes: true vertical where the columns are
    centres: Array  # (columns, depths, 2); nan where missing
    covs: Array  # (columns, depths, 2, 2) of own and shared errors together
    designs: Array  # (columns, 2) of the heads
    planned: Array  # (columns, depths, 2) of the design axes
    states: npt.NDArray[np.int8]  # (columns, depths)
    own: PlaneErrors
    shared: PlaneErrors
    radii: Array  # (columns, depths)
    radius_stds: Array  # (columns, depths)
    radius_correlation: float = 1.0  # of the radii of two columns at one depth
    layers: npt.NDArray[np.intp] | None = None  # (depths,) layer of each; a radius errs alike within one

    @classmethod
    def surveyed(
        cls, names: list[str], depths: Array, centres: Array, covs: Array, designs: Array, radius: float
    ) -> Columns:
        """Vertical designs of one radius, surveyed wherever there is a centre; columns err independently.

        The errors of one column at different depths are taken as one: what it is off, it is off all along.
        """
        shape = centres.shape[:2]
        finite = np.isfinite(centres[..., 0])
        states = np.where(finite, ColumnState.SURVEYED, ColumnState.MISSING).astype(np.int8)
        return cls(
            names, depths, centres, np.asarray(covs), designs, np.broadcast_to(designs[:, None, :], centres.shape),
            states, PlaneErrors.of_planes(covariance_roots(np.asarray(covs))),
            PlaneErrors.of_planes(np.zeros((*shape, 2, 0))),
            np.full(shape, radius), np.zeros(shape),
        )  # fmt: skip

    def subset(self, which: npt.NDArray[np.intp]) -> Columns:
        """Some of the columns, in the order of ``which``."""
        names = [self.names[k] for k in which.tolist()]
        return replace(
            self, names=names, centres=self.centres[which], covs=self.covs[which], designs=self.designs[which],
            planned=self.planned[which], states=self.states[which], own=self.own.subset(which),
            shared=self.shared.subset(which), radii=self.radii[which], radius_stds=self.radius_stds[which],
        )  # fmt: skip

    @property
    def drawn_centres(self) -> Array:
        """Centres (columns, depths, 2) for a picture: where a column is missing, its design."""
        return np.where(np.isfinite(self.centres), self.centres, self.planned)

    def depth_layers(self) -> npt.NDArray[np.intp]:
        """Layer (depths,) of every depth; one for all where none are given."""
        return np.zeros(len(self.depths), np.intp) if self.layers is None else self.layers


def covariance_roots(cov: Array) -> Array:
    """Symmetric root (..., k, k) of covariances."""
    values, vectors = np.linalg.eigh(cov)
    scaled = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return np.asarray(scaled @ np.swapaxes(vectors, -1, -2))


def plane_frame(designs: list[ColumnDesign]) -> Array:
    """Rows (3, 3): two axes across the mean of the design axes, and that mean: north, east, down of vertical ones."""
    mean = np.mean([design.axis for design in designs], axis=0)
    mean /= np.linalg.norm(mean)
    if abs(mean[2]) > 1.0 - 1e-12:
        return np.eye(3)
    inclination, azimuth = float(np.arccos(np.clip(mean[2], -1.0, 1.0))), float(np.arctan2(mean[1], mean[0]))
    middle = ColumnDesign(inclination=inclination, azimuth=azimuth)
    return np.concatenate([middle.across, middle.axis[None, :]])


@dataclass(frozen=True, slots=True)
class Cut:
    """Wells (w, n) where planes (z,) cut them.

    Attributes
    ----------
    centres : (w, z, 2); nan further than ``TOE`` above the first or below the last station
    upper, share : (w, z) station above each plane, and the share of the one below it
    slope : (w, n, 2) of the hole at its stations, m in the plane for a metre along its normal
    """

    centres: Array
    upper: npt.NDArray[np.intp]
    share: Array
    slope: Array

    def in_plane(self, errors: Array) -> Array:
        """Errors (w, n, 3, k) of stations projected into the plane (w, n, 2, k), along the hole's slope."""
        return errors[..., :2, :] - self.slope[..., :, None] * errors[..., 2:, :]


def intersect_planes(positions: Array, tangents: Array, depths: Array) -> Cut:
    """Cut wells by the planes of ``depths`` (z,), in a frame whose third axis is the normal of the planes.

    Positions and tangents (w, n, 3). Between stations the centre follows the cubic that has the stations' places and
    slopes.
    """
    tvd = positions[..., 2]
    slope = tangents[..., :2] / tangents[..., 2:]
    wells = np.arange(len(tvd))[:, None]
    k = np.clip(np.sum(tvd[:, None, :] <= depths[None, :, None], axis=-1) - 1, 0, tvd.shape[1] - 2)
    top, bottom = tvd[wells, k], tvd[wells, k + 1]
    step = bottom - top
    share = (depths - top) / step
    f = share[..., None]
    p0, p1 = positions[wells, k][..., :2], positions[wells, k + 1][..., :2]
    m0, m1 = slope[wells, k] * step[..., None], slope[wells, k + 1] * step[..., None]
    centre = p0 + f * (m0 + f * (3.0 * (p1 - p0) - 2.0 * m0 - m1 + f * (2.0 * (p0 - p1) + m0 + m1)))
    beyond = (depths[None, :] > tvd[:, -1:] + TOE) | (depths[None, :] < tvd[:, :1] - TOE)
    centre[beyond] = np.nan
    return Cut(centre, k, share, slope)
