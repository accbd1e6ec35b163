"""A survey as it is read: measured depths and directions, and what else stood beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SurveyRecord:
    """A survey as read: (n,) m, rad and rad; ``lines`` are those of the file, ``columns`` its further columns.

    ``of_displacements`` says that it was read as lateral displacements, the form of the published field records.
    """

    md: Array
    inclination: Array
    azimuth: Array
    lines: list[int]
    columns: dict[str, Array]
    of_displacements: bool = False
    warnings: tuple[EntryWarning, ...] = ()  # of values that are missing
