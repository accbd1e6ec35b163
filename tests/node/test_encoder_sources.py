"""Encoders of the kernel's counter subsystem and of two GPIO lines: the same yaw as by a record, and their proofs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from emulated_encoders import EmulatedCounter, EmulatedLines, turning

from node.errors import NodeConfigurationError, SensorError
from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.process.drivers.choice import encoder_source
from node.process.drivers.gpio_encoder import GpioEncoder
from node.process.drivers.gpio_lines import GET_LINES, GET_VALUES, ChipLines
from node.process.drivers.quadrature import QuadratureFile, counter_file
from node.process.drivers.replay_drivers import ReplayEncoder
from node.process.drivers.source import EncoderSource, SafeEncoder
from telemetry.messages import Aiding, Severity

PERIOD = 0.526
START = 5000.0
COUNT_DEG = 360.0 / 4096.0


class Told:
    """An encoder in use, and what it told."""

    def __init__(self, source: EncoderSource) -> None:
        source.start()
        self.events: list[tuple[str, str]] = []
        self.detail = ""
        self.safe = SafeEncoder(source, self._say)
        self.now = START

    def _say(self, _severity: Severity, code: str, arguments: dict) -> None:
        self.events.append((code, str(arguments.get("cause", ""))))
        self.detail = str(arguments.get("detail", self.detail))

    def read(self) -> EncoderSample | None:
        self.now += PERIOD
        return self.safe.read(self.now)


def edge_times(count_at, until: float) -> dict[int, float]:
    """Time of the edge that begins each count, of a head that turns forward."""
    fine = np.linspace(0.0, until, 400_001)
    counts = np.array([count_at(t) for t in fine])
    last = math.floor(counts[-1] - 1e-9)
    return dict(zip(range(1, last + 1), START + np.interp(np.arange(1, last + 1), counts, fine), strict=True))


def test_lines_give_the_same_yaw_as_a_record_of_their_edges(tmp_path: Path) -> None:
    count_at = turning(1.2, 14.0, 2.0)
    times = edge_times(count_at, 14.0)
    lines = EmulatedLines()
    source = GpioEncoder(lines.connect, lines.lines)
    source.start()
    live, rows = EncoderNode(), []
    aidings: list[Aiding] = []
    for k in range(36):
        end = START + (k + 1) * PERIOD
        passed = [n for n, at in times.items() if at <= end]
        lines.turn(times.__getitem__, max(passed, default=0))
        sample = source.read(end)
        aidings.append(live.on_cycle(sample, end))
        newest = [times[n] for n in sorted(passed, reverse=True)[:12]] or [0.0]
        rows.append([end, len(passed), newest[0], 1, *newest[1:], *[newest[-1]] * (12 - len(newest))])
    np.save(tmp_path / "counter.npy", rows)
    replay, again = ReplayEncoder(tmp_path / "counter.npy"), EncoderNode()
    replay.start()
    for k, aiding in enumerate(aidings):
        end = START + (k + 1) * PERIOD
        other = again.on_cycle(replay.read(end), end)
        apart = math.degrees(math.remainder(aiding.yaw - other.yaw, 2.0 * math.pi))
        assert abs(apart) < 0.01
        assert aiding.yaw_var == pytest.approx(other.yaw_var, rel=1e-3)
    turned = count_at(99.0) * COUNT_DEG % 360.0
    assert math.degrees(aidings[-1].yaw) == pytest.approx(
        turned, abs=3.0 * math.degrees(math.sqrt(aidings[-1].yaw_var))
    )
    assert math.degrees(math.sqrt(aidings[-1].yaw_var)) < 0.02  # the stop was placed inside its count


def test_lines_are_followed_back_and_forth_to_the_last_count() -> None:
    lines = EmulatedLines()
    told = Told(GpioEncoder(lines.connect, lines.lines))
    clock, total = [START], 0
    for step in (10, -25, 3, 4000, -1, 1, -1, 0, -5000):
        total += step

        def tick(_: int) -> float:
            clock[0] += 1e-5
            return clock[0]

        lines.turn(tick, total)
        sample = told.read()
        assert sample is not None
        assert sample.count == total
        if step:
            assert sample.rising == (step > 0)
            assert len(sample.earlier) == min(abs(step), 12) - 1
            assert sample.edge_at == pytest.approx(clock[0], abs=1e-8)
    assert told.events == []


@pytest.mark.parametrize("exchanged", [1, -1])
def test_a_counter_is_read_in_the_middle_of_its_count_and_its_levels_prove_it(tmp_path: Path, exchanged: int) -> None:
    counter = EmulatedCounter(tmp_path, begin=7, step=exchanged)
    told = Told(QuadratureFile(counter_file("/dev/counter0", tmp_path)))
    node, count_at = EncoderNode(), turning(1.2, 14.0, 2.0)
    for k in range(36):
        now = (k + 1) * PERIOD
        counter.turn_to(7 + math.floor(count_at(now)))
        sample = told.read()
        assert sample is not None
        assert sample.count == math.floor(count_at(now))
        aiding = node.on_cycle(sample, told.now)
        apart = math.remainder(aiding.yaw - math.radians(count_at(now) * COUNT_DEG), 2.0 * math.pi)
        assert abs(math.degrees(apart)) <= COUNT_DEG
    assert told.events == []


def test_a_counter_gives_the_same_yaw_as_a_record_of_its_counts(tmp_path: Path) -> None:
    """Forward, to rest, back: turning and resting the yaw of the device is that of ``time, count`` replayed."""
    counter = EmulatedCounter(tmp_path, begin=(1 << 32) - 5)  # it wraps on the way
    source = QuadratureFile(counter_file("/dev/counter0", tmp_path))
    source.start()
    live, aidings, rows = EncoderNode(), [], []
    forward = turning(1.2, 14.0, 2.0)
    for k in range(60):
        end = START + (k + 1) * PERIOD
        count = math.floor(forward((k + 1) * PERIOD) - 700.0 * max(k - 40, 0))
        counter.turn_to((1 << 32) - 5 + count)
        aidings.append(live.on_cycle(source.read(end), end))
        rows.append([end, count])
    np.save(tmp_path / "counts.npy", np.array(rows, dtype=np.float64))
    replay, again = encoder_source(f"replay:{tmp_path / 'counts.npy'}"), EncoderNode()
    replay.start()
    for k, aiding in enumerate(aidings):
        other = again.on_cycle(replay.read(START + (k + 1) * PERIOD), START + (k + 1) * PERIOD)
        assert abs(math.degrees(math.remainder(aiding.yaw - other.yaw, 2.0 * math.pi))) < 0.01, k
        assert (aiding.yaw_var, aiding.rate, aiding.sequence) == pytest.approx(
            (other.yaw_var, other.rate, other.sequence)
        )
    assert min(count for _, count in rows) < 0 < max(count for _, count in rows)


def test_counts_alone_that_are_none_are_named_by_their_row(tmp_path: Path) -> None:
    (tmp_path / "counts.csv").write_text("time,count\n0,5\n0.5,nan\n1,6\n")
    source = encoder_source(f"replay:{tmp_path / 'counts.csv'}")
    source.start()
    assert source.read(START).count == 5
    with pytest.raises(SensorError, match=r"counts\.csv: row 2: expected a count, got nan"):
        source.read(START + PERIOD)
    assert source.read(START + 2.0 * PERIOD).count == 6


@pytest.mark.parametrize("seed", range(10))
def test_a_counter_that_stands_or_loses_edges_is_named_within_two_turning_cycles(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    counter = EmulatedCounter(tmp_path)
    told, total = Told(QuadratureFile(counter.place / "count")), 0
    for _ in range(8):
        total += int(random.integers(300, 400))
        counter.turn_to(total)
        assert told.read() is not None
    counter.stands = True
    named = 0
    for k in range(12):
        total += int(random.integers(300, 400))
        counter.turn_to(total)
        told.read()
        named = named or (k + 1 if told.events else 0)
    assert told.events[0] == ("encoder_failed", "counter")
    assert 1 <= named <= 3  # one place in four is by chance the right one
    assert "contradict the count" in told.detail


@pytest.mark.parametrize(
    ("name", "text", "cause"),
    [
        ("function", "quadrature x2 a", "resolution"),
        ("function", "quadrature x1 b", "resolution"),
        ("enable", "0", "counter"),
        ("ceiling", "4095", "register"),
        ("count", "nonsense", "silent"),
        ("count", "90000", "counter"),
    ],
)
def test_each_setting_of_a_counter_that_changes_is_named_and_put_right(
    tmp_path: Path, name: str, text: str, cause: str
) -> None:
    counter = EmulatedCounter(tmp_path)
    told = Told(QuadratureFile(counter.place / "count"))
    assert told.read() is not None
    counter.set(name, text)
    assert told.read() is None
    assert told.events == [("encoder_failed", cause)]
    if name == "count":
        counter.turn_to(0)
    assert told.read() is None
    assert told.read() is not None
    assert told.events[-1] == ("encoder_back", "")


def test_encoders_that_are_unplugged_are_told_once_and_come_back(tmp_path: Path) -> None:
    counter, lines = EmulatedCounter(tmp_path), EmulatedLines()
    for device, told in (
        (counter, Told(QuadratureFile(counter.place / "count"))),
        (lines, Told(GpioEncoder(lines.connect, lines.lines))),
    ):
        assert told.read() is not None
        if isinstance(device, EmulatedCounter):
            device.unplug()
        else:
            device.gone = True
        assert [told.read() for _ in range(4)] == [None] * 4
        if isinstance(device, EmulatedCounter):
            EmulatedCounter(tmp_path / "again").device.rename(device.device)
        else:
            device.gone = False
        assert told.read() is None
        assert told.read() is not None
        assert told.events == [("encoder_failed", "silent"), ("encoder_back", "")]


def turned_lines(a_turn: int = 4096) -> tuple[EmulatedLines, Told]:
    """Lines with an index that have turned a little."""
    lines = EmulatedLines((17, 27, 22), a_turn)
    told = Told(GpioEncoder(lines.connect, lines.lines))
    lines.turn(lambda n: START + 1e-4 * n, 1000)
    assert told.read() is not None
    return lines, told


@pytest.mark.parametrize(
    ("defect", "cause"),
    [("drop", "overflow"), ("swallow", "counter"), ("dead", "counter"), ("resolution", "resolution")],
)
def test_each_defect_of_lines_is_named_within_two_cycles_of_a_turn(defect: str, cause: str) -> None:
    lines, told = turned_lines(4000 if defect == "resolution" else 4096)
    if defect == "dead":
        lines.dead.add(27)
    elif defect != "resolution":
        setattr(lines, defect, 1)
    found = []
    for to in (1403, 1806, 4300, 8500):
        lines.turn(lambda n: START + 1.0 + 1e-4 * n, to)
        found.append(told.read() is None)
    assert told.events[0] == ("encoder_failed", cause)
    if defect != "resolution":
        assert found[0]


def test_a_head_whose_index_agrees_is_never_doubted() -> None:
    lines, told = turned_lines()
    for to in (5000, 9000, 3000, -200, -9000, 300):
        lines.turn(lambda n: START + 1e-4 * abs(n), to)
        assert told.read() is not None
    assert told.events == []


def test_the_numbers_of_the_interface_are_those_of_the_kernel() -> None:
    """As a C program prints them of linux/gpio.h."""
    assert (GET_LINES, GET_VALUES) == (0xC250B407, 0xC010B40E)


def test_sources_by_their_names() -> None:
    assert counter_file("/dev/counter1:2") == Path("/sys/bus/counter/devices/counter1/count2/count")
    assert counter_file("counter0") == Path("/sys/bus/counter/devices/counter0/count0/count")
    for text in ("gpio:chip0:17,27", "gpio:/dev/gpiochip0:17,27,22", "gpio:gpiochip3:0,1"):
        assert isinstance(encoder_source(text), GpioEncoder)
    for text in ("gpio:", "gpio:chip0", "gpio:chip0:17", "gpio:chip0:17,17", "gpio:chip0:a,b", "gpio:chip0:1,2,3,4"):
        with pytest.raises(NodeConfigurationError, match="gpio:CHIP:A,B"):
            encoder_source(text)
    with pytest.raises(SensorError, match="gpio: /dev/gpiochip77: No such file"):
        encoder_source("gpio:chip77:1,2").start()
    with pytest.raises(SensorError, match=r"gpio: /dev/null: lines 1, 2: Inappropriate ioctl"):
        ChipLines(Path("/dev/null"), (1, 2))
