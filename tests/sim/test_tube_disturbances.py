"""What befalls tubes: each effect on a reading against a closed form, in a hole where gravity is known beforehand."""

import math
from typing import Any

import numpy as np
import pytest

from sim.studies.scenarios import Tables, change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World

G, STANDARD_G = 9.81, 9.80665
TUBES, BLOCKS = 3, 6
QUIET: Tables = {
    "rig": {"tubes": TUBES, "tubes_at_start": TUBES, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 0.0}},
    "schedule": {"add_s": 30.0, "stop_s": 24.0, "finish_s": 5.0, "blocks": BLOCKS},
    "rotation": {"turns": 2.0, "advance_m": 0.5},
    "joints": {"mount_std_deg": 0.0},
    "gyroscope": {
        "noise_dps_rthz": (1e-9,) * 3,
        "bias_std_dps": (0.0,) * 3,
        "constant_bias_dps": (0.0,) * 3,
        "constant_bias_std_dps": 0.0,
        "scale_factor_std": 0.0,
        "resolution_dps": 0.0,
    },
    "accelerometer": {"noise_deg": 0.0, "bias_std_deg": 0.0, "vibration_mps2": 0.0, "radius_m": 0.0},
}
SLANTED = {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}}


def world_of(seed: int = 1, path: dict[str, Any] | None = None, **disturbance: dict[str, Any]) -> World:
    tables = change_sections(QUIET, disturbance={name.replace("_", "-"): keys for name, keys in disturbance.items()})
    if path is not None:
        tables = {**tables, "path": path}
    return World(scenario_of(dict(tables)), seed)


def rests(world: World) -> list[np.ndarray]:
    """Cycles of every rest: before the first turning, and after each until the next."""
    drills = [(phase.start, phase.end) for phase in world.phases if phase.kind == "drill"]
    begins, ends = [world.begin, *(end for _, end in drills)], [*(start for start, _ in drills), world.end]
    return [
        np.flatnonzero((world.ends > begin + 1.0) & (world.ends <= end))
        for begin, end in zip(begins, ends, strict=True)
    ]


def forces(world: World, tube: int) -> np.ndarray:
    return world.sensors.samples(tube)[:, 3:]


def test_a_tube_lies_otherwise_at_every_stop_and_keeps_still_in_between() -> None:
    sigma, tilts = 0.3, []
    for seed in range(1, 21):
        world = world_of(seed, play={"sigma_deg": sigma})
        for tube in range(1, TUBES + 1):
            force = forces(world, tube)
            at_stops = [force[cycles] for cycles in rests(world)]
            assert max(np.ptp(one, axis=0).max() for one in at_stops) < 1e-12
            tilts.append([np.degrees(np.arcsin(-one[0, :2] / G)) for one in at_stops])
    found = np.array(tilts)  # (tubes of all seeds, rests, 2): in a plumb hole sideways gravity is the tilt alone
    assert found.std() == pytest.approx(sigma, rel=0.08)
    assert abs(found.mean()) < 4.0 * sigma / math.sqrt(found.size)
    follows = np.mean(found[:, 1:] * found[:, :-1]) / found.var()
    assert abs(follows) < 4.0 / math.sqrt(found[:, 1:].size)
    beside = np.mean(found[0::3] * found[1::3]) / found.var()
    assert abs(beside) < 4.0 / math.sqrt(found[0::3].size)


def test_gravity_and_the_rate_of_turning_are_as_large_in_a_tube_that_leans() -> None:
    leaning, straight = world_of(2, SLANTED, play={"sigma_deg": 1.0, "bow_deg": 1.0}), world_of(2, SLANTED)
    for part in (slice(0, 3), slice(3, 6)):
        one, other = leaning.sensors.samples(1)[:, part], straight.sensors.samples(1)[:, part]
        np.testing.assert_allclose(np.linalg.norm(one, axis=1), np.linalg.norm(other, axis=1), atol=1e-8)
        turned = np.degrees(
            np.arccos(np.clip(np.sum(one * other, axis=1), 0.0, None) / np.sum(other**2, axis=1).clip(1e-9))
        )
        assert turned[np.linalg.norm(other, axis=1) > 0.1].max() < 8.0


def test_a_bow_is_a_tilt_for_good() -> None:
    tilts = []
    for seed in range(1, 41):
        world = world_of(seed, play={"bow_deg": 0.2})
        for tube in range(1, TUBES + 1):
            resting = forces(world, tube)[np.concatenate(rests(world))]
            assert np.ptp(resting, axis=0).max() < 1e-12
            tilts.append(np.degrees(np.arcsin(-resting[0, :2] / G)))
    assert np.std(tilts) == pytest.approx(0.2, rel=0.15)


def test_while_it_turns_a_tube_goes_evenly_from_one_tilt_to_the_next() -> None:
    world = world_of(3, play={"sigma_deg": 0.3})
    drill = next(phase for phase in world.phases if phase.kind == "drill")
    force = forces(world, 1)  # in a plumb hole the bit's advance pushes along gravity
    tilt = np.arcsin(-force[:, 0] / np.linalg.norm(force, axis=1))
    before, after = tilt[world.ends < drill.start][-1], tilt[world.ends > drill.end + 1.0][0]
    inside = (world.ends > drill.start) & (world.ends < drill.end)
    share = (world.ends[inside] - drill.start) / (drill.end - drill.start)
    np.testing.assert_allclose(tilt[inside], before + share * (after - before), atol=1e-9)


def test_a_mount_that_slips_leans_and_turns_from_then_on() -> None:
    pitch, roll, turn = 2.0, -3.0, 25.0
    plumb = world_of(1, mount_slip={"tube": 2, "after_s": 60.0, "pitch_deg": pitch, "roll_deg": roll})
    force = forces(plumb, 2)
    later = plumb.ends > plumb.begin + 60.0
    assert np.abs(force[~later, :2]).max() < 1e-9
    p, r = math.radians(pitch), math.radians(roll)
    expected = -G * np.array([math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)])
    np.testing.assert_allclose(force[later][-1], expected, atol=1e-9)
    np.testing.assert_allclose(forces(plumb, 1), forces(world_of(1), 1), atol=1e-12)

    slanted, still = world_of(1, SLANTED, mount_slip={"tube": 2, "turn_deg": turn}), world_of(1, SLANTED)
    one, other = forces(slanted, 2)[-1], forces(still, 2)[-1]
    angle = np.arctan2(one[1], one[0]) - np.arctan2(other[1], other[0])
    assert math.degrees(math.remainder(angle, math.tau)) == pytest.approx(-turn, abs=1e-9)
    assert one[2] == pytest.approx(other[2], abs=1e-12)
    assert slanted.yaw_truth(2, slanted.end) == still.yaw_truth(2, still.end)


def test_an_accelerometer_steps_and_creeps() -> None:
    step, creep = np.array([1.0, -2.0, 3.0]), np.array([0.1, 0.0, -0.2])
    keys = {"tube": 3, "after_s": 50.0, "step_mg": tuple(step), "creep_mg_per_s": tuple(creep)}
    stepped, honest = world_of(1, force_step=keys), world_of(1)
    added = forces(stepped, 3) - forces(honest, 3)
    since = stepped.ends - stepped.begin - 50.0
    expected = 1e-3 * STANDARD_G * np.where(since[:, None] > 0.0, step + since[:, None] * creep, 0.0)
    np.testing.assert_allclose(added, expected, atol=1e-12)
    np.testing.assert_array_equal(stepped.sensors.samples(3)[:, :3], honest.sensors.samples(3)[:, :3])
    np.testing.assert_array_equal(forces(stepped, 1), forces(honest, 1))


def test_axes_are_exchanged_of_both_sensors() -> None:
    exchanged, honest = (world_of(1, SLANTED, **keys) for keys in ({"axes_exchanged": {"after_s": 40.0}}, {}))
    one, other = exchanged.sensors.samples(1), honest.sensors.samples(1)
    later = exchanged.ends > exchanged.begin + 40.0
    np.testing.assert_array_equal(one[~later], other[~later])
    np.testing.assert_array_equal(one[later], other[later][:, [1, 0, 2, 4, 3, 5]])
    np.testing.assert_array_equal(exchanged.sensors.samples(2), honest.sensors.samples(2))


def test_tubes_with_each_others_calibration_are_off_by_the_difference() -> None:
    left = []
    for seed in range(1, 101):
        exchanged, honest = world_of(seed, calibration_exchanged={"tubes": (1, 3), "raw_mg": 30.0}), world_of(seed)
        one, two, three = (forces(exchanged, tube)[0] - forces(honest, tube)[0] for tube in (1, 2, 3))
        np.testing.assert_allclose(one, -three, atol=1e-12)
        assert not two.any()
        left.append(one)
    assert np.std(left) == pytest.approx(math.sqrt(2.0) * 30.0e-3 * STANDARD_G, rel=0.15)
