"""A ground station that starts upon what another one took in: the same answers to the last byte, and what it costs."""

import math
from pathlib import Path

import orjson
import pytest

from borechain.load.crowd import ROUND_S
from borechain.load.day import ADVANCES, BEGUN_AT, depth_of, write_day
from borechain.load.learning import (
    AGAIN,
    ALONE,
    ARRIVAL,
    ASKED,
    FEW,
    FEW_ARRIVAL,
    HOLES,
    STARTED,
    TOGETHER,
    LearningLoad,
    measure_learning,
)
from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import find_path
from groundstation.service.process.ground_process import GroundProcess

TUBES, STOPS = 8, 12
OF_THE_HOLE = ("stations", "stations/1", "trajectory", "uncertainty", "column", "history", "measurements")


def answers(model: RigModel) -> dict[str, bytes]:
    """What is told of the hole now and at the end of every stop, without the header of the moment."""
    told = {path: orjson.dumps(find_path(model, path).view(model, {})) for path in OF_THE_HOLE}
    moments = [str(moment.number) for moment in model.hole.history.moments]
    return told | {n: orjson.dumps(find_path(model, "column").view(model, {"moment": n})) for n in moments}


@pytest.mark.slow
def test_a_start_knows_to_the_last_byte_what_was_known_before_it(tmp_path: Path) -> None:
    """Surveys of a stop that came together, one by one, and with a query after each of them."""
    config = GroundConfig(folder=tmp_path, tube_length=2.0, target=40.0)
    stored = write_day(config.url, STOPS, TUBES)
    hearing = LearningLoad(config, TUBES, BEGUN_AT + ROUND_S * (STOPS + 1))
    taken = 0
    for stop, learn in enumerate((hearing.learn_together, hearing.learn_alone, hearing.learn_asked) * 2, 1):
        md = depth_of(TUBES, ADVANCES + (stop - 1) // 3)
        surveys = hearing.drill(STOPS + stop, md)
        learn(surveys, md)
        taken += len(surveys)
    before = answers(hearing.ground.model)
    hearing.ground.close()
    again = GroundProcess(config)
    after = answers(again.model)
    again.close()
    assert again.model.newest_row("measurements") == stored + taken > STOPS * TUBES
    assert len(before) == len(OF_THE_HOLE) + STOPS + 5
    assert after == before


@pytest.mark.slow
def test_the_bench_asks_for_every_key_and_says_what_misses_its_bound(tmp_path: Path) -> None:
    result = measure_learning(200, 5, 3, tmp_path)
    figures = {row["what"]: row for row in result["figures"]}
    first = {f"{path}, the first time" for path in ASKED}
    assert set(figures) == {STARTED, AGAIN, TOGETHER, ALONE, ARRIVAL, FEW_ARRIVAL, *first, *ASKED}
    in_the_hole = [
        math.ceil((2.0 + 0.25 * (stop * 32 // 40)) / 2.0) for stop in range(40)
    ]  # tubes of 2 m, at each stop
    assert result["surveys"] == sum(in_the_hole) + 3 * 5
    assert all(0.0 < row["p50"] <= row["p99"] <= row["max"] for row in figures.values())
    assert all(row["holds"] == (row["p99"] <= row["bound"]) for row in figures.values())
    assert all((figures[what]["unit"], figures[what]["bound"]) == ("s", 2.0) for what in (STARTED, AGAIN))
    assert (figures[ALONE]["count"], figures[TOGETHER]["count"], figures[ARRIVAL]["count"]) == (5, 1, 2 * 5)
    assert (figures[FEW_ARRIVAL]["count"], figures[FEW_ARRIVAL]["bound"]) == (FEW * HOLES, 5.0)
