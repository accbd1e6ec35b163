"""Benchmarks of rigs, campaigns and nodes by clocks that a test turns: whose time is which, and what is asked of it."""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bench_modules import Clock, bench

from node.kernels.arithmetic.formats import PERIOD
from sim.rig.stepper import Answer
from telemetry.messages import BASE, ENCODER
from telemetry.runtime.stepped import Due, DueEvent


@pytest.mark.parametrize("name", ["campaign", "inline"])
def test_a_row_says_how_many_times_faster_ours_is_and_what_is_asked(name: str) -> None:
    assert bench(name).beside(2.0, 5.0, at_most=3.0) == {
        "ours": 2.0, "peer": 5.0, "ratio": 2.5, "ours_to_peer": 0.4, "at_most": 3.0,
    }  # fmt: skip
    assert sorted(bench(name).beside(4.0, 1.0, at_least=0.5)) == ["at_least", "ours", "ours_to_peer", "peer", "ratio"]


def test_what_a_rig_spends_is_read_between_its_run_in_or_settling_and_its_end() -> None:
    inline, clock = bench("inline"), Clock("perf_counter")
    inline.time = clock.time
    spent, ended = [0.0], []
    meter = inline.Meter(lambda: spent[0], lambda: ended.append(clock.now))
    for k in range(360):
        clock.now, spent[0] = 50.0 + 0.5 * k + 0.001 * k * k, 2.0 * k + 0.01 * k * k
        meter.follow(SimpleNamespace(begin=1000.0, end=1350.0, rig_time=1000.0 + k))
    assert (meter.told, meter.length) == (360, 350.0)
    assert [mark.rig for mark in meter.marks] == [1020.0, 1120.0, 1340.0]
    assert ended == [pytest.approx(50.0 + 170.0 + 0.001 * 340**2)]
    assert meter.per_second() == pytest.approx((2.0 + 0.01 * (340 + 120), 0.5 + 0.001 * (340 + 120)))
    assert meter.per_second(with_start=True) == pytest.approx((2.0 + 0.01 * (340 + 20), 0.5 + 0.001 * (340 + 20)))


def test_cycles_of_tubes_and_what_would_be_on_the_bus_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    inline = bench("inline")
    answers = {1: Answer([("a", b"")] * 2, 1.0), ENCODER: Answer([("a", b"")], 1.0)}
    monkeypatch.setattr(inline.InProcessStepper, "round", lambda _self, _steps: answers)
    counting = inline.Counting({})
    steps = {
        1: [Due.CYCLE, Due.UPPER_FRAME, Due.TIMER], 2: [Due.CYCLE, Due.CYCLE], ENCODER: [Due.CYCLE, Due.LOWER_FRAME],
        BASE: [Due.DEPTH, Due.TIMER, Due.CYCLE],
    }  # fmt: skip
    events = {a: [(DueEvent(kind, 1.0, None), b"") for kind in kinds] for a, kinds in steps.items()}
    for turn in (1, 2):
        assert counting.round(events) is answers
        assert (counting.node_cycles, counting.puts) == (3 * turn, 6 * turn)


def test_costs_of_a_string_are_those_of_a_node_cycle() -> None:
    inline = bench("inline")

    def meter(cpu: float, wall: float, start: float) -> Any:
        return SimpleNamespace(
            per_second=lambda *, with_start=False: (start, wall) if with_start else (cpu, wall), length=400.0, told=50
        )

    inline.drilled_inline = lambda _s, _f: (meter(3.0, 9.0, 8.0), SimpleNamespace(node_cycles=2000, puts=350))
    inline.drilled_by_processes = lambda _s, _f: (meter(7.0, 0.5, 11.0), {"medium": 40.0, "1": 30.0, "2": 20.0})
    assert inline.cost(4) == {
        "cpu_s": 7.0 / 5.0, "with_start_cpu_s": 11.0 / 5.0, "inline_s": 3.0 / 5.0, "wall_s": 0.5, "inline_wall_s": 3.0,
        "messages": 0.2, "memory_mb": 22.5, "medium_mb": 10.0,
    }  # fmt: skip
    found = {tubes: dict.fromkeys(inline.cost(4), 0.0) for tubes in inline.TUBES}
    names = list(found[10])
    for tubes in (10, 100):
        found[tubes] = {name: tubes / 10.0 + k for k, name in enumerate(names)}
    inline.cost, inline.ctypes = found.__getitem__, SimpleNamespace(CDLL=lambda _n: SimpleNamespace(prctl=lambda *_: 0))
    digests = {"--inline": (6.0, "d"), "--endpoint": (9.0, "d")}
    inline.drilled = lambda *words: digests[words[0]]
    rows = list(inline.run()["ratios"].values())
    ours = [(row["ours"], row["peer"], row.get("at_most"), row.get("at_least")) for row in rows]
    at = {name: k for k, name in enumerate(names)}
    assert ours == [
        (6.0, 9.0, None, None), (10.0 + at["cpu_s"], 1.0 + at["cpu_s"], 1.3, None),
        (10.0 + at["with_start_cpu_s"], 1.0 + at["with_start_cpu_s"], None, None),
        (10.0 + at["inline_s"], 1.0 + at["inline_s"], None, None), (10.0 + at["wall_s"], 1.0, None, 2.0),
        (10.0 + at["inline_wall_s"], 1.0, None, 20.0),
    ]  # fmt: skip
    digests["--endpoint"] = (9.0, "e")
    with pytest.raises(RuntimeError, match="digests differ: inline d, processes e"):
        inline.run()


def test_a_campaign_is_timed_by_who_does_what() -> None:
    campaign, clock = bench("campaign"), Clock("thread_time", "perf_counter")
    campaign.time = clock.time
    assert campaign.spent(clock.taking(2.5)) == 2.5
    lots: Iterator[tuple[float, bytes]] = iter([(9.0, b"y")] * 2 + [(1.0, b"y"), (2.0, b"y")] * 11)

    class One:
        kernels = staticmethod(lambda *, is_drawn: next(lots) if is_drawn in (True, False) else None)
        whole = staticmethod(lambda: 3.0)
        with_columns = staticmethod(lambda: 4.0)

    assert campaign.node_cycles(One) == {"bare": 1.0, "drawn": 2.0, "whole": 3.0, "columns": 4.0}
    lots = iter([(1.0, b"y"), (1.0, b"z")])
    with pytest.raises(RuntimeError, match="another yaw over readings drawn before"):
        campaign.node_cycles(One)
    told: list[Any] = []

    def start(words: list[str], **how: Any) -> Any:
        told.append((words[3:], how))
        clock.now += 7.0
        return SimpleNamespace(stdout="2048\n")

    campaign.subprocess = SimpleNamespace(run=start)
    assert campaign.command_time(12) == (7.0, 2.0)
    (words, how) = told[0]
    assert words[1:8] == ["-m", "borechain", "campaign", "wellbore-1", "--runs", "12", "--json"]
    assert how["check"]
    campaign.OneRun, campaign.node_cycles = lambda _s: None, lambda _o: dict(zip(
        ("bare", "drawn", "whole", "columns"), (2.0, 3.0, 5.0, 1e-6), strict=True))  # fmt: skip
    campaign.pool_time, campaign.long_string = lambda _s, processes: 9.0 / processes, lambda: (0.5, 900.0)
    campaign.command_time = lambda runs: (runs / 50.0, runs / 10.0)
    result = campaign.run()
    rows = result["ratios"].values()
    assert [(row["ours"], row["peer"], row.get("at_most"), row.get("at_least")) for row in rows] == [
        (3.0, 2.0, 1.6, None), (5.0, 2.0, 3.0, None), (1e-6, 2.5e-6, None, 1.0), (4.5, 9.0, None, 1.8),
        (0.5, 900.0, None, 2000.0), (20.0, 60.0, None, 1.0),
    ]  # fmt: skip
    few = campaign.FEW
    assert result["memory_mb"] == {str(few): few / 10.0, "1000": 100.0}


def taken_in_turn(left: Iterator[float], *_given: object) -> float:
    return next(left)


def test_loops_around_a_step_count_what_it_says_and_an_address_must_save_half(monkeypatch: pytest.MonkeyPatch) -> None:
    by_address = bench("by_address")
    lots = [0, 3, -1, 1]
    seen: list[Any] = []

    def step(nodes: str, settings: str, parameters: str, reading: int, moment: int) -> int:
        seen.append((nodes, settings, parameters, reading, moment))
        return lots[moment]

    monkeypatch.setattr(by_address, "node_step", step)
    moments = np.arange(4)
    assert by_address.given_address(step, "n", "s", "p", moments * 10, moments) == 2
    assert by_address.holding_copy("n", "s", "p", moments * 10, moments) == 2
    assert seen == [("n", "s", "p", 10 * k, k) for k in range(4)] * 2
    by_address.warm_up, by_address.firmware_addresses = lambda: None, lambda: (1, 2)
    for peer, holds in ((6.0, True), (5.9, False)):
        by_address.compile_time = partial(taken_in_turn, iter((0.0, 3.0, peer)))
        if holds:
            assert by_address.run()["ratios"]["a loop around the step"] == {
                "ours": 3.0, "peer": 6.0, "ratio": 2.0, "slower": 0.5,
            }  # fmt: skip
        else:
            with pytest.raises(by_address.EnvironmentFault, match=r"expected 2 times faster to compile, got 1\.97"):
                by_address.run()


def test_a_node_is_timed_in_turn_with_its_peer_and_its_ratio_is_a_median() -> None:
    node, clock = bench("node"), Clock("thread_time")
    node.time, node.BLOCKS = clock.time, 5
    ours, peer = iter((9.0, 1.0, 2.0, 1.0, 4.0, 2.0)), iter((9.0, 3.0, 2.0, 4.0, 20.0, 6.0))
    row = node.alternating(lambda: next(ours), lambda: next(peer), 1.5)
    assert row == pytest.approx({
        "ours": 2.0, "peer": 4.0, "ratio": 3.0, "ratio_quartiles": pytest.approx([3.0, 4.0]), "ours_to_peer": 1.0 / 3.0,
        "ours_to_peer_quartiles": pytest.approx([0.25, 1.0 / 3.0]), "at_most": 1.5,
    })  # fmt: skip
    assert node.call_time(clock.taking(1.0, 2.0, 6.0), [(1, 2), (3, 4), (5, 6)]) == 3.0
    begin, end = node.phase_cycles(1, "stop", 4)
    first, last = node.phase_cycles(1, "drill", 4)
    assert end * PERIOD > begin * PERIOD >= last * PERIOD - PERIOD > first * PERIOD > 0.0


@pytest.mark.slow
def test_the_library_s_filter_turns_its_horizontal_errors_and_takes_a_yaw() -> None:
    filterpy = pytest.importorskip("filterpy.kalman")
    node = bench("node")
    config = node.default_config()
    lot = random.Random(3)
    P = np.diag([lot.uniform(1e-6, 1e-3) for _ in range(8)])
    begin = np.zeros(1, node.STATE)
    begin[0]["P"] = P
    stretch = SimpleNamespace(config=config, begin=begin, inputs=np.zeros(2, node.INPUT))
    stretch.inputs["rate"][0, 2], stretch.inputs["turn_rate"][0], stretch.inputs["yaw_var"][0] = 0.7, 0.6, 2e-5
    calls = node.FilterpyCalls(stretch, filterpy.ExtendedKalmanFilter(8, 1), 3)
    floor = float(config[0]["aiding_floor_var"])
    assert calls.arguments == [pytest.approx((0.7, 0.6, 2e-5 + floor)), pytest.approx((0.0, 0.0, floor))]
    calls.step(*calls.arguments[0])
    dt, settings = PERIOD / 3.0, config[0]
    F, fade = np.eye(8), np.exp(-dt / settings["bias_tau"])
    angle = 0.7 * dt
    F[:2, :2] = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    F[[0, 1, 2], [3, 4, 5]], F[2, 6] = -dt, -angle
    F[[3, 4, 5], [3, 4, 5]] = fade
    white, wander = settings["gyro_noise"] ** 2 * dt, (1.0 - fade**2) * settings["bias_std"] ** 2
    Q = np.diag([*np.broadcast_to(white, 3), *np.broadcast_to(wander, 3), 0.0, settings["stamp_walk"] ** 2 * dt])
    for _ in range(3):
        P = F @ P @ F.T + Q
    row = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.6]])
    gain = P @ row.T / (row @ P @ row.T + 2e-5 + floor)
    np.testing.assert_allclose(calls.ekf.P, P - gain @ row @ P, rtol=1e-9, atol=1e-15)
    assert statistics.median(calls.row[0]) == 0.0
    clock = Clock("thread_time")
    node.time = clock.time
    calls.step = clock.taking(1.0, 4.0)
    assert (calls.seconds(), clock.calls) == (2.5, 2)


@pytest.mark.slow
def test_the_callers_of_a_step_end_with_one_yaw() -> None:
    step = bench("step")
    step.TUBES, step.BLOCKS = 2, 1
    ratios = step.run()["ratios"]
    assert list(ratios) == ["node by node, from Python", "integers, node by node", "a string a call", "compiled loop"]
    assert ratios["node by node, from Python"]["ratio"] == 1.0
    peer = ratios["node by node, from Python"]["ours"]
    assert all((row["peer"], row["ratio"]) == (peer, peer / row["ours"]) for row in ratios.values())


def test_a_string_in_one_process_is_read_while_it_drills(tmp_path: Path) -> None:
    inline = bench("inline")
    told: list[Any] = []

    class Rig:
        stepper: Any = SimpleNamespace(builders={1: print})

        def __init__(self, *given: Any) -> None:
            told.append(given)

        def run(self, follow: Any) -> None:
            follow(SimpleNamespace(begin=0.0, end=60.0, rig_time=30.0))
            assert isinstance(self.stepper, inline.Counting)
            assert self.stepper.builders == {1: print}

        def close(self) -> None:
            told.append("closed")

    inline.InlineRig, inline.read_world, inline.settings_of = Rig, lambda job: job.scenario.name, lambda *_: {"a": 1}
    meter, counting = inline.drilled_inline(tmp_path / "s.toml", tmp_path / "run")
    assert (meter.told, meter.length, len(meter.marks)) == (1, 60.0, 1)
    assert isinstance(counting, inline.Counting)
    assert told == [("s.toml", {"a": 1}, "rig-1", tmp_path / "run"), "closed"]
    assert (tmp_path / "run").is_dir()
