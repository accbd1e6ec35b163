"""Twist of the string between the drive head and one node, as the aiding reports it.

The twist of the tubes passed adds up, for the torque is one and the same: ``sigma = |T| sum L / (G J)``, and its square
is handed down. It is constant while the torque is, so no filter may average it away. Between two torques the yaw turns
against the drive by what the one and the other may be wrong: the filter's yaw is opened by that, its cross terms stay
true.
"""

from __future__ import annotations

import math
from dataclasses import replace

from node.firmware.pending_event import PendingEvent
from node.firmware.settings import TubeSettings
from node.kernels.layout import Array, Err
from telemetry.messages import Aiding, Severity

UNKNOWN_VAR = 10.0  # rad^2, of a twist of which nothing is known but for whole turns


class TubeTorsion:
    """What one node knows of the torque above it.

    Parameters
    ----------
    settings : stiffness of the tube, and what is done with aiding under torque
    states : the node's record, one-element array
    """

    def __init__(self, settings: TubeSettings, states: Array) -> None:
        self._settings = settings
        self._state = states[0]
        self._used: tuple[float, bool] | None = None  # std (rad) of the twist in the last aiding used, and under torque
        self._wound = False  # since then the string was under torque
        self._torque, self._holding = 0.0, False
        self._heard_at = -math.inf
        self._pending: list[PendingEvent] = []

    @property
    def var(self) -> float:
        """Variance (rad^2) of the twist in the last aiding used."""
        return self._used[0] ** 2 if self._used is not None else 0.0

    def reaches(self, aiding: Aiding) -> float:
        """Variance (rad^2) of the twist between the drive head and the lower end of this tube."""
        return min((math.sqrt(aiding.torsion_var) + aiding.torque / self._settings.stiffness) ** 2, UNKNOWN_VAR)

    def of_estimate(self, aiding: Aiding) -> Aiding:
        """The node's own yaw as aiding, with the twist that it was aided under."""
        var = self.var
        joints = max(aiding.systematic_var - var, 0.0)
        return replace(aiding, systematic_var=joints, torque=self._torque, torsion_var=var, under_torque=self._holding)

    def gate_aiding(self, aiding: Aiding, valid_local: float) -> bool:
        """Whether an aiding is for the filter; opens the filter's yaw where the twist has changed."""
        self._heard_at = valid_local
        self._torque, self._holding = aiding.torque, aiding.under_torque
        if aiding.under_torque and self._settings.torsion == "gate":
            self._wound = True
            return False
        std = math.sqrt(self.reaches(aiding))
        before, held = self._used or (std, True)  # after a start anything may have been
        change = 0.0
        if aiding.under_torque and held:
            change = std - before
            if self._used is not None and change * change <= aiding.yaw_var:
                return True  # a change waits until it has grown: a rest is not to be used again and again
        elif aiding.under_torque or held or self._wound:
            change = math.hypot(std, before)
            if aiding.torque and self._used is not None:
                self._tell(aiding, std)
        if change and self._state["yaw_known"]:
            self._state["P"][Err.YAW, Err.YAW] += change * change
            self._state["last_sequence"] = -1
        self._used = (std, aiding.under_torque)
        self._wound = False
        return True

    def holds_survey(self, now: float) -> bool:
        """Whether at ``now`` (s, own clock) the survey waits: the yaw that counts is that of a released string.

        A drive that is no longer reported is not waited for: the survey goes by what the node itself knows.
        """
        told = now - self._heard_at <= self._settings.aiding_old_after
        return self._holding and told and bool(self._state["still_cycles"])

    def drain_events(self) -> list[PendingEvent]:
        """Code, severity and arguments of the events since the last call."""
        said, self._pending = self._pending, []
        return said

    def _tell(self, aiding: Aiding, std: float) -> None:
        code = "string_under_torque" if aiding.under_torque else "string_released"
        self._pending.append((code, Severity.INFO, {"torque_nm": aiding.torque, "twist_sigma_deg": math.degrees(std)}))
