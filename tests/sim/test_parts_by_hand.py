"""Parts of the simulated world against what they are by hand: each draw in its order, each bound, each unlike part."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.campaign.summary import INTERVAL, OverRuns
from sim.rig.link_channel import BLOCK, LinkChannel, PortStream
from sim.rig.report import figures_of_merit, missing_surveys, wrap_deg
from sim.world.disc import Disc
from sim.world.disturbance.joint_slips import WITHIN, JointSlipsSection, slip_at_stops
from sim.world.disturbance.lost_cycles import LOST_CYCLES, are_run
from sim.world.disturbance.tube_play import lean_row, tilts_at
from sim.world.rack import RackTruth
from sim.world.radio import Bursts, power_of
from sim.world.radio_section import RadioSection
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario import scenario_of
from sim.world.torsion import polar_moment, smooth_step
from sim.world.truth import lean_rotation
from sim.world.world import World
from telemetry.messages import Side

# what happens to frames


def test_the_draws_of_a_port_come_in_the_order_of_its_stream() -> None:
    port, random = PortStream(7, RandomStream.LINK, 3, 1), random_stream(7, RandomStream.LINK, 3, 1)
    for _ in range(2):
        fate, waits = random.random(BLOCK), random.standard_exponential((BLOCK, 2))
        for k in range(BLOCK):
            assert port.draw() == (fate[k], waits[k, 0], waits[k, 1])


@pytest.mark.parametrize("duplicate", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("loss", [0.0, 0.3, 1.0])
def test_a_copy_comes_a_latency_after_the_frame_and_a_lost_one_never(loss: float, duplicate: float) -> None:
    channel, drawn = LinkChannel(7, 0.5, 0.1, loss, duplicate), PortStream(7, RandomStream.LINK, 3, int(Side.LOWER))
    lost = 0
    for _ in range(200):
        fate, wait, again = drawn.draw()
        found = [delay for delay, _ in channel.deliveries(3, Side.LOWER, b"x")]
        first = 0.5 + 0.1 * wait
        expected = [first, first + 0.5 + 0.1 * again] if fate > 1.0 - duplicate else [first]
        lost += fate < loss
        assert found == ([] if fate < loss else pytest.approx(expected))
    assert channel.lost == lost
    channel.severed.add((3, Side.LOWER))
    assert channel.deliveries(3, Side.LOWER, b"x") == []
    assert (channel.deliveries(3, Side.UPPER, b"x") == []) == (loss == 1.0)


def test_a_burst_lasts_from_its_begin_to_before_its_end() -> None:
    section = RadioSection.model_construct(burst_every_s=20.0, burst_s=5.0, burst_db=9.0)
    bursts, random = Bursts(section, np.random.default_rng(4), 100.0, 400.0), np.random.default_rng(4)
    spans, t = [], 100.0
    while (t := t + 20.0 * float(random.standard_exponential())) < 400.0:
        spans.append((t, t := t + 5.0 * float(random.standard_exponential())))
    assert len(spans) > 3
    for begin, end in spans:
        assert [bursts.loss(t) for t in (begin, 0.5 * (begin + end), end)] == [9.0, 9.0, 0.0]
        assert bursts.loss(begin - 1e-6) == 0.0
    assert bursts.loss(0.0) == 0.0


def test_both_antennas_add_their_gain() -> None:
    plain, better = (RadioSection.model_construct(transmit_dbm=10.0, gain_dbi=gain) for gain in (0.0, 1.5))
    assert float(power_of(better, 60.0)) - float(power_of(plain, 60.0)) == pytest.approx(3.0)


# the encoder's disc


def disc(jumps: list[tuple[float, float]], edge_std: float = 0.0) -> tuple[Disc, float]:
    """A disc of 400 edges on a head that turns 1.5 rad a second, and its quantum."""
    rate = 1.5
    motion: Any = SimpleNamespace(
        drive=lambda t: (rate * np.asarray(t),),
        time_of_angle=lambda angle: angle / rate,
        times_of_angles=lambda angles: angles / rate,
    )
    at, by = zip(*jumps, strict=True) if jumps else ((), ())
    return Disc(motion, 400, edge_std, np.random.default_rng(3), at, by), math.tau / 400


def test_a_free_turn_counts_from_its_very_moment_on() -> None:
    it, _ = disc([(5.0, 0.7), (8.0, 0.2)])
    t = np.array([5.0 - 1e-9, 5.0, 5.0 + 1e-9, 8.0])
    assert it.angles(t) == pytest.approx(1.5 * t + np.array([0.0, 0.7, 0.7, 0.9]))


@pytest.mark.parametrize("std", [0.0, 0.002])
def test_every_edge_has_the_time_at_which_the_head_passed_it(std: float) -> None:
    it, quantum = disc([(5.0, 0.7), (8.0, 0.2)], std)
    grid = np.linspace(0.0, 12.0, 1_200_001)
    angles = it.angles(grid)
    for t in (3.0, 5.0, 5.003, 5.2, 7.99, 8.0, 8.0005, 11.0):
        for _ in range(2):
            count, last, earlier = it.sample(t)
            places = [n * quantum + float(it.errors[n % 400]) for n in range(count, count - 1 - len(earlier), -1)]
            passed = [float(grid[np.searchsorted(angles, place)]) for place in places]
            assert (last, *earlier) == pytest.approx(passed, abs=3e-5)
            assert places[0] <= float(it.angles(np.array([t]))[0]) + 1e-12
    assert it.counts(np.array([3.0]))[0] == it.sample(3.0)[0]


# what a campaign and a rig show


def test_an_interval_counts_every_run_once_by_its_mean() -> None:
    runs = np.array([1, 1, 1, 2, 3, 3, 4])
    values = np.array([1.0, 2.0, 6.0, 5.0, 7.0, 9.0, 1.0])
    means = np.array([3.0, 5.0, 8.0, 1.0])
    found = OverRuns()
    found.add(runs[:4], values[:4])
    found.add(runs[4:], values[4:])
    half = INTERVAL * float(np.std(means, ddof=1)) / math.sqrt(4)
    assert found.interval == pytest.approx((means.mean(), means.mean() - half, means.mean() + half))
    assert (found.of_rows, found.rows, found.runs) == (pytest.approx(values.mean()), 7, 4)
    one = OverRuns()
    one.add(runs[:3], values[:3])
    assert one.interval == pytest.approx((3.0, math.nan, math.nan), nan_ok=True)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(180.0, 180.0), (-180.0, 180.0), (181.0, -179.0), (-181.0, 179.0), (540.0, 180.0), (0.0, 0.0)],
)
def test_an_angle_lies_beyond_minus_180_up_to_180(angle: float, wrapped: float) -> None:
    assert wrap_deg(angle) == wrapped


def world() -> Any:
    """Two stops of 20 s, the string stands 10 s more after each; every yaw is 0.1 rad, 0.02 of it in all alike."""
    phases = [
        SimpleNamespace(kind=kind, tube=tube, start=start, end=end)
        for kind, tube, start, end in (
            ("drill", 1, 0.0, 100.0), ("stop", 1, 100.0, 120.0), ("drill", 2, 130.0, 200.0), ("stop", 2, 200.0, 220.0),
        )
    ]  # fmt: skip
    return SimpleNamespace(
        phases=phases, end=230.0, bit_depth=lambda t: 0.02 * t, yaw_truth=lambda _tube, _t: 0.1,
        systematic_error=lambda _tube, _t: 0.02,
    )  # fmt: skip


def taken(tube: int, at: float, hops: int = 1, off: float = 0.0) -> dict[str, Any]:
    return {
        "tube": tube, "station_at_s": at, "hops": hops, "yaw_deg": math.degrees(0.1 + off),
        "sigma_yaw_deg": math.degrees(0.03), "sigma_systematic_deg": math.degrees(0.04),
    }  # fmt: skip


@pytest.mark.parametrize(("at", "counts"), [(99.9, False), (100.0, True), (121.0, True), (130.0, True), (130.1, False)])
def test_a_survey_is_of_a_stop_as_long_as_the_string_stands(at: float, counts: bool) -> None:
    found = missing_surveys([taken(1, at), taken(1, 210.0), taken(2, 230.0)], world())
    assert found == ([] if counts else [{"tube": 1, "bit_md_m": 2.4}])


def test_errors_of_yaws_are_told_hop_by_hop() -> None:
    rows = [taken(1, 110.0, 1, 0.05), taken(2, 210.0, 1, 0.09), taken(1, 210.0, 2, -0.03)]
    found = figures_of_merit([], rows, world())
    by_hop = [math.degrees(math.sqrt(0.5 * (0.03**2 + 0.07**2))), math.degrees(0.05)]
    assert found["yaw_rms_deg_by_hop"] == pytest.approx(by_hop)
    assert found["nees_by_hop"] == pytest.approx([0.5 * (0.05**2 + 0.09**2) / 0.05**2, 0.03**2 / 0.05**2])


# truth and disturbances


def test_a_smooth_step_has_the_derivatives_that_it_says() -> None:
    t, h = np.linspace(0.05, 3.95, 40), 1e-5
    value, rate, acceleration = smooth_step(t, 4.0)
    before, after = smooth_step(t - h, 4.0), smooth_step(t + h, 4.0)
    assert np.allclose((after[0] - before[0]) / (2.0 * h), rate, atol=1e-7)
    assert np.allclose((after[1] - before[1]) / (2.0 * h), acceleration, atol=1e-7)
    assert np.allclose(value + smooth_step(4.0 - t, 4.0)[0], 1.0)
    ends = smooth_step(np.array([-1.0, 0.0, 4.0, 5.0]), 4.0)
    assert [part.tolist() for part in ends] == [[0.0, 0.0, 1.0, 1.0], [0.0] * 4, [0.0] * 4]
    assert polar_moment(0.2, 0.1) == pytest.approx(math.pi / 32.0 * (0.2**4 - 0.1**4))


def test_between_two_attitudes_a_rack_turns_by_a_cycloid() -> None:
    held = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.8, 0.0, 0.0], [0.8, 0.0, 0.0]])
    truth = RackTruth(held, np.array([0.0, 20.0, 40.0]), 8.0, 9.8)
    u = np.array([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])
    turned = truth.attitude(12.0 + 8.0 * u).as_rotvec()[:, 0]
    assert turned == pytest.approx(0.8 * (u - np.sin(math.tau * u) / math.tau), abs=1e-12)
    rate, force = truth.cycle_means(np.array([16.0]), 0.01)
    assert rate[0] == pytest.approx([0.8 * 2.0 / 8.0, 0.0, 0.0], abs=1e-5)
    assert force[0] == pytest.approx([0.0, -9.8 * math.sin(0.4), -9.8 * math.cos(0.4)], abs=0.02)


def test_a_tilt_goes_evenly_from_one_stop_to_the_next_and_stays_before_the_first_turning() -> None:
    tilts = np.array([[0.1, -0.2], [0.3, 0.4], [-0.5, 0.6]])
    t = np.array([-50.0, -1e-9, 0.0, 5.0, 10.0, 29.0, 30.0, 35.0, 40.0, 90.0])
    share = np.array([0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 0.0, 0.5, 1.0, 1.0])[:, None]
    first = np.where(t < 30.0, 0, 1)
    expected = tilts[first] * (1.0 - share) + tilts[first + 1] * share
    assert np.allclose(tilts_at(tilts, t, 30.0, 10.0), expected)


@pytest.mark.parametrize(("pitch", "roll"), [(0.1, 0.0), (0.0, -0.2), (0.3, 0.4)])
def test_a_row_leans_as_the_rotation_of_its_axis_does(pitch: float, roll: float) -> None:
    axis = np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])
    row = np.array([0.1, 0.2, 0.3, 1.0, 2.0, 9.0])
    (frame,) = lean_rotation(axis[None])
    expected = np.concatenate([frame @ row[:3], frame @ row[3:]])
    lean_row(row, *axis)
    assert row == pytest.approx(expected)


@pytest.mark.parametrize(("after", "cycles"), [(0.0, 3), (0.5, 1), (0.55, 2), (0.9, 5), (3.0, 2), (0.3, 0)])
def test_so_many_cycles_in_a_row_are_lost_from_a_time_on(after: float, cycles: int) -> None:
    ends = 10.0 + 0.1 * np.arange(1, 11)
    file: Any = SimpleNamespace(
        schedule=SimpleNamespace(begin_s=10.0), disturbance={"lost-cycles": {"after_s": after, "cycles": cycles}}
    )
    section = LOST_CYCLES.section_of(file)
    assert (section.after_s, section.cycles) == (after, cycles)
    late = [k for k, end in enumerate(ends) if end >= 10.0 + after]
    assert np.flatnonzero(~are_run(file, ends)).tolist() == late[:cycles]


def test_a_joint_keeps_all_its_slips() -> None:
    t = np.array([9.0, 13.0, 13.0 + 0.5 * WITHIN, 13.0 + WITHIN, 33.0 + WITHIN, 60.0])
    motion: Any = SimpleNamespace(t=t, angle=0.1 * t, stops=lambda: [10.0, 30.0])
    imu: Any = SimpleNamespace(section_of=lambda _row: JointSlipsSection(slip_deg=4.0, after_s=3.0))
    slip_at_stops(motion, imu, None)
    assert np.degrees(motion.angle - 0.1 * t) == pytest.approx([0.0, 0.0, 2.0, 4.0, 8.0, 8.0])


@pytest.mark.parametrize("seed", [2, 3])
def test_the_lowest_tube_has_no_joint_below_and_no_error_of_one(seed: int) -> None:
    tables: dict[str, Any] = {
        "rig": {"tubes": 3, "tube_length_m": 2.0},
        "path": {"spiral": {"inclination_deg": 10.0, "azimuth_deg": 20.0, "build_deg": 30.0}},
        "joints": {"reading_std_deg": 0.5},
    }
    marks = World(scenario_of(tables), seed).marks
    assert marks.read(1).lower_joint.angle == 0.0
    assert all(marks.read(tube).lower_joint.angle != 0.0 for tube in (2, 3))
