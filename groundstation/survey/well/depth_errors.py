"""What is not known of measured depths: they move a station along the hole.

The depth of a node is that of the bit less the tubes between the two,

    md = (1 + scale) bit + offset + reading - sum of the lengths below the node.

Scale and offset are one number for the whole hole; the length of a tube is shared by all that the nodes above it read;
each reading of the bit errs anew. A station is where its readings are on the mean. What was measured there was measured
at the true depth, so a depth error changes how long the legs are and not which way they point.

The sigmas that stand where nothing was told:

* scale 5.6e-4: what the industry's model gives the drill pipe's depth (DSFS of ISCWSA MWD revision 5.1);
* offset 1 cm: the collar's edge and the stick-up, read by hand with a rule;
* tube 1 mm: a steel tape of class II (0.3 mm + 0.2 mm a metre, Directive 2014/32/EU) and the seat of the thread;
* reading 2 mm: a depth that is read to the millimetre on a string that hangs and stretches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.shared import Packed, Places

Array = npt.NDArray[np.float64]
OF_ALL = 2  # of the places of a reading, before those of the tubes below it: scale and offset


@dataclass(frozen=True, slots=True)
class DepthErrors:
    """Standard deviations of what makes a depth."""

    scale_std: float = 5.6e-4  # m/m, of the depth of the bit
    offset_std: float = 0.01  # m, of the stick-up
    tube_std: float = 1e-3  # m, of the length of each tube
    reading_std: float = 2e-3  # m, of each reading of the bit


@dataclass(frozen=True, slots=True, eq=False)
class StationDepth:
    """Error of one station's depth: its shared columns (1, s), m for one standard deviation, and what is its own.

    The places of the columns ascend.
    """

    columns: Packed
    own_var: float  # m^2


NONE_TOLD: Final[Mapping[int, float]] = {}
EXACT: Final = StationDepth(Packed(np.zeros((1, 0))), 0.0)


def mean_depth(
    md: float,
    places: Sequence[Places],
    errors: DepthErrors,
    tube_length: float,
    told: Mapping[int, float] = NONE_TOLD,
) -> StationDepth:
    """Depth error of a station that several nodes read, one reading as good as another.

    Parameters
    ----------
    md : m
    places : of the columns of each reading: scale, offset, and the length of each tube below its node from the bit up
    tube_length : m, as it is told
    told : m, standard deviations of the lengths of single tubes, by the places of their columns
    """
    counts, count = (*map(len, places),), len(places)
    parts = reading_parts(counts, places[counts.index(max(counts))].tobytes())
    values = _tube_stds(parts.places, errors.tube_std, told) * parts.tubes
    values[0, parts.scale] = errors.scale_std * (md + tube_length * parts.tubes_below)
    values[0, parts.offset] = errors.offset_std
    return StationDepth(Packed.of_values(values, parts.places, parts.width), errors.reading_std**2 / count)


def _tube_stds(places: Places, usual: float, told: Mapping[int, float]) -> Array | float:
    """Standard deviations (c,), m, of lengths with these columns; one number where all are alike."""
    return np.array([told.get(place, usual) for place in places.tolist()]) if told else usual


class ReadingParts(NamedTuple):
    """In which part of the readings of a station the length of each tube is, and where scale and offset stand."""

    width: int  # of the columns up to the last of them
    places: Places  # (c,) ascending
    scale: int  # place among these
    offset: int
    tubes: Array  # (1, c), zero for those two
    tubes_below: float  # on the mean of the readings


@lru_cache(maxsize=32)  # the next stop has the patterns of this one, one station further down
def reading_parts(counts: tuple[int, ...], deepest: bytes) -> ReadingParts:
    """Parts for readings with so many places each; ``deepest`` are those of the reading that has most."""
    places = np.frombuffer(deepest, np.intp)
    # the length of a tube is in the readings of all that have it below them
    parts = (np.array(counts)[:, None] > np.arange(len(places))).mean(axis=0)
    parts[:OF_ALL] = 0.0
    order = np.argsort(places)
    scale, offset = order.argsort()[:OF_ALL].tolist()
    below = sum(counts) / len(counts) - OF_ALL
    return ReadingParts(int(places.max()) + 1, places[order], scale, offset, parts[None, order], below)
