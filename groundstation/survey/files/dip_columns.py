"""Dips in place of inclinations: they count from the horizontal, not from the vertical."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError

Array = npt.NDArray[np.float64]


def inclinations_of_dips(path: Path, name: str, dip_deg: Array, lines: Sequence[int], *, signed: bool) -> Array:
    """Inclinations (deg) of dips (deg), down as one sign of them.

    ``signed`` of a format that says which sign that is: there a hole that rises has negative ones.

    Raises
    ------
    SurveyError
        When one is beyond 90 deg, or they have both signs where nothing says which is down.
    """
    beyond = np.flatnonzero(np.abs(dip_deg) > 90.0)
    if len(beyond):
        k = int(beyond[0])
        raise SurveyError(f"{path}: line {lines[k]}: {name}: expected a dip of -90..90 deg, got {dip_deg[k]:g}")
    if signed:
        return np.asarray(90.0 - dip_deg)
    if np.any(dip_deg > 0.0) and np.any(dip_deg < 0.0):
        raise SurveyError(f"{path}: {name}: expected dips of one sign, got {dip_deg.min():g} and {dip_deg.max():g} deg")
    return np.asarray(90.0 - np.abs(dip_deg))
