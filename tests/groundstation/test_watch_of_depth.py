"""What the watch tells of the depth and of surveys that wait for it, word by word; see ``test_watch_whole.py``."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from watched_rig import Rig

from groundstation.service.string.depth import CONTRADICTION
from telemetry.messages import EPOCH_UNKNOWN


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_a_depth_is_refused_three_times_in_a_row_or_jumps(rig: Rig) -> None:
    on_depth, new = rig.watch.on_depth, rig.alarms.new
    for refused in ("a", "b", "", "c", "d"):
        on_depth(refused)
    assert new() == []
    on_depth("e")
    assert new() == [("hold", "depth_refused", "depth", "e")]
    on_depth("f")
    assert new() == [("hold", "depth_refused", "depth", "f")]
    on_depth("")
    assert new() == [("clear", "depth_refused", "depth")]
    on_depth("g")
    assert new() == []
    rig.depths.jumped = "by 3.00 m"
    on_depth("")
    assert new() == [("hold", "depth_refused", "depth", "it jumped by 3.00 m; see the command accept_depth")]
    rig.depths.jumped = ""
    on_depth("")
    assert new() == [("clear", "depth_refused", "depth")]
    rig.depths.refusals[CONTRADICTION] = 1
    on_depth("")
    on_depth("")
    told = ("alert", "depth_refused", "stands", "stands of the bit contradict each other")
    assert new() == [told]
    rig.depths.refusals[CONTRADICTION] = 3
    on_depth("")
    assert new() == [told]


def test_a_depth_that_is_silent_from_its_last_reading_or_from_the_first_tube_on(rig: Rig) -> None:
    assert rig.look(10.0 + 4.5) == []
    assert rig.look(math.nextafter(14.5, 15.0)) == []  # since tubes are known: 14.5 at first
    rig = Rig()
    assert rig.look(9.0) == []
    assert rig.look(13.5) == []
    assert rig.look(13.51) == [("hold", "depth_silent", "depth", "no reading comes")]
    rig.string.depth_heard_at = 13.4
    assert rig.look(13.52) == [("clear", "depth_silent", "depth")]
    rig = Rig()
    rig.string.depth_heard_at, rig.string.tubes = -math.inf, []
    assert rig.look(50.0) == []
    rig.string.tubes = [1]
    assert rig.look(60.0) == []
    assert rig.look(64.5) == []
    assert rig.look(64.6) == [("hold", "depth_silent", "depth", "not heard since the ground station started")]


def test_a_depth_that_contradicts_the_tally_or_the_surveys(rig: Rig) -> None:
    rig.misfit, rig.by_surveys = "off", "surveys"
    assert rig.look() == [("hold", "depth_contradicts", "depth", "off 5 [1, 2]")]
    rig.misfit = ""
    assert rig.look() == [("hold", "depth_contradicts", "depth", "surveys ('accepted', 4)")]
    rig.misfit, rig.by_surveys, rig.string.knows_tubes = "off", "", False
    assert rig.look() == [("clear", "depth_contradicts", "depth")]
    rig.string.knows_tubes, rig.string.bit = True, None
    assert rig.look() == []


def waiting(tube: int, sequence: int, at: float, epoch: int = 4) -> Any:
    return SimpleNamespace(message=SimpleNamespace(tube=tube, sequence=sequence, station_at=at, epoch=epoch))


def test_surveys_that_wait_for_a_depth_are_told_after_five_seconds(rig: Rig) -> None:
    rig.placement.waiting = [waiting(1, 3, 95.0), waiting(2, 4, 94.9), waiting(2, 5, 99.0, epoch=3)]
    assert rig.look() == [("hold", "survey_unplaced", "tube 2", "numbers 4, 5")]
    rig.placement.waiting = [waiting(2, k, 1.0) for k in range(20, 32)]
    assert rig.look() == [("hold", "survey_unplaced", "tube 2", "numbers " + ", ".join(str(k) for k in range(20, 30)))]
    rig.placement.waiting = [waiting(2, 40, 99.0, epoch=EPOCH_UNKNOWN)]
    assert rig.look() == [("clear", "survey_unplaced", "tube 2")]


def test_a_station_that_turns_back_and_a_stop_without_its_surveys(rig: Rig) -> None:
    rig.hole.turned_back = [12.344]
    told = "it points back up the hole: the hole is not known from there on"
    assert rig.look() == [("hold", "survey_refused", "station at 12.34 m", told)]
    rig.hole.turned_back = []
    ((verb, kind, _),) = rig.look()
    assert (verb, kind) == ("clear", "survey_refused")
    stand = SimpleNamespace(md=7.126, epoch=4, begun_at=61.4)
    rig.stops[:] = [
        SimpleNamespace(judged=True, missing={5, 3}, stand=stand),
        SimpleNamespace(judged=False, missing={1}, stand=SimpleNamespace(md=9.0, epoch=4, begun_at=80.0)),
    ]
    assert rig.look() == [("hold", "survey_missing", "stop at 7.13 m, 4/61 s", "tubes 3, 5")]
    rig.stops[0].missing = set()
    assert rig.look() == [("clear", "survey_missing", "stop at 7.13 m, 4/61 s")]
