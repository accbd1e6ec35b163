"""What was told changes about measurements before they are resolved: yaws, their constant errors, and depths. No I/O.

A node says its yaw by the joint angles that it was told. Where one was not told its yaw lacks that angle, and its
constant errors have the variance of any yaw; the angle that the ground station was told takes the place of both. North
turns all yaws alike, and so does its error: no reading of one tube differs from another's by it, and it is no part of
what a measurement says of itself. Told lengths and the stick-up move a survey along the hole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from groundstation.service.setup.setup_book import Pair, SetupBook
from groundstation.service.setup.setup_items import JOINT_STD
from groundstation.service.setup.told_value import DRIVE, SetupKind, ToldValue
from groundstation.survey.bearings import wrap_azimuth
from groundstation.survey.fusion.survey_trust import UNKNOWN_YAW_VAR
from telemetry.frozen import replace
from telemetry.messages import SurveyMeasurement

LARGEST_VAR = 100.0  # rad^2, as a message says it
UNTOLD_FROM = 0.5  # part of the variance of any yaw from which on an angle above a node was not told


def chain_of(tube: int, above: Sequence[int]) -> list[Pair]:
    """Joints from a tube up to the drive head; ``above`` are the tubes above it, lowest first."""
    tubes = [tube, *above]
    return [*((upper, lower) for lower, upper in pairwise(tubes)), (DRIVE, tubes[-1])]


def corrected_measurement(
    measurement: SurveyMeasurement, above: Sequence[int] | None, book: SetupBook
) -> SurveyMeasurement:
    """A measurement as it is with what was told; it itself where that changes nothing.

    Parameters
    ----------
    above : tubes above its own, lowest first; None where the order of the string is not known
    """
    systematic = measurement.systematic_var
    chain = [] if above is None or not book.joints else chain_of(measurement.tube, above)
    turn, var = corrected_yaw(systematic, chain, book)
    north = book.standing(SetupKind.NORTH)
    turn += 0.0 if north is None else north.values[0]
    if turn == 0.0 and var == systematic:
        return measurement
    return replace(measurement, yaw=float(wrap_azimuth(measurement.yaw + turn)), systematic_var=min(var, LARGEST_VAR))


def corrected_yaw(systematic_var: float, chain: Sequence[Pair], book: SetupBook) -> tuple[float, float]:
    """By what a yaw is to be turned (rad), and its systematic variance (rad^2) then.

    Parameters
    ----------
    systematic_var : rad^2, as the node said it
    chain : joints from the tube up to the drive head
    """
    told = {pair: book.joints[pair] for pair in chain if pair in book.joints}
    if not told:
        return 0.0, systematic_var
    lacked = {pair: known for pair, known in told.items() if known.used is None}
    again = {pair: known for pair, known in told.items() if known.used is not None}
    turn, var = sum(known.correction for known in again.values()), systematic_var
    if systematic_var >= UNTOLD_FROM * UNKNOWN_YAW_VAR:
        turn += sum(known.correction for known in lacked.values())
        if is_whole(chain, lacked, book):
            marks = sum(book.node_knows(pair) is True for pair in chain)  # their errors are lost in that of any yaw
            var = max(systematic_var - UNKNOWN_YAW_VAR, 0.0) + marks * JOINT_STD**2
            var += sum(known.sigma**2 for known in lacked.values())
    return turn, var + sum(known.sigma**2 for known in again.values())


def is_whole(chain: Sequence[Pair], lacked: dict[Pair, ToldValue], book: SetupBook) -> bool:
    """Whether every joint of a chain is known: to its node, or told in its place."""
    return all(pair in lacked or book.node_knows(pair) is True for pair in chain)


def depth_shift(tube: int, tubes: Sequence[int], tube_length: float, book: SetupBook) -> float:
    """By how much deeper (m) a tube's node is than the tally of equal tubes says.

    Parameters
    ----------
    tubes : of the string, from the top down
    tube_length : m, of every tube of the tally
    """
    stick_up = book.standing(SetupKind.STICK_UP)
    shift = 0.0 if stick_up is None else -stick_up.values[0]
    if not book.lengths or tube not in tubes:
        return shift
    below = (book.lengths[one] for one in tubes[tubes.index(tube) + 1 :] if one in book.lengths)
    return shift + math.fsum(tube_length - told.values[0] for told in below)
