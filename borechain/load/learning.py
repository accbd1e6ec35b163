"""A ground station that has thousands of surveys: its start, what one more costs it, and how long answers take.

One process, without bus and page, so that its figures are the ground station's own. Bounds are those of its
specification; a row that misses its bound says so.
"""

from __future__ import annotations

import contextlib
import itertools
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from borechain.load.crowd import ROUND_S, TUBE_LENGTH, state_of
from borechain.load.day import ADVANCE, ADVANCES, BEGUN_AT, EPOCH, depth_of, surveys_at, up_to, write_day
from groundstation.config import GroundConfig, checked_config
from groundstation.ground_host import start_ground_process
from groundstation.recording.ground_replay import TapeClock
from sim.errors import RigError
from telemetry.application.depth_source import DepthSource
from telemetry.frozen import replace
from telemetry.messages import SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message

RIG = "load"
READINGS, READ_EVERY_S = 20, 2.0  # of the depth at a stop
SHORTLY_S = 0.01  # until the next reading
COURSES = 3  # stops at one depth
TENTH = 10
QUESTIONS = 5  # after a survey
START_S, LEARN_MS, ANSWER_MS, FEW_MS = 2.0, 1.0, 20.0, 5.0  # at most
STARTED, AGAIN = "start upon what another one wrote", "start again"
TOGETHER, ALONE, ARRIVAL = "learning each of a stop", "learning one alone", "arrival: working out the hole"
FEW = 10  # tubes, and stations of as many stops
FEW_ARRIVAL = f"arrival at {FEW} tubes and {FEW} stations"
HOLES = 5  # so small, each drawn anew
BOUNDS = {STARTED: START_S, AGAIN: START_S, TOGETHER: LEARN_MS, ALONE: LEARN_MS, FEW_ARRIVAL: FEW_MS}
ASKED = (
    "status", "verdict", "string", "nodes/1", "stations", "stations/1", "stations/1/measurements", "trajectory",
    "uncertainty", "column", "history", "events", "alarms", "measurements", "changes", "adjustment", "setup",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Figure:
    """One row: a median, a 99th percentile and the largest of ``count``, in a unit, and the bound of the percentile."""

    what: str
    unit: str
    p50: float
    p99: float
    most: float
    count: int
    bound: float

    @property
    def row(self) -> dict[str, Any]:
        """Row of a table."""
        return {
            "what": self.what, "unit": self.unit, "p50": self.p50, "p99": self.p99, "max": self.most,
            "count": self.count, "bound": self.bound, "holds": self.p99 <= self.bound,
        }  # fmt: skip


class LearningLoad:
    """A ground station that is told what a string says and asked meanwhile, each of it timed.

    Parameters
    ----------
    config : of its settings, with the database it starts upon
    tubes, begin : of the string, and rig time (s) from which on it goes on
    """

    def __init__(self, config: GroundConfig, tubes: int, begin: float) -> None:
        self._config, self._tubes = config, tubes
        self._now = begin
        self._clock = TapeClock(begin, EPOCH)
        self._source = DepthSource()
        self._questions = itertools.cycle(ASKED)
        self.taken: dict[str, list[float]] = defaultdict(list)  # s of CPU
        with self._timing(STARTED):
            self.ground = start_ground_process(config)
        self.ground.clock = self._clock

    def drill(self, number: int, md: float) -> list[SurveyMeasurement]:
        """Drill to ``md`` (m) and let the string stand there; returns the surveys that it takes."""
        for tube in up_to(self._tubes):
            state = state_of(tube, self._tubes - tube + 1, self._now)
            self.ground.on_message(replace(state, epoch=EPOCH, cycles=number), self._now)
        for _ in range(READINGS):
            self._read(md, READ_EVERY_S)
        return surveys_at(self._tubes, md, number, self._now)

    def learn_together(self, surveys: list[SurveyMeasurement], md: float) -> None:
        """Take all surveys of a stop before the next reading of the depth, as a string sends them."""
        before = time.process_time()
        self._take(surveys, md)
        self.ground.model.hole.settle()
        self.taken[TOGETHER].append((time.process_time() - before) / len(surveys))

    def learn_alone(self, surveys: list[SurveyMeasurement], md: float) -> None:
        """Take each survey by itself and compute the hole after it, as the next look or question does."""
        for survey in surveys:
            with self._timing(ALONE):
                self._take([survey], md)
            with self._timing(ARRIVAL):
                self.ground.model.hole.settle()

    def place_alone(self, survey: SurveyMeasurement, md: float) -> None:
        """One comes by itself, and the hole is worked out after it."""
        self._take([survey], md)
        self.ground.model.hole.settle()

    def learn_asked(self, surveys: list[SurveyMeasurement], md: float) -> None:
        """Take surveys one by one with a look and queries after each; what a query shows is not kept from before."""
        for survey in surveys:
            self._take([survey], md)
            with self._timing(ARRIVAL):
                self.ground.model.hole.settle()
            for path in itertools.islice(self._questions, QUESTIONS):
                with self._timing(path):
                    self.ground.operator.ask_json(path)

    def ask_first(self) -> None:
        """Ask for each path for the first time, when no answer is cached."""
        for path in ASKED:
            with self._timing(f"{path}, the first time"):
                self.ground.operator.ask_json(path)

    def start_again(self) -> None:
        """Close it, and start another upon what it has kept."""
        self.ground.close()
        with self._timing(AGAIN):
            start_ground_process(self._config).close()

    def _take(self, surveys: list[SurveyMeasurement], md: float) -> None:
        """Take surveys: they are stored, and placed by the next reading of the depth."""
        for survey in surveys:
            self.ground.on_message(survey, self._now)
        self.ground.before_frames()
        self._read(md, SHORTLY_S)

    def _read(self, md: float, after: float) -> None:
        self._now += after
        self._clock.rig_now = self._now
        self.ground.on_depth(encode_message(self._source.measure(self._now, md)), self._now)

    @contextlib.contextmanager
    def _timing(self, what: str) -> Iterator[None]:
        before = time.process_time()
        yield
        self.taken[what].append(time.process_time() - before)


def measure_learning(surveys: int, tubes: int, stops: int, folder: Path) -> dict[str, Any]:
    """Start a ground station upon so many surveys, let it learn some stops more and ask it, see ``LearningLoad``.

    Raises
    ------
    RigError
        When it has not fused all of them.
    """
    settings: dict[str, Any] = {"tube_length": TUBE_LENGTH, "target": TUBE_LENGTH * (tubes + ADVANCES * ADVANCE)}
    known = -(-surveys // tubes)  # stops
    tenth, whole = (checked_config(rig=RIG, folder=folder / str(n), **settings) for n in (known // TENTH, known))
    sizes = [bytes_of_a_survey(config, n, tubes) for config, n in ((tenth, known // TENTH), (whole, known))]
    hearing = LearningLoad(whole, tubes, BEGUN_AT + ROUND_S * (known + 1))
    hole = hearing.ground.model.hole
    before = hole.newest
    with contextlib.closing(hearing.ground):
        courses = itertools.cycle((hearing.learn_together, hearing.learn_alone, hearing.learn_asked))
        learnt = 0
        for stop, learn in zip(range(1, stops + 1), courses, strict=False):
            md = depth_of(tubes, ADVANCES + (stop - 1) // COURSES)
            taken = hearing.drill(known + stop, md)
            if stop == 1:
                hearing.ask_first()
            learn(taken, md)
            learnt += len(taken)
        if hole.newest != before + learnt:
            raise RigError(f"{learnt} surveys came, {hole.newest - before} were fused")
        stations = len(hole.stations)
        hearing.start_again()
    hearing.taken[FEW_ARRIVAL] = [one for n in range(HOLES) for one in arrivals_of_few(folder / f"few-{n}", n)]
    return {
        "surveys": before + learnt,
        "stations": stations,
        "store_bytes_of_a_survey": {"of a tenth": sizes[0], "of all": sizes[1]},
        "figures": [timing_figure(what, taken).row for what, taken in hearing.taken.items()],
    }


def arrivals_of_few(folder: Path, hole: int) -> list[float]:
    """Seconds of CPU of each arrival of the last stop of a small hole, that a string of few tubes has drilled."""
    config = checked_config(rig=RIG, folder=folder, tube_length=TUBE_LENGTH, target=2.0 * TUBE_LENGTH * FEW)
    write_day(config.url, 0, FEW)  # the order of its tubes alone
    load = LearningLoad(config, FEW, BEGUN_AT)
    advances = round(TUBE_LENGTH / ADVANCE)
    with contextlib.closing(load.ground):
        for stop in range(1, FEW + 1):
            for part in range(1, advances + 1):
                md = TUBE_LENGTH * (stop - 1) + ADVANCE * part
                taken = load.drill(FEW * hole + stop, md)
            learn = load.learn_alone if stop == FEW else load.learn_together
            learn(taken, md)
        if load.ground.model.hole.newest != FEW * (FEW + 1) // 2:
            raise RigError(f"{load.ground.model.hole.newest} surveys of {FEW} tubes at {FEW} stops were fused")
    return load.taken[ARRIVAL]


def bytes_of_a_survey(config: GroundConfig, stops: int, tubes: int) -> float:
    """Fill a database with the surveys of some stops; returns its size by their number."""
    count = write_day(config.url, stops, tubes)
    return sum(file.stat().st_size for file in config.folder.iterdir()) / count


def timing_figure(what: str, taken: list[float]) -> Figure:
    """The row of what was timed."""
    unit, scale = ("s", 1.0) if what in (STARTED, AGAIN) else ("ms", 1e3)
    bound = BOUNDS.get(what, ANSWER_MS)
    p50, p99 = (scale * float(value) for value in np.percentile(taken, (50.0, 99.0)))
    return Figure(what, unit, p50, p99, scale * max(taken), len(taken), bound)
