"""The angle of a joint that was made up above, solved from the yaw that the string below kept.

While a tube is added the string below stands still. At the first aiding after it the angle from the drive head down to
this node is ``saved yaw - aiding``; the yaw goes on as before, and so do its constant errors. A rest is one measurement
of the encoder, with one error. Where the head turned meanwhile the aiding is another measurement, and its variance and
that of the saved yaw come to them. Where it did not, the saved yaw has that very error in it already: the difference is
what it was before, nothing is added, and the filter goes on undisturbed.
"""

from __future__ import annotations

import math

from node.firmware.pending_event import PendingEvent
from node.firmware.settings import TubeSettings
from node.kernels.angles import from_binary, wrap
from node.kernels.layout import DEG, Array, Err
from telemetry.messages import Aiding, Severity

SAME = 1e-8  # rad, between two offsets of one string
LARGEST_STD = 1.0 * DEG  # of a saved yaw that can solve a joint
CONTRADICTION = 4.0  # sigmas between marks and solution


class MakeUp:
    """Joints above one node.

    Parameters
    ----------
    settings : ``joints`` is the source of their angles
    states : the node's record, one-element array
    """

    def __init__(self, settings: TubeSettings, states: Array) -> None:
        self._settings = settings
        self._state = states[0]
        self._path: tuple[int, float] | None = None  # hops and offset (rad) of the marks, in the aiding used last
        self._offset = 0.0  # rad, in their place
        self._var: float | None = None  # rad^2, of it; None: that of the marks
        self._pending: list[PendingEvent] = []

    def follow(
        self, aiding: Aiding, marks: float, marks_var: float, torsion_var: float, twist_var: float
    ) -> tuple[float, float]:
        """Offset (rad) and systematic variance (rad^2) of this node, where the marks' are given.

        Of the node's present systematic variance ``torsion_var`` (rad^2) belongs to no joint; this aiding's part of it
        is ``twist_var``.
        """
        if self._settings.joints == "marks":
            return marks, marks_var
        if self._path is None:
            self._resume(aiding, marks, twist_var)
        elif aiding.hops != self._path[0] or abs(wrap(marks - self._path[1])) > SAME:
            self._make_up(aiding, marks, marks_var, torsion_var, twist_var)
        self._path = (aiding.hops, marks)
        if self._var is None:
            return marks, marks_var
        return self._offset, self._var

    def drain_events(self) -> list[PendingEvent]:
        """Code, severity and arguments of the events since the last call."""
        said, self._pending = self._pending, []
        return said

    def _resume(self, aiding: Aiding, marks: float, twist_var: float) -> None:
        """After a start the earlier solution stands, if the string is still the same."""
        state = self._state
        hops, reference = int(state["reference_hops"]), float(state["reference_offset"])
        if hops >= 0 and hops != aiding.hops:
            self._refuse(aiding, "the node was started anew meanwhile")
        elif hops >= 0 and abs(wrap(reference - marks)) > SAME:
            self._offset = reference
            self._var = max(float(state["systematic_var"]) - (0.0 if aiding.under_torque else twist_var), 0.0)

    def _make_up(self, aiding: Aiding, marks: float, marks_var: float, torsion_var: float, twist_var: float) -> None:
        state = self._state
        P = float(state["now_P"][Err.YAW, Err.YAW])
        if reason := self._refusal(aiding, P):
            self._refuse(aiding, reason)
            return
        turned = bool(state["stopped_at"] > state["last_aided"])
        same = aiding.sequence == int(state["last_sequence"]) and not turned
        var = max(float(state["systematic_var"]) - torsion_var, 0.0) + self._settings.unseen_std**2
        if same:
            solved = float(state["reference_offset"])
        else:
            solved = float(wrap(from_binary(state["now_yaw"]) - aiding.yaw))
            var += P + aiding.yaw_var
        off = float(wrap(solved - marks))
        contradicts = abs(off) > CONTRADICTION * math.sqrt(var + marks_var)
        is_new = aiding.hops == 1 and self._path is not None and self._path[0] == 0
        share = 1.0
        if is_new and self._settings.joints == "both" and not contradicts:
            # the marks of two new joints are independent of all before; farther down the chain they bring nothing new
            share = marks_var / (marks_var + var)
        self._offset = solved if share == 1.0 else float(wrap(marks + share * off))
        self._var = share * var
        if same and share == 1.0:  # the same reference, said by another neighbour
            state["reference_hops"] = aiding.hops
            state["systematic_var"] = var + twist_var
        detail = {
            "angle_deg": self._offset / DEG,
            "sigma_deg": math.sqrt(self._var) / DEG,
            "marks_deg": marks / DEG,
            "turned": turned,
        }
        if is_new:
            self._pending.append(("joint_solved", Severity.INFO, dict(detail)))
        if contradicts:
            self._pending.append(("joint_contradicts_marks", Severity.WARNING, dict(detail)))

    def _refuse(self, aiding: Aiding, reason: str) -> None:
        self._var = None
        self._pending.append(("joint_not_solved", Severity.WARNING, {"reason": reason, "hops": aiding.hops + 1}))

    def _refusal(self, aiding: Aiding, P: float) -> str:
        """Why the saved yaw cannot solve the joint; empty if it can."""
        state = self._state
        if not state["yaw_known"] or P > LARGEST_STD**2:
            return "the saved yaw is not known"
        if aiding.rate != 0.0 or aiding.under_torque or not state["still_cycles"]:
            return "the string does not stand still"
        return ""
