"""The log of a rig whose output is redirected: a line a phase, survey, verdict, alarm and restart."""

from __future__ import annotations

import datetime
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from borechain.client import Ground

View = dict[str, Any]
FOLLOWED = ("measurements", "alarms", "verdict", "wall")


class DrillingState(Protocol):
    """What a medium tells while it drills."""

    @property
    def phase(self) -> str:
        """What the rig does."""

    @property
    def rig_time(self) -> float:
        """Rig time, s."""

    @property
    def begin(self) -> float:
        """Rig time of the first phase, s."""

    @property
    def end(self) -> float:
        """Rig time of the end, s."""


class RunLog:
    """Turns what happens into lines.

    Parameters
    ----------
    write : takes one line; called from any thread
    """

    def __init__(self, write: Callable[[str], object]) -> None:
        self._write = write
        self._is_joined = False
        self._phase = ""
        self._elapsed = 0.0
        self._alarms: dict[int, tuple[str, str]] = {}  # state and level of each that was told
        self._word = ""
        self._joints: dict[str, str] = {}  # of a wall, as each was told
        self._restarts: dict[str, int] = {}
        self._surveys: set[int] = set()  # that were told
        self._newest = 0  # of them
        self._lock = threading.Lock()  # what is published comes on a thread of the bus

    def join(self, endpoint: str, rig: str, ground: Ground) -> None:
        """Tell once that the endpoint of a rig can be joined, and log what its ground stations publish from now on."""
        if self._is_joined:
            return
        self._is_joined = True
        self._line("open", f"{endpoint}: borechain crew --endpoint {endpoint} --rig {rig}")
        for path in FOLLOWED:
            ground.follow(path, self.on_answer)

    def on_hole(self, name: str) -> None:
        """Another hole of the site is begun, by a ground station that knows nothing yet."""
        self._word = self._phase = ""
        self._surveys.clear()
        self._newest = 0
        self._alarms.clear()
        self._joints.clear()
        self._line("hole", name)

    def on_tick(self, tick: DrillingState, restarts: Mapping[str, int]) -> bool:
        """Take the rig's progress and how often each process was started again; whether a phase began."""
        self._elapsed = tick.rig_time - tick.begin
        for name, count in restarts.items():
            if count > self._restarts.get(name, 0):
                self._line("restart", f"process {name}, {count} so far")
        self._restarts = dict(restarts)
        if tick.phase == self._phase:
            return False
        self._phase = tick.phase
        self._line("phase", f"{tick.phase}, at {self._elapsed:.0f} of {tick.end - tick.begin:.0f} s")
        return True

    def on_answer(self, path: str, view: View) -> None:
        """Take an answer of the ground station."""
        with self._lock:
            self._tell(path, view)

    def poll(self, ask: Callable[[str, dict[str, str]], View], since: int | None = None) -> None:
        """Log what a ground station knows that was not told yet; of surveys those after ``since``, or after the newest.

        Under load some of what it publishes may not come, so a rig asks for all of them (0) in the end.
        """
        begin = self._newest if since is None else since
        for path in FOLLOWED:
            self.on_answer(path, ask(path, {"since": str(begin)} if path == "measurements" else {}))

    def _tell(self, path: str, view: View) -> None:
        match path:
            case "measurements":
                for row in view["measurements"]:
                    self._tell_survey(row)
            case "alarms":
                for alarm in (*view["open"], *view["closed"]):
                    self._tell_alarm(alarm)
            case "wall" if view["wall"] is not None:
                for row in view["wall"]["joints"]:
                    self._tell_joint(row)
            case "verdict" if view["verdict"] != self._word:
                self._word = view["verdict"]
                self._line("verdict", view["line"])

    def _tell_survey(self, row: View) -> None:
        if row["seq"] in self._surveys:
            return
        self._surveys.add(row["seq"])
        self._newest = max(self._newest, row["seq"])
        lean = f"{row['inclination_deg']:.2f} deg to {row['azimuth_deg']:.0f} deg"
        trust = "" if row["trust"] == "full" else f", {row['trust'].replace('_', ' ')}"
        again = "" if row["replaces"] is None else ", again"
        self._line("survey", f"tube {row['tube']} at {row['md_m']:.2f} m: {lean}{trust}{again}")

    def _tell_alarm(self, alarm: View) -> None:
        now = alarm["state"], alarm["level"]
        if self._alarms.get(alarm["number"]) == now:
            return
        self._alarms[alarm["number"]] = now
        way = "" if alarm["wind"] is None else f" to {alarm['azimuth_deg']:g} deg {alarm['wind']}"
        where = "" if alarm["md_m"] is None else f" at {alarm['md_m']:.1f} m"
        what = f"{alarm['code']} {alarm['subject']}{where}{way}: {alarm['detail']}"
        self._line("alarm", f"{alarm['number']} {alarm['state']}, {alarm['level']}, {what}")

    def _tell_joint(self, joint: View) -> None:
        found = joint["probability_where_surveyed"]
        told = (
            f"P(opening) {found:.2g}, {joint['surveyed_percent']} % surveyed" if found is not None else "not surveyed"
        )
        if self._joints.get(joint["joint"]) != told:
            self._joints[joint["joint"]] = told
            self._line("joint", f"{joint['joint']} {joint['state']}: {told}")

    def _line(self, kind: str, text: str) -> None:
        utc = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        self._write(f"{utc} {self._elapsed:8.1f} s {kind:8} {text}")
