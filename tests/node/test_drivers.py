"""Sources of a board: the MPU-6500 against its registers, recordings, counters, and what a fault of each becomes."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from emulated_mpu import EmulatedMpu

from node.errors import NodeConfigurationError, SensorError
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.process.drivers.choice import encoder_source, imu_source
from node.process.drivers.mpu_imu import MpuImu, open_bus
from node.process.drivers.quadrature import QuadratureFile
from node.process.drivers.replay_drivers import ReplayEncoder, ReplayImu
from node.process.drivers.source import SafeEncoder, SafeImu
from node.process.drivers.timed import TimedEncoder, TimedImu
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from telemetry.messages import Event, Severity

RATE, FORCE = (0.1 * DEG, -3.0 * DEG, 71.0 * DEG), (0.2, -0.3, -9.7)
RATE_LSB, FORCE_LSB = 500.0 * DEG / 32768.0, 8.0 * 9.80665 / 32768.0


class Cycles:
    """A driver and its sensor over cycles."""

    def __init__(self, **options: int) -> None:
        self.chip = EmulatedMpu()
        self.slept = 0.0
        self.driver = MpuImu(self.chip.connect, sleep=self._sleep, **options)
        self.driver.start()
        self.now = 100.0

    def _sleep(self, seconds: float) -> None:
        self.slept += seconds

    def read(self, rate: tuple = RATE, force: tuple = FORCE, temperature: float = 25.0, seconds: float = PERIOD):
        self.chip.live(seconds, rate, force, temperature)
        self.now += seconds
        return self.driver.read(self.now - seconds, self.now)


def test_a_cycle_is_the_mean_of_its_frames_in_si_units() -> None:
    cycles = Cycles()
    for _ in range(5):
        sample = cycles.read(temperature=61.5)
    assert sample.rate == pytest.approx(RATE, abs=RATE_LSB)
    assert sample.force == pytest.approx(FORCE, abs=FORCE_LSB)
    assert sample.temperature == pytest.approx(61.5, abs=0.01)
    assert not sample.saturated
    assert cycles.slept < 0.5


def test_the_mean_of_a_changing_rate_is_its_integral() -> None:
    cycles = Cycles()
    cycles.read()
    for k in range(26):
        cycles.chip.live(1.0 / 50.0, (0.0, 0.0, k * DEG), FORCE)
    assert cycles.driver.read(0.0, PERIOD).rate[2] == pytest.approx(12.5 * DEG, rel=0.05)


def test_the_inside_of_a_cycle_is_told_part_by_part() -> None:
    """A string that gains 35 deg/s in every second, in frames of 20 ms, once the phase of the frames is known."""
    cycles, slope = Cycles(), 35.0 * DEG
    assert cycles.read().parts == ()  # what a FIFO held at the start may be of any length
    frames, taken = 0, 0
    for k in range(1, 60):
        end, turned = 100.0 + (k + 1) * PERIOD, []
        count = math.floor((k + 1) * PERIOD * 50.0) - math.floor(k * PERIOD * 50.0)
        for _ in range(count):
            turned.append(slope * (frames % 200) * 0.02)
            cycles.chip.live(0.02, (0.0, 0.0, turned[-1]), FORCE)
            frames += 1
        sample = cycles.driver.read(end - PERIOD, end)
        if k > 40 and np.all(np.diff(turned) > 0.0):
            behind, *parts = sample.parts
            assert np.diff(parts)[:-1] == pytest.approx(
                slope * PERIOD / 8.0, abs=2.0 * RATE_LSB + 0.01 * slope * PERIOD
            )
            assert behind < parts[0] < sample.rate[2] < parts[-1]
            taken += 1
    assert taken > 5


def test_a_cycle_after_lost_frames_tells_its_mean_alone() -> None:
    cycles = Cycles()
    for _ in range(5):
        cycles.read()
    assert len(cycles.read().parts) == 9
    cycles.chip.live(0.7 * PERIOD, RATE, FORCE)
    assert cycles.driver.read(cycles.now, cycles.now + PERIOD).parts == ()


@pytest.mark.parametrize("rate_range", [250, 500, 1000, 2000])
@pytest.mark.parametrize("force_range", [2, 4, 8, 16])
def test_every_range_gives_the_same_reading(rate_range: int, force_range: int) -> None:
    cycles = Cycles(rate_range=rate_range, force_range=force_range)
    sample = cycles.read()
    assert sample.rate == pytest.approx(RATE, abs=rate_range * DEG / 32768.0)
    assert sample.force == pytest.approx(FORCE, abs=force_range * 9.80665 / 32768.0)


def test_the_sensor_is_configured_as_the_manual_says() -> None:
    registers = Cycles(rate_range=1000, force_range=16, low_pass=41).chip.registers
    assert registers[0x1A] == 0x40 | 3  # stop when full, 41 Hz
    assert registers[0x1B] == 2 << 3
    assert registers[0x1C] == 3 << 3
    assert registers[0x1D] == 3
    assert registers[0x19] == 19  # 50 Hz
    assert registers[0x23] == 0xF8
    assert registers[0x6B] == 0x01
    assert registers[0x6A] == 0x40


def test_one_frame_at_the_range_marks_the_cycle() -> None:
    cycles = Cycles()
    cycles.read()
    cycles.chip.live(0.02, (0.0, 0.0, 600.0 * DEG), FORCE)
    sample = cycles.read()
    assert sample.saturated
    assert sample.rate[2] < 400.0 * DEG


def test_another_chip_and_no_chip_are_refused_by_name() -> None:
    chip = EmulatedMpu(identity=0x71)
    with pytest.raises(SensorError, match="WHO_AM_I: expected 0x70, got 0x71"):
        MpuImu(chip.connect, sleep=lambda _: None).start()
    chip.absent = True
    with pytest.raises(SensorError, match="No such device"):
        MpuImu(chip.connect, sleep=lambda _: None).start()
    with pytest.raises(SensorError, match="not started"):
        MpuImu(chip.connect).read(0.0, 1.0)


def test_a_register_that_does_not_take_its_value_is_named() -> None:
    chip = EmulatedMpu()
    chip.deaf = {0x1B}
    with pytest.raises(SensorError, match="register 0x1b: expected 0x08, got 0x00"):
        MpuImu(chip.connect, sleep=lambda _: None).start()


@pytest.mark.parametrize(
    ("option", "value"), [("rate_range", 300), ("force_range", 3), ("low_pass", 21), ("sample_rate", 2)]
)
def test_options_out_of_range_are_refused_by_name(option: str, value: int) -> None:
    with pytest.raises(SensorError, match=option):
        MpuImu(EmulatedMpu().connect, **{option: value})


def test_a_fifo_that_overflew_is_a_cycle_lost_and_the_next_one_is_whole() -> None:
    cycles = Cycles()
    cycles.read()
    with pytest.raises(SensorError, match="overflown"):
        cycles.read(seconds=2.0)
    assert cycles.read().rate == pytest.approx(RATE, abs=RATE_LSB)


def test_too_few_frames_are_nonsense() -> None:
    cycles = Cycles()
    cycles.read()
    cycles.chip.live(0.1, RATE, FORCE)
    with pytest.raises(SensorError, match="expected about 26 frames in the FIFO, got 5"):
        cycles.driver.read(0.0, PERIOD)


def test_one_error_of_the_bus_is_tried_again_and_a_lasting_one_named() -> None:
    cycles = Cycles()
    cycles.chip.fail_next = 1
    assert cycles.read().rate == pytest.approx(RATE, abs=RATE_LSB)
    cycles.chip.fail_next = 2
    with pytest.raises(SensorError, match=r"register 0x3a: .*Remote I/O error"):
        cycles.read()


def test_a_missing_library_and_a_missing_bus_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "smbus2", None)
    with pytest.raises(SensorError, match=r"pip install 'borechain\[board\]'"):
        open_bus(1)
    monkeypatch.undo()
    pytest.importorskip("smbus2")
    with pytest.raises(SensorError, match="/dev/i2c-250"):
        open_bus(250)


def test_the_library_has_what_the_driver_uses() -> None:
    library = pytest.importorskip("smbus2")
    for name in ("read_byte_data", "write_byte_data", "read_i2c_block_data", "close"):
        assert hasattr(library.SMBus, name)


ROWS = [[0.5 * k, 0.01 * k, 0.02, 1.2, 0.1, 0.2, -9.8, 30.0 + k] for k in range(4)]


@pytest.mark.parametrize("suffix", ["csv", "npy"])
@pytest.mark.parametrize("width", [7, 8])
def test_a_recording_is_played_row_by_row_and_its_end_is_told(tmp_path: Path, suffix: str, width: int) -> None:
    path = tmp_path / f"imu.{suffix}"
    rows = np.array(ROWS)[:, :width]
    if suffix == "npy":
        np.save(path, rows)
    else:
        text = "\n".join(",".join(map(str, row)) for row in rows)
        path.write_text(f"time,wx,wy,wz,fx,fy,fz,temperature\n{text}\n")
    source = ReplayImu(path)
    source.start()
    for row in ROWS:
        sample = source.read(0.0, 1.0)
        assert (*sample.rate, *sample.force) == pytest.approx(row[1:7])
        assert sample.temperature == (row[7] if width == 8 else 25.0)
    with pytest.raises(SensorError, match="of 4 cycles has ended"):
        source.read(0.0, 1.0)


@pytest.mark.parametrize("content", ["", "a,b\n", "1,2,3\n", "1,2,3,4,5,6,seven\n", "1,2\n1,2,3\n"])
def test_a_recording_that_is_none_is_refused_by_its_name(tmp_path: Path, content: str) -> None:
    path = tmp_path / "imu.csv"
    path.write_text(content)
    with pytest.raises(SensorError, match=r"imu\.csv"):
        ReplayImu(path).start()
    with pytest.raises(SensorError, match="absent"):
        ReplayImu(tmp_path / "absent.npy").start()
    (tmp_path / "bad.npy").write_bytes(b"\x93NUMPY nonsense")
    with pytest.raises(SensorError, match=r"bad\.npy"):
        ReplayImu(tmp_path / "bad.npy").start()


def test_a_bad_row_costs_its_cycle_alone(tmp_path: Path) -> None:
    rows = np.array(ROWS)
    rows[1, 3] = math.nan
    np.save(tmp_path / "imu.npy", rows)
    source = ReplayImu(tmp_path / "imu.npy")
    source.start()
    source.read(0.0, 1.0)
    with pytest.raises(SensorError, match="line 2: expected finite numbers"):
        source.read(0.0, 1.0)
    source.start()
    assert source.read(0.0, 1.0).rate[0] == pytest.approx(0.02)


def test_a_recorded_counter_is_moved_to_now(tmp_path: Path) -> None:
    np.save(tmp_path / "counter.npy", [[10.0, 5, 9.9, 1], [10.5, 400, 10.49, 0], [11.0, 4, 99.0, 1]])
    source = ReplayEncoder(tmp_path / "counter.npy")
    source.start()
    assert source.read(1000.0).edge_at == pytest.approx(999.9)
    second = source.read(1000.5)
    assert (second.count, second.rising) == (400, False)
    assert second.edge_at == pytest.approx(1000.49)
    with pytest.raises(SensorError, match="row 3"):
        source.read(1001.0)


def test_a_recorded_counter_may_tell_the_edges_before_the_last(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "counter.csv", [[10.0, 5, 9.9, 1, 9.8, 9.6]], delimiter=",")
    source = ReplayEncoder(tmp_path / "counter.csv")
    source.start()
    assert source.read(20.0).earlier == pytest.approx((19.8, 19.6))


def test_a_counter_file_is_unwrapped_and_its_edges_timed(tmp_path: Path) -> None:
    path = tmp_path / "count"
    path.write_text("4294967290\n")
    source = QuadratureFile(path)
    source.start()
    assert source.read(1.0).count == 0
    path.write_text("4\n")
    sample = source.read(2.0)
    assert (sample.count, sample.edge_at, sample.rising, sample.timed) == (10, 2.0, True, False)
    assert source.read(3.0).edge_at == 2.0
    (tmp_path / "direction").write_text("backward\n")
    path.write_text("0\n")
    sample = source.read(4.0)
    assert (sample.count, sample.edge_at, sample.rising) == (6, 4.0, False)


@pytest.mark.parametrize("content", ["", "nan", "1e9", "\x00", "9" * 30])
def test_a_counter_that_answers_nonsense_is_named(tmp_path: Path, content: str) -> None:
    path = tmp_path / "count"
    with pytest.raises(SensorError, match="count"):
        QuadratureFile(path).start()
    path.write_text("0")
    source = QuadratureFile(path)
    source.start()
    path.write_text(content)
    with pytest.raises(SensorError, match="expected a count"):
        source.read(1.0)
    path.write_text("1000000")
    with pytest.raises(SensorError, match="counts a cycle"):
        source.read(1.0)


def test_sources_are_chosen_by_name(tmp_path: Path) -> None:
    recording = tmp_path / "a.csv"
    recording.touch()
    assert isinstance(imu_source(f"replay:{recording}"), ReplayImu)
    assert isinstance(imu_source(f"timed:{recording}"), TimedImu)
    assert isinstance(imu_source("mpu6500:1"), MpuImu)
    assert isinstance(imu_source("mpu6500:1:0x69"), MpuImu)
    assert isinstance(encoder_source("counter:/sys/x"), QuadratureFile)
    assert isinstance(encoder_source(f"replay:{recording}"), ReplayEncoder)
    assert isinstance(encoder_source(f"timed:{recording}"), TimedEncoder)
    for chip in ("mpu6050", "mpu9250", "icm20948"):
        assert isinstance(imu_source(f"{chip}:1"), MpuImu)
    for text in ("", "replay:", "mpu6500:", "mpu6500:x", "mpu6500:-1", "mpu6500:1:0x70", "bmp280:1"):
        with pytest.raises(NodeConfigurationError, match="imu: expected"):
            imu_source(text)
    for text in ("", "counter:", "counter", "file:x"):
        with pytest.raises(NodeConfigurationError, match="counter: expected"):
            encoder_source(text)


def test_a_fault_is_told_once_and_the_source_started_again() -> None:
    cycles = Cycles()
    said: list[tuple[Severity, str]] = []
    safe = SafeImu(cycles.driver, lambda severity, code, _: said.append((severity, code)))

    def read() -> tuple[float, ...]:
        cycles.chip.live(PERIOD, RATE, FORCE)
        return safe.read(0.0, PERIOD).rate

    assert math.isfinite(read()[2])
    cycles.chip.absent = True
    assert all(math.isnan(read()[2]) for _ in range(5))
    cycles.chip.absent = False
    cycles.chip.reset()
    back = [math.isfinite(read()[2]) for _ in range(4)]
    assert back == [False, True, True, True]
    assert said == [(Severity.ERROR, "sensor_failed"), (Severity.WARNING, "sensor_back")]


def events(process: TubeProcess) -> list[str]:
    return [said.code for _, said in process.said]


class Watched(TubeProcess):
    """Keeps what the tube says."""

    def _send(self, said, now: float) -> bool:
        self.said = [*getattr(self, "said", []), (now, said)] if isinstance(said, Event) else getattr(self, "said", [])
        return super()._send(said, now)

    def _send_event(self, severity, code, arguments) -> None:
        self.said = [*getattr(self, "said", []), (0.0, Event(3, 0, 0.0, severity, code, arguments))]
        super()._send_event(severity, code, arguments)


def test_a_node_whose_sensor_goes_away_goes_on_untrusted_and_comes_back(tmp_path: Path) -> None:
    cycles = Cycles()
    random = np.random.default_rng(1)
    process = Watched(TubeSettings(3), tmp_path, imus=[cycles.driver])
    now = 1000.0
    for k in range(200):
        cycles.chip.absent = 100 <= k < 120
        for _ in range(26):
            noise = random.normal(0.0, 0.05 * DEG, 3)
            cycles.chip.live(PERIOD / 26.0, tuple(noise), tuple(np.array(FORCE) + 0.1 * noise / DEG))
        now += PERIOD
        process.on_cycle([now - PERIOD, *[0.0] * 6], now)
        process.take_frames(now)
        assert np.all(np.isfinite(process.state[0]["P"]))
    codes = events(process)
    assert [c for c in codes if c.startswith("sensor_f") or c in ("bad_sample", "sensor_back")] == [
        "sensor_failed",
        "bad_sample",
        "sensor_back",
    ]


def test_a_sensor_absent_at_the_start_is_an_error(tmp_path: Path) -> None:
    chip = EmulatedMpu()
    chip.absent = True
    with pytest.raises(SensorError, match="mpu6500"):
        TubeProcess(TubeSettings(3), tmp_path, imus=[MpuImu(chip.connect)])
    with pytest.raises(SensorError, match="absent"):
        EncoderProcess(tmp_path, QuadratureFile(tmp_path / "absent"))


@pytest.mark.parametrize("data", [None, [], "nonsense", [1.0], [1.0, "x", 0, 0, 0, 0, 0], list(range(20)), {}, 3])
def test_a_cycle_that_brings_nonsense_ends_nothing(tmp_path: Path, data: object) -> None:
    process = Watched(TubeSettings(3), tmp_path)
    now = 1000.0
    for k in range(6):
        now += PERIOD
        process.on_cycle(data if k == 3 else [now - PERIOD, 1e-4 * k, 0, 1e-5 * k, 0.1 * k, 0.3, -9.8], now)
    assert set(events(process)) & {"bad_sample", "clock_jumped"}
    encoder = EncoderProcess(tmp_path / "encoder")
    encoder.on_cycle(data, 1000.0)
    encoder.on_cycle([999.0, 5, 998.0, 1], 1000.5)


@pytest.mark.parametrize("jump", [-500.0, 1e7])
def test_a_process_whose_clock_jumps_goes_on(tmp_path: Path, jump: float) -> None:
    process = Watched(TubeSettings(3), tmp_path)
    now, random = 1000.0, np.random.default_rng(1)
    for k in range(300):
        now += PERIOD + (jump if k == 120 else 0.0)
        process.on_cycle(
            [now - PERIOD, *random.normal(0.0, 1e-4, 3), *(np.array(FORCE) + random.normal(0, 0.01, 3))], now
        )
        process.take_frames(now)
        assert np.all(np.isfinite(process.state[0]["P"]))
    assert events(process).count("clock_jumped") == 1


def test_a_counter_in_use_gives_no_aiding_while_it_fails(tmp_path: Path) -> None:
    path = tmp_path / "count"
    path.write_text("5")
    said: list[str] = []
    source = QuadratureFile(path)
    source.start()
    safe = SafeEncoder(source, lambda _severity, code, _arguments: said.append(code))
    assert safe.read(1.0) is not None
    path.unlink()
    assert [safe.read(2.0), safe.read(3.0)] == [None, None]
    path.write_text("7")
    assert safe.read(4.0) is None
    sample = safe.read(5.0)
    assert sample is not None
    assert said == ["encoder_failed", "encoder_back"]
