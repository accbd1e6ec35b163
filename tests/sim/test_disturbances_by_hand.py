"""Disturbances and parts of a rig by their closed forms, each with numbers that all differ.

What a kernel does with one row is asked of the function that it is made of, so nothing is compiled here.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.node_record import TEMPERATURE
from sim.rig.link_channel import PortStream
from sim.rig.radio_channel import RadioChannel, failed_attempts
from sim.world.depth_meter import DepthMeter
from sim.world.disturbance import accelerometer, converter, gyroscope, warm_up
from sim.world.marks import Marks
from sim.world.rack import Rack
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_disc import RoughDisc
from sim.world.rough_section import RoughEncoderSection
from sim.world.scenario import scenario_of
from sim.world.torsion import StringTorsion, torsional_stiffness
from sim.world.world import World
from telemetry.messages import Side


def python_of(body: Any) -> Any:
    """The function that a kernel is made of."""
    return getattr(body, "py_func", body)


# forces and rates


@pytest.mark.parametrize(("share", "shaken"), [(1.0, 0.0), (0.5, 1.0), (0.25, 0.7)])
def test_noise_and_shaking_of_a_force_add_by_their_squares(share: float, shaken: float) -> None:
    shared, now = SimpleNamespace(force=0.3, shaking=0.4), SimpleNamespace(share=share, shaken=shaken)
    row, drawn = np.array([1.0, 2.0, 3.0, 10.0, 20.0, 30.0]), np.array([9.0, 1.0, -2.0, 0.5])
    python_of(accelerometer.read_noise)(shared, None, now, drawn, 1, row)
    size = share * math.hypot(0.3, 0.4 * shaken)
    assert row == pytest.approx([1.0, 2.0, 3.0, 10.0 + size, 20.0 - 2.0 * size, 30.0 + 0.5 * size])


@pytest.mark.parametrize("period", [PERIOD, 0.01])
def test_noise_that_is_stated_for_a_cycle_is_larger_by_the_root_over_less(period: float) -> None:
    file = SimpleNamespace(
        accelerometer=SimpleNamespace(noise_deg=0.02, gravity_mps2=9.8, vibration_mps2=0.0), rough=object()
    )
    drawn = np.random.default_rng(5).standard_normal((40, 3))
    imu: Any = SimpleNamespace(file=file, noise=3.0, random=lambda _: np.random.default_rng(5))
    samples: Any = SimpleNamespace(force=np.ones((40, 3)), period=period, turning=np.ones(40))
    accelerometer.add_noise(samples, imu, None)
    std = 3.0 * 0.02 * math.radians(1.0) * 9.8 * (1.0 if period == PERIOD else math.sqrt(PERIOD / period))
    assert samples.force == pytest.approx(1.0 + std * drawn)


def test_a_gyroscope_reads_its_matrix_times_the_rate_and_its_bias() -> None:
    matrix = np.array([[1.01, 0.002, 0.003], [0.004, 0.98, 0.006], [0.007, 0.008, 1.03]])
    drawn = gyroscope.GyroscopeConstants(np.array([0.1, 0.2, 0.3]), matrix)
    samples: Any = SimpleNamespace(rate=np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]))
    gyroscope.distort_rates(samples, None, drawn)
    assert samples.rate == pytest.approx(np.array([1.0, 2.0, 3.0])[:, None] * matrix.T + [0.1, 0.2, 0.3])
    shown = gyroscope.gyroscope_gains(drawn, None)
    assert shown[:3, :3] == pytest.approx(matrix)
    assert shown[3:, 3:] == pytest.approx(np.eye(3))


def test_a_sensor_warms_by_its_age_and_its_rate_drifts_by_the_time_since_it_was_cold() -> None:
    shared = SimpleNamespace(warm_up=0.02, warm_up_c=15.0, warm_up_s=100.0)
    now, row = SimpleNamespace(since=50.0, age=300.0), np.zeros(TEMPERATURE + 1)
    python_of(warm_up.feel_warm_up)(shared, None, now, None, 0, row)
    python_of(warm_up.tell_warmth)(shared, None, now, None, 0, row)
    assert row[:6] == pytest.approx([0.02 * (1.0 - math.exp(-0.5))] * 3 + [0.0] * 3)
    assert row[TEMPERATURE] == pytest.approx(15.0 * (1.0 - math.exp(-3.0)))


def test_steps_of_a_frame_are_noise_of_a_twelfth_and_those_of_a_cycle_are_steps() -> None:
    file: Any = SimpleNamespace(gyroscope=SimpleNamespace(resolution_dps=0.5, range_dps=500.0), rough=object())
    step = math.radians(500.0 / 32768.0)
    shared: dict[str, Any] = {"white": np.array([0.001, 0.002, 0.003])}
    converter.set_step(shared, file)
    assert shared["white"] == pytest.approx(np.sqrt(np.array([0.001, 0.002, 0.003]) ** 2 + step**2 / 12.0))
    plain: dict[str, Any] = {}
    converter.set_step(plain, SimpleNamespace(gyroscope=file.gyroscope, rough=None))
    assert plain["step"] == pytest.approx(math.radians(0.5))
    row = np.array([0.9, 1.1, -2.6])
    python_of(converter.read_steps)(SimpleNamespace(step=0.5), None, None, None, 0, row)
    assert row == pytest.approx([1.0, 1.0, -2.5])
    python_of(converter.read_within)(SimpleNamespace(limit=1.5), None, None, None, 0, row)
    assert row == pytest.approx([1.0, 1.0, -1.5])


@pytest.mark.parametrize(("values", "is_clipped"), [([0.0, 0.998], False), ([0.0, 0.999], True), ([-1.5, 0.0], True)])
def test_a_sample_stands_at_its_range_from_just_below_it_on(values: list[float], is_clipped: bool) -> None:
    clipped, at_range = converter.clip_values(np.array([[2.0 * v, 0.0, 0.0] for v in values]), 2.0)
    assert bool(at_range.any()) == is_clipped
    assert np.abs(clipped).max() <= 2.0


# what passes a joint, and what is read of it


@pytest.mark.parametrize("attempts", [1, 3])
def test_each_attempt_that_failed_costs_its_time_and_the_last_that_fails_loses_the_frame(attempts: int) -> None:
    links: Any = SimpleNamespace(
        section=SimpleNamespace(attempts=attempts, attempt_ms=20.0),
        margin=lambda *_: 3.0,
        error_rate=lambda _: 0.5,
        reach=1,
    )
    channel = RadioChannel(links, 7, 0.1, 0.01, 0.3, 0.0)
    drawn = PortStream(7, RandomStream.RADIO, 3, int(Side.LOWER), 4)
    lost, seen = 0, set()
    for _ in range(200):
        fate, wait, again = drawn.draw()
        failed = 0
        while failed < 60 and fate < 0.5 ** (failed + 1):  # as many in a row as its fate is that unlikely
            failed += 1
        first = 0.1 + 0.01 * wait + 0.02 * failed
        expected = [first, first + 0.1 + 0.01 * again] if fate > 0.7 else [first]
        if failed >= attempts:
            expected, lost = [], lost + 1
        found = channel.deliveries(3, Side.LOWER, 4, (1,), 0.0, b"x")
        assert [delay for delay, _, _ in found] == pytest.approx(expected)
        assert {margin for _, _, margin in found} <= {3.0}
        seen.add(failed)
    assert (channel.lost, {0, 1} <= seen) == (lost, True)
    assert [failed_attempts(*one) for one in ((0.2, 0.0), (0.0, 0.5), (0.3, 1.0), (0.5, 0.5))] == [
        0,
        math.inf,
        math.inf,
        0,
    ]


TABLES: dict[str, Any] = {
    "rig": {"tubes": 4, "tube_length_m": 2.0},
    "path": {"spiral": {"inclination_deg": 10.0, "azimuth_deg": 20.0, "build_deg": 30.0}},
    "joints": {"reading_std_deg": 0.5, "mount_std_deg": 0.3, "unseen_std_deg": 0.2},
}


@pytest.fixture(scope="module")
def marks() -> Marks:
    return World(scenario_of(TABLES), 3).marks


def test_a_tube_bears_its_own_error_and_those_of_the_joints_between_it_and_the_top(marks: Marks) -> None:
    drive, lower = marks._joint_errors
    for tube in (1, 2, 3, 4):
        expected = [drive[top] + sum(lower[tube + 1 : top + 1]) - marks.mounts[tube] for top in range(tube, 5)]
        assert marks.errors(tube).tolist() == pytest.approx(expected)


def test_what_turns_unseen_counts_from_the_moment_at_which_a_joint_is_made_up(marks: Marks) -> None:
    slips = marks._slips
    for tube in (1, 2, 3):
        first = max(tube - 1, 0)
        for k, at in enumerate(marks.made_up.tolist()):
            before, since = marks.unseen(tube, np.array([at - 1e-6, at]))
            assert before == pytest.approx(float(np.sum(slips[first:k])) if k > first else 0.0)
            assert since == pytest.approx(float(np.sum(slips[first : k + 1])) if k >= first else 0.0)


def test_in_a_rack_gravity_shows_pitch_and_roll_as_they_are_told() -> None:
    section: Any = SimpleNamespace(
        attitudes_deg=[(0.0, 0.0), (30.0, 0.0), (0.0, 40.0), (-20.0, 110.0)], attitude_std_deg=0.0, lead_s=10.0,
        move_s=5.0, hold_s=40.0, apply_s=7.0,
    )  # fmt: skip
    rack = Rack(section, 100.0)
    assert rack.arrivals.tolist() == [110.0, 155.0, 200.0, 245.0]
    assert (rack.rest_from, rack.end) == (285.0, 292.0)
    names = [(cue.name, cue.at) for cue in rack.cues()]
    assert names == [
        ("begin", 109.0), ("attitude 1", 114.0), ("attitude 2", 159.0), ("attitude 3", 204.0), ("attitude 4", 249.0),
        ("solve", 285.0), ("confirm", 290.0),
    ]  # fmt: skip
    truth = rack.truth(np.random.default_rng(1), 0.0, 9.8)
    for at, (pitch_deg, roll_deg) in zip(rack.arrivals, section.attitudes_deg, strict=True):
        p, r = math.radians(pitch_deg), math.radians(roll_deg)
        down = np.array([math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)])
        assert truth.force(np.array([at + 1.0]))[0] == pytest.approx(-9.8 * down, abs=1e-9)


def test_a_tube_twists_by_the_torque_that_passes_it_summed_over_the_length_above() -> None:
    """Slice by slice: the bit's torque, and the wall's friction below each slice, over the stiffness of a metre."""
    section: Any = SimpleNamespace(
        outer_diameter_m=0.1, inner_diameter_m=0.08, shear_modulus_gpa=80.0, bit_torque_nm=300.0,
        wall_friction_nm_per_m=25.0,
    )  # fmt: skip
    motion: Any = SimpleNamespace(
        phases=[SimpleNamespace(kind="drill", start=0.0, end=100.0)], depth=lambda t: (np.full(len(t), 5.0),) * 3
    )
    torsion = StringTorsion(section, motion, 2.0, np.array([4.0]), np.array([0.0]))
    a_metre = 1.0 / (torsional_stiffness(section, 2.0) * 2.0)
    middles = (np.arange(80_000) + 0.5) * 1e-4
    for tube in (1, 2, 3, 4, 5):
        for depth in (0.0, 1.5, 3.0, 5.0, 7.9):
            above = middles[middles > 2.0 * (tube - 1)]
            whole = a_metre * np.sum(300.0 + 25.0 * np.minimum(above, depth)) * 1e-4 if tube <= 4 else 0.0
            course = (np.array([depth]), np.array([0.0]), np.array([0.0]))
            assert torsion._loaded(tube, np.array([0]), course)[0][0] == pytest.approx(whole, rel=1e-6, abs=1e-15)


def test_a_measured_depth_errs_anew_at_every_stop_and_goes_there_while_the_bit_is_moved() -> None:
    drills = [SimpleNamespace(kind="drill", start=10.0 + 50.0 * k, end=30.0 + 50.0 * k) for k in range(3)]
    motion: Any = SimpleNamespace(phases=drills, depth=lambda t: (0.02 * t,))
    told = SimpleNamespace(
        depth_stuck_after_s=None, depth_stuck_s=None, depth_scale=0.01, depth_offset_m=0.3, depth_std_m=0.05
    )
    meter = DepthMeter(SimpleNamespace(file=SimpleNamespace(told=told)), 4, motion, 0.0)
    draws = 0.05 * random_stream(4, RandomStream.DEPTH_ERRORS, 0).standard_normal(4)
    off = [
        meter.measure_depth(t) - 0.02 * t * 1.01 - 0.3 for t in (0.0, 10.0, 20.0, 30.0, 55.0, 60.0, 80.0, 130.0, 999.0)
    ]
    middle = 0.5 * (draws[0] + draws[1])
    assert off == pytest.approx([draws[0], draws[0], middle, *[draws[1]] * 3, draws[2], draws[3], draws[3]])


# an encoder in the field


def rough(head: np.ndarray, t: np.ndarray, *, lines: int = 36, **section: float | bool | int) -> RoughDisc:
    random = np.random.default_rng(6)
    errors = 0.1 * math.tau / lines * random.uniform(-1.0, 1.0, lines)
    return RoughDisc(RoughEncoderSection(**section), t, head, 100.0, errors, 8)  # type: ignore[arg-type]


@pytest.mark.parametrize("section", [{}, {"reversed": True}, {"eccentricity_deg": 3.0}, {"belt_slip": 0.05}])
def test_edges_are_where_the_disc_passes_its_lines_and_the_twelve_latest_of_one_sense_are_told(
    section: dict[str, Any],
) -> None:
    t = 100.0 + 0.5 * np.arange(81)
    head = 0.3 + 2.0 * np.sin(0.15 * (t - 100.0)) + 0.2 * (t - 100.0)
    disc = rough(head, t, **section)
    fine = np.arange(100.0, 140.0, 0.001)
    shown = np.interp(fine, t, disc.shown)
    width = math.tau / 36
    near = np.floor(shown / width).astype(int)
    around = np.stack([near + k for k in (-1, 0, 1, 2)])
    lines = around * width + disc._errors[around % 36]
    count = np.where(lines <= shown, around, -(10**6)).max(axis=0)
    at = np.flatnonzero(np.diff(count)) + 1
    edges, rises, after = fine[at], np.diff(count)[at - 1] > 0, count[at]
    assert len(edges) > 40
    assert 0 < int(np.sum(rises)) < len(rises)
    for k in range(3, len(edges) - 1, 4):
        if edges[k + 1] - edges[k] < 0.004:
            continue
        found = disc.sample(float(edges[k]) + 0.002)
        first = k
        while first > max(k - 11, 0) and rises[first - 1] == rises[k]:
            first -= 1
        assert (found[0], found[2]) == (after[k], int(rises[k]))
        assert found[1] == pytest.approx(edges[k], abs=0.0011)
        assert list(found[3]) == pytest.approx(edges[first:k][::-1].tolist(), abs=0.0011)
        assert disc.samples(np.array([edges[k] + 0.002]))[0] == pytest.approx([found[0], found[1], found[2]])
    assert disc.sample(100.0) == (count[0], 100.0, 1, ())


def test_a_disc_shows_what_its_seat_its_belt_and_its_wires_make_of_the_head() -> None:
    t, head = np.arange(3.0), np.array([0.5, 4.0, 9.0])
    bare = rough(head, t)
    assert bare.shown == pytest.approx(head)
    assert rough(head, t, reversed=True).shown == pytest.approx(1.0 - head)
    assert rough(head, t, belt_slip=0.1).shown == pytest.approx(head - 0.1 * (head - 0.5))
    once_a_turn = head - 0.1 * np.array([0.0, 3.5, 8.5 - math.tau])
    assert rough(head, t, belt_slip=0.1, index=True).shown == pytest.approx(once_a_turn)
    off_centre = rough(head, t, eccentricity_deg=2.0)
    assert off_centre.shown - head == pytest.approx(math.radians(2.0) * np.sin(head + off_centre._phase))


@pytest.mark.parametrize(("index", "after_a_turn"), [(False, 4), (True, 0)])
def test_counts_that_jump_stay_wrong_until_an_index_passes_in_either_sense(index: bool, after_a_turn: int) -> None:
    t = np.array([100.0, 110.0, 120.0])
    for sign in (1.0, -1.0):
        disc = rough(sign * np.array([1.0, 2.0, 9.0]), t, jump_deg=40.0, jump_s=3.0, index=index)
        off = [disc.sample(at)[0] - int(disc.samples(np.array([at]))[0, 0]) for at in (102.999, 103.0, 109.0, 119.9)]
        assert off == [0, 4, 4, after_a_turn]
    stuck = rough(np.array([1.0, 2.0, 9.0]), t, stuck_bit=3)
    assert stuck.sample(105.0)[0] == int(stuck.samples(np.array([105.0]))[0, 0]) | 8
