"""Benchmarks by clocks that a test turns: whose time is which, what is a round, and what each pair does."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bench_modules import Clock, bench

from groundstation.survey.tools.formulas import parse_formula
from groundstation.survey.wall.wall_file import read_wall
from telemetry.messages import Side
from telemetry.presentation.msgpack_codec import decode_message, encode_message


def test_a_survey_is_timed_by_the_median_of_its_calls_and_a_ratio_by_that_of_its_blocks() -> None:
    survey, clock = bench("survey"), Clock("perf_counter")
    survey.time = clock.time
    assert survey.median_time(clock.taking(100.0, 1.0, 7.0, 3.0), 3) == 3.0
    assert clock.calls == 4
    survey.BLOCKS = 3
    ours = clock.taking(9.0, 1.0, 9.0, 2.0, 9.0, 4.0)  # one warms up in each block
    peer = clock.taking(9.0, 6.0, 9.0, 4.0, 9.0, 12.0)
    assert survey.compare(ours, peer, 1) == {"ours": 2.0, "peer": 6.0, "ratio": 3.0, "ratio_min": 2.0, "ratio_max": 6.0}
    row = survey.alternating(clock.taking(100.0, *[2.0] * 8), clock.taking(100.0, *[5.0] * 8))
    assert row == {"ours": 2.0, "peer": 5.0, "ratio": 2.5}
    run: list[Any] = []

    def start(command: list[str], *, check: bool) -> None:
        run.append((command[1:], check))
        clock.now += 4.0 if command[-1] == "import x.y" else 1.5

    survey.subprocess = SimpleNamespace(run=start)
    assert survey.import_time("x.y") == 2.5
    assert run == [*[(["-c", "pass"], True)] * 5, *[(["-c", "import x.y"], True)] * 5]
    md, inclination, azimuth = survey.well()
    assert [(one[0], one[-1], len(one)) for one in (md, inclination, azimuth)] == [
        (0.0, 5000.0, 1000), (0.0, math.pi / 2.0, 1000), (0.2, 2.0, 1000),
    ]  # fmt: skip


def test_wells_of_a_batch_cost_a_part_of_it_each_and_one_station_is_appended_after_the_other() -> None:
    survey = bench("survey")
    survey.WELLS, survey.WELL_STATIONS = 40, 3
    done: list[Any] = []

    def compare(ours: Any, peer: Any) -> dict[str, float]:
        ours(), peer()
        return {"ours": 8.0, "peer": 3.0, "ratio": 0.375, "ratio_min": 0.25, "ratio_max": 0.5}

    survey.compare = compare
    survey.locate_many = lambda method, found, tool, site: done.append((method, found, tool, site))

    def analyse(record: Any, *given: Any) -> Any:
        done.append((record, given))
        return SimpleNamespace(uncertainty=SimpleNamespace(cov=0))

    survey.analyse_survey = analyse
    assert survey.batch("tool", "site") == {
        "ours": 0.2,
        "peer": 3.0,
        "ratio": 15.0,
        "ratio_min": 10.0,
        "ratio_max": 20.0,
    }
    (method, many, *given), (alone, given_alone) = done
    assert tuple(given) == ("tool", "site")
    assert given_alone == (method, "tool", "site")
    assert many.md.shape == (40, 3)
    assert many.md[7].tolist() == [0.0, 2.0, 4.0]
    assert np.degrees([many.inclination.min(), many.inclination.max()]) == pytest.approx([0.6, 5.7], abs=0.3)
    assert np.ptp(many.azimuth) > 5.5
    np.testing.assert_array_equal(alone.md, many.md[0])
    np.testing.assert_array_equal(alone.inclination, many.inclination[0])
    np.testing.assert_array_equal(alone.azimuth, many.azimuth[0])
    survey.STATIONS, clock = 6, Clock("perf_counter")
    survey.time = clock.time
    appended: list[Any] = []

    class Appended:
        def append(self, md: float, direction: Any) -> None:
            appended.append((md, direction))
            clock.now += len(appended)

    survey.Trajectory = Appended
    assert survey.append_time() == 3.0
    assert [md for md, _ in appended] == pytest.approx([1000.0, 2000.0, 3000.0, 4000.0, 5000.0])
    for (_, direction), inclination, azimuth in zip(
        appended, np.linspace(0.0, math.pi / 2.0, 6)[1:], np.linspace(0.2, 2.0, 6)[1:], strict=True
    ):
        wanted = math.sin(inclination) * np.array([math.cos(azimuth), math.sin(azimuth)])
        np.testing.assert_allclose(direction.lean, wanted)
        assert direction.shared.shape == (2, 250)
        np.testing.assert_allclose(direction.cov, 1e-8 * np.eye(2))


def test_code_that_writes_code_is_timed_by_rounds_of_a_hundredth_of_a_second() -> None:
    codec, clock = bench("codec"), Clock("thread_time")
    codec.time = clock.time
    assert codec.seconds(clock.taking(1.0, 2.0), 4) == 1.5
    clock.calls = 0
    counts: list[int] = []
    timed = codec.seconds

    def seconds(act: Callable[[], object], count: int) -> float:
        counts.append(count)
        return float(timed(act, count))

    codec.seconds = seconds
    row = codec.timed(clock.taking(0.004), clock.taking(0.02))
    assert counts == [1, 1, *[3, 1] * 15]
    assert row == {
        "ours": pytest.approx(0.004), "peer": pytest.approx(0.02), "ratio": pytest.approx(5.0),
        "slower": pytest.approx(0.2), "slower_interval": pytest.approx([0.2, 0.2]),
    }  # fmt: skip


@pytest.mark.parametrize(("ratios", "status", "told"), [((2.0, 9.0), 0, []), ((1.99, 2.0, 0.1), 1, ["a", "c"])])
def test_what_is_not_twice_as_fast_is_named(
    ratios: tuple[float, ...], status: int, told: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    codec = bench("codec")
    result = {"ratios": {name: {"ratio": ratio} for name, ratio in zip("abc", ratios, strict=False)}}
    codec.run = lambda: result
    assert codec.main() == status
    out, err = capsys.readouterr()
    assert json.loads(out) == result
    assert err.splitlines() == [f"{name}: expected to be 2 times as fast as the plain way" for name in told]


def test_the_plain_way_of_a_codec_checks_each_field_and_says_the_same() -> None:
    codec = bench("codec")
    payload = encode_message(codec.STATE)
    assert codec.encode_by_hand(codec.STATE) == payload
    assert codec.decode_by_hand(payload) == codec.STATE == decode_message(payload)
    with pytest.raises(ValueError, match="expected a node state"):
        codec.decode_by_hand(encode_message(codec.AIDING))
    assert set(codec.can_pairs()) == {"CAN signals packed", "CAN signals unpacked"}
    packed, by_signal = codec.can_pairs()["CAN signals packed"]
    assert packed() == by_signal()
    assert len(packed()) == 4
    ours, usual = codec.frozen_pair()
    assert ours() == codec.STATE
    assert [getattr(usual(), name) for name in codec.STATE.__struct_fields__] == [
        getattr(codec.STATE, name) for name in codec.STATE.__struct_fields__
    ]


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("2 + x*3 - y/4", 2.0 + 21.0 - 0.125), ("-x^2", -49.0), ("sqrt(x + 2) * sqr(y)", 3.0 * 0.25),
        ("sin(y) / cos(y)", math.tan(0.5)),
    ],
)  # fmt: skip
def test_a_formula_that_is_walked_has_its_value(formula: str, value: float) -> None:
    codec = bench("codec")
    tree = parse_formula(formula.replace("x", "md").replace("y", "inc"))
    known = {codec.normalise_name("md"): np.float64(7.0), codec.normalise_name("inc"): np.float64(0.5)}
    assert codec.walked(tree, known) == pytest.approx(value)


def test_the_best_round_counts_of_a_seal_that_is_made_and_judged() -> None:
    seals, clock = bench("seals"), Clock("perf_counter")
    seals.time, seals.ROUNDS, seals.TIMES = clock.time, 3, 2
    assert seals.best(clock.taking(5.0, 3.0, 2.0, 1.0, 9.0, 9.0)) == 1.5
    assert clock.calls == 6
    lots = iter((4.0, 6.0, 0.5, 2.0))
    seals.best = lambda _act: next(lots)
    assert seals.both(lambda: 1, lambda: 2, seals.AIDING) == {"ours": 10.0, "peer": 2.5, "ratio": 0.25}
    lots = iter((4.0, 6.0))
    ends = SimpleNamespace(joints={Side.LOWER: "a", Side.UPPER: "b"})
    seals.joined = lambda one, other: (SimpleNamespace(close=(one, other).index), SimpleNamespace(open=None))
    assert seals.frames(ends, ends) == {"ours": 6.0, "peer": 4.0, "ratio": 4.0 / 6.0}


@pytest.mark.slow
def test_seals_of_every_kind_are_made_and_judged() -> None:
    """Each kind's content is believed at the other end, or the benchmark refuses."""
    seals = bench("seals")
    seals.ROUNDS, seals.TIMES = 1, 2
    result = seals.run()
    kinds = [type(message).__name__ for message in (*seals.UP, *seals.DOWN)]
    assert list(result["ratios"]) == [*kinds, "Aiding", "DepthReading", "frame of 300 bytes"]
    assert all(row["ratio"] == pytest.approx(row["peer"] / row["ours"]) for row in result["ratios"].values())
    assert sorted(result["decode_verify_us"]) == ["Aiding", "Hello", "NodeState", "TimeReply", "TimeRequest"]


def test_the_time_of_an_exchange_is_the_median_of_its_calls() -> None:
    can, clock = bench("can"), Clock("perf_counter")
    can.time = clock.time
    assert can.seconds_of(clock.taking(5.0, 1.0, 2.0), 3) == 2.0
    upper, lower = can.ends("r")
    assert (lower.rig, lower.address, lower.side, upper.side) == ("r", 1, Side.UPPER, Side.LOWER)
    assert can.joint(77, "tunnel") == (f"can:77,interface={can.INTERFACE},profile=tunnel", "tunnel")
    frame = can.frame_of(9, 3)
    assert tuple(frame.content.header) == (3, can.HEADER.epoch, 9, *can.HEADER[3:])
    assert [number for number, _ in frame.content.entries] == [0]
    assert can.holds_aiding(frame.content)
    assert not can.holds_aiding(can.LinkFrame(frame.content.header, []))
    assert can.holds_aiding(bytes(can.AIDING_BYTES + 1))
    assert not can.holds_aiding(bytes(can.AIDING_BYTES))
    can.ours_isotp()
    can.their_isotp()()
    can.DECODED = 1
    assert set(can.decode_times().values()) == {0.0}  # the clock stands
    for traffic in can.steady_traffic(1):
        native = can.NATIVE[can.SPEC_OF[type(traffic.message)].kind]
        data = native.fd.pack(native.raws_of(traffic.message), 1)
        assert type(can.decoded(native, data)) is type(traffic.message)


def test_a_wall_of_columns_each_of_which_leans_its_own_way(tmp_path: Path) -> None:
    wall = bench("wall")
    file = wall.write(tmp_path, 3, (0.025, 0.05))
    read = file.read_text().splitlines()
    assert read == [
        "radius_m = 0.6", "thickness_m = 0.8", "spacing_m = 0.75", "head_sigma_m = 0.02", 'heads = "heads.csv"',
        'stations = "stations.csv"',
    ]  # fmt: skip
    assert (tmp_path / "heads.csv").read_text().splitlines() == [
        "column,north_m,east_m", "K0,0,0.00", "K1,0,0.75", "K2,0,1.50",
    ]  # fmt: skip
    head, *rows = ((tmp_path / "stations.csv").read_text()).splitlines()
    assert head == "column,md_m,inclination_deg,azimuth_deg"
    stations = [
        (name, int(md), float(lean), float(towards)) for name, md, lean, towards in (r.split(",") for r in rows)
    ]
    assert [(name, md) for name, md, _, _ in stations] == [(f"K{k}", md) for k in range(3) for md in range(0, 31, 2)]
    assert all(0.025 <= lean <= 0.05 and 0.0 <= towards <= 360.0 for _, _, lean, towards in stations)
    assert len({(lean, towards) for _, _, lean, towards in stations}) == 3
    assert read_wall(file) is not None
    wall.judged = lambda _file: (2.0, 31.4)
    wall.COUNTS = (2, 3)
    rows_by_name = wall.run()["ratios"]
    assert rows_by_name["2 columns, all doubtful: 31 MB"] == {
        "ours": 2.0,
        "peer": None,
        "ratio": None,
        "memory_mb": 31.4,
    }


class EchoPort:
    """A port whose other end answers from the ``deaf``-th frame on, at once."""

    def __init__(self, module: Any, deaf: int) -> None:
        self.module, self.deaf, self.sent = module, deaf, list[int]()

    def listen(self, call: Any) -> None:
        self.call = call

    def send(self, frame: Any) -> None:
        self.sent.append(frame.content.header.number)
        bare = self.module.LinkFrame(frame.content.header, [])
        self.call(bare if len(self.sent) <= self.deaf else frame.content)


@pytest.mark.parametrize("deaf", [0, 2])
def test_frames_go_there_and_back_one_after_the_other(deaf: int) -> None:
    can = bench("can")
    can.TURN = can.PATIENCE = 0.001
    port = EchoPort(can, deaf)
    pinger = can.Pinger(port)
    pinger.meet()
    assert port.sent == list(range(1, deaf + 2))
    pinger.exchange(4)
    assert port.sent == list(range(1, deaf + 6))
    port.deaf = 10**6
    for act in (pinger.meet, lambda: pinger.exchange(1)):
        with pytest.raises(RuntimeError, match=r"^no answer$"):
            act()
    assert len(port.sent) == deaf + 5 + can.TRIES + 1
