"""Raises an alarm of each certificate in the ground station's folder of keys that ends within a month."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable
from pathlib import Path

from groundstation.service.alarms.rig_alarms import RigAlarms
from telemetry.transport.certificate_dates import certificate_troubles

LOOK_EVERY = 10.0  # s
CODE = "certificate"


def utc_now() -> datetime.datetime:
    """Return the date of this machine."""
    return datetime.datetime.now(datetime.UTC)


class CertificateWatch:
    """Looks at the certificates beside the keys now and then; one that was made anew clears its alarm.

    Parameters
    ----------
    place : folder of the keys, or a key file in it; None where there are no keys
    alarms : to be raised and cleared
    date : of this machine, UTC
    """

    def __init__(self, place: Path | None, alarms: RigAlarms, date: Callable[[], datetime.datetime] = utc_now) -> None:
        self._place, self._alarms, self._date = place, alarms, date
        self._looked_at = -math.inf
        self._told: set[str] = set()

    def look(self, now: float) -> None:
        """Look at ``now`` (s, own clock)."""
        if self._place is None or now < self._looked_at + LOOK_EVERY:
            return
        self._looked_at = now
        troubles = certificate_troubles(self._place, self._date())
        for name in self._told | troubles.keys():
            self._alarms.hold(CODE, name, troubles.get(name, ""))
        self._told = set(troubles)
