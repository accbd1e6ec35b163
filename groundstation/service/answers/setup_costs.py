"""What each item of a setup costs at the toe: to first order, or exactly where the hole is adjusted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.service.answers.model import RigModel
from groundstation.service.hole.examined_hole import ExaminedHole, std_across
from groundstation.service.hole.position_sources import UNDONE, take_undone
from groundstation.service.setup.setup_items import SetupItem
from groundstation.service.setup.setup_priors import setup_priors
from groundstation.service.setup.toe_costs import toe_costs
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.well.trajectory import Trajectory

Array = npt.NDArray[np.float64]
KIND_OF: Final = {
    "bias": SetupKind.ACCELEROMETER,
    "tilt": SetupKind.MOUNT,
    "mount": SetupKind.MOUNT_TURN,
    "joint": SetupKind.JOINT,
    "drive": SetupKind.JOINT,
    "play": SetupKind.PLAY,
    "path": SetupKind.PATH,
    "collar": SetupKind.COLLAR,
    "gravity": SetupKind.GRAVITY,
}  # of the names of shares
ADJUSTED_KINDS: Final = frozenset(KIND_OF.values())


def setup_costs(k: RigModel, items: list[SetupItem], course: Trajectory) -> Mapping[str, float]:
    """Standard deviation (m) at the toe by each item, by name."""
    costs = dict(toe_costs(setup_priors(items, k.setup.version), course))
    examined = k.hole.examined if k.hole.is_adjusted else None
    if examined is not None:
        found: dict[str, Array] = defaultdict(lambda: np.zeros(3))
        found |= {item.name: np.zeros(3) for item in items if item.kind in ADJUSTED_KINDS}  # also of what read nothing
        drawn = k.hole.trajectory
        found[SetupKind.PATH.value] = np.diagonal(drawn.path_covs[-1]).copy()
        for name, variances in _shares_by_item(examined, items):
            found[name] += variances
        left = take_undone(np.array([found[name] for name in UNDONE]), np.diagonal(drawn.tied_covs[-1]))
        found |= zip(UNDONE, left, strict=True)
        costs |= {name: std_across(variances) for name, variances in found.items()}
    return costs


def _shares_by_item(examined: ExaminedHole, items: list[SetupItem]) -> Iterator[tuple[str, Array]]:
    """Name of the item of each share of the variance at the toe (3,), m^2; what is of none is left out."""
    for share in examined.shares:
        source, tube = examined.share_name(share)
        kind, number = KIND_OF.get(source), tube.removeprefix("tube ")
        for item in items:
            if item.kind is kind and item.subject.rpartition("-")[2] == number:
                yield item.name, share.variances
