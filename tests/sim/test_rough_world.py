"""The field's world: every effect by a known answer, and a world without one as before."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.errors import ScenarioError
from sim.studies.scenarios import change_sections, complete_string
from sim.world.borehole import Borehole
from sim.world.disturbance.converter import FORCE_CLIPPED
from sim.world.disturbance.vibration import band_noise
from sim.world.rough_disc import RoughDisc
from sim.world.rough_motion import RoughMotion
from sim.world.rough_section import RoughEncoderSection, RoughSection
from sim.world.rough_truth import transport_angle
from sim.world.scenario import scenario_of
from sim.world.world import World

SHORT = {
    "rig": complete_string(1),
    "path": {"straight": {"inclination_deg": 2.0}},
    "schedule": {"add_s": 12.0, "stop_s": 25.0, "finish_s": 5.0, "blocks": 2},
    "rotation": {"turns": 2.0},
    "accelerometer": {"vibration_mps2": 0.0},
    "medium": {"link": "off"},
}
QUIET = {
    "gyroscope": {
        "noise_dps_rthz": (0.0, 0.0, 0.0),
        "bias_std_dps": (0.0, 0.0, 0.0),
        "constant_bias_dps": (0.0, 0.0, 0.0),
        "constant_bias_std_dps": 0.0,
        "scale_factor_std": 0.0,
        "resolution_dps": 0.0,
    },
    "accelerometer": {"vibration_mps2": 0.0, "noise_deg": 0.0, "bias_std_deg": 0.0},
}
LINES = np.zeros(4096)


def rough_world(*, seed: int = 3, hertz: float = 250.0, quiet: bool = True, **sections: dict[str, object]) -> World:
    tables = change_sections(SHORT, rough={"samples_hz": hertz, **sections})
    return World(scenario_of(dict(change_sections(tables, **QUIET) if quiet else tables)), seed)


@pytest.mark.slow
def test_without_an_effect_it_is_the_plain_world() -> None:
    plain = World(scenario_of(SHORT), 3)
    rough = rough_world(hertz=1000.0, quiet=False)
    found, known = rough.sensors.samples(1), plain.sensors.samples(1)
    np.testing.assert_allclose(found[:, :3], known[:, :3], atol=1e-4)
    np.testing.assert_allclose(found[:, 3:], known[:, 3:], atol=5e-3)  # quadrature over the corners of a ramp
    np.testing.assert_allclose(rough.truth(1).yaw(plain.ends), plain.truth(1).yaw(plain.ends), atol=1e-6)
    for end in plain.ends.tolist():
        count, edge_at, rising, _, _ = rough.encoder_sample(end)
        assert (count, rising) == plain.encoder_sample(end)[:3:2]
        assert edge_at == pytest.approx(plain.encoder_sample(end)[1], abs=1e-3)


@pytest.mark.parametrize("drive", [{"ripple": 1.0}, {"stick_slip": 1.0}])
def test_a_drive_that_swings_turns_as_far_and_never_back(drive: dict[str, float]) -> None:
    world = rough_world(drive=drive)
    moved = world.rough_run.moved
    base, rate, _ = world.motion.drive(moved.t)
    np.testing.assert_allclose(moved.head[rate == 0.0], base[rate == 0.0], atol=1e-9)
    flat = rate == rate.max()  # between the ramps, where the mean is steady
    turning = np.diff(moved.head)[flat[1:] & flat[:-1]]
    assert turning.min() > -1e-9
    assert turning.max() > 1.9 * rate.max() / 250.0


def test_a_head_that_stops_dead_and_turns_back() -> None:
    dead, back = rough_world(drive={"dead_stop_dps": 10.0}), rough_world(drive={"turns_back_deg": 5.0})
    braked = math.radians(10.0**2 / (2.0 * 35.0))  # v^2 / 2a
    schedule = dead.motion.drive(dead.rough_run.moved.t)[0]
    assert schedule[-1] - dead.rough_run.moved.head[-1] == pytest.approx(2.0 * braked, rel=0.01)
    assert schedule[-1] - back.rough_run.moved.head[-1] == pytest.approx(math.radians(10.0), rel=1e-6)
    end = float(back.motion.phases[1].end)
    assert back.encoder_sample(end)[2] == 1
    assert back.encoder_sample(end + 6.0)[2] == 0


@given(st.floats(0.01, 5.0), st.integers(0, 1000))
def test_the_string_stays_within_its_play(backlash_deg: float, seed: int) -> None:
    world = World(scenario_of(SHORT), 1)
    section = RoughSection.model_validate(
        {"samples_hz": 50.0, "string": {"backlash_deg": backlash_deg}, "drive": {"turns_back_deg": 2.0}}
    )
    moved = RoughMotion(section, world.motion, world.begin, seed)
    ahead = moved.string - moved.head
    assert ahead.min() >= -1e-12
    assert ahead.max() <= math.radians(backlash_deg) + 1e-12
    assert np.ptp(ahead) > 0.0


def test_a_twist_comes_and_goes() -> None:
    held = rough_world(string={"twist_deg": 2.0, "unwind_s": 0.0}).rough_run
    gone = rough_world(string={"twist_deg": 2.0, "hold_s": 2.0, "unwind_s": 3.0})
    section = gone.scenario.file.rough
    assert section is not None
    lag = gone.rough_run.moved.twist(section.string)
    drill = gone.motion.phases[1]
    t = gone.rough_run.moved.t
    assert np.degrees(np.interp([drill.start, drill.end, drill.end + 5.1], t, lag)) == pytest.approx([0.0, 2.0, 0.0])
    kept = held.moved.twist(section.string.model_copy(update={"unwind_s": 0.0}))
    assert np.degrees(kept[-1]) == pytest.approx(2.0)


def test_a_shaft_in_a_bent_hole_turns_by_the_solid_angle() -> None:
    inclination, turn = math.radians(30.0), math.radians(20.0)
    hole = Borehole.spiral(inclination, 0.0, turn, 10.0)
    assert transport_angle(hole, np.array([10.0]))[0] == pytest.approx((1.0 - math.cos(inclination)) * turn, rel=1e-3)
    spiral = {"spiral": {"inclination_deg": 30.0, "turn_deg": 20.0}}
    tables = change_sections(SHORT, **QUIET)
    shaft = World(scenario_of({**tables, "path": spiral, "rough": {"string": {"transport": "parallel"}}}), 3)
    turned = float(np.sum(shaft.sensors.samples(1)[:, 2])) / 1.9
    head = shaft.motion.drive(np.array([shaft.end]))[0][0] - shaft.first_angle
    assert turned == pytest.approx(head, abs=1e-3)  # the gyroscope of a shaft sees the head's turn and no more


@given(st.lists(st.floats(-0.4, 0.4), min_size=2, max_size=30))
def test_the_counter_follows_a_head_in_either_direction(steps: list[float]) -> None:
    t = np.arange(len(steps) + 1.0)
    head = 0.01 + np.concatenate([[0.0], np.cumsum(steps)])
    disc = RoughDisc(RoughEncoderSection(), t, head, 0.0, LINES, 1)
    for at, angle in zip(t.tolist(), head.tolist(), strict=True):
        count, edge_at, rising, earlier = disc.sample(at)
        assert abs(count - math.floor(angle / (math.tau / 4096))) <= 1
        assert edge_at <= at
        assert list(earlier) == sorted(earlier, reverse=True)
        if edge_at > 0.0:  # an edge is where the head was at its time
            border = (count + (0 if rising else 1)) * math.tau / 4096
            assert np.interp(edge_at, t, head) == pytest.approx(border, abs=1e-9)


def test_encoders_that_are_off() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    head = math.tau * np.clip(t, 0.0, 10.0) / 4.0 + 0.1
    shown = {
        name: RoughDisc(RoughEncoderSection.model_validate(section), t, head, 0.0, LINES, 1)
        for name, section in {
            "plain": {},
            "eccentric": {"eccentricity_deg": 0.5},
            "slipping": {"belt_slip": 0.01},
            "reversed": {"reversed": True},
            "jumped": {"jump_deg": 9.0, "jump_s": 5.0},
            "indexed": {"jump_deg": 9.0, "jump_s": 5.0, "index": True},
            "outliers": {"outliers": 0.5, "outlier_deg": 10.0},
        }.items()
    }
    counts = {name: np.array([disc.sample(at)[0] for at in t.tolist()]) for name, disc in shown.items()}
    plain = counts["plain"]
    off = np.degrees(shown["eccentric"].shown - head)
    assert (off.max(), off.min()) == pytest.approx((0.5, -0.5), abs=1e-3)
    assert plain[-1] - counts["slipping"][-1] == pytest.approx(0.01 * 2.5 * 4096, abs=2)
    assert counts["reversed"][-1] - counts["reversed"][0] == pytest.approx(-2.5 * 4096, abs=2)
    jumped, indexed = counts["jumped"] - plain, counts["indexed"] - plain
    assert (jumped[0], jumped[-1]) == (0, round(9.0 / 360.0 * 4096))
    assert indexed.max() == jumped[-1]
    assert indexed[-1] == 0
    assert np.mean(counts["outliers"] != plain) == pytest.approx(0.5, abs=0.05)


def test_vibration_has_its_band_and_size() -> None:
    noise = band_noise(np.random.default_rng(1), 1 << 16, 1000.0, 20.0, 300.0)
    power = np.abs(np.fft.rfft(noise)) ** 2
    hertz = np.fft.rfftfreq(len(noise), 1e-3)
    assert noise.std() == pytest.approx(1.0, rel=0.02)
    assert power[(hertz < 20.0) | (hertz > 300.0)].sum() < 1e-9 * power.sum()


@pytest.mark.slow
def test_a_front_end_is_late_and_clips() -> None:
    exact = rough_world(hertz=1000.0).sensors.samples(1)
    late = rough_world(hertz=1000.0, sensor={"frames_hz": 1000.0, "low_pass_hz": 20.0}).sensors.samples(1)
    ramp = np.argmax(exact[:, 2] > math.radians(20.0))  # 35 deg/s^2 for two seconds
    delay = (exact[ramp, 2] - late[ramp, 2]) / math.radians(35.0)
    assert delay == pytest.approx(math.sqrt(2.0) / (math.tau * 20.0), abs=2e-3)
    shaken = rough_world(hertz=1000.0, vibration={"turning_g": 4.0}).sensors.rough_cycles(1)
    clipped = shaken.clipped & FORCE_CLIPPED > 0
    turning = exact[:, 2] > math.radians(70.0)
    assert clipped[turning].all()
    assert not clipped[exact[:, 2] == 0.0].any()


def test_the_eighths_of_a_cycle_are_what_the_string_turned_in_them() -> None:
    told = change_sections(SHORT, **QUIET)
    told = change_sections(told, gyroscope={"increments": True})
    for world in (
        World(scenario_of(told), 3),
        World(scenario_of(change_sections(told, rough={"samples_hz": 1000.0})), 3),
    ):
        parts = world.sensors.parts(1)
        assert parts is not None
        borders = world.ends[:, None] + np.arange(-8, 1) / (8.0 * 1.9)
        turned = np.diff(world.truth(1).turned(borders.ravel())[0].reshape(borders.shape), axis=1)
        np.testing.assert_allclose(parts[:, 1:] / (8.0 * 1.9), turned, atol=math.radians(1e-4))
        np.testing.assert_allclose(parts[:, 1:].mean(axis=1), world.sensors.samples(1)[:, 2], atol=1e-9)


def test_the_noise_of_the_eighths_is_white_and_has_the_cycles_for_its_mean() -> None:
    tables = change_sections(SHORT, gyroscope={"increments": True, "resolution_dps": 0.0})
    alone, told = World(scenario_of(SHORT | {"gyroscope": {"resolution_dps": 0.0}}), 3), World(scenario_of(tables), 3)
    np.testing.assert_array_equal(told.sensors.samples(1), alone.sensors.samples(1))
    parts = told.sensors.parts(1)
    assert parts is not None
    still = told.truth(1).rate(told.ends - 0.5)[:, 2] == 0.0
    rest = parts[still & np.roll(still, 1) & np.roll(still, -1), 1:]
    assert rest.mean(axis=1) == pytest.approx(
        told.sensors.samples(1)[still & np.roll(still, 1) & np.roll(still, -1), 2]
    )
    expected = math.radians(7.313e-3) * math.sqrt(8.0 * 1.9)
    assert np.diff(rest, axis=1).std() == pytest.approx(math.sqrt(2.0) * expected, rel=0.1)


@pytest.mark.slow
def test_a_fifo_tells_what_turned_in_each_part_but_for_the_end_that_its_filter_holds_back() -> None:
    sensor = {"frames_hz": 50.0, "low_pass_hz": 20.0, "crystal": 0.01}
    world = rough_world(hertz=1000.0, sensor=sensor)
    parts = world.sensors.parts(1)
    assert parts is not None
    borders = world.ends[:, None] + np.arange(-8, 1) / (8.0 * 1.9)
    turned = np.diff(world.truth(1).turned(borders.ravel())[0].reshape(borders.shape), axis=1)
    late = world.sensors.rough_cycles(1).late
    assert late.min() > 0.0
    found = parts[40:, 1:8] / (8.0 * 1.9)  # by then the crystal is known
    off = found - turned[40:, :7]
    assert np.degrees(np.abs(off).max()) < 0.05  # 71 deg/s for half a millisecond, and the bends of a ramp
    assert np.degrees(off.std()) < 0.01


def test_a_sensor_warms_up() -> None:
    warm = rough_world(sensor={"warm_up_dps": 1.0, "warm_up_s": 5.0, "warm_up_c": 20.0}).sensors.rough_cycles(1)
    np.testing.assert_allclose(np.degrees(warm.readings[-1, :3]), 1.0, atol=1e-3)
    assert warm.temperature[-1] - warm.temperature[0] == pytest.approx(20.0 * math.exp(-0.2), rel=0.1)


def test_a_scale_that_is_another_one_backwards() -> None:
    drive = {"turns_back_deg": 30.0}
    even = rough_world(drive=drive).sensors.rough_cycles(1).readings[:, 2]
    uneven = rough_world(drive=drive, sensor={"scale_asymmetry": 0.02}).sensors.rough_cycles(1).readings[:, 2]
    forward, backward = even > math.radians(70.0), even < math.radians(-10.0)
    assert forward.any()
    assert backward.any()
    np.testing.assert_allclose(uneven[forward] / even[forward], 1.01, rtol=1e-6)
    np.testing.assert_allclose(uneven[backward] / even[backward], 0.99, rtol=1e-6)


def test_the_earth_turns_under_a_gyroscope() -> None:
    still, turned = rough_world(), rough_world(latitude_deg=50.0)
    felt = turned.sensors.rough_cycles(1).readings[:, :3] - still.sensors.rough_cycles(1).readings[:, :3]
    # a whole turn in a sidereal day; about an axis that leans by 2 deg to the north nearly that of the vertical
    rest = felt[still.sensors.rough_cycles(1).readings[:, 2] == 0.0]
    np.testing.assert_allclose(np.linalg.norm(rest, axis=1), math.tau / 86164.1, rtol=1e-6)
    np.testing.assert_allclose(rest[:, 2], -math.tau / 86164.1 * math.sin(math.radians(48.0)), rtol=1e-4)


@pytest.mark.slow
def test_one_seed_one_reading() -> None:
    sections = {"sensor": {"frames_hz": 50.0, "jitter_ms": 5.0}, "vibration": {"torsional_dps": 5.0}}
    one, other = (rough_world(hertz=1000.0, quiet=False, **sections) for _ in range(2))
    np.testing.assert_array_equal(one.sensors.samples(1), other.sensors.samples(1))
    assert not np.array_equal(one.sensors.samples(1), rough_world(seed=4, hertz=1000.0, quiet=False).sensors.samples(1))


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            {"rough": {"vibration": {"turning_g": 1.0}, "samples_hz": 100.0}},
            "rough.vibration: expected lowest_hz below",
        ),
        ({"rough": {}, "encoder": {"edge_times": False}}, "encoder.edge_times: expected no such setting beside"),
        ({"rough": {"drive": {"rippel": 1.0}}}, "rough.drive.rippel: unknown key; did you mean ripple"),
    ],
)
def test_what_cannot_be_is_refused(sections: dict[str, dict[str, object]], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        scenario_of({**SHORT, **sections})


def test_a_driller_stops_anywhere_and_the_encoder_knows_where() -> None:
    plain, spread = rough_world(), rough_world(drive={"stop_spread_deg": 360.0})
    stops = [phase.end for phase in plain.phases if phase.kind == "stop"]
    further = np.degrees(spread.truth(1).yaw(np.array(stops)) - plain.truth(1).yaw(np.array(stops)))
    assert 0.0 < further[0] < 360.0
    assert 0.0 < further[1] - further[0] < 360.0
    assert further[1] - further[0] != pytest.approx(further[0], abs=1.0)
    for at, turned in zip(stops, further.tolist(), strict=True):
        counted = spread.encoder_sample(at)[0] - plain.encoder_sample(at)[0]
        assert counted * 360.0 / 4096 == pytest.approx(turned, abs=0.1)
    begin = [phase.start for phase in plain.phases if phase.kind == "drill"][:1]
    np.testing.assert_array_equal(spread.truth(1).yaw(np.array(begin)), plain.truth(1).yaw(np.array(begin)))


def test_a_spiral_builds_evenly() -> None:
    hole = Borehole.spiral(math.radians(5.0), 0.0, math.radians(60.0), 30.0, math.radians(30.0))
    middle, end = (np.degrees(hole.direction(md)) for md in (15.0, 30.0))
    assert middle == pytest.approx([20.0, 30.0], abs=1e-9)
    assert end == pytest.approx([35.0, 60.0], abs=1e-9)
