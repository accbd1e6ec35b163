"""A node's idea of rig time, from two-way exchanges with the neighbour that is nearer to the encoder.

Each node compares its own crystal with its neighbour's own crystal, two free-running clocks, by a two-state Kalman
filter (offset, drift); rig time is then the neighbour's account of it, carried over that comparison. Comparing with
the neighbour's filtered rig time instead would cascade the filters: each takes the corrections of all above it for
drift and overshoots, so that errors grow with the hops instead of adding up.

An exchange asked at t1, received t2, replied t3, back t4 measures ((t2 - t1) + (t3 - t4)) / 2, wrong by half the
difference of its two delays. That half is at most half of what the round trip took beyond the shortest one. Where even
the shortest was long (a machine that does many things has just started fifty nodes), it may have waited one way only:
until three of late have taken as long and found the same, all of it beyond a plausible round trip counts as a wait.
A reply that took seconds is not used as a measurement: the question has been repeated since, or the reply is a
recording that comes again after a start, when nothing better is known.
"""

from __future__ import annotations

import math
from collections import deque

from telemetry.messages import EPOCH_UNKNOWN, TimeReply

DRIFT_STD = 50e-6  # 1, between two crystals never compared before
JITTER_STD = 0.4e-3  # s, of one exchange over one joint
OFFSET_WALK = 2e-6  # s/sqrt(s)
DRIFT_WALK = 1e-9  # 1/sqrt(s)
PLAUSIBLE_ROUND_TRIP = 0.02  # s, of a joint whose ends both wait; a longer one must be seen more than once
LONGEST_ROUND_TRIP = 2.0  # s, two requests at the quick pace
AGREEING, OF_LATE = 3, 8  # exchanges: so often, of so many
GATE = 6.0  # sigmas
RESET_AFTER = 3  # exchanges that disagree in a row


class ClockFilter:
    """Rig time of one process. The root of time (the encoder) is its own rig time.

    Parameters
    ----------
    is_root : whether this process's clock is rig time
    epoch : of the root: the start that its clock counts from
    """

    def __init__(self, *, is_root: bool = False, epoch: int = EPOCH_UNKNOWN) -> None:
        self.is_root = is_root
        self._own_epoch = epoch if is_root else EPOCH_UNKNOWN
        self.exchanges = 0
        self._epoch = 0.0
        self._offset = 0.0
        self._drift = 0.0
        self._p = (0.0, 0.0, 0.0)  # var(offset), cov, var(drift)
        self._told = TimeReply(0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        self._disagreed = 0
        self._least_round_trip = math.inf
        self._of_late: deque[tuple[float, float]] = deque(maxlen=OF_LATE)  # s: round trip, measured
        self._another = False
        self._jumped = False
        self.stepped = 0.0  # s, see ``take_step``

    @property
    def synchronised(self) -> bool:
        """Whether rig time is known."""
        return self.is_root or self.exchanges > 0

    @property
    def epoch(self) -> int:
        """Epoch of the rig time known now."""
        return self._own_epoch if self.is_root else self._told.epoch

    @property
    def rig_rate(self) -> float:
        """Rig seconds per second of the own clock."""
        return (1.0 + self._drift) * self._told.rig_rate

    def rig_from_local(self, local: float) -> float:
        """Rig time (s) at the local time ``local`` (s)."""
        neighbour = local + self._offset + self._drift * (local - self._epoch)
        return self._told.rig_at + self._told.rig_rate * (neighbour - self._told.replied_at)

    def local_from_rig(self, rig: float) -> float:
        """Local time (s) at the rig time ``rig`` (s)."""
        neighbour = self._told.replied_at + (rig - self._told.rig_at) / self._told.rig_rate
        return self._epoch + (neighbour - self._epoch - self._offset) / (1.0 + self._drift)

    def variance(self, local: float) -> float:
        """Variance (s^2) of rig time at ``local``, that of the neighbours above included; infinite before any."""
        if self.is_root:
            return 0.0
        if self.exchanges == 0:
            return math.inf
        return self._predicted(local)[0] + self._told.clock_var

    @property
    def drift_std(self) -> float:
        """Standard deviation of the rate of rig time, s/s.

        Of the joints above only the variance of their time is known, and their rates are taken to be as well known.
        """
        own, _, drift_var = self._p
        return math.sqrt(drift_var * (1.0 + self._told.clock_var / own)) if own > 0.0 else 0.0

    def take_step(self) -> float:
        """Return the correction (s) of the clock since the last call, positive where it now dates later.

        NaN where the step is unknown, for the own clock may have jumped or rig time is another one.
        """
        stepped, self.stepped = self.stepped, 0.0
        return stepped

    def change_neighbour(self) -> None:
        """Restart the comparison at the next exchange, with another crystal; rig time stays as known till then."""
        self._another = True

    def suspect_neighbour(self) -> None:
        """Accept the next exchange even if it disagrees: the neighbour has restarted, perhaps from zero."""
        self._disagreed = RESET_AFTER - 1

    def doubt(self, seconds: float) -> None:
        """Note a possible jump of the own clock by ``seconds``: take the next exchange, and trust little till then."""
        p00, p01, p11 = self._p
        self._p = (p00 + seconds * seconds, p01, p11)
        self._disagreed = RESET_AFTER - 1
        self._jumped = True

    def exchange(self, reply: TimeReply, back: float) -> None:
        """Take a reply that came ``back`` at a local time (s); one that is impossible or took too long is ignored."""
        round_trip = (back - reply.asked_at) - (reply.replied_at - reply.received_at)
        if self.is_root or not 0.0 <= round_trip <= LONGEST_ROUND_TRIP:
            return
        measured = 0.5 * ((reply.received_at - reply.asked_at) + (reply.replied_at - back))
        self._least_round_trip = min(self._least_round_trip, round_trip)
        self._of_late.append((round_trip, measured))
        wait = 0.5 * (round_trip - self._least_round_trip) + self._doubt()
        var = JITTER_STD**2 + wait * wait
        middle = 0.5 * (reply.asked_at + back)
        continues = self.exchanges > 0 and reply.epoch == self._told.epoch and not self._jumped
        before = self.rig_from_local(back)
        if self.exchanges == 0 or self._another:
            self._start(middle, measured, var)
        elif not self._update(middle, measured, var):
            return
        self._told = reply
        self._jumped = False
        self.stepped += (before - self.rig_from_local(back)) / self.rig_rate if continues else math.nan

    def _doubt(self) -> float:
        """Possible error (s) of the shortest round trip, which may have waited one way only."""
        beyond = 0.5 * max(self._least_round_trip - PLAUSIBLE_ROUND_TRIP, 0.0)
        if beyond == 0.0 or len(self._of_late) < AGREEING:
            return beyond
        shortest = sorted(self._of_late)[:AGREEING]
        found = [measured for _, measured in shortest]
        return min(beyond, 0.5 * (shortest[-1][0] - shortest[0][0]) + max(found) - min(found))

    def _start(self, local: float, offset: float, var: float) -> None:
        self._epoch, self._offset, self._drift = local, offset, 0.0
        self._p = (var, 0.0, DRIFT_STD**2)
        self.exchanges = 1
        self._disagreed = 0
        self._another = False

    def _predicted(self, local: float) -> tuple[float, float, float]:
        p00, p01, p11 = self._p
        dt = local - self._epoch
        age = abs(dt)
        return (
            p00 + 2.0 * dt * p01 + dt * dt * p11 + OFFSET_WALK**2 * age,
            p01 + dt * p11,
            p11 + DRIFT_WALK**2 * age,
        )

    def _update(self, local: float, measured: float, var: float) -> bool:
        """Kalman update; False when the exchange disagrees beyond the gate (the neighbour restarted, or is wrong)."""
        p00, p01, p11 = self._predicted(local)
        offset = self._offset + self._drift * (local - self._epoch)
        residual = measured - offset
        s = p00 + var
        if residual * residual > GATE * GATE * s:
            self._disagreed += 1
            if self._disagreed < RESET_AFTER:
                return False
            self._start(local, measured, var)
            return True
        self._disagreed = 0
        k0, k1 = p00 / s, p01 / s
        self._epoch = local
        self._offset = offset + k0 * residual
        self._drift += k1 * residual
        self._p = (p00 * (1.0 - k0), p01 * (1.0 - k0), p11 - k1 * p01)
        self.exchanges += 1
        return True
