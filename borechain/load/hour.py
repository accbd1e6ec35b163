"""What each process of a rig holds as the hours go by: memory, open files, and the ground station's database."""

from __future__ import annotations

import contextlib
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sim.rig.processes import ProcessTable
from sim.rig.realtime_run import memory_footprint, running_pids
from telemetry.messages import SurveyMeasurement
from telemetry.presentation.msgpack_codec import decode_message

GROUND = "base"  # as the table of processes has it
STOP_EVERY_S, STOP_S, FINISH_S = 90.0, 26.0, 30.0  # of rig time
ADVANCE_M = 0.8  # of the bit in all: the ground station knows how far the string reaches
SCENARIO = """\
[rig]
tubes = {tubes}
tube_length_m = 2.0
tubes_at_start = {tubes}

[path.straight]
inclination_deg = 3.0
azimuth_deg = 40.0

[rotation]
turns = 1.5
advance_m = {advance}

[schedule]
add_s = {add}
stop_s = {stop}
finish_s = {finish}
blocks = {stops}
"""


@dataclass(frozen=True, slots=True)
class Weight:
    """One process at one time."""

    hours: float  # wall, since the rig began to drill
    process: str
    private_mb: float
    handles: int  # open files
    database_kb: float  # with its log of writes; 0 of all but the ground station
    surveys: int  # that the database holds


def scenario_text(tubes: int, rig_s: float) -> str:
    """A string that hangs complete, is drilled a little and surveyed, over and over, for ``rig_s`` of rig time."""
    stops = max(int(rig_s / STOP_EVERY_S), 1)
    add = STOP_EVERY_S - STOP_S
    return SCENARIO.format(tubes=tubes, advance=ADVANCE_M / stops, add=add, stop=STOP_S, finish=FINISH_S, stops=stops)


class Scales:
    """Weighs every process of a rig at regular times while it drills.

    Parameters
    ----------
    table : of the processes
    database : file of the ground station's
    every : wall s between two weighings
    """

    def __init__(self, table: ProcessTable, database: Path, every: float) -> None:
        self._table = table
        self._database = database
        self._every = every
        self._begun = self._due = time.monotonic()
        self.weights: list[Weight] = []

    def on_tick(self) -> None:
        """Weigh, where it is time."""
        now = time.monotonic()
        if now >= self._due:
            self._due += self._every
            self.weights += self._weigh((now - self._begun) / 3600.0)

    def _weigh(self, hours: float) -> Iterator[Weight]:
        for name, pid in sorted(running_pids(self._table).items()):
            kept = self.kept() if name == GROUND else (0.0, 0)
            handles = len(list(Path(f"/proc/{pid}/fd").iterdir()))
            yield Weight(hours, name, memory_footprint(pid)["private_mb"], handles, *kept)

    def kept(self) -> tuple[float, int]:
        """Size of the database in kB, and surveys in it."""
        if not self._database.exists():
            return 0.0, 0
        size = sum(file.stat().st_size for file in self._database.parent.glob(f"{self._database.name}*"))
        with contextlib.closing(sqlite3.connect(f"file:{self._database}?mode=ro", uri=True)) as connection:
            # the file is there before the ground station has laid out its tables
            (tables,) = connection.execute("select count(*) from sqlite_master where name = 'messages'").fetchone()
            if not tables:
                return size / 1e3, 0
            rows = connection.execute("select payload from messages where kind = 'SurveyMeasurement'").fetchall()
        # one that was said again has the tube and the time of the first
        said = (decode_message(payload) for (payload,) in rows)
        surveys = {(m.tube, m.station_at) for m in said if isinstance(m, SurveyMeasurement)}
        return size / 1e3, len(surveys)
