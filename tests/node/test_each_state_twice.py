"""What a node keeps, tells and believes: every transition twice, every bound at its value, parts that all differ."""

from __future__ import annotations

import errno
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from emulated_encoders import EmulatedCounter, EmulatedLines
from strict_disk import StrictDisk
from test_block_changes import FOLDER, TURNS, Node, block, rested, segments
from test_encoder_sources import START, Told
from test_save_times import BLOB, FillingDisk, nodes
from test_told_figures import AROUND, UNDATED, tube
from test_vn100 import Line, line, line_of, started

from node.errors import SensorError
from node.firmware.block_trial import DIFFER_CYCLES, Trial, TrialVerdict
from node.firmware.edge_interpolation import UNKNOWN, stopped_at
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.firmware.saved_state import resume_node
from node.firmware.tube_settings import TubeSettings
from node.kernels.record.filter_record import default_config
from node.process.block_store import BlockStore
from node.process.counter import LOTS, BootCounter, read_count, write_count
from node.process.drivers.fifo_window import OFF, window_std
from node.process.drivers.frame_clock import phase_bounds
from node.process.drivers.gpio_encoder import WIDTH, GpioEncoder
from node.process.drivers.gravity_witness import SAME_FORCE, SAME_RATE, is_near
from node.process.drivers.quadrature import LARGEST_JUMP, QuadratureFile, counter_file
from node.process.drivers.vn100 import RATE
from node.process.encoder_process import EncoderProcess
from node.process.journal import Journal
from node.process.saver import AT_ONCE, SPACING, Saver
from node.process.survey_log import PLACES, SurveyLog
from node.process.temperature_watch import TemperatureWatch
from node.process.tube_process import OVERRUN_EVERY, TubeProcess
from telemetry.messages import Aiding, NodeFlag, Severity, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters

__all__ = ["line", "rested"]  # fixtures

# what is kept


class WornDisk(StrictDisk):
    """A disk some of whose slots refuse what is written; the calls are noted."""

    def __init__(self) -> None:
        super().__init__()
        self.bad: set[str] = set()
        self.did: list[str] = []

    def reserve(self, path: Path, size: int) -> None:
        self.did.append(f"reserve {path.name}")
        super().reserve(path, size)

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        self.did.append(f"write {path.name}")
        if path.name in self.bad:
            raise OSError(errno.EIO, "Input/output error")
        super().write(path, data, offset)


def test_slots_are_written_in_turn_the_newest_last_and_each_reserved_before() -> None:
    disk = WornDisk()
    journal = Journal(FOLDER, 4, disk)
    for round_ in range(3):
        for place in range(4):
            disk.did = []
            journal.save(nodes(), b"x")
            assert disk.did == [f"reserve slot-{place}", f"write slot-{place}"], round_
        journal = Journal(FOLDER, 4, disk)  # a start in between changes nothing
    disk.bad = {"slot-0", "slot-1"}
    disk.did = []
    journal.save(nodes(), b"y")
    assert [call for call in disk.did if call.startswith("write")] == ["write slot-0", "write slot-1", "write slot-2"]
    assert journal.worn == {0, 1}
    disk.bad = {f"slot-{place}" for place in range(4)}
    for _ in range(2):  # refused by all, and the next save tries every one again
        disk.did = []
        with pytest.raises(OSError, match="Input/output"):
            journal.save(nodes(), b"z")
        assert journal.worn == set()
    assert [call for call in disk.did if call.startswith("write")] == [
        "write slot-3", "write slot-0", "write slot-1", "write slot-2",
    ]  # fmt: skip
    disk.bad = set()
    journal.save(nodes(), b"w")
    loaded = Journal(FOLDER, 4, disk).load()
    assert loaded is not None
    assert loaded[1] == b"w"


def test_the_newest_save_wins_though_those_before_it_were_lost() -> None:
    """Numbers go on from the newest that is there, however few slots there are."""
    disk = StrictDisk()
    for start in range(12):
        journal = Journal(FOLDER, 4, disk)
        if start:
            loaded = journal.load()
            assert loaded is not None
            assert loaded[1] == b"%d" % (3 * start - 1)
        for save in range(3):
            journal.save(nodes(), b"%d" % (3 * start + save))
        for name in list(disk.seen):
            if name != f"slot-{(3 * start + 2) % 4}" and start % 2:
                del disk.seen[name]


def test_after_many_saves_in_a_row_there_is_one_more_each_spacing_and_at_the_end_of_a_rest() -> None:
    saver, still, turning = Saver(FOLDER, StrictDisk()), nodes(), nodes(still=False)
    for _ in range(AT_ONCE):
        saver.save(still, BLOB)
    for _ in range(2):
        assert saver.spent
        for cycle in range(1, SPACING + 1):
            saver.count_cycle(still)
            assert saver.spent == (cycle < SPACING)
        saver.save(still, BLOB)
    assert saver.spent
    saver.count_cycle(turning)  # a rest that was saved is over: it must not be believed
    assert (saver.due, saver.spent) == (True, False)
    saver.save(turning, BLOB)
    saver.count_cycle(turning)
    assert (saver.due, saver.spent) == (False, True)


def test_a_block_goes_to_the_slot_that_is_not_in_use_also_after_a_start() -> None:
    disk = StrictDisk()
    used = []
    for version in range(1, 7):
        store = BlockStore(FOLDER, disk)
        loaded = store.load(lambda _block: "")
        assert (0 if loaded is None else loaded.version) == version - 1
        before = {name: bytes(content.seen) for name, content in disk.seen.items()}
        store.keep_block(block(version))
        (changed,) = [name for name, content in disk.seen.items() if before.get(name) != bytes(content.seen)]
        used.append(changed)
    assert used == ["parameters-1", "parameters-0"] * 3


def test_a_log_that_has_overwritten_says_from_which_number_on_it_is_complete() -> None:
    for starts in (False, True):
        disk = StrictDisk()
        log = SurveyLog(FOLDER, disk)
        for number in range(1, PLACES + 4):
            log.append_payload(number, b"survey %d" % number)
            if starts:
                log = SurveyLog(FOLDER, disk)
            assert log.complete_from == (1 if number == PLACES and starts else max(number - PLACES + 1, 0)
                                         if number > PLACES else 0)  # fmt: skip
        assert [number for number, _ in log.payloads(0, 10**6)] == list(range(4, PLACES + 4))
        assert log.payloads(5, 6) == [(5, b"survey 5"), (6, b"survey 6")]


@pytest.mark.parametrize("count", [0, 1, LOTS - 1, LOTS, LOTS + 7, 2 * LOTS - 2])
def test_every_start_is_counted_from_the_one_before_those_by_lot_too(count: int) -> None:
    disk = StrictDisk()
    for boots in (count + 1, count + 2):
        if boots == 2 * LOTS:
            break
        if boots == count + 1:
            write_count(disk, FOLDER, count)
        counter = BootCounter(FOLDER, lambda below: below - 1, disk)
        assert (counter.boots, counter.fault) == (boots, "")
    write_count(disk, FOLDER, 2 * LOTS - 1)
    with pytest.raises(ValueError, match="expected the number of starts"):
        read_count(disk, FOLDER / "boots")
    assert BootCounter(FOLDER, lambda below: below - 1, disk).boots == 2 * LOTS - 1


@pytest.mark.parametrize(("is_new", "boots"), [(True, 1), (False, LOTS + 5)])
def test_a_folder_without_a_count_is_a_new_one_only_where_it_may_be(is_new: bool, boots: int) -> None:
    disk = StrictDisk()
    assert BootCounter(FOLDER, lambda _below: 5, disk, is_new=is_new).boots == boots
    assert BootCounter(FOLDER, lambda _below: 9, disk, is_new=is_new).boots == boots + 1


@pytest.mark.parametrize("start", [1, 2])
def test_numbers_of_an_encoder_leave_room_for_years_of_cycles_between_two_starts(tmp_path: Path, start: int) -> None:
    for _ in range(start):
        process = EncoderProcess(tmp_path)
    sent: list[Aiding] = []
    process.endpoint.send_aiding = lambda aiding, now: sent.append(aiding)  # type: ignore[method-assign]
    process.on_cycle([0.0, 5, 0.1, 1], 0.5)
    assert sent[0].sequence // 2**32 == start
    assert 2**32 * 0.5 / (365.25 * 86400.0) > 50.0


def test_a_message_is_on_the_disk_before_it_leaves_though_saves_are_few(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path, disk=FillingDisk())
    for number in (1, 2):
        process._saver.due = False
        process.on_overrun(1, 1000.0 + OVERRUN_EVERY * number)
        assert not process._saver.due  # saved at once
    process._saver._allowed = 0
    process._send_event(Severity.WARNING, "x", {})
    assert process._saver.due
    assert process.endpoint.mail._holding


@pytest.mark.parametrize(("later", "told"), [(OVERRUN_EVERY - 1e-6, 1), (OVERRUN_EVERY, 2), (OVERRUN_EVERY + 1.0, 2)])
def test_overruns_are_told_once_in_exactly_so_long_and_counted_always(tmp_path: Path, later: float, told: int) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path, disk=StrictDisk())
    codes: list[tuple[str, object]] = []
    process._send_event = lambda _severity, code, more: codes.append((code, more["overruns"]))  # type: ignore[method-assign, assignment]
    for now in (1000.0, 1000.0 + later):
        process.on_overrun(3, now)
    assert codes == [("overrun", 1), ("overrun", 2)][:told]
    assert process.tube.node["overruns"] == 2


# blocks


@pytest.mark.parametrize("rounds", [1, 2])
def test_a_segment_of_an_older_version_does_not_end_a_newer_upload(rested: Callable[[], Node], rounds: int) -> None:
    node = rested()
    for round_ in range(rounds):
        older, newer = segments(5 + 4 * round_, 1), segments(7 + 4 * round_, 2)
        assert node.take(older[0]).phase is UploadPhase.PARTIAL
        assert node.take(newer[0]).phase is UploadPhase.PARTIAL  # a newer one takes its place
        refused = node.take(older[1])
        assert (refused.phase, refused.received) == (UploadPhase.REFUSED, 0)
        assert "is being uploaded" in refused.detail
        assert node.take(*newer[1:]).phase is UploadPhase.WAITING
        node.rest(8)
        assert node.version == 7 + 4 * round_


def test_readings_that_differ_count_only_where_the_node_knows_that_it_is_quiet() -> None:
    for is_quiet, verdict in ((True, TrialVerdict.REFUSE), (False, TrialVerdict.WAIT)):
        trial = Trial(ParameterBlock(3, 1), 9.81)
        found = [trial.judge_reading(*TURNS, standing=True, quiet=is_quiet) for _ in range(3 * DIFFER_CYCLES)]
        assert found[DIFFER_CYCLES - 1] is verdict
    mixed = Trial(ParameterBlock(3, 1), 9.81)
    for _ in range(DIFFER_CYCLES - 1):
        assert mixed.judge_reading(*TURNS, standing=True, quiet=True) is TrialVerdict.WAIT
        assert mixed.judge_reading(*TURNS, standing=True, quiet=False) is TrialVerdict.WAIT
    assert mixed.judge_reading(*TURNS, standing=True, quiet=True) is TrialVerdict.REFUSE


# what is told


def test_a_node_that_wakes_takes_its_string_for_wound() -> None:
    made = nodes()
    for _ in range(2):
        made[0]["twist"]["wound"] = 0
        made[0]["mount"]["aligning"] = 1
        assert resume_node(made, default_config())
        assert made[0]["twist"]["wound"] == 1
        assert not resume_node(made, default_config())


@pytest.mark.parametrize("then", [AROUND, UNDATED])
@pytest.mark.parametrize("now", [AROUND, UNDATED])
def test_whether_a_revised_survey_is_dated_is_all_that_it_keeps_of_its_flags(then: Any, now: Any) -> None:
    one = tube()
    one.reporter.survey(1000.0, then)
    for is_exceeded in (1, 0, 1):
        one.state["rate_exceeded"] = is_exceeded
        revised = one.reporter.revised_survey(1060.0, now)
        assert revised is not None
        assert (NodeFlag.RATE_EXCEEDED in revised.flags) == bool(is_exceeded)
        assert (NodeFlag.CLOCK_UNSYNCHRONISED in revised.flags) == (not then.synchronised)


@pytest.mark.parametrize("beyond", [-1e-6, 0.0, 1e-6])
def test_an_aiding_is_old_beyond_exactly_its_time(beyond: float) -> None:
    one = tube()
    one.state["yaw_known"], one.state["last_aided"] = 1, 1000.0
    limit = one.settings.aiding_old_after
    now = 1000.0 + limit + beyond
    assert (NodeFlag.AIDING_OLD in one.flags(AROUND, now)) == (now - 1000.0 > limit)
    report = one.reporter.report(now, AROUND, (1, bytes(8)))
    assert report.aiding_age == pytest.approx(limit + beyond, abs=1e-9)


def test_an_innovation_is_told_with_its_own_variance() -> None:
    one = tube()
    one.state["innovation"], one.state["innovation_var"], one.state["scale"] = -3e-3, 7e-5, 2e-4
    report = one.reporter.report(1000.0, AROUND, (1, bytes(8)))
    assert (report.innovation, report.innovation_var, report.scale_factor) == (
        pytest.approx(-3e-3), pytest.approx(7e-5), pytest.approx(2e-4),
    )  # fmt: skip


def stopped(power: float, beyond: float, edges: int = 12, jitter: float = 0.0) -> tuple[float, float]:
    """What is found of a head that passed its edges as k + x = c t^p, with places in error."""
    k = np.arange(edges) + beyond + jitter * np.array([1, -1, -1, 1, 1, 1, -1, -1, 1, -1, 1, -1][:edges])
    times = -(np.maximum(k, 1e-6) ** (1.0 / power))
    return stopped_at(tuple(times.tolist()), 0.02)


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize("beyond", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_where_a_head_stopped_is_found_with_an_error_that_is_that_of_its_sigma(power: float, beyond: float) -> None:
    mean, var = stopped(power, beyond)
    assert 1.0 / (12.0 * 32**2) <= var < 1.0 / 12.0
    assert abs(mean - beyond) <= 3.0 * math.sqrt(var)
    assert stopped(power, beyond, edges=7) == UNKNOWN
    assert stopped(power, beyond, edges=8) != UNKNOWN


# sensors


def test_temperatures_that_are_lost_again_are_those_known_last_of_each_imu() -> None:
    watch = TemperatureWatch(lambda *_said: None, (ImuSettings(), ImuSettings()), lambda: ParameterBlock(3, 1))

    def look(first: float, second: float) -> list[float]:
        other = ImuReading(0.0, 0.5, (0.0, 0.0, 0.1), (0.0, 0.0, -9.8), second)
        reading = ImuReading(0.0, 0.5, (0.0, 0.0, 0.1), (0.0, 0.0, -9.8), first, others=(other,))
        found = watch.look(reading)
        return [found.temperature, found.others[0].temperature]

    assert look(31.0, 41.0) == [31.0, 41.0]
    assert look(math.nan, 42.0) == [31.0, 42.0]
    assert look(33.0, math.nan) == [33.0, 42.0]
    assert look(math.nan, math.nan) == [33.0, 42.0]
    assert look(34.0, 44.0) == [34.0, 44.0]
    assert look(math.nan, math.nan) == [34.0, 44.0]


@pytest.mark.parametrize("of", ["gyroscope", "accelerometer"])
@pytest.mark.parametrize("where", ["imu", "block"])
def test_a_reading_that_any_correction_follows_by_its_temperature_is_lost_without_it(of: str, where: str) -> None:
    sloped = SensorParameters(bias_slopes=((0.0, 1e-5, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    imu = ImuSettings(**{of: sloped}) if where == "imu" else ImuSettings()
    used = ParameterBlock(3, 1, **{of: sloped}) if where == "block" else ParameterBlock(3, 1)
    watch = TemperatureWatch(lambda *_said: None, (imu,), lambda: used)
    found = watch.look(ImuReading(0.0, 0.5, (0.0, 0.0, 0.1), (0.0, 0.0, -9.8), math.nan))
    assert math.isnan(found.rate[2])


@pytest.mark.parametrize("moved", [LARGEST_JUMP - 1, LARGEST_JUMP, LARGEST_JUMP + 1])
@pytest.mark.parametrize("way", [1, -1])
def test_a_counter_may_move_by_exactly_so_much_in_a_cycle(tmp_path: Path, moved: int, way: int) -> None:
    counter = EmulatedCounter(tmp_path, begin=5)
    source = QuadratureFile(counter_file("counter0", tmp_path))
    source.start()
    counter.turn_to(5 + way * moved)
    if moved <= LARGEST_JUMP:
        assert source.read(10.0).count == way * moved
    else:
        with pytest.raises(SensorError, match="expected at most"):
            source.read(10.0)


@pytest.mark.parametrize("ceiling", [999, 4095, 65535])
def test_a_counter_wraps_at_its_ceiling_in_both_ways(tmp_path: Path, ceiling: int) -> None:
    counter = EmulatedCounter(tmp_path, begin=5)
    counter.set("ceiling", str(ceiling))
    source = QuadratureFile(counter_file("counter0", tmp_path))
    source.start()
    total = 0
    for step in (-9, 4, 20, -30, 15, 15):
        total += step
        counter.set("count", str((5 + total) % (ceiling + 1)))
        for k in range(2):  # levels that are not shown
            (counter.device / f"signal{k}" / "signal").unlink(missing_ok=True)
        assert source.read(10.0).count == total


def test_a_counter_that_was_plugged_in_again_may_have_its_lines_the_other_way(tmp_path: Path) -> None:
    counter = EmulatedCounter(tmp_path, begin=0)
    source = QuadratureFile(counter_file("counter0", tmp_path))
    for step in (1, -1, 1):
        counter.step = step
        counter.turn_to(0)
        source.start()
        for count in range(1, 9):
            counter.turn_to(count)
            source.read(10.0)


@pytest.mark.parametrize("off", [WIDTH - 1, WIDTH, WIDTH + 1])
@pytest.mark.parametrize("way", [1, -1])
def test_an_index_may_be_off_by_exactly_its_width(off: int, way: int) -> None:
    lines = EmulatedLines((17, 27, 22), 4096 + way * off)
    told = Told(GpioEncoder(lines.connect, lines.lines))
    lines.turn(lambda n: START + 1e-4 * n, lines.a_turn)
    assert told.read() is not None
    lines.turn(lambda n: START + 1e-4 * n, 2 * lines.a_turn)
    assert (told.read() is not None) == (off <= WIDTH)


def test_lines_that_are_taken_anew_know_of_no_index_and_no_edges_of_before() -> None:
    lines = EmulatedLines((17, 27, 22))
    source = GpioEncoder(lines.connect, lines.lines)
    for _ in range(2):
        source.start()
        lines.turn(lambda n: START + 1e-4 * n, lines.count + 5000)
        source.read(10.0)
        lines.edges()
        lines.turn(lambda n: START + 1e-4 * n, lines.count + 1234)  # while the lines were not taken
        lines.edges()


def test_edges_of_before_a_head_turned_back_say_nothing_of_where_it_stops() -> None:
    lines = EmulatedLines()
    source = GpioEncoder(lines.connect, lines.lines)
    source.start()
    for to, known in ((8, 7), (5, 2), (6, 0), (9, 3), (7, 1)):
        lines.turn(lambda n: START + 1e-4 * n, to)
        assert len(source.read(10.0).earlier) == known


def test_reads_of_a_fifo_bound_the_phase_of_its_frames_from_both_sides() -> None:
    """A read at t that brings the count to n: frame n by then, frame n + 1 later. By hand for three reads."""
    t, n = np.array([10.3, 10.9, 11.6]), np.array([3.0, 6.0, 9.0])
    earliest, latest = phase_bounds(t, n, 0.2)
    assert latest == pytest.approx(min(10.3 - 0.6, 10.9 - 1.2, 11.6 - 1.8))
    assert earliest == pytest.approx(max(10.3 - 0.8, 10.9 - 1.4, 11.6 - 2.0))


@pytest.mark.parametrize(("clock", "delay"), [(3e-4, 0.0), (0.0, 9.9e-3), (3e-4, 4e-3)])
def test_a_window_is_as_uncertain_as_its_clock_and_its_delay_are_together(clock: float, delay: float) -> None:
    assert window_std(clock, delay) ** 2 == pytest.approx(clock**2 + (OFF * delay) ** 2, rel=1e-9)


@pytest.mark.parametrize("size", [SAME_FORCE, SAME_RATE])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_two_readings_are_near_up_to_exactly_so_much_on_every_axis_and_both_ways(
    size: float, axis: int, sign: float
) -> None:
    for off, found in ((0.5 * size, True), (size, True), (1.001 * size, False), (math.nan, False)):
        other = [0.0, 0.0, 0.0]
        other[axis] = sign * off
        assert is_near((0.0, 0.0, 0.0), (other[0], other[1], other[2]), size) == found


@pytest.mark.parametrize(("lines", "is_enough"), [(24, False), (25, True), (26, True)])
def test_half_of_the_lines_of_a_cycle_are_enough(line: Line, lines: int, is_enough: bool) -> None:
    source = started(line)
    row = line_of(np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, -9.0]))
    line.send(row)
    source.read(0.0, 0.5)
    line.send(lines * row)
    assert RATE * 0.5 == 50.0
    if is_enough:
        found = source.read(0.5, 1.0)
        assert found.rate == pytest.approx((0.1, 0.2, 0.3))
        assert found.force == pytest.approx((1.0, 2.0, -9.0))
    else:
        with pytest.raises(SensorError, match=f"expected about 50 lines, got {lines}"):
            source.read(0.5, 1.0)
    source.close()
