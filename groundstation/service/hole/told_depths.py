"""How well the depths of a hole are known by what was told of the rig, and what the make-ups say of them. No I/O."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_items import STICK_UP_STD
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.well.depth_errors import OF_ALL, DepthErrors
from groundstation.survey.well.make_up_depths import MakeUpDepths, make_up_depths

Array = npt.NDArray[np.float64]
NOTHING = MakeUpDepths(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))


def told_depth_errors(config: GroundConfig, book: SetupBook) -> DepthErrors:
    """Errors of measured depths: those of a stick-up and of lengths as they were told, wide where none was."""
    usual = config.depth_errors
    told = book.standing(SetupKind.STICK_UP)
    offset = max(usual.offset_std, STICK_UP_STD) if told is None else told.sigma
    lengths = max([usual.tube_std, *(length.sigma for length in book.lengths.values())])
    return DepthErrors(usual.scale_std, offset, lengths, usual.reading_std)


def depths_at_make_ups(
    stops: ResolvedStops, shared: SharedErrors, config: GroundConfig, book: SetupBook, since: float = -np.inf
) -> MakeUpDepths:
    """Depths of the tube at the bit, and how many tubes hung above it.

    Parameters
    ----------
    since : s, rig time from which on stops count
    """
    table = stops.rows[: len(stops)]
    is_at_bit = np.array([len(places) == OF_ALL for places in stops.depth_places[: len(stops)]], bool)
    rows = np.flatnonzero(is_at_bit & (table["hops"] > 0) & (table["md"] > 0.0) & (table["at"] > since))
    if not len(rows):
        return NOTHING
    longest = table["chain"][rows[np.argmax(table["hops"][rows])]].item()
    tube, above = shared.chain(longest)
    tubes = np.asarray(table["hops"][rows], np.intp)
    return make_up_depths(tubes, table["md"][rows], _lengths(config, book, [tube, *(above or ())], int(tubes.max())))


def _lengths(config: GroundConfig, book: SetupBook, from_bit: list[int], count: int) -> Array:
    """Lengths (m) of tubes from the bit up; of those that are not known that of every tube of the tally."""
    told = [book.lengths[tube].values[0] if tube in book.lengths else config.tube_length for tube in from_bit[:count]]
    return np.array(told + [config.tube_length] * (count - len(told)))
