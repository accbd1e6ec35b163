"""A sensor's window beside the cycle: what a late one lacks is made up for, and when frames were taken is found out."""

import math

import numpy as np
import pytest
from emulated_mpu import EmulatedMpu
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.node_record import DELAYED
from node.kernels.sensors.delay import date_window, make_up_delay
from node.process.drivers.frame_clock import FrameClock
from node.process.drivers.mpu_chips import DELAYS
from node.process.drivers.mpu_imu import MpuImu
from sim.studies.field.cases import CASES
from sim.studies.field.run import disturbance_row, run_seed

RATES = st.floats(-70.0, 70.0).map(math.radians)
LATE = st.floats(-0.01, 0.03)


class Late:
    """One sensor whose windows end late, over a rate (rad/s) that is linear between the given points."""

    def __init__(self, late: list[float], t: list[float], rate: list[float]) -> None:
        fine = np.linspace(-PERIOD, t[-1], 200_000)
        self.turn = np.concatenate([[0.0], np.cumsum(np.diff(fine) * np.interp(0.5 * (fine[1:] + fine[:-1]), t, rate))])
        self.fine, self.late = fine, late
        self.memory = np.zeros(1, DELAYED)[0]
        self.memory["late"] = math.nan
        self.made: list[float] = []
        self.doubts: list[float] = []
        for k in range(1, len(late)):
            begin, end = (k - 1) * PERIOD - late[k - 1], k * PERIOD - late[k]
            mean = (self.at(end) - self.at(begin)) / (end - begin)
            given_rate = np.array([0.0, 0.0, mean])
            self.doubts.append(make_up_delay(self.memory, late[k], given_rate, PERIOD))
            self.made.append(float(given_rate[2]))

    def at(self, t: float) -> float:
        return float(np.interp(t, self.fine, self.turn))

    def turned(self) -> np.ndarray:
        """Angle since the end of the first cycle, as made up for."""
        return np.cumsum(np.array(self.made[1:]) * PERIOD)

    def truth(self) -> np.ndarray:
        return np.array([self.at(k * PERIOD) - self.at(PERIOD) for k in range(2, len(self.late))])


@pytest.mark.parametrize(
    ("told_ms", "lasting_ms"),
    [
        ([5.8, 2.0, 0.3, 0.3, 0.3], 0.3),  # bounds that close in upon the phase of a crystal
        ([1.9, 0.1, 3.5, 0.8, 0.1] * 20, 0.1),  # time stamps that jitter: bounds that contradict each other
        ([0.1] + [1.0] * 2000, 1.0),  # a phase that is known less well from now on
    ],
)
def test_what_stays_of_a_dates_error_is_the_best_of_late(told_ms: list[float], lasting_ms: float) -> None:
    memory = np.zeros(1, DELAYED).view(np.recarray)[0]
    memory.late = math.nan
    for std in told_ms:
        date_window.py_func(memory, 1e-3 * std)
        memory.late = 0.01
    assert memory.lasting == pytest.approx(1e-3 * lasting_ms, rel=0.05)
    assert memory["std"] == 1e-3 * told_ms[-1]


@pytest.mark.statistical
@pytest.mark.timeout(600)
def test_an_mpu6500_with_delay_crystal_and_fifo_is_as_good_as_it_says_and_never_called_faulty() -> None:
    case = next(case for case in CASES if case.key == "mpu6500")
    figures = disturbance_row(case, [run_seed((case, seed)) for seed in range(1, 101)])
    assert 0.8 < figures["nees_turning"] < 1.25
    assert 0.8 < figures["nees_rest"] < 1.25
    assert figures["gyro_step"] == figures["gyro_scale"] == figures["other_faults"] == 0
    assert figures["surveys_percent"] == 100


@given(RATES, LATE)
def test_a_steady_rate_stays_what_it_is(rate: float, late: float) -> None:
    found = Late([late] * 8, [-1.0, 8 * PERIOD], [rate, rate])
    assert found.made == pytest.approx([rate] * 7, abs=1e-6)
    assert max(found.doubts) < 1e-12


@pytest.mark.slow
@given(st.lists(LATE, min_size=12, max_size=12), RATES)
def test_a_ramp_is_followed_to_the_end_of_every_cycle(late: list[float], more: float) -> None:
    found = Late(late, [-1.0, 12 * PERIOD], [1.3, 1.3 + more])  # not through zero, beyond which nothing is carried
    off = found.turned() - found.truth()
    change = abs(more) * PERIOD / (1.0 + 12 * PERIOD)  # rad/s in a cycle
    assert np.abs(off[1:] - off[1]).max() < 0.1 * 0.03 * change + 1e-5


def test_what_a_bend_takes_for_missing_is_given_back_and_doubted_meanwhile() -> None:
    """A head that starts, turns at 71 deg/s and stops, over windows 20 ms late."""
    t, top = [-1.0, 3.1, 7.1, 15.0, 19.0, 30.0], 71.0 * DEG
    found = Late([0.02] * 50, t, [0.0, 0.0, top, top, 0.0, 0.0])
    off = found.turned() - found.truth()
    uncorrected = 0.02 * top
    assert np.abs(off).max() < 0.2 * uncorrected
    assert abs(off[-1]) < 1e-6
    doubts = np.array(found.doubts[1:])
    assert np.all(np.abs(off[:-1]) <= 2.0 * np.sqrt(doubts[:-1] + doubts[1:]) + 1e-5)


def test_readings_in_time_are_left_alone_to_the_last_bit() -> None:
    memory = np.zeros(1, DELAYED)[0]
    memory["late"] = math.nan
    rates = np.random.default_rng(1).standard_normal((20, 3))
    for rate in rates:
        made = rate.copy()
        assert make_up_delay(memory, 0.0, made, PERIOD) == 0.0
        np.testing.assert_array_equal(made, rate)


def test_after_a_reading_that_was_none_the_windows_begin_anew() -> None:
    memory = np.zeros(1, DELAYED)[0]
    memory["late"] = math.nan
    for value in (1.0, math.nan):
        make_up_delay(memory, 0.01, np.full(3, value), PERIOD)
    made = np.full(3, 2.0)
    assert make_up_delay(memory, 0.01, made, PERIOD) == 0.0
    np.testing.assert_array_equal(made, np.full(3, 2.0))


@given(st.floats(-0.03, 0.03), st.floats(0.0, 1.0))
def test_the_crystal_and_the_phase_of_the_frames_are_found(crystal: float, phase: float) -> None:
    period = 0.02 / (1.0 + crystal)
    clock, taken, off = FrameClock(50.0), 0, 0.0
    for k in range(1, 400):
        now = k * PERIOD
        count = math.floor(now / period - phase) + 1
        newest = clock.on_read(now, count - taken)
        taken = count
        if k > 300:
            off = max(off, abs(newest - (count - 1 + phase) * period))
    assert clock.period == pytest.approx(period, rel=2e-3)
    assert off < 0.4 * period  # half of one is what is known without counting


def test_the_driver_says_how_late_its_window_is() -> None:
    chip = EmulatedMpu()
    driver = MpuImu(chip.connect, sleep=lambda _: None)
    driver.start()
    late = []
    for k in range(1, 200):
        chip.live(PERIOD, (0.0, 0.0, 1.0), (0.0, 0.0, -9.8))
        late.append(driver.read((k - 1) * PERIOD, k * PERIOD).late)
    half = 0.5 / driver.sample_rate
    assert min(late) >= DELAYS[20] - 1.01 * half
    assert max(late) <= DELAYS[20] + 1.01 * half
    assert np.ptp(late) > half
