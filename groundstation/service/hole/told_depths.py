"""What the make-ups of a string say of the depths of its hole. No I/O."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.setup.setup_book import SetupBook
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.well.make_up_depths import MakeUpDepths, make_up_depths

Array = npt.NDArray[np.float64]
NO_MAKE_UPS = MakeUpDepths(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))


def depths_at_make_ups(
    stops: ResolvedStops, shared: SharedErrors, config: GroundConfig, book: SetupBook, since: float = -np.inf
) -> MakeUpDepths:
    """Depths of the tube at the bit, and how many tubes hung above it.

    Parameters
    ----------
    since : s, rig time from which on stops count
    """
    table = stops.rows[: len(stops)]
    is_at_bit = np.array(stops.below) == 0
    rows = np.flatnonzero(is_at_bit & (table["hops"] > 0) & (table["md"] > 0.0) & (table["at"] > since))
    if not len(rows):
        return NO_MAKE_UPS
    longest = table["chain"][rows[np.argmax(table["hops"][rows])]].item()
    tube, above = shared.chain(longest)
    tubes = np.asarray(table["hops"][rows], np.intp)
    return make_up_depths(tubes, table["md"][rows], _lengths(config, book, [tube, *(above or ())], int(tubes.max())))


def _lengths(config: GroundConfig, book: SetupBook, from_bit: list[int], count: int) -> Array:
    """Lengths (m) of tubes from the bit up; of those that are not known that of every tube of the tally."""
    told = [book.lengths[tube].values[0] if tube in book.lengths else config.tube_length for tube in from_bit[:count]]
    return np.array(told + [config.tube_length] * (count - len(told)))
