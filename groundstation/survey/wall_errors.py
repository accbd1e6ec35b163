"""All errors of a wall as independent standard normal numbers: of what columns share, of each alone, of the radii.

A wall is drawn from them, and the likeliest numbers at which something opens are found among them. m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.as_built import Columns

Array = npt.NDArray[np.float64]
Point = tuple[Array, float]  # shift in standard deviations, and about how likely it is to be passed
FURTHEST = 6.0  # standard deviations of a design point that is still drawn from


@dataclass(frozen=True, slots=True)
class Errors:
    """Where each standard normal number acts. Columns of ``Columns.own`` and radii by column and layer."""

    columns: Columns
    shared: int
    own: int
    layers: int

    @classmethod
    def of(cls, columns: Columns) -> Errors:
        """The errors of some columns."""
        return cls(columns, columns.shared.shape[-1], columns.own.shape[-1], int(columns.depth_layers().max()) + 1)

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self.shared + len(self.columns.names) * (self.own + self.layers) + self.layers

    def own_slice(self, column: int) -> slice:
        """Numbers of one column alone."""
        begin = self.shared + column * self.own
        return slice(begin, begin + self.own)

    def radius_index(self, column: int, layer: int) -> int:
        """Number of the radius of one column in a layer."""
        return self.shared + len(self.columns.names) * self.own + column * self.layers + layer

    def common_index(self, layer: int) -> int:
        """Number of what all radii in a layer share."""
        return self.shared + len(self.columns.names) * (self.own + self.layers) + layer

    def drawn(self, x: Array) -> tuple[Array, Array]:
        """Centres (columns, samples, depths, 2) and radii (columns, samples, depths) of all columns."""
        c = self.columns
        shape = (len(c.names), len(x), len(c.depths))
        centres, radii = np.empty((*shape, 2)), np.empty(shape)
        for k in range(len(c.names)):
            centres[k], radii[k] = self.centres(x, k), self.radii(x, k)
        return centres, radii

    def centres(self, x: Array, column: int) -> Array:
        """Centres (samples, depths, 2) of one column."""
        c = self.columns
        moved = x[:, : self.shared] @ _flat(c.shared[column]) + x[:, self.own_slice(column)] @ _flat(c.own[column])
        return np.asarray(c.centres[column] + moved.reshape(len(x), len(c.depths), 2))

    def radii(self, x: Array, column: int) -> Array:
        """Radii (samples, depths) of one column."""
        c, layer = self.columns, self.columns.depth_layers()
        rho = c.radius_correlation
        common = x[:, [self.common_index(int(k)) for k in layer]]
        alone = x[:, [self.radius_index(column, int(k)) for k in layer]]
        drawn = math.sqrt(rho) * common + math.sqrt(1.0 - rho) * alone
        return np.asarray(np.maximum(c.radii[column] + c.radius_stds[column] * drawn, 0.0))


def _flat(errors: Array) -> Array:
    """Errors (depths, 2, k) as a matrix (k, 2 depths)."""
    return np.ascontiguousarray(errors.reshape(errors.shape[0] * errors.shape[1], errors.shape[2]).T)


def add_radius(errors: Errors, normal: Array, column: int, depth: int, slope: float) -> None:
    """What the radius of a column adds to a normal: ``slope`` (m/m)."""
    c, layer = errors.columns, int(errors.columns.depth_layers()[depth])
    change, rho = slope * float(c.radius_stds[column, depth]), c.radius_correlation
    normal[errors.common_index(layer)] += change * math.sqrt(rho)
    normal[errors.radius_index(column, layer)] += change * math.sqrt(1.0 - rho)


def design_point(normal: Array, rest: float) -> Point:
    """Point beta u of a half-space ``rest`` + normal x < 0, and Phi(-beta)."""
    size = max(float(np.linalg.norm(normal)), 1e-12)
    beta = min(max(rest / size, 0.0), FURTHEST)
    return -beta / size * normal, 0.5 * math.erfc(beta / math.sqrt(2.0))
