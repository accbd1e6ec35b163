"""A node's idea of rig time: offset and drift of its clock, from two-way exchanges with the neighbour above.

``rig = local + offset + drift (local - epoch)``; a two-state Kalman filter, so that the jitter of single exchanges
averages out and rig time never jumps by more than its own uncertainty. The error of an exchange is half the
difference of its two delays: asked at t1, received t2, replied t3, back at t4 gives ((t2 - t1) + (t3 - t4)) / 2.
"""

from __future__ import annotations

import math

DRIFT_STD = 50e-6  # 1, a crystal before it was ever compared
JITTER_STD = 0.4e-3  # s, of one exchange over one joint
OFFSET_WALK = 2e-6  # s/sqrt(s)
DRIFT_WALK = 1e-9  # 1/sqrt(s)
GATE = 6.0  # sigmas
RESET_AFTER = 3  # exchanges that disagree in a row


class ClockFilter:
    """Rig time of one process. The root of time (the encoder) is its own rig time.

    Parameters
    ----------
    is_root : whether this process's clock is rig time
    """

    def __init__(self, *, is_root: bool = False) -> None:
        self.is_root = is_root
        self.exchanges = 0
        self._epoch = 0.0
        self._offset = 0.0
        self._drift = 0.0
        self._p = (0.0, 0.0, 0.0)  # var(offset), cov, var(drift)
        self._upstream_var = 0.0
        self._disagreed = 0
        self._least_rtt = math.inf

    @property
    def synchronised(self) -> bool:
        """Whether rig time is known at all."""
        return self.is_root or self.exchanges > 0

    def rig_from_local(self, local: float) -> float:
        """Rig time (s) at the local time ``local`` (s)."""
        return local + self._offset + self._drift * (local - self._epoch)

    def local_from_rig(self, rig: float) -> float:
        """Local time (s) at the rig time ``rig`` (s)."""
        return self._epoch + (rig - self._epoch - self._offset) / (1.0 + self._drift)

    def variance(self, local: float) -> float:
        """Variance (s^2) of rig time at ``local``, that of the neighbours above included; infinite before any."""
        if self.is_root:
            return 0.0
        if self.exchanges == 0:
            return math.inf
        return self._predicted(local)[0] + self._upstream_var

    def exchange(self, asked: float, received: float, replied: float, back: float, upstream_var: float) -> None:
        """Take one exchange: ``asked`` and ``back`` local, ``received`` and ``replied`` rig time (s)."""
        round_trip = (back - asked) - (replied - received)
        if self.is_root or round_trip < 0.0:
            return
        self._least_rtt = min(self._least_rtt, round_trip)
        middle = 0.5 * (asked + back)
        measured = 0.5 * ((received - asked) + (replied - back))
        excess = 0.5 * (round_trip - self._least_rtt)
        var = JITTER_STD**2 + excess * excess
        self._upstream_var = upstream_var
        if self.exchanges == 0:
            self._start(middle, measured, var)
        else:
            self._update(middle, measured, var)

    def _start(self, local: float, offset: float, var: float) -> None:
        self._epoch, self._offset, self._drift = local, offset, 0.0
        self._p = (var, 0.0, DRIFT_STD**2)
        self.exchanges = 1
        self._disagreed = 0

    def _predicted(self, local: float) -> tuple[float, float, float]:
        p00, p01, p11 = self._p
        dt = local - self._epoch
        age = abs(dt)
        return (
            p00 + 2.0 * dt * p01 + dt * dt * p11 + OFFSET_WALK**2 * age,
            p01 + dt * p11,
            p11 + DRIFT_WALK**2 * age,
        )

    def _update(self, local: float, measured: float, var: float) -> None:
        p00, p01, p11 = self._predicted(local)
        offset = self._offset + self._drift * (local - self._epoch)
        residual = measured - offset
        s = p00 + var
        if residual * residual > GATE * GATE * s:
            self._disagreed += 1
            if self._disagreed >= RESET_AFTER:
                self._start(local, measured, var)
            return
        self._disagreed = 0
        k0, k1 = p00 / s, p01 / s
        self._epoch = local
        self._offset = offset + k0 * residual
        self._drift += k1 * residual
        self._p = (p00 * (1.0 - k0), p01 * (1.0 - k0), p11 - k1 * p01)
        self.exchanges += 1
