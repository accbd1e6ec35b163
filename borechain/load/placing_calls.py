"""How many Python functions of the ground station are called to place one measurement at its station.

Counted are calls of functions, generators and comprehensions in ``groundstation``, and nothing of what it stands on:
from the arrival of the message, through the database and the next reading of the depth, to the hole that is worked out.
The clock of a recording, which stands here for that of a process, is not counted.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import groundstation
from borechain.load.crowd import ROUND_S, TUBE_LENGTH
from borechain.load.day import ADVANCE, ADVANCES, BEGUN_AT, depth_of, write_day
from borechain.load.learning import RIG, LearningLoad
from groundstation.config import checked_config
from groundstation.survey.fusion.fusion import Weighting

TUBES, STOPS = 10, 10
CALLS_AT_MOST = {Weighting.BAYES: 300, Weighting.ADJUSTED: 2400}  # an adjustment works the whole hole out
OURS = str(Path(groundstation.__file__).parent)
CLOCKS = str(Path(groundstation.__file__).parent / "recording")


def count_placing_calls(folder: Path, weighting: Weighting) -> list[int]:
    """Calls for every measurement of a stop, each of which comes alone; ten stops of ten tubes are known."""
    settings: dict[str, Any] = {"tube_length": TUBE_LENGTH, "target": TUBE_LENGTH * (TUBES + ADVANCES * ADVANCE)}
    config = checked_config(rig=RIG, folder=folder, weighting=weighting, **settings)
    write_day(config.url, STOPS, TUBES)
    load = LearningLoad(config, TUBES, BEGUN_AT + ROUND_S * (STOPS + 1))
    with contextlib.closing(load.ground):
        md = depth_of(TUBES, ADVANCES)
        return [_count_calls(partial(load.place_alone, m, md)) for m in load.drill(STOPS + 1, md)]


def _count_calls(act: Callable[[], None]) -> int:
    """Calls of functions of the ground station while something is done."""
    count = 0

    def on_call(frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        name = frame.f_code.co_filename
        count += event == "call" and name.startswith(OURS) and not name.startswith(CLOCKS)

    with _profiled(on_call):
        act()
    return count


@contextlib.contextmanager
def _profiled(on_call: Callable[[FrameType, str, object], None]) -> Iterator[None]:
    before = sys.getprofile()
    sys.setprofile(on_call)
    try:
        yield
    finally:
        sys.setprofile(before)
