"""How the chains of a hole hang and what turns them, kept from one adjustment to the next. No I/O.

A survey that comes mostly has a chain that is known, and a variance that is: then all of it is as it was.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.string_prior import Hanging, causes_of_turns
from groundstation.survey.adjustment.run_of_stops import TurnCauses
from groundstation.survey.fusion.shared import SharedErrors

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


class HungChains:
    """Chains in the order in which they came.

    Parameters
    ----------
    shared : which knows them by their numbers
    mount_var : rad^2, of an IMU in its tube, about the axis

    Attributes
    ----------
    hanging : of the chains that were asked for last
    """

    def __init__(self, shared: SharedErrors, mount_var: float) -> None:
        self._shared, self._mount_var = shared, mount_var
        self._begin_anew()

    def _begin_anew(self) -> None:
        self.hanging = Hanging()
        self._numbers: list[int] = []
        self._hung: list[tuple[int, int]] = []
        self._causes: tuple[list[int], bytes, TurnCauses] | None = None

    def hung(self, numbers: Sequence[int]) -> Places:
        """Places (c, 2) of tube and make-up of chains by their numbers, in the order of their coming."""
        known = len(self._numbers)
        if self._numbers != numbers[:known]:
            self._begin_anew()
            known = 0
        for number in numbers[known:]:
            self._hung.append(self.hanging.add_chain(self._shared.chain(number)))
            self._numbers.append(number)
        return np.array(self._hung, np.intp)

    def causes(self, systematic_vars: Array) -> TurnCauses:
        """Causes of the turns of the chains that were asked for last, of which each reported such a variance, rad^2."""
        numbers, told = self._numbers, systematic_vars.tobytes()
        if self._causes is None or self._causes[:2] != (numbers, told):
            chains = [*map(self._shared.chain, numbers)]
            found = causes_of_turns(self.hanging, chains, systematic_vars.tolist(), self._mount_var)
            self._causes = numbers[:], told, found
        return self._causes[2]
