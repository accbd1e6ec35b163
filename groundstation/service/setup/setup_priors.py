"""The setup as the priors of an adjustment: means and standard deviations by name, and the direction at the collar."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.config import GroundConfig
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_checks import counted_std
from groundstation.service.setup.setup_items import COLLAR_STD, SetupItem, untold_stick_up_std
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.fusion.resolve import Direction, known_direction
from groundstation.survey.well.depth_errors import DepthErrors
from telemetry.messages import UNKNOWN_YAW_STD


@dataclass(frozen=True, slots=True)
class SetupPrior:
    """What is known of one item before any survey; SI and rad.

    ``mean`` is empty where the item may have any value, as an angle that was not told; ``sigma`` is of each number.
    """

    kind: SetupKind
    subject: str
    mean: tuple[float, ...]
    sigma: float
    is_told: bool


@dataclass(frozen=True, slots=True)
class SetupPriors:
    """Priors by the names of their items, such as ``north``, ``joint.4-3`` and ``mount.3``.

    ``version`` is that of the book they are from: with another version surveys are to be adjusted anew.
    """

    version: int
    by_name: Mapping[str, SetupPrior]


def setup_priors(items: Iterable[SetupItem], version: int = 0) -> SetupPriors:
    """Priors of all items of a setup."""
    by_name = {one.name: SetupPrior(one.kind, one.subject, one.values, one.sigma, one.is_told) for one in items}
    return SetupPriors(version, by_name)


def north_std(book: SetupBook) -> float:
    """Standard deviation (rad) of the encoder's zero against north; of one that was not told any azimuth may be."""
    told = book.standing(SetupKind.NORTH)
    return UNKNOWN_YAW_STD if told is None else counted_std(book, told)


def collar_direction(config: GroundConfig, book: SetupBook) -> Direction:
    """Direction of the hole at the collar as well as it is known: told, or that of the design."""
    told = book.standing(SetupKind.COLLAR)
    if told is None:
        return uncertain_direction(config.design.inclination, config.design.azimuth, COLLAR_STD)
    inclination, azimuth = told.values
    return uncertain_direction(inclination, azimuth, told.sigma)


def depth_errors(config: GroundConfig, book: SetupBook) -> DepthErrors:
    """Errors of measured depths but for those of lengths that were told; of a stick-up wide where none was."""
    usual, told = config.depth_errors, book.standing(SetupKind.STICK_UP)
    return replace(usual, offset_std=untold_stick_up_std(config) if told is None else counted_std(book, told))


def length_stds(book: SetupBook) -> Mapping[int, float]:
    """Standard deviations (m) of the lengths that were told, by tube."""
    return {tube: told.sigma for tube, told in book.lengths.items()}


def uncertain_direction(inclination: float, azimuth: float, std: float) -> Direction:
    """A direction (rad) that is known with a standard deviation (rad) each way."""
    along = np.array([math.cos(azimuth), math.sin(azimuth)])
    across = np.array([-along[1], along[0]])
    lean_cov = math.cos(inclination) ** 2 * np.outer(along, along) + np.outer(across, across)
    return replace(known_direction(inclination, azimuth), cov=std**2 * lean_cov)
