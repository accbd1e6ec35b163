"""A gyroscope that saturates, sticks, steps or changes its scale: flagged in time, survived, and recovered from."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from string_of_one import Sample, Spoil, StringOfOne

from node.errors import NodeConfigurationError
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube_settings import TubeSettings, settings_record
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.events import Fault
from node.kernels.record.filter_record import Err, default_config
from node.kernels.record.node_record import AIDINGS, MISMATCH, new_node
from node.kernels.sensors.sensor_watch import find_faults
from node.kernels.turns.aiding_watch import AT_ONCE, find_mismatch, reset_aiding_watch
from node.kernels.turns.gates import contradicts_gyroscope
from telemetry.messages import NodeFlag, NodeMode

FLAGGED_WITHIN = 10  # cycles
LASTS = 25  # cycles
SETTLED = 30  # cycles after the recovery
PLACES: dict[str, Callable[[StringOfOne], int]] = {
    "turning": lambda s: s.turning(1),
    "resting": lambda s: s.resting(0),
    "starting": lambda s: s.turning(1, 0.0) - 4,
    "stopping": lambda s: s.resting(0, 0.0) - 4,
}


def saturate(at: int) -> Spoil:
    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:2], 500.0 * DEG, *sample[3:]] if at <= cycle < at + LASTS else sample

    return spoil


def stick(at: int, axes: tuple[int, ...]) -> Spoil:
    held: Sample = []

    def spoil(cycle: int, sample: Sample) -> Sample:
        if cycle == at - 1:
            held[:] = sample
        return [held[k] if k in axes and at <= cycle < at + LASTS else sample[k] for k in range(6)]

    return spoil


def step(at: int, dps: float, until: int = 10**9) -> Spoil:
    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:2], sample[2] + dps * DEG, *sample[3:]] if at <= cycle < until else sample

    return spoil


def rescale(at: int, factor: float) -> Spoil:
    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:2], sample[2] * factor, *sample[3:]] if at <= cycle else sample

    return spoil


def void(at: int) -> Spoil:
    def spoil(cycle: int, sample: Sample) -> Sample:
        return [math.nan] * 6 if at <= cycle < at + LASTS else sample

    return spoil


KINDS: dict[str, tuple[Callable[[int], Spoil], set[str]]] = {
    "saturated": (saturate, {"gyro_saturated"}),
    "stuck": (lambda at: stick(at, (0, 1, 2)), {"gyro_stuck"}),
    "stuck axis": (lambda at: stick(at, (2,)), {"gyro_stuck", "gyro_step"}),
    "step 5 deg/s": (lambda at: step(at, -5.0), {"gyro_step"}),
    "step 2 deg/s": (lambda at: step(at, 2.0), {"gyro_step"}),
    "step 0.2 deg/s": (lambda at: step(at, 0.2), {"gyro_step"}),
    "no numbers": (void, {"bad_sample"}),
}


@pytest.fixture(scope="module")
def healthy() -> StringOfOne:
    return StringOfOne(1).run()


def test_a_healthy_sensor_raises_no_alarm(healthy: StringOfOne) -> None:
    assert set(healthy.codes()) == {"bias_known", "started", "stopped", "yaw_reset"}
    assert all(NodeFlag.SENSOR_FAULT not in state.flags for state in healthy.states)
    assert NodeMode.FAULT not in {state.mode for state in healthy.states}


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.statistical)])
def test_a_faulty_gyroscope_is_flagged_and_recovered_from(
    kind: str, place: str, seed: int, healthy: StringOfOne
) -> None:
    at = PLACES[place](healthy)
    make, names = KINDS[kind]
    string = StringOfOne(seed, make(at)).run()
    flagged = min(string.first(name, at) for name in names if name in string.codes(at))
    assert flagged - at <= FLAGGED_WITHIN
    assert NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED in string.states[flagged].flags
    assert string.states[flagged].mode is NodeMode.FAULT
    recovered = [cycle for cycle, event in string.events if event.code == "sensor_recovered" and cycle >= at]
    assert recovered
    end = at + LASTS if "step" not in kind else flagged
    assert recovered[-1] - end < 20
    z = np.abs(string.error) / string.std
    assert z[recovered[-1]] < 3.0
    assert np.mean(z[recovered[-1] :] < 3.0) > 0.99
    assert string.states[-1].flags == NodeFlag.NONE
    assert string.states[-1].mode in (NodeMode.STILL, NodeMode.SURVEY)
    assert abs(string.error[-1]) < 0.05 * DEG
    untrusted = [NodeFlag.YAW_UNTRUSTED in state.flags for state in string.states]
    unflagged = [k for k in range(at, string.cycles) if not untrusted[k] and z[k] > 5.0 and k > flagged]
    assert not unflagged, "no unflagged divergence once the fault is known"


def test_the_variance_of_a_yaw_nobody_knows_says_so(healthy: StringOfOne) -> None:
    at = healthy.turning(1)
    string = StringOfOne(1, saturate(at)).run()
    assert np.all(string.std[at : at + LASTS] > 1.0)
    assert np.all(np.isfinite(string.std))
    codes = string.codes(at)
    assert codes.count("gyro_saturated") == codes.count("sensor_recovered") == 1


def test_a_step_that_goes_away_is_flagged_again_and_recovered_from(healthy: StringOfOne) -> None:
    at = healthy.turning(1)
    string = StringOfOne(1, step(at, 3.0, at + 30)).run()
    codes = string.codes(at)
    assert codes.count("gyro_step") == codes.count("sensor_recovered") == 2
    assert string.first("gyro_step", at + 30) - (at + 30) < FLAGGED_WITHIN
    assert abs(string.error[-1]) < 3.0 * string.std[-1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_step_that_goes_away_while_nothing_aids_leaves_no_yaw_surer_than_it_is(seed: int) -> None:
    """A string that winds up looks like a step of the gyroscope, and what is learnt of it is false from then on."""
    plain = StringOfOne(seed)
    begin, end = plain.turning(1, 0.4), plain.resting(1, 0.0)
    string = StringOfOne(seed, step(begin, 0.25, end), loss=0.0).advance(end)
    assert "gyro_step" in string.codes(begin)
    string.string.schedule.is_sent[end : end + 40] = False
    string.advance(40)
    off, std = np.abs(string.error[end : end + 40]), string.std[end : end + 40]
    assert off[-1] > 2.0 * DEG, "0.25 deg/s for 21 s"
    assert np.max(off[3:] / std[3:]) < 4.0
    assert off[-1] < 2.0 * std[-1], "it grows while nothing measures"


@pytest.mark.slow
@pytest.mark.parametrize("goes_away", [False, True])
def test_a_rest_decides_whose_a_small_step_was(goes_away: bool) -> None:
    """A string that winds up by 0.25 deg/s looks like a step, and its twist is what encoder and gyroscope differ by."""
    plain, dps = StringOfOne(1), 0.25
    begin, end = plain.turning(1, 0.4), plain.resting(1, 0.0)
    string = StringOfOne(1, step(begin, dps, end if goes_away else 10**9), loss=0.0).advance(end - 5)
    found = string.first("gyro_step", begin) - begin
    apart = math.sqrt(float(string.tube.state["systematic_var"]))
    assert 0.5 * found < apart / (dps * DEG * PERIOD) < found + 1.5
    string.advance(40)
    left, twist = (
        math.sqrt(float(string.tube.state["systematic_var"])),
        string.string.nodes[0]["guard"]["ramp"]["doubt"],
    )
    assert math.sqrt(float(twist)) == pytest.approx(apart if goes_away else 0.0)
    assert left > 0.99 * apart if goes_away else left == 0.0


def test_a_large_step_is_no_strings() -> None:
    plain = StringOfOne(1)
    begin = plain.turning(1, 0.4)
    string = StringOfOne(1, step(begin, 2.0), loss=0.0).advance(begin + 40)
    assert "gyro_step" in string.codes(begin)
    assert float(string.tube.state["systematic_var"]) == 0.0


@pytest.mark.parametrize("factor", [1.03, 1.005])
def test_a_new_scale_is_named_and_learnt(factor: float, healthy: StringOfOne) -> None:
    at = healthy.resting(0)
    string = StringOfOne(1, rescale(at, factor)).run()
    assert "gyro_scale" in string.codes(at)
    begins = healthy.turning(1, 0.0)
    assert min(c for c, e in string.events if c >= at and e.code in ("gyro_scale", "gyro_step")) - begins < 10
    assert string.codes(at)[-1] == "stopped"
    assert abs(string.error[-1]) < 3.0 * string.std[-1]


@pytest.mark.parametrize("slipped_deg", [20.0, -100.0, 0.0])
def test_what_the_encoder_jumped_by_before_a_gyroscope_was_found_stuck_stays_in_doubt(
    slipped_deg: float, healthy: StringOfOne
) -> None:
    """Earlier readings are all that contradicts it; afterwards the node takes the yaw that it is given."""
    at = healthy.resting(1)
    jump = {"jump_deg": slipped_deg, "jump_s": (at + 1) * PERIOD}
    string = StringOfOne(1, stick(at + 2, (0, 1, 2)), rough={"encoder": jump}).advance(at + LASTS + SETTLED)
    assert {"gyro_stuck", "sensor_recovered"} <= set(string.codes(at))
    assert string.codes(at).count("yaw_reset") == 0
    systematic = math.sqrt(float(string.tube.state["systematic_var"]))
    assert systematic == pytest.approx(abs(slipped_deg) * DEG, abs=0.1 * DEG)


def test_a_yaw_that_a_stop_left_in_doubt_follows_an_encoder_that_rests(healthy: StringOfOne) -> None:
    """A scale that changed on the ramp, then a small step at rest: the resting encoder repeats itself, and is right."""
    ramp, at = healthy.resting(1, 0.0) - 3, healthy.resting(1, 0.4)
    rescaled, stepped = rescale(ramp, 1.1), step(at, 0.3, at + 3)
    string = StringOfOne(1, lambda cycle, sample: stepped(cycle, rescaled(cycle, sample))).advance(at + 40)
    assert "aiding_doubted" in string.codes(ramp)
    assert abs(string.error[at + 39]) < 0.1 * DEG


def test_no_cross_term_is_kept_when_a_fault_is_found(healthy: StringOfOne) -> None:
    at = healthy.turning(1)
    string = StringOfOne(1, step(at, 2.0))
    for _ in range(at + 12):
        string.advance(1)
        if "gyro_step" in string.codes(at):
            break
    P = string.tube.state["P"]
    for state in (Err.YAW, Err.BIAS_Z, Err.SCALE):
        assert not np.any(np.delete(P[state], state))
        assert P[state, state] > 0.0


def test_a_stuck_or_saturated_accelerometer_is_flagged_and_no_survey_made_of_it(healthy: StringOfOne) -> None:
    at = healthy.resting(0, 0.1)
    held: Sample = []

    def spoil(cycle: int, sample: Sample) -> Sample:
        if cycle == at - 1:
            held[:] = sample
        return [*sample[:3], *held[3:]] if at <= cycle < at + 60 else sample

    string = StringOfOne(1, spoil).run()
    assert string.first("force_stuck") - at < FLAGGED_WITHIN
    flags = string.states[at + 10].flags
    assert NodeFlag.SENSOR_FAULT in flags
    assert NodeFlag.YAW_UNTRUSTED not in flags
    assert "sensor_recovered" in string.codes(at)
    assert np.all(np.abs(string.error[at:]) < 5.0 * string.std[at:])


def knock(at: int, lasts: int, force: list[float]) -> Spoil:
    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:3], *force] if at <= cycle < at + lasts else sample

    return spoil


@pytest.mark.parametrize(
    "force", [[-78.5, 0.4, -9.8], [0.3, -0.4, -78.5], [1.0, 2.0, -9.0], [-9.81, 0.0, 0.0]], ids=str
)
@pytest.mark.parametrize("lasts", [1, 2, LASTS])
def test_a_force_that_is_not_that_of_gravity_moves_nothing_at_rest(force: list[float], lasts: int) -> None:
    """Two cycles of it took the tilt for 40 deg and the biases for 0.5 deg/s, before it counted as a fault."""
    at = StringOfOne(1).resting(0, 0.5)
    string = StringOfOne(1, knock(at, lasts, force), loss=0.0).advance(at)
    before = string.tube.state.copy()
    for _ in range(lasts):
        string.advance(1)
        moved = np.abs(string.tube.state["bias"] - before["bias"])
        assert np.all(moved < 0.05 * DEG), moved / DEG
        assert float(string.tube.state["now_down"] @ before["now_down"]) > math.cos(1.0 * DEG)
    string.run()
    assert np.all(np.abs(string.error[at:]) < 5.0 * string.std[at:])


def test_a_stop_that_was_knocked_is_averaged_anew() -> None:
    at = StringOfOne(1).resting(1, 0.2)
    string = StringOfOne(1, knock(at, 1, [-78.5, 0.4, -9.8])).run()
    rest = range(string.resting(1, 0.0), string.resting(1, 1.0))
    (survey,) = [one.measurement for one in string.string.run.surveys if one.cycle in rest]
    assert math.hypot(*survey.imus[0].force) == pytest.approx(9.80665, abs=0.01)
    assert survey.imus[0].force_cov[0][0] < 1e-4


def test_a_tilt_that_no_gyroscope_saw_is_believed_when_it_stays() -> None:
    at, angle = StringOfOne(1).resting(0, 0.2), 20.0 * DEG
    leant = [9.80665 * math.sin(angle), 0.0, -9.80665 * math.cos(angle)]
    noise = np.random.default_rng(1)

    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:3], *(leant + 0.003 * noise.standard_normal(3))] if cycle >= at else sample

    string = StringOfOne(1, spoil).advance(at)
    before = string.tube.state.copy()
    string.advance(30)
    state = string.tube.state
    assert math.degrees(math.asin(-state["now_down"][0])) == pytest.approx(20.0, abs=0.1)
    assert np.all(np.abs(state["bias"] - before["bias"]) < 0.05 * DEG)


@pytest.mark.parametrize("jump", [-1000.0, -0.8, 16.0, 200.0, 1e9])
def test_a_clock_that_jumps_is_told_and_the_yaw_taken_anew(jump: float, healthy: StringOfOne) -> None:
    string = StringOfOne(1)
    at = healthy.turning(1)
    string.advance(at)
    string.shift_clock(jump)
    string.advance(40)
    assert string.codes(at)[0] == "clock_jumped"
    assert string.codes(at).count("clock_jumped") == 1
    assert NodeFlag.YAW_UNTRUSTED in string.states[at].flags
    assert NodeFlag.YAW_UNTRUSTED not in string.states[-1].flags
    assert abs(string.error[at + 39]) < 0.1 * DEG


def test_times_that_are_none_are_told_once_and_change_nothing() -> None:
    string = StringOfOne(1)
    string.advance(20)
    before = string.tube.state.tobytes()
    for shift in (math.nan, math.inf, -math.inf):
        string.shift_clock(shift)
        string.advance(1)
    assert string.codes(20) == ["clock_jumped", "aiding_untimely"]
    assert string.tube.state.tobytes() == before


class Watched:
    """The watch over the aidings of one node, with what it found last."""

    def __init__(self) -> None:
        self.watch, self.found = np.zeros(1, AIDINGS)[0], np.zeros(1, MISMATCH)[0]
        reset_aiding_watch(self.watch)

    def takes(self, innovation: float, spin: float, now: float, *, rejected: bool = True) -> Fault:
        find_mismatch(self.watch, self.found, innovation, 1e-4, spin, now, int(rejected), 0, AT_ONCE)
        return Fault(int(self.found["fault"]))


def test_a_wrong_aiding_is_no_step_of_the_gyroscope() -> None:
    watched = Watched()
    assert watched.takes(0.0, 1.0, 0.5, rejected=False) is Fault.NONE
    for k in range(6):
        assert watched.takes(0.5 + 1e-5 * (-1) ** k, 1.0, 1.0 + 0.5 * k) is Fault.NONE


def test_a_bias_that_grows_the_innovation_is_a_step_and_one_with_the_rate_a_scale() -> None:
    watched = Watched()
    watched.takes(0.0, 1.0, 0.5, rejected=False)
    found = [watched.takes(0.01 * k, 1.0, 0.5 + 0.5 * k) for k in (1, 2, 3)]
    assert found == [Fault.NONE, Fault.NONE, Fault.GYRO_STEP]
    assert float(watched.found["rate"]) == pytest.approx(0.02)
    assert watched.found["steady"]
    reset_aiding_watch(watched.watch)
    watched.takes(0.0, 0.0, 0.5, rejected=False)
    spins, innovation = (0.2, 0.6, 1.0), 0.0
    for k, spin in enumerate(spins):
        innovation += 0.03 * spin * 0.5
        last = watched.takes(innovation, spin, 1.0 + 0.5 * k)
    assert last is Fault.GYRO_SCALE


def test_three_in_a_row_are_no_step_where_an_aiding_was_wrong_lately() -> None:
    def wanted(used_since: int) -> int:
        watched, now = Watched(), 0.5
        watched.takes(0.0, 1.0, now, rejected=False)
        for innovation, rejected in [(0.5, True)] + [(0.0, False)] * (1 + used_since):
            now += 0.5
            watched.takes(innovation, 1.0, now, rejected=rejected)
        found = [watched.takes(0.01 * k, 1.0, now + 0.5 * k) for k in range(1, 7)]
        return 1 + found.index(Fault.GYRO_STEP)

    assert [wanted(0), wanted(31), wanted(32)] == [4, 4, 3]


def test_a_part_of_a_swing_of_once_a_turn_is_no_step() -> None:
    watched = Watched()
    watched.takes(0.0, 1.24, 0.0, rejected=False)
    innovation = 0.0
    for k in range(40):
        innovation += 2e-3 * math.cos(math.tau * k / 10.0)
        assert watched.takes(innovation, 1.24, 0.5 * (k + 1)) is Fault.NONE


def test_a_growth_over_half_a_turn_is_that_of_the_shorter_way() -> None:
    watched = Watched()
    watched.takes(math.pi - 0.005, 1.0, 0.5)
    for k in (1, 2):
        watched.takes(math.remainder(math.pi - 0.005 + 0.01 * k, math.tau), 1.0, 0.5 + 0.5 * k)
    assert watched.takes(math.remainder(math.pi + 0.025, math.tau), 1.0, 2.0) is Fault.GYRO_STEP
    assert float(watched.found["rate"]) == pytest.approx(0.02)


def test_one_knock_is_no_fault_of_the_accelerometer() -> None:
    limits = SensorLimits()
    record = settings_record(TubeSettings(1, limits=limits), default_config())[0]
    watch = new_node(default_config())[0]["guard"]["readings"]

    def faults(rate: list[float], force: list[float], saturated: int = 0) -> tuple[int, int]:
        return find_faults(watch, record, np.array(rate), np.array(force), saturated)

    limit = limits.force_range
    rates = [[1e-4 * k, 2e-4 * k, 3e-4 * k] for k in range(9)]
    knocks = [[limit if 2 <= k <= 3 else 0.1 * k, 0.2 * k, 0.3 * k] for k in range(9)]
    assert all(faults(r, f) == (Fault.NONE, Fault.NONE) for r, f in zip(rates[1:], knocks[1:], strict=True))
    for k in range(3):
        found = faults([1e-3 * k, 1.0 + k, 0.1 * k], [limit, float(k), 0.1 * k], int(k == 2))
    assert found == (Fault.GYRO_SATURATED, Fault.FORCE_SATURATED)


@pytest.mark.parametrize(
    "change", [{"rate_range": 0.0}, {"force_range": math.nan}, {"repeats_alone": -1}, {"repeats_together": -1}]
)
def test_limits_that_cannot_be_are_refused_by_name(change: dict) -> None:
    with pytest.raises(NodeConfigurationError, match=next(iter(change))):
        SensorLimits(**change)


@pytest.mark.parametrize(
    ("stopped_at", "off_deg", "judged"),
    [(50.0, 14.0, True), (50.0, 0.05, False), (20.0, 14.0, False), (math.nan, 14.0, False)],
)
def test_a_reference_at_rest_is_judged_anew_by_a_node_that_turned_unaided(
    stopped_at: float, off_deg: float, judged: bool
) -> None:
    """The encoder stood all the while and repeats itself; what turned the node is then in its yaw."""
    nodes = new_node(default_config())
    node = nodes.view(np.recarray)[0]
    state = node.filter
    state["yaw_known"], state["mode"], state["still_cycles"] = 1, int(NodeMode.STILL), 10
    state["now"], state["last_aided"], state["stopped_at"] = 60.0, 30.0, stopped_at
    state["now_P"][Err.YAW, Err.YAW] = (0.03 * DEG) ** 2
    assert bool(contradicts_gyroscope.py_func(node, off_deg * DEG, 60.0)) == judged
