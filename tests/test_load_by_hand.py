"""What loads and benches of a ground station tell it, count and read, by hand: a second table beside each module."""

from __future__ import annotations

import contextlib
import itertools
import math
import random
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.stats import binom

from borechain.load import day, learning, placing_calls, realtime_string, rounds
from borechain.load.crowd import Crowd, state_of, survey_of
from borechain.load.patience import wait_for
from groundstation.service.disk.ground_store import Store
from node.errors import SensorError
from node.process.node_host import run_encoder, run_node
from sim.errors import RigError
from telemetry.messages import BASE, ENCODER, NodeFlag, NodeMode, Severity, Side
from telemetry.presentation.msgpack_codec import decode_message

# a string that speaks


def test_a_state_of_the_crowd_field_by_field() -> None:
    state = state_of(3, 5, 7.5)
    told = {
        "tube": 3, "at": 7.5, "hops": 5, "mode": NodeMode.TRACKING, "yaw": 1.0, "yaw_var": 1e-6,
        "systematic_var": 1e-6, "gyro_bias": (0.0, 0.0, 0.0), "scale_factor": 0.0, "innovation": 0.0,
        "innovation_var": 1e-6, "aiding_age": 0.1, "clock_var": 1e-8, "flags": NodeFlag.NONE, "cycles": 5,
        "overruns": 0,
    }  # fmt: skip
    assert {name: getattr(state, name) for name in told} == told


def test_surveys_of_the_crowd_lean_north_by_their_own_draw_of_half_the_noise_they_state() -> None:
    survey = survey_of(4, 6, 9.0, 2)
    told = {
        "tube": 4, "sequence": 6, "station_at": 9.0, "hops": 2, "yaw": 0.0, "yaw_var": 1e-8, "systematic_var": 1e-8,
        "samples": 32, "settle_time": 5.0, "flags": NodeFlag.NONE,
    }  # fmt: skip
    assert {name: getattr(survey, name) for name in told} == told
    var = 0.0034**2 / 32.0
    assert survey.imus[0].force_cov == ((var, 0.0, 0.0), (0.0, var, 0.0), (0.0, 0.0, var))
    draw = random.Random(4 * 2**32 + 6)
    lean = math.radians(0.3)
    quiet = np.array([9.81 * math.sin(lean), 0.0, -9.81 * math.cos(lean)])
    drawn = [0.5 * math.sqrt(var) * draw.gauss(0.0, 1.0) for _ in range(3)]
    assert survey.imus[0].force == pytest.approx(tuple(quiet + drawn), abs=1e-12)
    forces = {survey_of(tube, number, 0.0, 1).imus[0].force for tube in range(1, 21) for number in range(1, 21)}
    assert len(forces) == 400
    assert np.std(np.array(list(forces)) - quiet, axis=0) == pytest.approx([0.5 * math.sqrt(var)] * 3, rel=0.15)


class Bus:
    """A bus on which depths are kept in their order."""

    def __init__(self) -> None:
        self.told: list[tuple[str, Any]] = []

    def publisher(self, key: str) -> Any:
        return SimpleNamespace(put=lambda payload: self.told.append((key, decode_message(payload))))


def told_crowd(tubes: int, speed: float) -> tuple[Crowd, Bus, list[Any], list[Any]]:
    bus, states, handed = Bus(), list[Any](), list[Any]()
    string = Crowd(tubes, bus, "r", speed)  # type: ignore[arg-type]
    string.endpoint.send_state = lambda *given: states.append(given)  # type: ignore[method-assign]
    string.endpoint.mail.submit = lambda *given: handed.append(given)  # type: ignore[method-assign]
    return string, bus, states, handed


def test_a_crowd_speaks_in_turn_drills_by_rounds_and_surveys_once_in_each() -> None:
    """Eight tubes of 2 m: from 6 m on 0.01 m/s for 80 s of every 120 s, surveyed 22 s after; a cycle is 0.5 s."""
    string, bus, states, handed = told_crowd(8, 0.01)
    assert (string.endpoint.address, string.endpoint.clock.is_root, string.surveys, string.events) == (
        ENCODER,
        True,
        0,
        0,
    )
    times = [1000.0 + 0.5 * k for k in range(560)]
    for now in times:
        string.on_cycle(None, now)
    assert [(state.tube, state.hops, state.at, now) for state, now in states] == [
        (8 - k % 8, 1 + k % 8, now, now) for k, now in enumerate(times)
    ]
    read = [(k, now) for k, now in enumerate(times) if (k + 1) % 4 == 0]
    assert [key for key, _ in bus.told] == ["borechain/r/surface/depth"] * len(read)
    for (_, message), (_, now) in zip(bus.told, read, strict=True):
        whole, into = divmod(now - 1000.0, 120.0)
        assert message.at == now
        assert message.md == pytest.approx(6.0 + 0.01 * (80.0 * whole + min(into, 80.0)))
    assert [(s.tube, s.sequence, s.hops, s.station_at, now) for s, now in handed] == [
        (tube, number + 1, 9 - tube, at, at) for number, at in ((0, 1102.0), (1, 1222.0)) for tube in range(1, 9)
    ]
    assert string.surveys == 16


@pytest.mark.parametrize(("tubes", "speed", "first"), [(3, 0.0, None), (3, 0.1, 0.0), (6, 0.1, 2.0)])
def test_a_crowd_that_does_not_drill_tells_no_depth_and_a_short_one_starts_at_the_collar(
    tubes: int, speed: float, first: float | None
) -> None:
    string, bus, states, handed = told_crowd(tubes, speed)
    for _ in range(12):
        string.on_cycle(None, 50.0)
    assert len(states) == 12
    assert not handed
    assert {message.md for _, message in bus.told} == (set() if first is None else {first})


def test_what_happened_is_receipted_once_it_has_left_the_outbox() -> None:
    string = Crowd(2, Bus(), "r")  # type: ignore[arg-type]
    for k in range(3):
        string.happen(5.0 + k)
        assert (string.events, string.receipted, string.endpoint.mail.outbox_size) == (k + 1, 0, k + 1)
    string, _, _, handed = told_crowd(2, 0.0)
    string.happen(5.0)
    string.happen(6.0)
    assert [(*msgspec.structs.astuple(event)[:5], now) for event, now in handed] == [
        (ENCODER, number, now, Severity.INFO, "stopped", now) for number, now in ((1, 5.0), (2, 6.0))
    ]
    assert string.receipted == 2


# hours of it in a database


def test_a_day_is_written_stop_by_stop(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'g.sqlite'}"
    count = day.write_day(url, 5, 6)
    depths = [4.0 + 0.25 * (stop * 32 // 5) for stop in range(5)]
    begins = [1080.0 + 120.0 * stop for stop in range(5)]
    inside = [[tube for tube in range(1, 7) if 2.0 * (tube - 1) < md] for md in depths]
    with contextlib.closing(Store(url)) as store:
        assert (store.epoch(), store.tally()) == (1, [6, 5, 4, 3, 2, 1])
        assert [msgspec.structs.astuple(stand) for stand in store.stands()] == [
            (1, begin, begin + 40.0, md) for begin, md in zip(begins, depths, strict=True)
        ]
        kept = [(one.message, one.md, one.below) for one in store.messages()]
    wanted = [
        (tube, stop + 1, begins[stop] + 22.0, 7 - tube, 1, depths[stop] - 2.0 * (tube - 1), 2.0 * (tube - 1))
        for stop in range(5)
        for tube in inside[stop]
    ]
    assert [(m.tube, m.sequence, m.station_at, m.hops, m.epoch, md, below) for m, md, below in kept] == wanted  # type: ignore[union-attr]
    assert count == len(wanted)
    assert all(m.imus == survey_of(m.tube, m.sequence, 0.0, 1).imus for m, _, _ in kept)  # type: ignore[union-attr]


@pytest.mark.parametrize(("md", "tubes"), [(0.0, 0), (0.01, 1), (2.0, 1), (2.01, 2), (5.9, 3), (99.0, 4)])
def test_a_tube_is_surveyed_once_its_node_is_below_the_collar(md: float, tubes: int) -> None:
    assert [survey.tube for survey in day.surveys_at(4, md, 3, 8.0)] == list(range(1, tubes + 1))
    assert day.depth_of(3, 0) == 2.0
    assert day.depth_of(50, 3) == pytest.approx(92.75)


# a string in real time, rounds, patience


def test_a_string_in_real_time_is_a_chain_of_processes_each_with_its_recording(tmp_path: Path) -> None:
    world, table = realtime_string.prepare_processes(3, 2.0, "tcp/h:1", tmp_path, 5)
    assert list(table.specs) == ["encoder", "3", "2", "1"]
    chain = [BASE, ENCODER, 3, 2, 1, None]
    for k, (name, spec) in enumerate(table.specs.items(), 1):
        place, *_, own = spec.arguments
        assert spec.target is (run_encoder if name == "encoder" else run_node)
        assert (place.rig, place.endpoint, place.folder) == ("realtime", "tcp/h:1", tmp_path / name)
        upper, address, lower = chain[k - 1 : k + 2]
        assert own.neighbours == {Side.UPPER: upper} | ({} if lower is None else {Side.LOWER: lower})
        assert own.offset == pytest.approx(world.local_clock(address, world.begin) - world.begin)  # type: ignore[arg-type]
    (recorded,) = table.specs["2"].arguments[2]
    assert table.specs["2"].arguments[1] == world.tube_settings(2)
    with pytest.raises(SensorError, match=f"^{tmp_path}/tube-2.npy: not started$"):
        recorded.read(1.0, 2.0)
    with pytest.raises(SensorError, match=f"^{tmp_path}/encoder.npy: not started$"):
        table.specs["encoder"].arguments[1].read(1.0)
    rest = 0.25 * 3 + 0.5 * 2.0
    assert world.end - world.begin >= rest + 2.0 + 120.0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["encoder.npy", "tube-1.npy", "tube-2.npy", "tube-3.npy"]


@pytest.mark.parametrize("count", [1, 2, 5, 6, 8, 9, 11, 12, 15, 17, 20, 40, 101])
def test_the_interval_of_a_median_holds_it_in_95_of_a_hundred_and_no_narrower_one_does(count: int) -> None:
    def outside(left_out: int) -> float:
        return 2.0 * float(binom.cdf(left_out, count, 0.5))  # so many values at most lie on one side of the median

    left_out = rounds.below_interval(count)
    assert 0 <= left_out <= (count - 1) // 2
    if left_out:
        assert outside(left_out) <= 0.05
    if left_out < (count - 1) // 2:
        assert outside(left_out + 1) > 0.05


def test_a_row_of_rounds_by_hand() -> None:
    """Nine ratios 1..9: of nine the interval leaves out one at either end."""
    peer = [2.0, 1.0, 0.5, 4.0, 1.0, 2.0, 5.0, 1.0, 3.0]
    ratios = [3.0, 9.0, 1.0, 7.0, 5.0, 2.0, 8.0, 4.0, 6.0]
    row = rounds.compare_rounds([r * p for r, p in zip(ratios, peer, strict=True)], peer)
    assert row == {
        "ours": pytest.approx(6.0), "peer": 2.0, "ratio": pytest.approx(0.2), "slower": pytest.approx(5.0),
        "slower_interval": pytest.approx([2.0, 8.0]),
    }  # fmt: skip


def test_patience_asks_again_and_ends_with_its_words() -> None:
    looks = itertools.count()
    assert wait_for(lambda: found if (found := next(looks)) >= 3 else None, "x", 30.0, 0.0) == 3
    assert wait_for(lambda: 0, "x", 30.0, 0.0) == 0  # nothing but None is nothing yet
    with pytest.raises(RigError, match=r"^no tube has come within 0 s$"):
        wait_for(lambda: None, "no tube has come", 0.01, 0.001)


# what is timed and counted


@pytest.mark.parametrize(
    ("what", "unit", "scale", "bound"),
    [
        (learning.STARTED, "s", 1.0, 2.0), (learning.AGAIN, "s", 1.0, 2.0), (learning.TOGETHER, "ms", 1e3, 1.0),
        (learning.ALONE, "ms", 1e3, 1.0), (learning.ARRIVAL, "ms", 1e3, 20.0), (learning.FEW_ARRIVAL, "ms", 1e3, 5.0),
        ("verdict", "ms", 1e3, 20.0),
    ],
)  # fmt: skip
def test_a_timing_is_told_in_its_unit_beside_its_bound(what: str, unit: str, scale: float, bound: float) -> None:
    figure = learning.timing_figure(what, [0.001 * k for k in (101, *range(1, 101))])
    row: dict[str, Any] = {
        "what": what,
        "unit": unit,
        "p50": 0.051,
        "p99": 0.1,
        "max": 0.101,
        "count": 101,
        "bound": bound,
    }
    assert figure.row == {
        name: pytest.approx(value * scale) if name in ("p50", "p99", "max") else value for name, value in row.items()
    } | {"holds": 0.1 * scale <= bound}


def test_bytes_of_a_survey_are_those_of_all_files_by_their_number(tmp_path: Path) -> None:
    config: Any = SimpleNamespace(url=f"sqlite:///{tmp_path / 'g.sqlite'}", folder=tmp_path)
    (tmp_path / "more").write_bytes(bytes(80_000))
    found = learning.bytes_of_a_survey(config, 2, 3)
    count = sum(2.0 * (tube - 1) < md for md in (2.0, 6.0) for tube in (1, 2, 3))
    assert found == pytest.approx(sum(path.stat().st_size for path in tmp_path.iterdir()) / count)


def test_calls_of_the_ground_station_alone_are_counted_and_the_profile_of_before_is_back() -> None:
    calls = compile("def ours(): return theirs()\ndef theirs(): return 1", placing_calls.OURS + "/x.py", "exec")
    clock = compile("def ours(): return 1", placing_calls.CLOCKS + "/x.py", "exec")
    space: dict[str, Any] = {}
    exec(calls, space)
    own, tape = space["ours"], dict[str, Any]()
    exec(clock, tape)
    before = sys.getprofile()
    assert placing_calls._count_calls(own) == 2
    assert placing_calls._count_calls(tape["ours"]) == 0
    assert placing_calls._count_calls(lambda: None) == 0
    assert sys.getprofile() is before
    assert Path(placing_calls.OURS).is_dir()
