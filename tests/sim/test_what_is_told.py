"""What the crew tells wrongly: the truth stays, and what node and ground station are told is off by what was asked."""

import math
from typing import Any

import numpy as np
import pytest

from sim.rig.ground_settings import ground_settings
from sim.world.marks import wrap_angle
from sim.world.scenario import scenario_of
from sim.world.world import World

TABLES: dict[str, Any] = {
    "rig": {"tubes": 4, "tube_length_m": 2.0},
    "path": {"spiral": {"inclination_deg": 10.0, "azimuth_deg": 20.0, "build_deg": 30.0}},
    "rotation": {"turns": 3.0},
}


def world_of(seed: int = 2, **tables: dict[str, Any]) -> World:
    return World(scenario_of(TABLES | tables), seed)


def told(**keys: Any) -> World:
    return world_of(told=keys)


def test_a_joint_is_told_wrong_and_no_other() -> None:
    honest, wrong = world_of(), told(joint_tube=3, joint_deg=7.0, drive_deg=-4.0)
    for tube in range(1, 5):
        one, other = wrong.tube_settings(tube), honest.tube_settings(tube)
        off = [
            wrap_angle(a.angle - b.angle)
            for a, b in ((one.lower_joint, other.lower_joint), (one.drive_joint, other.drive_joint))
        ]
        np.testing.assert_allclose(np.degrees(off), [7.0, -4.0] if tube == 3 else [0.0, 0.0], atol=1e-9)
        assert wrong.yaw_truth(tube, wrong.end) == honest.yaw_truth(tube, honest.end)


@pytest.mark.parametrize("north_deg", [12.0, -150.0])
@pytest.mark.parametrize("rough", [False, True])
def test_an_encoder_whose_zero_is_off_counts_that_much_less(north_deg: float, rough: bool) -> None:
    field = {"rough": {"samples_hz": 100.0}} if rough else {}
    honest, turned = world_of(**field), world_of(told={"north_deg": north_deg}, **field)
    for share in (0.0, 0.4, 0.61, 0.87, 1.0):
        at = honest.ends[int(share * (honest.cycles - 1))]
        counts = turned.encoder_sample(at)[0] - honest.encoder_sample(at)[0]
        assert counts / 4096 * 360.0 == pytest.approx(-north_deg, abs=0.1)
        assert turned.yaw_truth(1, at) == honest.yaw_truth(1, at)
        assert turned.systematic_error(1, at) - honest.systematic_error(1, at) == pytest.approx(
            -math.radians(north_deg)
        )


def test_its_edges_pass_where_the_head_is() -> None:
    world = told(north_deg=33.0)
    turning = world.ends[np.flatnonzero(world.motion.drive(world.ends)[1] > 1.0)[3]]
    count, edge_at, _, _, earlier = world.encoder_sample(float(turning))
    for back, at in enumerate((edge_at, *earlier)):
        head = float(world.motion.drive(np.array([at]))[0][0])
        shown = math.radians((count - back) * 360.0 / 4096)
        assert head - shown == pytest.approx(math.radians(33.0), abs=math.radians(0.04))


def test_a_collar_is_told_to_lean_otherwise() -> None:
    honest, wrong = ground_settings(world_of()), ground_settings(told(collar_north_deg=0.5, collar_east_deg=-0.3))
    leans = []
    for settings in (honest, wrong):
        inclination, azimuth = (math.radians(settings[f"collar_{name}_deg"]) for name in ("inclination", "azimuth"))
        leans.append(math.tan(inclination) * np.array([math.cos(azimuth), math.sin(azimuth)]))
    expected = np.tan(np.radians(10.0)) * np.array([math.cos(math.radians(20.0)), math.sin(math.radians(20.0))])
    np.testing.assert_allclose(leans[0], expected, atol=1e-12)
    np.testing.assert_allclose((leans[1] - leans[0]) * math.cos(math.radians(10.0)), np.radians([0.5, -0.3]), atol=1e-9)
    changed = {key for key in honest if honest[key] != wrong[key]}
    assert changed == {"collar_inclination_deg", "collar_azimuth_deg"}


def test_a_tube_that_is_longer_lifts_those_above_it() -> None:
    honest, longer = world_of(), told(lengths_off_m=(0.0, 0.3))
    assert [longer.below(tube) for tube in range(1, 5)] == pytest.approx([0.0, 2.0, 4.3, 6.3])
    at = np.array([honest.end - 1.0])
    bit = longer.bit_depth(float(at[0]))
    for tube, below in ((2, 2.0), (3, 4.3)):
        force = longer.truth(tube).force(at)[0]
        inclination = longer.scenario.hole.direction(bit - below)[0]
        assert math.acos(-force[2] / np.linalg.norm(force)) == pytest.approx(inclination, abs=1e-9)


def test_tubes_are_added_at_one_height_so_the_bit_goes_as_far_as_they_are_long() -> None:
    off = (0.1, -0.2, 0.3)
    honest, longer = world_of(), told(lengths_off_m=off)
    stops = [phase for phase in longer.phases if phase.kind == "stop"]
    bits = [longer.bit_depth(stop.start) for stop in stops]
    assert bits == pytest.approx([2.1, 3.9, 6.2, 8.2], abs=1e-9)
    t = longer.ends
    depth, rate, thrust = longer.motion.depth(t)
    assert np.diff(depth).min() >= -1e-12
    before, after = (longer.motion.depth(t + s * 1e-3)[0] for s in (-1.0, 1.0))
    np.testing.assert_allclose((after - before) / 2e-3, rate, atol=2e-3 * float(np.abs(thrust).max()) + 1e-9)
    np.testing.assert_array_equal(told(lengths_off_m=(0.0,)).motion.depth(t)[0], honest.motion.depth(t)[0])


def test_a_second_reading_is_of_what_is_so_and_errs_by_itself() -> None:
    found = ground_settings(told(north_deg=3.0, north_check_deg=0.2, depth_offset_m=-0.3, stick_up_check_m=0.01))
    assert (found["north_check_deg"], found["stick_up_check_m"]) == pytest.approx((3.2, -0.29))
    crew = ground_settings(world_of(setup={"unchecked": ("north",), "untold": ("stick-up",)}))
    assert not [key for key in crew if "check" in key]


def test_a_depth_that_counts_too_much_from_another_zero() -> None:
    world = told(depth_scale=0.05, depth_offset_m=-0.2)
    for at in world.ends[:: world.cycles // 7]:
        assert world.measured_depth(float(at)) == pytest.approx(1.05 * world.bit_depth(float(at)) - 0.2)
    assert world.bit_depth(world.end) == pytest.approx(8.0)


def test_a_depth_errs_anew_at_every_stop_and_by_one_number_there() -> None:
    errors = []
    for seed in range(1, 101):
        world = world_of(seed, told={"depth_std_m": 0.01})
        stops = [phase for phase in world.phases if phase.kind == "stop"]
        for stop in stops:
            found = {round(world.measured_depth(t) - world.bit_depth(t), 12) for t in (stop.start, stop.end)}
            assert len(found) == 1
            errors += found
    assert len(set(errors)) == 4 * 100
    assert np.std(errors) == pytest.approx(0.01, rel=0.15)
    by_stop = np.reshape(errors, (100, 4))
    assert abs(np.mean(by_stop[:, 1:] * by_stop[:, :-1])) < 4.0 * 1e-4 / math.sqrt(300)


@pytest.mark.parametrize("lasts", [None, 100.0])
def test_a_depth_that_stands_still_misses_what_the_bit_goes_meanwhile(lasts: float | None) -> None:
    world = told(depth_stuck_after_s=150.0, **({} if lasts is None else {"depth_stuck_s": lasts}))
    at, until = world.begin + 150.0, world.end if lasts is None else world.begin + 150.0 + lasts
    stuck = world.bit_depth(at)
    for t in world.ends[:: world.cycles // 40].tolist():
        if t <= at:
            expected = world.bit_depth(t)
        elif t <= until:
            expected = stuck
        else:
            expected = world.bit_depth(t) - (world.bit_depth(until) - stuck)
        assert world.measured_depth(t) == pytest.approx(expected, abs=1e-12)
    assert world.bit_depth(until) - stuck > 0.5


def test_a_stretch_of_the_hole_leans_over_while_the_rig_drills_below() -> None:
    moved = {"after_s": 300.0, "from_m": 2.0, "to_m": 4.0, "north_deg": 0.0, "east_deg": 0.8, "ramp_m": 0.5}
    path = {"straight": {"inclination_deg": 0.0}}
    honest, after = world_of(path=path), world_of(path={**path, "moved": moved})
    before = after.ends <= after.begin + 300.0
    for tube in range(1, 5):
        t = after.ends
        md = np.array([after.bit_depth(float(one)) for one in t]) - 2.0 * (tube - 1)
        force = after.truth(tube).force(t)
        lean = np.degrees(np.arctan2(np.hypot(force[:, 0], force[:, 1]), -force[:, 2]))
        still = honest.truth(tube).force(t)
        np.testing.assert_array_equal(force[before], still[before])
        inside, far = (md >= 2.0) & (md <= 4.0), (md < 1.5) | (md > 4.5)
        slow = np.hypot(still[:, 0], still[:, 1]) < 1e-9  # nothing else pushes sideways
        flat = after.motion.drive(t)[1] == 0.0
        np.testing.assert_allclose(lean[~before & inside & flat], math.degrees(math.atan(math.radians(0.8))), atol=1e-6)
        np.testing.assert_allclose(lean[~before & far & flat & slow], 0.0, atol=1e-6)
    assert after.truth_station(3.0)["inclination_deg"] == pytest.approx(
        math.degrees(math.atan(math.radians(0.8))), abs=1e-6
    )
    assert after.truth_station(3.0)["azimuth_deg"] == pytest.approx(90.0, abs=1e-6)
    # what lies below has shifted aside by the stretch and half of either ramp
    shift = math.radians(0.8) * (2.0 + 0.5)
    assert after.truth_station(8.0)["east_m"] == pytest.approx(shift, rel=2e-3)
    assert honest.truth_station(8.0)["east_m"] == pytest.approx(0.0, abs=1e-12)
