"""The integer loop and the float64 loop side by side, and the node that is built on either."""

from dataclasses import replace

import numpy as np
import pytest

from node.errors import ConfigurationError
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.kernel_choice import kernel_of
from node.firmware.settings import TubeSettings
from node.firmware.tube import Tube
from node.kernels.cycle import run_cycle
from node.kernels.fixed.border import COVARIANCE, learn_config, learn_state, show_aiding, show_covariance, show_cycle
from node.kernels.fixed.layout import FIXED_STATE
from node.kernels.fixed.node import FixedNode
from node.kernels.layout import DEG, PERIOD, STATE, Status, default_config, new_state
from node.kernels.record import new_node
from node.kernels.relay import offer_aiding
from node.kernels.resets import forget_bias
from sim.studies.fixed_point.run import AIDING_VAR, LIMITS, compare, inputs, rows_of
from telemetry.messages import Aiding, NodeState

WORK_SPACE = {"h", "ph", "gain"}
G = 9.81


@pytest.mark.slow
def test_four_thousand_cycles_agree() -> None:
    found = compare(4000, 3)
    rows = rows_of(found)
    assert [row["case"] for row in rows] == ["turning, aided", "turning, outage", "rest, aided", "rest, outage"]
    assert max(row["yaw_max_deg"] for row in rows) < LIMITS["yaw_deg"] / 100.0
    assert max(row["sigma_max"] for row in rows) < LIMITS["sigma"] / 100.0
    assert (found.overflows, found.status_differs) == (0, 0)


def shown(cycles: int, seed: int) -> tuple[np.void, np.void, FixedNode]:
    """Both float64 records after the same inputs."""
    config, reference, shadow = default_config()[0], new_state(default_config())[0], new_state(default_config())[0]
    fixed = FixedNode()
    for given in inputs(cycles, seed):
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
    again = learn_state(shadow, G, fixed.overflows)[0]
    for name in set(FIXED_STATE.names or ()) - {"ph", "rest", "gain", "gain_q", "decay"}:
        a, b = np.asarray(fixed.state[name], np.int64), np.asarray(again[name], np.int64)
        if name.startswith("pending_"):
            a, b = a[: fixed.state["pending"]], b[: fixed.state["pending"]]
        largest = 2 ** max(0, int(np.abs(a).max(initial=0)).bit_length() - 52)
        assert np.abs(a - b).max(initial=0) <= largest, name
    show_cycle(again, shadow, G)
    show_covariance(again, shadow, COVARIANCE)
    show_aiding(again, shadow)


def test_the_configuration_fits() -> None:
    _, beyond = learn_config(default_config()[0])
    assert beyond == 0
    wild = default_config()
    wild["boot_bias_std"] = 1e3
    wild["bias_std"] = 1e3
    assert learn_config(wild[0])[1] > 0
    assert learn_state(new_state(wild)[0], G, 0)[0]["overflows"] == 6  # three biases, in P and now_P


def test_a_reading_beyond_the_range_is_held_and_counted() -> None:
    config, state, fixed = default_config()[0], new_state(default_config())[0], FixedNode()
    status = fixed.run_cycle(state, config, np.array([0.0, 0.0, 40.0]), np.array([0.0, 0.0, -1e9]), 0.0, PERIOD, 1)
    assert status & Status.RATE_EXCEEDED
    assert fixed.overflows == 2
    before = state.tobytes()
    nothing = np.array([0.0, np.nan, 0.0])
    assert fixed.run_cycle(state, config, nothing, np.zeros(3), PERIOD, 2 * PERIOD, 1) == Status.BAD_SAMPLE
    assert state.tobytes() == before


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
    for k, given in enumerate(inputs(1300, 6)):
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
    assert kernel_of("float64") is None


def test_an_unknown_kernel_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="kernel: expected one of float64, fixed, published, got Q16"):
        replace(TubeSettings(1), kernel="Q16")
