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
from groundstation.service.setup.told_value import DRIVE
from groundstation.survey.bearings import wrap_azimuth
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from telemetry.frozen import replace
from telemetry.messages import SurveyMeasurement

ANY_YAW = 0.5 * UNKNOWN_YAW_VAR  # rad^2, systematic variance from which on an angle above a node was not told


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
    turn, var = book.north, measurement.systematic_var
    if above is not None and (book.joints or var >= ANY_YAW):
        by_joints, var = corrected_yaw(var, chain_of(measurement.tube, above), book)
        turn += by_joints
    if turn == 0.0 and var == measurement.systematic_var:
        return measurement
    return replace(measurement, yaw=float(wrap_azimuth(measurement.yaw + turn)), systematic_var=var)


def corrected_yaw(systematic_var: float, chain: Sequence[Pair], book: SetupBook) -> tuple[float, float]:
    """By what a yaw is to be turned (rad), and its systematic variance (rad^2) then.

    A node bounds the sum of angles that may be any by one of them. Here each joint counts by itself, so that what a
    tube has more than the one above it is the joint between them.

    Parameters
    ----------
    systematic_var : rad^2, as the node said it
    chain : joints from the tube up to the drive head
    """
    told = {pair: book.joints[pair] for pair in chain if pair in book.joints}
    again = [known for known in told.values() if known.used is not None]
    turn, var = sum(known.correction for known in again), sum(known.sigma**2 for known in again)
    if systematic_var < ANY_YAW:
        return turn, systematic_var + var
    lacked = {pair: known for pair, known in told.items() if known.used is None}
    untold = [pair for pair in chain if pair not in told and book.was_untold(pair)]
    if not lacked and not untold:
        return turn, systematic_var + var  # by what the nodes say now none lacked an angle: it is not known which did
    marks = len(chain) - len(lacked) - len(untold)  # told to their nodes; their own errors are lost under the bound
    var += max(systematic_var - UNKNOWN_YAW_VAR, 0.0) + marks * JOINT_STD**2 + len(untold) * UNKNOWN_YAW_VAR
    turn += sum(known.correction for known in lacked.values())
    return turn, var + sum(known.sigma**2 for known in lacked.values())


def depth_shift(tube: int, tubes: Sequence[int], tube_length: float, book: SetupBook) -> float:
    """By how much deeper (m) a tube's node is than the tally of equal tubes says.

    Parameters
    ----------
    tubes : of the string, from the top down
    tube_length : m, of every tube of the tally
    """
    if not book.lengths or tube not in tubes:
        return -book.stick_up
    below = (book.lengths[one] for one in tubes[tubes.index(tube) + 1 :] if one in book.lengths)
    return math.fsum(tube_length - told.values[0] for told in below) - book.stick_up
