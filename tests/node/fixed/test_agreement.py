"""The integer loop and the float64 loop side by side, and the node that is built on either."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from node.errors import NodeConfigurationError
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.kernel_choice import Loop, added_loop, kernel_of
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import CEILING, DEG, PERIOD, VAR_Q, Array
from node.kernels.filter.fixed.cycle import run_cycle as fixed_run_cycle
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.filter.resets import forget_bias
from node.kernels.record.filter_conversion import (
    LARGEST,
    config_in_integers,
    saturated_integer,
    show_aiding,
    show_covariance,
    show_cycle,
    state_in_integers,
    to_fixed,
)
from node.kernels.record.filter_record import STATE, CycleStatus, default_config, new_state
from node.kernels.record.integer_filter import FIXED_STATE
from node.kernels.record.integer_node import new_integers
from node.kernels.record.node_record import END, JOINED, START, new_node
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.node_step import (
    ONWARD,
    REFUSED,
    USED,
    begin_step,
    end_step,
    hand_down,
    node_aiding,
    node_step,
    own_systematic,
    say_events,
    take_aiding,
)
from node.kernels.step.shadow_words import learn_aiding, learn_inputs, learn_node, show_node
from node.kernels.string.relay import offer_aiding
from node.kernels.turns.yaw_doubts import noise_var
from sim.studies.fixed_point.run import AIDING_VAR, LIMITS, compare_kernels, draw_inputs, rows_of
from sim.studies.published_form.published_step import leave_published, published_loop
from telemetry.messages import Aiding, NodeState

WORK_SPACE = {"h", "ph", "gain"}
G = 9.81


@pytest.mark.slow
def test_four_thousand_cycles_agree() -> None:
    found = compare_kernels(4000, 3)
    rows = rows_of(found)
    assert [row["case"] for row in rows] == ["turning, aided", "turning, outage", "rest, aided", "rest, outage"]
    assert max(row["yaw_max_deg"] for row in rows) < LIMITS["yaw_deg"] / 100.0
    assert max(row["sigma_max"] for row in rows) < LIMITS["sigma"] / 100.0
    assert (found.overflows, found.status_differs) == (0, 0)


def shown(cycles: int, seed: int) -> tuple[np.void, np.void, FixedNode]:
    """Both float64 records after the same inputs."""
    config, reference, shadow = default_config()[0], new_state(default_config())[0], new_state(default_config())[0]
    fixed = FixedNode()
    for given in draw_inputs(cycles, seed):
        reading = (np.array(given.rate), np.array(given.force), given.start, given.end, given.joined)
        run_cycle(reference, config, *reading)
        fixed.run_cycle(shadow, config, *reading)
        if given.aiding is not None:
            yaw, at, sequence = given.aiding
            offer_aiding(reference, config, yaw, AIDING_VAR, 1e-6, -0.3, at, sequence, 0)
            fixed.offer_aiding(shadow, config, yaw, AIDING_VAR, 1e-6, -0.3, at, sequence, 0)
    return reference, shadow, fixed


def test_every_field_of_the_record_is_shown() -> None:
    reference, shadow, _ = shown(1700, 2)
    assert reference["pending"] == shadow["pending"]
    for name in set(STATE.names or ()) - WORK_SPACE:
        a, b = np.asarray(reference[name], float), np.asarray(shadow[name], float)
        if name == "reference_offset":
            a = a % (2.0 * np.pi)
        if name.startswith("pending_"):
            a, b = a[: reference["pending"]], b[: reference["pending"]]
        np.testing.assert_allclose(b, a, rtol=2e-4, atol=200.0 if name.endswith("yaw") else 1e-7, err_msg=name)


def test_what_is_shown_is_read_back_the_same() -> None:
    _, shadow, fixed = shown(1500, 4)
    again = state_in_integers(shadow, G)[0]
    again["overflows"] += fixed.overflows
    for name in set(FIXED_STATE.names or ()) - {"ph", "rest", "gain", "gain_q", "decay"}:
        a, b = np.asarray(fixed.state[name], np.int64), np.asarray(again[name], np.int64)
        if name.startswith("pending_"):
            a, b = a[: fixed.state["pending"]], b[: fixed.state["pending"]]
        largest = 2 ** max(0, int(np.abs(a).max(initial=0)).bit_length() - 52)
        assert np.abs(a - b).max(initial=0) <= largest, name
    show_cycle(again, shadow, G)
    show_covariance(again, shadow)
    show_aiding(again, shadow)


def test_the_configuration_fits() -> None:
    _, beyond = config_in_integers(default_config()[0])
    assert beyond == 0
    wild = default_config()
    wild["boot_bias_std"] = 1e3
    wild["bias_std"] = 1e3
    assert config_in_integers(wild[0])[1] > 0
    assert state_in_integers(new_state(wild)[0], G)[0]["overflows"] == 6  # three biases, in P and now_P


def test_a_reading_beyond_the_range_is_held_and_counted() -> None:
    config, state, fixed = default_config()[0], new_state(default_config())[0], FixedNode()
    status = fixed.run_cycle(state, config, np.array([0.0, 0.0, 40.0]), np.array([0.0, 0.0, -1e9]), 0.0, PERIOD, 1)
    assert status & CycleStatus.RATE_EXCEEDED
    assert fixed.overflows == 2
    before = state.tobytes()
    nothing = np.array([0.0, np.nan, 0.0])
    assert fixed.run_cycle(state, config, nothing, np.zeros(3), PERIOD, 2 * PERIOD, 1) == CycleStatus.BAD_SAMPLE
    assert state.tobytes() == before


@pytest.mark.parametrize(
    ("value", "sign"), [(13.0, 1), (-13.0, -1), (1e9, 1), (-1e300, -1), (np.inf, 1), (-np.inf, -1)]
)
def test_whatever_lies_beyond_the_range_is_held_at_its_end(value: float, sign: int) -> None:
    record = np.zeros(1, FIXED_STATE)[0]
    assert to_fixed(record, value, VAR_Q, CEILING) == sign * CEILING
    assert record["overflows"] == 1


@pytest.mark.parametrize(
    ("value", "nearest", "beyond"),
    [
        (0.5, 0, 0),
        (1.5, 2, 0),
        (-2.5, -2, 0),
        (2.0**61, LARGEST, 0),
        (2.0**62, LARGEST, 1),
        (-np.inf, -LARGEST, 1),
        (np.nan, 0, 1),
    ],
)
def test_what_is_learnt_is_the_nearest_integer(value: float, nearest: int, beyond: int) -> None:
    record = np.zeros(1, FIXED_STATE)[0]
    assert (saturated_integer(record, value), record["overflows"]) == (nearest, beyond)


def test_what_nobody_changed_is_not_read_back() -> None:
    config, state, fixed = default_config()[0], new_state(default_config())[0], FixedNode()
    rate, force = np.zeros(3), np.array([0.0, 0.0, -G])
    fixed.run_cycle(state, config, rate, force, 0.0, PERIOD, 1)
    fixed.state["gain_q"] = 77  # which no float64 field holds: reading back forgets it
    fixed.run_cycle(state, config, np.array([np.nan, 0.0, 0.0]), force, PERIOD, 2.0 * PERIOD, 1)
    fixed.offer_aiding(state, config, 1.0, 1e-9, 0.0, 0.0, PERIOD, 1, 0)
    assert fixed.state["gain_q"] == 77
    assert state["scale"] == 0.0
    state["scale"] = -0.0  # another byte, though the same number
    fixed.offer_aiding(state, config, 1.0, 1e-9, 0.0, 0.0, PERIOD, 2, 0)
    assert fixed.state["gain_q"] == 0


@pytest.mark.parametrize("hours", [0.01, 2.0, 500.0])
def test_lost_cycles_are_bridged(hours: float) -> None:
    config, state, fixed = default_config()[0], new_state(default_config())[0], FixedNode()
    rate, force = np.zeros(3), np.array([0.0, 0.0, -G])
    now = 1000.0
    for k in range(6):
        fixed.run_cycle(state, config, rate, force, now, now + PERIOD, 1)
        fixed.offer_aiding(state, config, 1.0, 1e-9, 0.0, 0.0, now, k, 0)
        now += PERIOD + (3600.0 * hours if k == 3 else 0.0)
    assert state["now"] == pytest.approx(now, abs=1e-6)
    assert state["now_yaw"] * 2.0 * np.pi / 2**32 == pytest.approx(1.0, abs=1e-6)
    assert (fixed.overflows > 0) == (hours > 4096.0 / 3600.0)


def tube(kernel: str) -> Tube:
    config = default_config()
    settings = TubeSettings(1, state_every=10, kernel=kernel)
    return Tube(settings, config, new_node(config), iter(range(10**6)).__next__, restored=False)


def reports(kernel: str, *, forget: bool) -> list[NodeState]:
    node = tube(kernel)
    said = []
    for k, given in enumerate(draw_inputs(1300, 6)):
        around = RigContext(True, 1, given.end, 1e-8, True)
        reading = ImuReading(given.start, given.end, given.rate, given.force)
        said += [message for message in node.on_cycle(reading, around) if isinstance(message, NodeState)]
        if given.aiding is not None:
            yaw, at, sequence = given.aiding
            node.on_aiding(Aiding(yaw, AIDING_VAR, 0.0, 0.0, given.rate[2], at, sequence, 0), at)
        if forget and k == 500:
            forget_bias(node.state, node.config)
            node.take_survey()
    return said


def in_parts(loop: Loop, leave: Callable[..., int] = end_step) -> Loop:
    """The step and the aiding of a loop, called part by part from Python."""

    def step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        waits, node = begin_step(nodes, settings, parameters, readings, moment), nodes[0]
        if waits == REFUSED:
            return say_events(node)
        times = float(moment[START]), float(moment[END]), int(moment[JOINED])
        status = loop.run_cycle(node["filter"], node["config"], node["rate"], node["force"], *times)
        return leave(nodes, settings, moment, int(status), waits)

    def aiding(nodes: Array, settings: Array, given: Array) -> int:
        node, gates = nodes[0], take_aiding(nodes, settings, given)
        if gates & USED:
            yaw, yaw_var, _, _, _, valid_at, sequence, hops, *_ = given.tolist()
            about = own_systematic(node), float(node["down_offset"]), valid_at, int(sequence), int(hops)
            yaw_var += noise_var(node)
            node["noticed"] |= loop.offer_aiding(node["filter"], node["config"], yaw, yaw_var, *about)
        if gates & ONWARD:
            hand_down(nodes, settings)
        return gates

    return loop._replace(step=step, aiding=aiding)


def integers_in_parts(loop: Loop) -> Loop:
    """The step and the aiding of the integers, called part by part from Python over their own record."""
    integers = new_integers()
    nodes, own_settings, own = integers["node"], integers["settings"], integers[0]

    def step(shadows: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        learn_node(shadows, settings, integers)
        learn_inputs(parameters, readings, moment, integers)
        waits, node, times = (
            begin_step(nodes, own_settings, own["parameters"], own["readings"], own["moment"]),
            nodes[0],
            own["moment"],
        )
        if waits == REFUSED:
            says = say_events(node)
        else:
            reading = node["rate"], node["force"], int(times[START]), int(times[END]), int(times[JOINED])
            status = fixed_run_cycle(node["filter"], node["config"], *reading)
            says = end_step(nodes, own_settings, times, int(status), waits)
        show_node(shadows, settings, integers, True)
        return int(says)

    def aiding(shadows: Array, settings: Array, given: Array) -> int:
        learn_node(shadows, settings, integers)
        learn_aiding(given, integers)
        node, taken, gates = nodes[0], own["aiding"].tolist(), take_aiding(nodes, own_settings, own["aiding"])
        if gates & USED:
            yaw, yaw_var, _, _, _, valid_at, sequence, hops, *_ = taken
            about = own_systematic(node), int(node["down_offset"]), valid_at, sequence, hops
            node["noticed"] |= offer_aiding(node["filter"], node["config"], yaw, yaw_var + noise_var(node), *about)
        if gates & ONWARD:
            hand_down(nodes, own_settings)
        show_node(shadows, settings, integers, False)
        return int(gates)

    return loop._replace(step=step, aiding=aiding)


@pytest.mark.slow
@pytest.mark.parametrize("kernel", ["float64", pytest.param("fixed", marks=pytest.mark.statistical), "published"])
def test_the_compiled_step_does_what_the_step_in_parts_does(kernel: str) -> None:
    with added_loop("published", published_loop):
        whole, parts = tube(kernel), tube(kernel)
    if kernel == "fixed":
        parts._loop = integers_in_parts(parts._loop)
    else:
        parts._loop = in_parts(parts._loop, leave_published if kernel == "published" else end_step)
    for k, given in enumerate(draw_inputs(1300, 8)):
        around = RigContext(True, 1 + k // 900, given.end, 1e-8 * (1 + k // 500), True)
        rate = given.rate if k % 211 else (np.nan, 0.0, 0.0)
        reading = ImuReading(given.start, given.end, rate, given.force)
        said = [repr(node.on_cycle(reading, around)) for node in (whole, parts)]
        assert said[0] == said[1]
        if given.aiding is not None:
            yaw, at, sequence = given.aiding
            aiding = Aiding(yaw + 0.2 * (k // 700), AIDING_VAR, 0.0, 0.0, rate[2], at, sequence, k // 600)
            assert whole.on_aiding(aiding, at) == parts.on_aiding(aiding, at)
        for node in (whole, parts):
            if k in (500, 800):
                forget_bias(node.state, node.config)
            if k % 300 == 100:
                node.take_survey()
            if k == 650:
                node.config["still_walk"] *= 2.0
        assert whole.nodes.tobytes() == parts.nodes.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("forget", [False, True])
def test_a_node_says_the_same_on_either_kernel(forget: bool) -> None:
    floats, integers = reports("float64", forget=forget), reports("fixed", forget=forget)
    assert len(floats) == len(integers) >= 130
    for a, b in zip(floats, integers, strict=True):
        assert (a.mode, a.flags, a.at) == (b.mode, b.flags, b.at)
        assert abs((a.yaw - b.yaw + np.pi) % (2 * np.pi) - np.pi) < LIMITS["yaw_deg"] * DEG / 100.0
        assert b.yaw_var == pytest.approx(a.yaw_var, rel=1e-3)
        assert b.gyro_bias == pytest.approx(a.gyro_bias, abs=1e-8)


def test_float64_is_the_default_and_untouched() -> None:
    assert TubeSettings(1).kernel == "float64"
    assert kernel_of("float64") == (run_cycle, offer_aiding, node_step, node_aiding)


def test_an_unknown_kernel_is_refused() -> None:
    with pytest.raises(NodeConfigurationError, match="kernel: expected one of float64, fixed, chip, library, got Q16"):
        replace(TubeSettings(1), kernel="Q16")
