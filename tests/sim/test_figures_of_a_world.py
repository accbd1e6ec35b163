"""Figures of a simulated world by hand: what a tube passes, who is missed when, means, bursts, and its own bias."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from node.firmware.edge_interpolation import EDGES
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.string.encoder_step import COUNT, EDGE_AT, NOW
from sim.gauntlet.faulty_channel import FaultyChannel
from sim.rig.radio_channel import RadioChannel, failed_attempts
from sim.string.head_measurements import all_samples, measure_head, turning_samples
from sim.string.schedule import SILENT_AFTER, are_open, count_powered, joined_of, phases_of
from sim.world.disturbance.converter import AT_RANGE, clip_values
from sim.world.disturbance.fifo import any_between, mean_between
from sim.world.disturbance.mount_slip import draw_slip
from sim.world.disturbance.row import OneImu
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Side


def world_of(seed: int = 3, tubes: int = 3, at_start: int | None = None, **tables: Any) -> World:
    begun = tubes if at_start is None else at_start
    plain: dict[str, Any] = {
        "rig": {"tubes": tubes, "tubes_at_start": begun, "tube_length_m": 1.0},
        "path": {"straight": {}},
        "schedule": {"stop_s": 24.0} | ({"blocks": 2} if begun == tubes else {}),
        "rotation": {"turns": 2.0},
        "medium": {"link": "off"},
    }
    return World(scenario_of(plain | tables), seed)


@pytest.mark.parametrize("reach", [1, 2, 4, 8])
def test_a_tube_knows_the_joints_of_all_that_its_radio_passes(reach: int) -> None:
    """Of five tubes: between one and the neighbour that it still hears hang ``reach`` - 1 at most, all above it."""
    world = world_of(tubes=5)
    world.radio = SimpleNamespace(reach=reach)  # type: ignore[assignment]
    for tube in range(1, 6):
        wanted = [other for other in range(tube + 1, 6) if other < tube + reach]
        above = world.tube_settings(tube).above
        assert [one.lower_joint for one in above] == [world.tube_settings(other).lower_joint for other in wanted]
        assert [one.drive_joint for one in above] == [world.tube_settings(other).drive_joint for other in wanted]


def test_a_true_bias_is_what_a_gyroscope_reads_at_rest_beyond_its_noise() -> None:
    """Before the first turning and after it: the readings themselves tell which way a step went."""
    quiet = {"noise_dps_rthz": [0.0, 0.0, 0.0], "resolution_dps": 0.0, "scale_factor_std": 0.0}
    for step_dps in (0.5, -0.5):
        world = world_of(gyroscope=quiet | {"bias_step_dps": step_dps}, joints={"mount_tilt_std_deg": 0.0})
        rests = world.motion.drive(world.ends)[1] + world.motion.drive(world.ends - PERIOD)[1] == 0.0
        known, read = world.sensors.gyro_bias(2), world.sensors.samples(2)[:, 2]
        np.testing.assert_allclose(read[rests], known[rests], atol=1e-7)
        assert known[-1] - known[0] == pytest.approx(math.radians(step_dps), abs=math.radians(0.2))


def test_the_tube_that_was_at_the_top_misses_its_neighbour_after_its_silence_and_the_new_one_at_once() -> None:
    world = world_of(tubes=4, at_start=2)
    powered, later = count_powered(world), phases_of(world)
    joined = joined_of(world, powered, later)
    for cycle, end in enumerate(world.ends.tolist()):
        top = int(powered[cycle])
        for tube in range(1, top + 1):
            at = end + later[tube - 1]
            adds = [phase for phase in world.phases if phase.kind == "add" and phase.start < at < phase.joint_closed]
            missed = bool(adds) and at > adds[0].start + SILENT_AFTER
            is_apart = bool(adds) and (tube == top or (tube == top - 1 and missed))
            assert joined[cycle, tube - 1] == (0.0 if is_apart else 1.0), (cycle, tube)
    assert 0 < np.count_nonzero(joined == 0.0) < joined.size / 2
    assert np.array_equal(are_open(world, world.ends, 1e9), np.zeros(len(world.ends), bool))


def test_a_head_taken_all_at_once_has_the_edges_of_one_taken_cycle_by_cycle() -> None:
    world = world_of()
    (fast, fast_edges), (slow, slow_edges) = turning_samples(world), all_samples(world)
    np.testing.assert_allclose(fast[:, [COUNT, EDGE_AT, NOW]], slow[:, [COUNT, EDGE_AT, NOW]], atol=1e-9)
    for cycle in range(0, world.cycles, 7):
        one, other = list(fast_edges(cycle)), list(slow_edges(cycle))
        assert len(one) >= EDGES - 1
        np.testing.assert_allclose(one[: len(other)], other[: len(one)], atol=1e-9)
        if fast[cycle, EDGE_AT] > world.begin:
            assert one[0] < fast[cycle, EDGE_AT]


def test_a_head_that_rests_knows_its_place_better_than_by_a_count() -> None:
    world = world_of()
    rows = measure_head(world)
    rests = world.motion.drive(world.ends)[1] == 0.0
    after = rests & (world.ends > world.phases[1].end)
    uniform = (math.tau / world.scenario.file.encoder.counts_per_turn) ** 2 / 12.0
    assert np.median(rows[after, 1]) < 0.5 * uniform


@pytest.mark.parametrize("stamps", [[0.0, 1.0, 2.0], [0.25, 0.5, 2.75], [0.1, 0.15, 0.2]])
def test_a_mean_between_two_stamps_is_that_of_the_line_through_the_samples(stamps: list[float]) -> None:
    """Of 3 + 2 t between a and b: 3 + a + b, also where both lie inside one step."""
    t = np.linspace(0.0, 3.0, 31)
    found = mean_between(t, 3.0 + 2.0 * t, np.array(stamps))
    expected = [3.0 + a + b for a, b in itertools.pairwise(stamps)]
    at_grid = all(abs(10.0 * s - round(10.0 * s)) < 1e-9 for s in stamps)
    np.testing.assert_allclose(found, expected, atol=1e-12 if at_grid else 0.06)


def test_a_flag_counts_from_its_own_cut_to_the_next() -> None:
    flags = np.array([True, False, False, True, False, True])
    assert any_between(flags, np.array([0, 1, 3, 3, 4, 6])).tolist() == [1, 0, 0, 1, 1]


@pytest.mark.parametrize(("part", "stands"), [(AT_RANGE - 1e-9, False), (AT_RANGE, True), (1.0, True), (2.0, True)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_sample_stands_at_its_range_from_a_thousandth_below_it_on(part: float, stands: bool, sign: float) -> None:
    values = np.zeros((3, 3))
    values[1, 2] = sign * part * 5.0
    cut, at_range = clip_values(values, 5.0)
    assert at_range.tolist() == [False, stands, False]
    assert cut[1, 2] == sign * min(part, 1.0) * 5.0


@pytest.mark.parametrize("attempts", [1, 2, 5])
def test_a_packet_is_lost_where_all_its_attempts_fail_and_not_before(attempts: int) -> None:
    """With an error rate of a half a fate of f has failed log2(1 / f) times."""
    for failures in range(attempts + 2):
        fate = 0.5**failures * 0.75
        assert failed_attempts(fate, 0.5) == failures
        links = SimpleNamespace(
            reach=1,
            section=SimpleNamespace(attempts=attempts, attempt_ms=10.0),
            margin=lambda joints, at: 3.0,
            error_rate=lambda margin: 0.5,
        )
        channel = RadioChannel(links, 1, 0.02, 0.0, 0.0, 0.0)  # type: ignore[arg-type]
        drawn = SimpleNamespace(draw=lambda f=fate: (f, 0.0, 0.0), damage=lambda frame, part: frame)
        channel._streams[1, Side.UPPER, 2] = drawn  # type: ignore[assignment]
        heard = channel.deliveries(1, Side.UPPER, 2, [], 0.0, b"frame")
        assert [round(delay, 9) for delay, _, _ in heard] == (
            [round(0.02 + 0.01 * failures, 9)] if failures < attempts else []
        )
        assert channel.lost == (0 if failures < attempts else 1)


def test_a_burst_takes_twenty_frames_of_its_port_and_then_ends() -> None:
    channel = FaultyChannel(5, 0.01, 0.0, 0.0, 0.0)
    channel.burst = 0.03
    lost = [not channel.deliveries(1, Side.UPPER, b"x") for _ in range(600)]
    runs, length = [], 0
    for one in [*lost, False]:
        if not one and length:
            runs.append(length)
        length = length + 1 if one else 0
    assert runs
    assert all(run % 20 == 0 for run in runs[:-1])
    assert sum(lost) < 500


@pytest.mark.parametrize("turn_deg", [0.0, 25.0, -70.0])
def test_an_imu_that_slips_by_a_turn_reads_what_is_fixed_in_the_tube_turned_back_by_it(turn_deg: float) -> None:
    world = world_of(disturbance={"mount-slip": {"tube": 2, "turn_deg": turn_deg}})
    slip = draw_slip(OneImu(world.scenario.file, 3, 2, 0))
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    np.testing.assert_allclose(slip @ np.array([1.0, 0.0, 0.0]), [c, -s, 0.0], atol=1e-12)
    np.testing.assert_allclose(slip @ np.array([0.0, 1.0, 0.0]), [s, c, 0.0], atol=1e-12)
    np.testing.assert_array_equal(draw_slip(OneImu(world.scenario.file, 3, 1, 0)), np.eye(3))
