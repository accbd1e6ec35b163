"""The end of a hole as it was foreseen at an earlier stop, in a sixth of the memory: a day has five hundred. No I/O."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd

Array = npt.NDArray[np.float64]
Few = npt.NDArray[np.float32]
UPPER: Final = np.array([0, 1, 3])  # of the entries of a covariance those that are not said twice
LEAST_WEIGHT = 1e-4  # of a part that is kept: what is left out is less than a thousandth
WHOLE: Final = np.array([0, 1, 1, 2])  # places of all entries among them


@dataclass(frozen=True, slots=True)
class PackedEnd:
    """A projected end without the way there.

    Parameters
    ----------
    numbers : (13,) depth, length along the axis and limit (m), offset (2), covariance (3) and that of the surveys (3),
        whether the end is reached, and whether the hole comes there
    parts : (c, 6) weight, mean (2) and covariance (3) of each part of the mixture, to seven digits
    """

    numbers: Array
    parts: Few

    @property
    def ends(self) -> Deviation:
        """Mean and covariance of the end."""
        md, along, limit = self.numbers[:3].tolist()
        return Deviation(md, along, self.numbers[3:5], self.numbers[5:8][WHOLE].reshape(2, 2), limit)

    def unpacked(self) -> ProjectedEnd:
        """The end as it was."""
        parts = self.parts.astype(np.float64)
        mixture = NormalMixture(parts[:, 0].copy(), parts[:, 1:3].copy(), parts[:, 3:][:, WHOLE].reshape(-1, 2, 2))
        is_reached, comes_there = (bool(number) for number in self.numbers[11:])
        return ProjectedEnd(self.ends, mixture, self.numbers[8:11][WHOLE].reshape(2, 2), is_reached, comes_there)


def packed_end(end: ProjectedEnd) -> PackedEnd:
    """Pack an end."""
    ends, mixture = end.ends, end.foreseen
    kept = mixture.weights > LEAST_WEIGHT
    numbers = [ends.md, ends.along, ends.limit, *ends.offset, *ends.cov.ravel()[UPPER], *end.measured.ravel()[UPPER]]
    weights = mixture.weights[kept] / mixture.weights[kept].sum()
    parts = [weights[:, None], mixture.means[kept], mixture.covs[kept].reshape(-1, 4)[:, UPPER]]
    return PackedEnd(
        np.array([*numbers, end.is_reached, end.comes_there], np.float64),
        np.concatenate(parts, axis=1).astype(np.float32),
    )
