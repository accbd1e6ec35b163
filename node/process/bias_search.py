"""A search for the gyroscope's bias that does not end: told once by name, with what the node needs.

A node without a bias knows no yaw, and a crew that waits does not see why. What keeps it searching shows in the rates
of its last cycles, corrected as the filter has them: none, a steady one beyond what a bias may be, or rates that do not
stand still. Steady rates below that are a bias unless gravity, or an encoder that turns, tells of a motion.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.record.filter_record import RING
from node.kernels.turns.rest_watch import CYCLES, LARGEST
from node.process.drivers.source import Say
from telemetry.messages import Scalar, Severity

LONGEST: Final = 180.0  # s, of a search before it is told; at rest, alone on a table, it takes 52
LARGEST_DEG: Final = math.degrees(LARGEST)  # deg/s


class BiasSearch:
    """Looks at the mode of a node, every cycle."""

    def __init__(self, say: Say) -> None:
        self._say = say
        self._since: float | None = None
        self._told = False

    def look(self, state: Any, config: Any, now: float, *, lost: bool) -> None:
        """Tell of a search that is too long, or of the end of one that was told.

        Parameters
        ----------
        state, config : records of the filter
        now : s, own clock, end of the cycle
        lost : the cycle has no reading
        """
        if state["mode"] != STATIC_BIAS:
            if self._told:
                self._say(Severity.WARNING, "bias_learnt", {})
            self._since, self._told = None, False
            return
        if self._since is None or now < self._since:  # a clock that was set begins anew
            self._since = now
        if not self._told and now - self._since >= LONGEST:
            self._told = True
            needs, found = missing_of(state, config, lost=lost)
            self._say(Severity.ERROR, "bias_never_learnt", {"searched_s": now - self._since, "needs": needs, **found})


def missing_of(state: Any, config: Any, *, lost: bool) -> tuple[str, dict[str, Scalar]]:
    """What a node that searches needs, in words, and what its last cycles read (deg/s)."""
    cycles = int(state["cycles"])
    if lost or cycles < CYCLES:
        return "readings of the gyroscope: they are missing or faulty", {}
    rates = np.degrees(state["ring_rate"][(cycles - 1 - np.arange(CYCLES)) % RING])
    mean = rates.mean(axis=0)
    axis = int(np.argmax(np.abs(mean)))
    still = math.degrees(float(config["still_rate"])) * np.array([2.0, 2.0, 1.0])
    moved = np.abs(rates - mean).max(axis=0)
    found: dict[str, Scalar] = {"axis": "xyz"[axis], "rate_dps": float(mean[axis]), "scatter_dps": float(moved.max())}
    if np.any(moved > still):
        return f"a minute at rest: its readings move by more than {still.max():.3g} deg/s", found
    if abs(float(mean[axis])) > LARGEST_DEG:
        needs = f"--imu-gyroscope with its calibration: an offset beyond {LARGEST_DEG:.2g} deg/s is taken for a motion"
        return needs, found
    return "a rest that gravity and the encoder do not deny: they tell of a slow turn", found
