"""A tube's process over its lives: what it saves, what it forgets, and that nothing it says can end it."""

import errno
import math
from pathlib import Path

import msgpack
import numpy as np
import pytest

from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import Err
from node.process.journal import Journal
from node.process.saver import AT_ONCE, SAVE_EVERY, SPACING
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.messages import HOPS_UNKNOWN, Aiding, Side
from telemetry.schema import VARIANCE

REST = (0.0, 0.0, 0.0, 0.0, 0.3, -9.8)
TURN = 0.5  # rad/s


def cycles(process: TubeProcess, count: int, start: float = 1000.0) -> float:
    now = start
    for _ in range(count):
        now += PERIOD
        process.on_cycle([now - PERIOD, *REST], now)
        process.take_frames(now)
    return now


def test_a_later_life_goes_on_with_bias_and_numbers(tmp_path: Path) -> None:
    first = TubeProcess(TubeSettings(3), tmp_path)
    now = cycles(first, 120)
    second = TubeProcess(TubeSettings(3), tmp_path)
    assert second.boots == first.boots + 1
    assert second.state[0]["mode"] == first.state[0]["mode"]
    assert second.endpoint.mail.series.take() >= first.endpoint.mail.outbox_size + 1
    assert second.endpoint.mail.outbox_size == first.endpoint.mail.outbox_size > 0
    cycles(second, 5, now + 30.0)


def test_damaged_slots_are_told_and_the_node_begins_anew(tmp_path: Path) -> None:
    cycles(TubeProcess(TubeSettings(3), tmp_path), 120)
    for slot in tmp_path.glob("slot-*"):
        slot.write_bytes(b"damaged")
    again = TubeProcess(TubeSettings(3), tmp_path)
    assert again.boots == 2
    assert not again.state[0]["static_bias_var"].any()


@pytest.mark.parametrize("wild", [math.nan, math.inf, 1e300])
def test_no_reading_and_no_frame_ends_the_process(tmp_path: Path, wild: float) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    now = cycles(process, 3)
    for k in range(6):
        sample = [now, *REST]
        sample[1 + k] = wild
        now += PERIOD
        process.on_cycle(sample, now)
        process.on_frame(Side.UPPER, b"garbage", now)
        process.take_frames(now)
    cycles(process, 110, now)
    assert process.state[0]["mode"] != 0


def test_an_aiding_that_cannot_be_said_is_not_handed_on(tmp_path: Path) -> None:
    """A torque that no message holds; constant errors that grew are those of any yaw at most, and can be said."""
    process = TubeProcess(TubeSettings(3, lower_joint=MakeUpAngle(0.0, 0.1)), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    now = cycles(process, 110)
    for number, (var, torque, unsayable) in enumerate(((1e-4, 0.0, 0), (VARIANCE, 0.0, 0), (1e-4, 2e6, 1))):
        process._on_aiding(Aiding(1.0, 1e-9, var, 0.0, 0.0, now, number, 1, torque), now)
        assert process.endpoint.counters["unsayable"] == unsayable
    cycles(process, 3, now)
    assert process.state[0]["yaw_known"]


def noisy(process: TubeProcess, count: int, start: float = 1000.0, rate: float = 0.0) -> float:
    """Cycles of a sensor with noise, which does not look stuck, at a rate (rad/s) about the axis."""
    random, now = np.random.default_rng(int(start)), start
    moved = np.array([0.0, 0.0, rate, *REST[3:]])
    for _ in range(count):
        now += PERIOD
        noise = random.normal(0.0, 1e-4, 6)
        process.on_cycle([now - PERIOD, *(noise + moved)], now)
        process.take_frames(now)
    return now


@pytest.fixture
def saves(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Whether the node was still, of every save."""
    made: list[int] = []
    plain = Journal.save

    def save(self: Journal, state, blob: bytes) -> None:
        made.append(int(state[0]["filter"]["still_cycles"]) > 0)
        plain(self, state, blob)

    monkeypatch.setattr(Journal, "save", save)
    return made


def test_at_rest_a_node_saves_every_five_minutes(tmp_path: Path, saves: list[int]) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    now = noisy(process, 200)
    saves.clear()
    noisy(process, 5 * SAVE_EVERY, now)
    assert abs(SAVE_EVERY * PERIOD - 300.0) < 1.0
    assert saves == [True] * 5


def test_no_save_shows_a_rest_that_is_over(tmp_path: Path, saves: list[int]) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    now = noisy(process, 200)
    for _ in range(3):
        now = noisy(process, 1, now, TURN)
        assert not saves[-1], "in the first cycle of the turn"
        saves.clear()
        now = noisy(process, 40, now, TURN)
        assert saves == [], "a turn is saved once"
        now = noisy(process, 60, now)
        assert saves[-1]


def test_events_without_end_do_not_wear_the_flash(tmp_path: Path, saves: list[int]) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    now = noisy(process, 200)
    saves.clear()
    storm = 20 * SPACING
    for k in range(storm):  # the clock jumps in every other cycle, and each jump is an event
        now += PERIOD
        process.on_cycle([now - PERIOD if k % 2 else math.nan, *REST], now)
        process.take_frames(now)
    assert storm // 2 > len(saves) >= AT_ONCE + storm // SPACING - 1
    assert len(saves) <= AT_ONCE + storm // SPACING + 1
    told = process.endpoint.mail.outbox_size
    assert told > storm // 2, "every jump is kept"
    noisy(process, SPACING, now)
    loaded = Journal(tmp_path).load()
    assert loaded is not None
    assert len(msgpack.unpackb(loaded[1])[2]) == process.endpoint.mail.outbox_size >= told, "the last one is not lost"


def test_a_start_tells_what_its_yaw_is_worth(tmp_path: Path) -> None:
    first = TubeProcess(TubeSettings(3), tmp_path)
    first.endpoint.clock = ClockFilter(is_root=True)
    now = noisy(first, 150)
    for k in range(40):
        first._on_aiding(Aiding(1.0, 1e-6, 0.0, 0.0, 0.0, now, 1 + k, 1), now)
        now = noisy(first, 1, now)
    first.close()
    sigma = math.sqrt(first.tube.yaw_var)
    woken = TubeProcess(TubeSettings(3), tmp_path)
    hours = (sigma / (2e-4 * DEG)) ** 2 / 3600.0
    assert woken.tube.boot_event(0.0).arguments["worth_h"] == pytest.approx(hours, rel=0.1)
    assert hours > 0.01
    noisy(woken, 60, now, TURN)
    woken.close()
    turned = TubeProcess(TubeSettings(3), tmp_path)
    assert turned.tube.boot_event(0.0).arguments["worth_h"] == 0.0
    assert "worth_h" not in TubeProcess(TubeSettings(3), tmp_path / "new").tube.boot_event(0.0).arguments


def test_telemetry_of_another_layout_is_refused_by_name(tmp_path: Path) -> None:
    first = TubeProcess(TubeSettings(3), tmp_path)
    noisy(first, 120)
    blob = msgpack.packb(msgpack.unpackb(first.endpoint.export_state())[1:])
    Journal(tmp_path).save(first.nodes, blob)
    again = TubeProcess(TubeSettings(3), tmp_path)
    assert again._saver.fault == "saved state: expected telemetry of layout endpoint-2, got unnamed"
    assert not again.state[0]["static_bias_var"].any()


def test_what_is_sent_is_on_the_disk(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    now, numbers = 1000.0, set()
    for k in range(400):
        now = noisy(process, 1, now, TURN if 150 < k < 200 or k == 300 else 0.0)
        loaded = Journal(tmp_path).load()
        assert loaded is not None
        saved, sent = msgpack.unpackb(loaded[1]), msgpack.unpackb(process.endpoint.export_state())
        assert saved[:4] == sent[:4], "layout, next number, what waits for its receipt, answers"
        numbers.add(saved[1])
    assert len(numbers) > 5


def test_power_that_comes_and_goes_spares_the_yaw_of_a_node_at_rest(tmp_path: Path, saves: list[int]) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    now = noisy(process, 200)
    process._on_aiding(Aiding(1.0, 1e-9, 0.0, 0.0, 0.0, now, 1, 1), now)
    noisy(process, SAVE_EVERY, now)
    sigma = float(process.state[0]["P"][2, 2]) ** 0.5
    assert sigma < 0.01
    saves.clear()
    for _ in range(3):
        again = TubeProcess(TubeSettings(3), tmp_path)
        assert again.state[0]["yaw_known"] == 1
        assert float(again.state[0]["P"][2, 2]) ** 0.5 < 0.01
    assert saves == [], "a start that learns nothing writes nothing"


def test_a_node_runs_on_where_the_disk_refuses_and_says_so_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    told: list[str] = []
    plain = process._send_event

    def tell(severity, code, arguments) -> None:
        told.append(code)
        plain(severity, code, arguments)

    monkeypatch.setattr(process, "_send_event", tell)
    now = noisy(process, 30)
    with monkeypatch.context() as patch:

        def refuse(*_: object) -> None:
            raise OSError(errno.EIO, "worn out")

        patch.setattr(Journal, "_write", refuse)
        now = noisy(process, 120, now)
        assert process.state[0]["static_bias_var"].any(), "it learnt its bias, an event that it could not save"
        assert told == ["state_not_saved"]
    now = noisy(process, 30, now, TURN)
    process._saver._journal.worn |= {7}
    noisy(process, 3, now, TURN)
    assert told == ["state_not_saved", "saved_slot_worn"]


def test_a_place_in_the_string_that_was_saved_is_not_told_as_known(tmp_path: Path) -> None:
    """Two tubes that were given each other's saved state must not turn the ground station's order round."""
    first = TubeProcess(TubeSettings(3), tmp_path)
    first.endpoint.place.hops = 2
    first.close()
    again = TubeProcess(TubeSettings(3), tmp_path)
    assert again.endpoint.place.hops == 2
    assert again.endpoint.place.told_hops == HOPS_UNKNOWN


def test_a_yaw_of_any_variance_can_be_said(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3, state_every=1), tmp_path)
    process.nodes[0]["filter"]["now_P"][Err.YAW, Err.YAW] = 470.0
    process.nodes[0]["filter"]["P"][Err.YAW, Err.YAW] = 470.0
    cycles(process, 3)
    assert process.endpoint.counters["unsayable"] == 0
