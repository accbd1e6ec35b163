"""The clock and the date of the ground station's machine, which may step back: followed, held and told. No I/O."""

from __future__ import annotations

from collections.abc import Callable

from groundstation.service.alarms.crew_alarms import CrewAlarms, Times
from groundstation.service.alarms.rig_alarms import RigAlarms
from telemetry.runtime.steady_time import SteadyTime

CLOCK_BACK = "clock_back"


class StationClock(SteadyTime):
    """Time of a machine that goes on where its clock steps back, as that of a restored one does.

    Parameters
    ----------
    alarms : where a step back is told
    date : of this machine, UTC, s since 1970
    """

    def __init__(self, alarms: RigAlarms, date: Callable[[], float]) -> None:
        super().__init__()  # and no clock inside this one: it is followed at all that comes
        self._alarms, self._date, self._told_back = alarms, date, 0.0

    def times_at(self, now: float, rig_now: float) -> Times:
        """The times (s) of an alarm that is raised or cleared now."""
        return Times(now, rig_now, self._date())

    def look(self) -> None:
        """Tell by how much the clock has stepped back since it was told last."""
        if (back := self.back) > self._told_back:
            what = f"it stepped back by {back - self._told_back:.1f} s; times go on from where they were"
            self._alarms.alert(CLOCK_BACK, "clock", what)
            self._told_back = back

    def look_at_date(self, crew_alarms: CrewAlarms, utc: float) -> None:
        """Have what is shelved come back in time where the date (s since 1970) stepped back, and tell that."""
        if back := crew_alarms.follow_date(utc):
            self._alarms.alert(CLOCK_BACK, "date", f"the date of its machine is {back:.0f} s before one that was")
