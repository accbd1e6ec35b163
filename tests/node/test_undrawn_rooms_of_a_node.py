"""Small rooms of a node's process, by hand: what is told of its sensors, each bound at its value, each way twice."""

from __future__ import annotations

import errno
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from emulated_vn100 import Line

from node.errors import SensorCause, SensorError
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.record.filter_record import PARTS, RING
from node.kernels.turns.rest_watch import CYCLES
from node.process.bias_search import LARGEST_DEG, BiasSearch, missing_of
from node.process.board_findings import bad_finding, good_finding
from node.process.board_watch import worst_of
from node.process.drivers import vn100
from node.process.drivers.fifo_window import parts_of, window_std
from node.process.drivers.gravity_witness import GravityWitness
from node.process.drivers.timed import TimedEncoder
from node.process.drivers.vn100 import Vn100
from node.process.temperature_range import bias_at, unmeasured_bias
from node.process.temperature_watch import TemperatureWatch, follows_temperature
from telemetry.messages import Severity
from telemetry.parameters import SensorParameters

NAN = math.nan


class Said:
    """What a node says."""

    def __init__(self) -> None:
        self.words: list[Any] = []

    def __call__(self, *words: Any) -> None:
        self.words.append(words)

    def take(self) -> list[Any]:
        taken, self.words = self.words, []
        return taken


# gravity


@pytest.mark.parametrize(
    ("size", "is_fault"), [(8.336, False), (8.335, True), (11.277, False), (11.278, True), (19.6, True), (0.0, True)]
)
def test_a_force_at_rest_is_gravity_within_fifteen_percent(size: float, is_fault: bool) -> None:
    """9.80665 m/s^2, of which 15 % are 1.4710."""
    witness = GravityWitness()
    force = (0.6 * size, 0.0, -0.8 * size)
    witness.look((0.0, 0.0, 0.0), force)  # one cycle alone says nothing
    for _ in range(2):
        if not is_fault:
            witness.look((0.0, 0.0, 0.0), force)
            continue
        with pytest.raises(SensorError, match=rf"^a force of {size:.2f} m/s\^2 at rest, expected gravity") as caught:
            witness.look((0.0, 0.0, 0.0), force)
        assert caught.value.cause is SensorCause.GRAVITY


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_string_that_moves_from_cycle_to_cycle_is_not_at_rest(axis: int, sign: float) -> None:
    for rate_deg, force_by, rests in ((0.499, 0.0999, True), (0.501, 0.0, False), (0.0, 0.1001, False)):
        witness = GravityWitness()
        rate, force = np.radians([40.0, -7.0, 3.0]), np.array([3.0, 2.0, 1.0])
        witness.look(tuple(rate), tuple(force))
        rate[axis] += sign * math.radians(rate_deg)
        force[axis] += sign * force_by
        if rests:
            with pytest.raises(SensorError):
                witness.look(tuple(rate), tuple(force))
        else:
            witness.look(tuple(rate), tuple(force))
    witness = GravityWitness()
    witness.look((0.0, 0.0, 0.0), (3.0, 2.0, 1.0))
    witness.look((0.0, 0.0, 0.0), (5.0, 2.0, 1.0))
    with pytest.raises(SensorError):  # it has come to rest since
        witness.look((0.0, 0.0, 0.0), (5.0, 2.0, 1.0))
    witness = GravityWitness()
    for _ in range(3):
        witness.look((NAN, 0.0, 0.0), (1.0, 0.0, 0.0))


# a bias that is not found


def searched(mode: int, cycles: int, rates_deg: Any, still_deg: float = 0.2) -> tuple[Any, Any]:
    ring = np.full((RING, 3), 9.0)
    rows = np.radians(np.broadcast_to(rates_deg, (CYCLES, 3)))
    for k in range(CYCLES):
        ring[(cycles - CYCLES + k) % RING] = rows[k]
    return {"mode": mode, "cycles": cycles, "ring_rate": ring}, {"still_rate": math.radians(still_deg)}


def test_a_search_is_told_after_three_minutes_once_and_its_end_where_it_was_told() -> None:
    said = Said()
    search, other = BiasSearch(said), STATIC_BIAS + 1
    looking, config = searched(STATIC_BIAS, 400, [0.1, -0.3, 0.2])
    found, _ = searched(other, 400, 0.0)
    for _ in range(2):
        for now, count in ((100.0, 0), (279.999, 0), (280.0, 1), (500.0, 0)):
            search.look(looking, config, now, lost=False)
            told = said.take()
            assert len(told) == count
            for severity, code, arguments in told:
                assert (severity, code, arguments["searched_s"]) == (Severity.ERROR, "bias_never_learnt", 180.0)
                assert (arguments["axis"], arguments["rate_dps"]) == ("y", pytest.approx(-0.3))
        search.look(found, config, 501.0, lost=False)
        assert said.take() == [(Severity.WARNING, "bias_learnt", {})]
    search.look(looking, config, 100.0, lost=False)
    search.look(looking, config, 50.0, lost=False)  # the clock was set
    search.look(looking, config, 229.0, lost=False)
    search.look(found, config, 230.0, lost=False)
    assert said.take() == []


@pytest.mark.parametrize(
    ("axis", "moved", "words"),
    [(0, 0.39, "a rest"), (0, 0.41, "a minute"), (1, 0.41, "a minute"), (2, 0.19, "a rest"), (2, 0.21, "a minute")],
)
def test_rates_that_move_need_a_rest_across_by_twice_what_is_still(axis: int, moved: float, words: str) -> None:
    rates = np.zeros((CYCLES, 3))
    rates[:, axis] = moved * (-1.0) ** np.arange(CYCLES)
    state, config = searched(STATIC_BIAS, RING + 7, rates)
    needs, found = missing_of(state, config, lost=False)
    assert needs.startswith(words)
    assert found["scatter_dps"] == pytest.approx(moved, rel=0.02 if CYCLES % 2 else 1e-9)


def test_what_a_search_needs_is_readings_or_a_calibration_or_a_rest() -> None:
    for by, words in ((0.99, "a rest that gravity"), (1.01, "--imu-gyroscope with its"), (-1.01, "--imu-gyroscope")):
        state, config = searched(STATIC_BIAS, CYCLES, [0.0, 0.0, by * LARGEST_DEG])
        needs, found = missing_of(state, config, lost=False)
        assert needs.startswith(words)
        assert found["axis"] == "z"
        assert found["rate_dps"] == pytest.approx(by * LARGEST_DEG)
        assert missing_of(state, config, lost=True) == ("readings of the gyroscope: they are missing or faulty", {})
    state, config = searched(STATIC_BIAS, CYCLES, 0.0)
    state["cycles"] = CYCLES - 1
    assert missing_of(state, config, lost=False)[1] == {}


# temperatures


SLOPED = SensorParameters(reference=20.0, bias_slopes=((1e-3, -2e-3, 3e-3), (1e-5, 0.0, -1e-5), (0.0, 0.0, 0.0)))


def test_a_bias_follows_its_polynomial_from_the_reference_on() -> None:
    np.testing.assert_allclose(bias_at(SLOPED, 30.0), [0.011, -0.02, 0.029], rtol=1e-12)
    np.testing.assert_allclose(bias_at(SLOPED, 10.0), [-0.009, 0.02, -0.031], rtol=1e-12)
    imu = ImuSettings(gyroscope=SLOPED, corrected_within=(10.0, 30.0))
    np.testing.assert_allclose(unmeasured_bias(imu, 10.0), [0.013, -0.02, 0.027], rtol=1e-12)  # from 30 to 40 C
    np.testing.assert_allclose(unmeasured_bias(imu, -10.0), [-0.007, 0.02, -0.033], rtol=1e-12)  # from 10 to 0 C
    np.testing.assert_array_equal(unmeasured_bias(imu, 0.0), np.zeros(3))


def test_a_correction_follows_the_temperature_by_any_of_its_slopes() -> None:
    plain = SensorParameters()
    assert not follows_temperature(plain)
    assert follows_temperature(SLOPED)
    assert follows_temperature(SensorParameters(bias_slopes=((0.0, 0.0, 0.0), (0.0, 0.0, -1e-9), (0.0, 0.0, 0.0))))


def reading(temperature: float, *others: ImuReading) -> ImuReading:
    return ImuReading(0.0, 0.5, (0.1, 0.2, 0.3), (1.0, 2.0, 9.0), temperature, others=others)


@pytest.mark.parametrize("impossible", [-45.0, 125.0, NAN, -300.0])
@pytest.mark.parametrize("is_followed", [False, True])
def test_an_impossible_temperature_is_told_and_leaves_out_what_follows_it(impossible: float, is_followed: bool) -> None:
    said, plain = Said(), SensorParameters()
    block: Any = SimpleNamespace(gyroscope=plain, accelerometer=SLOPED if is_followed else plain)
    watch = TemperatureWatch(said, (ImuSettings(),), lambda: block)
    for _ in range(2):
        for usual in (-44.9, 124.9, 31.0):
            assert watch.look(reading(usual)) == reading(usual)
        said.take()
        for k in range(2):
            looked = watch.look(reading(impossible))
            assert looked.temperature == 31.0
            assert all(map(math.isnan, (*looked.rate, *looked.force))) == is_followed
            told = said.take()
            assert len(told) == (k == 0)
            for severity, code, arguments in told:
                assert (severity, code) == (Severity.ERROR, "temperature_lost")
                assert arguments["readings_used"] == (not is_followed)
                assert arguments["detail"] == f"expected -45..125 C, got {impossible:g}"
                assert "imu" not in arguments
        assert watch.look(reading(30.0)) == reading(30.0)
        assert said.take() == [(Severity.WARNING, "temperature_back", {})]


def test_of_two_imus_the_one_that_lost_its_temperature_is_named() -> None:
    said, plain = Said(), SensorParameters()
    block: Any = SimpleNamespace(gyroscope=plain, accelerometer=plain)
    watch = TemperatureWatch(said, (ImuSettings(), ImuSettings(gyroscope=SLOPED)), lambda: block)
    looked = watch.look(reading(25.0, reading(200.0)))
    assert (looked.temperature, looked.rate) == (25.0, (0.1, 0.2, 0.3))
    assert all(map(math.isnan, looked.others[0].rate))
    ((_, code, arguments),) = said.take()
    assert (code, arguments["imu"], arguments["readings_used"]) == ("temperature_lost", 2, False)
    watch.look(reading(25.0, reading(40.0)))
    assert said.take() == [(Severity.WARNING, "temperature_back", {"imu": 2})]


def test_a_serial_line_that_refuses_to_be_read_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line()
    source = Vn100(line.path)
    source.start()

    def refused(*_: Any) -> bytes:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(vn100, "read_waiting", refused)
    with pytest.raises(SensorError, match=rf"^vn100: {line.path}: Input/output error: the line is gone$"):
        source.read(100.0, 100.5)
    source.close()
    line.cut()


# windows, rows and findings


def test_a_window_is_dated_as_well_as_its_frames_and_a_tenth_of_its_filter() -> None:
    assert window_std(3e-4, 4e-3) == pytest.approx(5e-4)
    assert window_std(0.0, 0.02) == pytest.approx(2e-3)


def test_parts_of_a_window_are_the_turns_between_borders_by_their_lengths() -> None:
    """Frames of 1/16 s whose rates rise by one each: from 0.25 s before the cycle to its end at 1 s."""
    rates = np.arange(20.0)
    parts = parts_of(rates, (-0.25, 1.0), 0.0, 1.0)
    assert len(parts) == PARTS + 1
    assert parts[0] == pytest.approx(1.5)  # the four frames before
    assert parts[1:] == pytest.approx([4.5 + 2.0 * k for k in range(PARTS)])
    shared = parts_of(rates, (-0.25, 1.0), 1.0 / 32.0, 1.0 + 1.0 / 32.0)  # borders within frames
    assert shared[0] == pytest.approx((0.0 + 1.0 + 2.0 + 3.0 + 0.5 * 4.0) / 4.5)
    assert shared[1] == pytest.approx((0.5 * 4.0 + 5.0 + 0.5 * 6.0) / 2.0)
    assert shared[-1] == pytest.approx((0.5 * 18.0 + 19.0) / 1.5)
    at_once = parts_of(rates[:16], (0.0, 1.0), 0.0, 1.0)
    assert at_once[0] == 0.0
    assert at_once[1:] == pytest.approx([0.5 + 2.0 * k for k in range(PARTS)])


@pytest.mark.parametrize(
    ("count", "window"), [(15, (0.0, 1.0)), (16, (0.001, 1.0)), (16, (0.0, 1.001)), (16, (0.0, 0.875))]
)
def test_a_window_that_is_short_or_no_cycle_s_has_no_parts(count: int, window: tuple[float, float]) -> None:
    assert parts_of(np.ones(count), window, 0.0, 1.0) == ()


def test_a_counter_s_recording_has_the_newest_row_that_is_not_in_the_future(tmp_path: Path) -> None:
    file = tmp_path / "counter.npy"
    np.save(file, np.array([[10.0, 5.0, 9.5, 1.0], [11.0, 7.0, 10.5, 0.0], [12.0, 9.0, 11.5, 1.0]]))
    encoder = TimedEncoder(file)
    with pytest.raises(SensorError, match=r"counter\.npy: not started$"):
        encoder.read(10.0)
    encoder.start()
    for now, count, edge_at, rising in ((10.0, 5, 9.5, True), (10.999, 5, 9.5, True), (11.0, 7, 10.5, False)):
        sample = encoder.read(now)
        assert (sample.count, sample.edge_at, sample.rising) == (count, edge_at, rising)
    for now in (9.999, 12.0, 13.0):
        with pytest.raises(SensorError):
            encoder.read(now)


@pytest.mark.parametrize(
    ("times", "row"), [([10.0, 11.0, 11.0], 3), ([10.0, 9.0, 11.0], 2), ([10.0, 11.0, NAN], 3), ([10.0], 2)]
)
def test_times_of_a_recording_go_on_and_the_first_that_does_not_is_named(
    tmp_path: Path, times: list[float], row: int
) -> None:
    file = tmp_path / "counter.npy"
    np.save(file, np.array([[at, 5.0, 9.5, 1.0] for at in times]))
    with pytest.raises(SensorError, match=rf"row {row}: expected"):
        TimedEncoder(file).start()


def test_of_several_imus_each_part_has_the_first_line_that_is_wrong() -> None:
    good, bad = good_finding, bad_finding
    one, two = [good("sensor", "a"), bad("rate", "slow")], [bad("sensor", "b"), bad("rate", "fast"), good("noise", "n")]
    third = [bad("sensor", "c")]
    assert worst_of([one]) == one
    first = [bad("sensor", "IMU 2: b"), bad("rate", "IMU 1: slow"), good("noise", "IMU 2: n")]
    assert worst_of([one, two, third]) == first
