"""Sensors, clocks and joints of a world: statistics, determinism, independence."""

import math
from pathlib import Path

import numpy as np
import pytest

from node.kernels.arithmetic.formats import PERIOD
from sim.errors import ScenarioError
from sim.world.disturbance.converter import clip_rates, quantise_rates
from sim.world.disturbance.row import ImuSamples, OneImu
from sim.world.disturbance.sensor_reading import read_means
from sim.world.disturbance.wander import gauss_markov
from sim.world.marks import wrap_angle
from sim.world.scenario import load_scenario
from sim.world.scenario_file import GyroSection
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, Side

SCENARIO = load_scenario(Path(__file__).parents[2] / "scenarios" / "rig-3.toml")


def test_samples_do_not_depend_on_who_asks_first() -> None:
    one, other = World(SCENARIO, 7), World(SCENARIO, 7)
    asked = [(tube, cycle) for tube in (1, 2, 3) for cycle in range(50)]
    forward = {key: one.imu_sample(*key) for key in asked}
    backward = {key: other.imu_sample(*key) for key in reversed(asked)}
    assert forward == backward
    assert one.imu_sample(1, 3) != one.imu_sample(2, 3)
    assert World(SCENARIO, 8).imu_sample(1, 3) != one.imu_sample(1, 3)


def test_gauss_markov_has_its_variance_and_its_correlation_time() -> None:
    random = np.random.default_rng(1)
    std, tau = np.array([1.0, 2.0, 0.5]), 15.87
    process = gauss_markov(random, 400_000, std, tau, PERIOD)
    np.testing.assert_allclose(process.std(axis=0), std, rtol=0.03)
    lag = round(tau / PERIOD)
    correlation = (process[:-lag] * process[lag:]).mean(axis=0) / process.var(axis=0)
    np.testing.assert_allclose(correlation, math.exp(-lag * PERIOD / tau), atol=0.03)


def test_white_noise_is_the_angle_random_walk() -> None:
    gyro = GyroSection(
        bias_std_dps=(0.0, 0.0, 0.0),
        constant_bias_dps=(0.0, 0.0, 0.0),
        constant_bias_std_dps=0.0,
        scale_factor_std=0.0,
        resolution_dps=0.0,
    )
    zero = np.zeros((100_000, 3))
    readings = read_means(ImuSamples(zero[:, 0], zero, zero, zero[:, 0]), one_imu(gyro))[:, :3]
    expected = np.radians(np.array(gyro.noise_dps_rthz)) / math.sqrt(PERIOD)
    np.testing.assert_allclose(readings.std(axis=0), expected, rtol=0.02)


def test_a_gyroscope_saturates_and_has_steps() -> None:
    rates = np.radians(np.array([[-900.0, 0.0014, 900.0]]))
    samples, imu = ImuSamples(np.zeros(1), rates, rates, np.zeros(1)), one_imu(GyroSection(resolution_dps=0.0026))
    for act in (quantise_rates, clip_rates):
        act(samples, imu, None)
    np.testing.assert_allclose(np.degrees(samples.rate), [[-500.0, 0.0026, 500.0]], atol=1e-9)


def one_imu(gyroscope: GyroSection) -> OneImu:
    """An IMU of a plain world with this gyroscope."""
    return OneImu(SCENARIO.file.model_copy(update={"gyroscope": gyroscope}), 1, 1)


def test_readings_of_the_marks_explain_the_yaw_but_for_the_systematic_error() -> None:
    world = World(SCENARIO, 3)
    for top, t in ((1, 1040.0), (3, world.end - 5.0)):
        settings = {tube: world.tube_settings(tube) for tube in range(1, top + 1)}
        head = float(world.motion.drive(np.array([t]))[0][0])
        for tube in range(1, top + 1):
            above = sum(settings[k].lower_joint.angle for k in range(tube + 1, top + 1))
            known = head + settings[top].drive_joint.angle + above
            off = wrap_angle(known - world.yaw_truth(tube, t) - world.systematic_error(tube, t))
            assert off == pytest.approx(0.0, abs=1e-9)


def test_a_tube_keeps_its_yaw_while_another_is_added_above() -> None:
    world = World(SCENARIO, 3)
    added = next(p for p in world.phases if p.kind == "add" and p.tube == 2)
    assert world.yaw_truth(1, added.start) == world.yaw_truth(1, added.end)
    before = wrap_angle(world.systematic_error(1, added.joint_closed - 0.1))
    after = wrap_angle(world.systematic_error(1, added.joint_closed + 0.1))
    assert before != after  # what is known of it comes through other joints now


def test_clocks_differ_and_come_back() -> None:
    world = World(SCENARIO, 1)
    assert world.local_clock(ENCODER, 1234.5) == 1234.5
    for address in (BASE, 1, 2, 3):
        local = world.local_clock(address, 1234.5)
        assert local != 1234.5
        assert world.true_time(address, local) == pytest.approx(1234.5, abs=1e-9)


def test_a_link_channel_depends_on_the_port_and_nothing_else() -> None:
    from sim.rig.link_channel import LinkChannel

    frame = bytes(40)
    one, other = LinkChannel(1, 0.003, 0.001, 0.2, 0.1), LinkChannel(1, 0.003, 0.001, 0.2, 0.1)
    upper = [one.deliveries(1, Side.UPPER, frame) for _ in range(3000)]
    for _ in range(500):
        other.deliveries(2, Side.LOWER, frame)
    assert upper == [other.deliveries(1, Side.UPPER, frame) for _ in range(3000)]
    assert sum(not d for d in upper) / 3000 == pytest.approx(0.2, abs=0.03)
    assert sum(len(d) == 2 for d in upper) / 3000 == pytest.approx(0.1, abs=0.03)
    assert min(delay for d in upper for delay, _ in d) >= 0.003
    damaging = LinkChannel(1, 0.003, 0.001, 0.2, 0.1, 0.5)
    damaged = [damaging.deliveries(1, Side.UPPER, frame) for _ in range(3000)]
    assert [[delay for delay, _ in d] for d in damaged] == [[delay for delay, _ in d] for d in upper]
    copies = [copy for d in damaged for _, copy in d]
    assert sum(copy != frame for copy in copies) / len(copies) == pytest.approx(0.5, abs=0.05)
    assert all(sum(byte.bit_count() for byte in copy) <= 1 for copy in copies)
    damaging.severed.add((1, Side.UPPER))
    assert damaging.deliveries(1, Side.UPPER, frame) == []


def scenario_of(tmp_path: Path, *replaced: tuple[str, str]) -> Path:
    source = Path(__file__).parents[2] / "scenarios" / "rig-3.toml"
    text = source.read_text()
    for table, lines in replaced:
        head = f"[{table}]\n"
        text = text.replace(head, head + lines + "\n") if head in text else f"{text}\n{head}{lines}\n"
    for file in source.parent.glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    made = tmp_path / "scenario.toml"
    made.write_text(text)
    return made


def test_a_tube_may_have_several_imus_and_the_first_reads_what_it_reads_alone(tmp_path: Path) -> None:
    world = World(load_scenario(scenario_of(tmp_path, ("node", "imus = 2\nimu_noise = [1.0, 3.0]"))), 7)
    alone = World(SCENARIO, 7)
    rows = np.array([world.imu_sample(1, cycle) for cycle in range(90)])
    assert rows.shape == (90, 2, 6)
    np.testing.assert_array_equal(rows[:, 0], [alone.imu_sample(1, cycle) for cycle in range(90)])
    spread = rows.std(axis=0)
    assert np.all(spread[1, 3:] > 1.8 * spread[0, 3:])
    assert abs(np.corrcoef(rows[:, 0, 3], rows[:, 1, 3])[0, 1]) < 0.4
    assert [imu.noise for imu in world.tube_settings(1).imus] == [1.0, 3.0]


def test_a_mount_leans_as_the_scenario_has_it_and_turns_nothing_else(tmp_path: Path) -> None:
    world = World(load_scenario(scenario_of(tmp_path, ("joints", "mount_tilt_std_deg = 1.0"), ("node", "imus = 2"))), 7)
    frames = [world.sensors.frame(tube, imu) for tube in (1, 2, 3) for imu in (0, 1)]
    leans = np.degrees([math.acos(frame[2, 2]) for frame in frames])
    assert 0.1 < leans.mean() < 4.0
    assert len(set(leans)) == len(leans)
    plain = np.array([World(SCENARIO, 7).imu_sample(2, cycle) for cycle in range(60)]).mean(axis=0)
    tilted = np.array([world.imu_sample(2, cycle)[0] for cycle in range(60)]).mean(axis=0)
    np.testing.assert_allclose(tilted[3:], world.sensors.frame(2) @ plain[3:], atol=1e-4)


@pytest.mark.parametrize("lines", ["imus = 0", "imus = 9", "imus = 2\nimu_noise = [1.0]", "imu_noise = [1.0, 1.0]"])
def test_a_cluster_that_cannot_be_is_refused_by_name(tmp_path: Path, lines: str) -> None:
    with pytest.raises(ScenarioError, match=r"node\.imu"):
        load_scenario(scenario_of(tmp_path, ("node", lines)))
