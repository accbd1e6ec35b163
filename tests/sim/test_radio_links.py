"""The radio of the world: margins by depth, bursts and distance, the fate of frames, and scenarios that cannot be."""

from __future__ import annotations

import copy
import math
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.errors import ScenarioError
from sim.rig.link_channel import LinkChannel
from sim.rig.radio_channel import RadioChannel, failed_attempts
from sim.studies.soil_link.delivery_time import STEP, LossyJoint, joint_delay, message_delay, quantile
from sim.world.radio import RadioLinks
from sim.world.radio_section import RadioSection
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Side
from telemetry.radio.soil_dielectric import PorosityWarning
from telemetry.transport.hop import FIRST_TIMEOUT, HopLink

DRY, WET = {"sand": 0.4, "clay": 0.1, "water": 0.05}, {"sand": 0.05, "clay": 0.47, "water": 0.4}
SOIL: dict[str, Any] = {"gap_m": 0.3, "soil": [DRY | {"to_m": 2.0}, WET]}
PIPE: dict[str, Any] = {"mode": "pipe", "frequency_mhz": 5000.0, "pipe": {"reach": 3, "joint_db": 4.0}}
RIG: dict[str, Any] = {
    "rig": {"tubes": 3, "tubes_at_start": 3, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 60.0}},
    "schedule": {"blocks": 1},
}


def links(section: dict[str, Any], seed: int = 1, bit: float = 10.0) -> RadioLinks:
    return RadioLinks(RadioSection(**section), seed, 5, 2.0, 1000.0, 3000.0, lambda _t: bit, lambda md: 0.5 * md)


def test_a_joint_takes_the_soil_at_its_true_depth() -> None:
    """Joints at measured depths of 8, 6, 4, 2 and 0 m of a hole that goes down by half: wet, wet, at the bound, dry."""
    heard = [links(SOIL).margin((joint,), 1500.0) for joint in range(1, 6)]
    assert heard[0] == heard[1] == heard[2] < heard[3] == heard[4]
    air = links(SOIL, bit=9.0).margin((5,), 1500.0)
    assert air > heard[4]


def test_margin_inside_the_pipe_falls_by_wall_and_joint() -> None:
    pipe = links(PIPE)
    one, two, three = (pipe.margin(tuple(range(2, 2 + n)), 1500.0) for n in (1, 2, 3))
    assert one - two == pytest.approx(two - three)
    assert 4.0 < one - two < 4.2


def test_fades_and_bursts_are_of_the_joint_and_the_seed() -> None:
    faded = SOIL | {"fade_std_db": 3.0, "burst_every_s": 20.0, "burst_s": 2.0, "burst_db": 9.0}
    first, again, other = links(faded), links(faded), links(faded, seed=2)
    times = np.arange(1000.0, 3000.0, 0.05)
    trace, same, different = ([r.margin((2,), t) for t in times] for r in (first, again, other))
    assert trace == same
    assert trace != different
    clear, burst = first.states(2, 1500.0)
    assert set(np.round(trace, 9)) == {round(clear, 9), round(burst, 9)}
    assert clear - burst == pytest.approx(9.0)
    inside = np.isclose(trace, burst)
    assert np.mean(inside) == pytest.approx(2.0 / 22.0, abs=0.04)


@given(st.floats(0.01, 0.99), st.integers(1, 5))
@pytest.mark.slow
def test_attempts_fail_with_the_power_of_the_error_rate(error_rate: float, attempts: int) -> None:
    fates = (np.arange(20_000) + 0.5) / 20_000
    share = np.mean([failed_attempts(fate, error_rate) >= attempts for fate in fates])
    assert share == pytest.approx(error_rate**attempts, abs=2e-4)


def test_a_frame_without_a_chance_is_lost_and_one_without_a_risk_is_not() -> None:
    assert failed_attempts(0.0, 0.0) == failed_attempts(0.999, 0.0) == 0
    assert failed_attempts(0.0, 0.5) == failed_attempts(0.3, 1.0) == math.inf


def test_loss_and_delay_follow_from_the_margin() -> None:
    """A link at its threshold: half of the attempts fail, so of three an eighth of the frames."""
    section = SOIL | {"attempts": 3, "attempt_ms": 5.0}
    at_threshold = section | {"threshold_dbm": -103.0 + links(section).margin((1,), 1500.0)}
    channel = RadioChannel(links(at_threshold), 1, 0.003, 0.0, 0.0, 0.0)
    assert channel.reach == 1
    fates = [channel.deliveries(1, Side.UPPER, 2, (1,), 1500.0, b"frame") for _ in range(20_000)]
    late = np.array([1000.0 * copies[0][0] for copies in fates if copies])
    assert 1.0 - len(late) / len(fates) == pytest.approx(0.125, abs=0.01)
    assert channel.lost == len(fates) - len(late)
    for delay, share in ((3.0, 0.5), (8.0, 0.25), (13.0, 0.125)):
        assert np.mean(np.isclose(late, delay)) * len(late) / len(fates) == pytest.approx(share, abs=0.015)
    assert all(abs(copies[0][2]) < 1e-9 for copies in fates if copies)


def test_pairs_of_ports_draw_apart_from_each_other_and_from_a_cable() -> None:
    def fates(seed: int, hearer: int) -> list[float]:
        channel = RadioChannel(links(PIPE), seed, 0.003, 0.001, 0.0, 0.0)
        return [channel.deliveries(1, Side.UPPER, hearer, (1,), 1500.0, b"x")[0][0] for _ in range(20)]

    cable = LinkChannel(1, 0.003, 0.001, 0.0, 0.0)
    wired = [cable.deliveries(1, Side.UPPER, b"x")[0][0] for _ in range(20)]
    assert fates(1, 2) == fates(1, 2)
    assert len({tuple(fates(1, 2)), tuple(fates(1, 3)), tuple(fates(2, 2)), tuple(wired)}) == 4


def test_a_lossless_joint_takes_its_latency() -> None:
    sure = LossyJoint((0.0, 0.0), 2, 0.004, 0.003, 0.0)
    assert joint_delay(sure)[3] == pytest.approx(1.0)
    assert quantile(message_delay([sure] * 4), 0.99) == pytest.approx(0.012, abs=STEP)


def test_a_lost_frame_comes_one_timeout_later() -> None:
    """One attempt of a half: again after 60 ms, then 120 ms, and so on."""
    delay = joint_delay(LossyJoint((0.5, 0.5), 1, 0.004, 0.003, 0.0))
    for k, at in enumerate((0.0, FIRST_TIMEOUT, 3.0 * FIRST_TIMEOUT, 7.0 * FIRST_TIMEOUT)):
        assert delay[round((at + 0.003) / STEP)] == pytest.approx(0.5 ** (k + 1))


def test_the_expected_delay_is_that_of_two_links_over_a_channel_with_bursts() -> None:
    """Four thousand messages over one joint, far enough from each other to find the bursts in balance."""
    section = SOIL | {"attempts": 1, "width_db": 1.5, "burst_every_s": 4.0, "burst_s": 1.0, "burst_db": 8.0}
    margin = links(section | {"burst_every_s": None}).margin((1,), 1500.0)
    radio = RadioSection(**(section | {"threshold_dbm": -103.0 + margin - 3.0}))
    joints = RadioLinks(radio, 5, 1, 2.0, 0.0, 41_000.0, lambda _t: 10.0, lambda md: 0.5 * md)
    channel = RadioChannel(joints, 5, 0.003, 0.0, 0.0, 0.0)
    times = np.array([time_over(channel, 10.0 * (k + 1)) for k in range(4000)])
    rates = tuple(joints.error_rate(m) for m in joints.states(1, 0.0))
    expected = np.cumsum(joint_delay(LossyJoint(rates, 1, 0.004, 0.003, 0.0, 0.25, 1.0)))  # type: ignore[arg-type]
    for seconds in (0.01, 0.1, 0.3, 0.5, 1.0, 2.0, 4.0):
        came = np.mean(times <= seconds)
        assert came == pytest.approx(expected[round(seconds / STEP)], abs=0.025)


def time_over(channel: RadioChannel, at: float) -> float:
    """Time that a message takes from one link to the next, both fresh; the way back is free of loss."""
    lower, upper = HopLink(1, 1), HopLink(2, 1)
    lower.receive(upper_hello(upper, lower, at), at)
    lower.send_reliable(b"survey")
    now = at
    while now < at + 30.0:
        for frame in lower.take_frames(now):
            for delay, arriving, _ in channel.deliveries(1, Side.UPPER, 2, (1,), now, frame.payload):
                if b"survey" in upper.receive(arriving, now + delay):
                    return now + delay - at
        lower.last_heard = now  # the way back is heard all the time
        now = max(lower.next_wake(now), now + 1e-4)
    raise AssertionError("the message never came")


def upper_hello(upper: HopLink, lower: HopLink, now: float) -> bytes:
    """A first frame of the upper end, which has heard the lower one."""
    lower.send_best_effort(b"hello", "hello")
    for frame in lower.take_frames(now):
        upper.receive(frame.payload, now)
    upper.send_best_effort(b"hello", "hello")
    return upper.take_frames(now)[0].payload


def scenario(radio: dict[str, Any], **tables: Any) -> World:
    return World(scenario_of(copy.deepcopy(RIG | tables | {"radio": radio})), 1)


def test_tubes_know_the_joints_that_they_may_hear_across() -> None:
    world = scenario(PIPE)
    settings = {tube: world.tube_settings(tube) for tube in (1, 2, 3)}
    assert [s.reach for s in settings.values()] == [3, 3, 3]
    assert [len(s.above) for s in settings.values()] == [2, 1, 0]
    for tube, passed in ((1, settings[1].above), (2, settings[2].above)):
        for k, known in enumerate(passed, tube + 1):
            assert (known.drive_joint, known.lower_joint) == (settings[k].drive_joint, settings[k].lower_joint)
    assert scenario(SOIL).tube_settings(1).above == ()


@pytest.mark.parametrize(
    ("radio", "tables", "named"),
    [
        (SOIL | {"frequency_mhz": 2400.0}, {}, "radio: frequency: expected 0.3..1.3 GHz, got 2.4"),
        (PIPE | {"frequency_mhz": 2400.0}, {}, "radio: frequency: expected more than 2.928 GHz, the cut-off of TE11"),
        (PIPE | {"pipe": {"carbon_percent": 5.0}}, {}, "radio: carbon: expected 0.06..1.22 %, got 5"),
        (PIPE | {"pipe": {"radius_cm": -3.0}}, {}, "radio.pipe.radius_cm"),
        (SOIL | {"gap_m": -0.1}, {}, "radio.gap_m"),
        (SOIL | {"soil": [WET | {"sand": 0.9}]}, {}, "radio: sand and clay: expected fractions of at most 1 together"),
        (SOIL | {"soil": [WET | {"water": 1.5}]}, {}, "radio: water: expected 0..1, got 1.5"),
        (SOIL | {"soil": []}, {}, "radio: soil: expected at least one [[radio.soil]]"),
        (SOIL | {"pipe": {}}, {}, "radio: soil: expected at least one [[radio.soil]] and no [radio.pipe]"),
        (SOIL | {"soil": [WET | {"to_m": 3.0}]}, {}, "radio: soil.to_m: expected growing depths"),
        (
            SOIL | {"soil": [DRY | {"to_m": 3.0}, DRY | {"to_m": 2.0}, WET]},
            {},
            "radio: soil.to_m: expected growing depths, and none in the last layer",
        ),
        (PIPE | {"soil": [WET]}, {}, "radio: soil: expected no [[radio.soil]] with the mode pipe"),
        (SOIL, {"medium": {"link": "off"}}, 'radio: expected medium.link = "on" with it, got off'),
        (PIPE, {"node": {"joints": "solved"}}, "node.joints: expected marks with a radio in the pipe, got solved"),
        (SOIL | {"soil": [WET | {"sandy": 0.1}]}, {}, "radio.soil.0.sandy: unknown key; did you mean sand?"),
    ],
)
def test_a_radio_that_cannot_be_is_refused_in_one_line(
    radio: dict[str, Any], tables: dict[str, Any], named: str
) -> None:
    with pytest.raises(ScenarioError) as refused:
        scenario(radio, **tables)
    assert named in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_water_beyond_the_pores_is_accepted_with_one_warning() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        world = scenario(SOIL | {"soil": [WET | {"water": 0.8}]})
    assert [warning.category for warning in caught] == [PorosityWarning]
    assert world.radio is not None
    assert world.radio.margin((1,), world.begin) > 0.0


def test_a_fault_of_a_tube_that_hangs_from_the_start_has_its_time() -> None:
    world = scenario(PIPE, faults=["kill-node:2@50+20"])
    assert [str(fault) for fault in world.faults] == ["kill-node:2@50+20"]
    with pytest.raises(ScenarioError, match="expected a time between 0 s, when the tube is added, and"):
        scenario(PIPE, faults=["kill-node:2@5000+20"])
