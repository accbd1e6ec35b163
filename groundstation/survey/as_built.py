"""Columns as built, cut by planes across them: where their centres are, how well that is known, and where it is not.

What is not known is never left out: within its design length a column is surveyed, unsurveyed (drilled, but below its
last survey) or missing. Frame: two axes in the plane (north and east where the columns are vertical); m.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from groundstation.survey.columns import Design

Array = npt.NDArray[np.float64]
TOE = 0.05  # m, by which a column may end above the depth asked for: its last leg goes on


class State(IntEnum):
    """What is known of a column at a depth."""

    SURVEYED = 0
    UNSURVEYED = 1  # drilled, but below its last survey: extrapolated
    MISSING = 2  # planned, not drilled, or below the end of the column: an opening
    OUTSIDE = 3  # above the head or below the toe of its design: nothing is required


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
    own: Array  # (columns, depths, 2, k)
    shared: Array  # (columns, depths, 2, s)
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
        states = np.where(finite, State.SURVEYED, State.MISSING).astype(np.int8)
        return cls(
            names, depths, centres, np.asarray(covs), designs, np.broadcast_to(designs[:, None, :], centres.shape),
            states, roots(np.asarray(covs)), np.zeros((*shape, 2, 0)), np.full(shape, radius), np.zeros(shape),
        )  # fmt: skip

    def subset(self, which: npt.NDArray[np.intp]) -> Columns:
        """Some of the columns, in the order of ``which``."""
        names = [self.names[k] for k in which.tolist()]
        return replace(
            self, names=names, centres=self.centres[which], covs=self.covs[which], designs=self.designs[which],
            planned=self.planned[which], states=self.states[which], own=self.own[which], shared=self.shared[which],
            radii=self.radii[which], radius_stds=self.radius_stds[which],
        )  # fmt: skip

    @property
    def drawn_centres(self) -> Array:
        """Centres (columns, depths, 2) for a picture: where a column is missing, its design."""
        return np.where(np.isfinite(self.centres), self.centres, self.planned)

    def depth_layers(self) -> npt.NDArray[np.intp]:
        """Layer (depths,) of every depth; one for all where none are given."""
        return np.zeros(len(self.depths), np.intp) if self.layers is None else self.layers


def roots(cov: Array) -> Array:
    """Symmetric root (..., k, k) of covariances."""
    values, vectors = np.linalg.eigh(cov)
    scaled = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return np.asarray(scaled @ np.swapaxes(vectors, -1, -2))


def plane_frame(designs: list[Design]) -> Array:
    """Rows (3, 3): two axes across the mean of the design axes, and that mean: north, east, down of vertical ones."""
    mean = np.mean([design.axis for design in designs], axis=0)
    mean /= np.linalg.norm(mean)
    if abs(mean[2]) > 1.0 - 1e-12:
        return np.eye(3)
    inclination, azimuth = float(np.arccos(np.clip(mean[2], -1.0, 1.0))), float(np.arctan2(mean[1], mean[0]))
    middle = Design(inclination=inclination, azimuth=azimuth)
    return np.concatenate([middle.across, middle.axis[None, :]])


def at_depths(positions: Array, tangents: Array, errors: Array, depths: Array) -> tuple[Array, Array]:
    """Centres (w, z, 2) and their errors (w, z, 2, k) where wells cross the planes of ``depths``.

    Positions (w, n, 3) and errors (w, n, 3, k), one column a standard deviation, in a frame whose third axis is the
    normal of the planes. Between stations the centre follows the cubic that has the stations' places and slopes; its
    errors are those of the two stations, blended. An error along the normal moves the centre by the slope of the hole.
    nan further than ``TOE`` above the first or below the last station.
    """
    tvd = positions[..., 2]
    slope = tangents[..., :2] / tangents[..., 2:]
    wells = np.arange(len(tvd))[:, None]
    k = np.clip(np.sum(tvd[:, None, :] <= depths[None, :, None], axis=-1) - 1, 0, tvd.shape[1] - 2)
    top, bottom = tvd[wells, k], tvd[wells, k + 1]
    step = bottom - top
    f = ((depths - top) / step)[..., None]
    p0, p1 = positions[wells, k][..., :2], positions[wells, k + 1][..., :2]
    m0, m1 = slope[wells, k] * step[..., None], slope[wells, k + 1] * step[..., None]
    centre = p0 + f * (m0 + f * (3.0 * (p1 - p0) - 2.0 * m0 - m1 + f * (2.0 * (p0 - p1) + m0 + m1)))
    plane = errors[..., :2, :] - slope[..., :, None] * errors[..., 2:, :]
    g = f[..., None]
    blended = (1.0 - g) * plane[wells, k] + g * plane[wells, k + 1]
    beyond = (depths[None, :] > tvd[:, -1:] + TOE) | (depths[None, :] < tvd[:, :1] - TOE)
    centre[beyond] = np.nan
    return centre, blended
