"""A string that turns below a head at rest: what the gyroscope shows of it, and what the other axes and gravity say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.filter.modes import HELD, STATIC_BIAS, STILL
from node.kernels.record.events import Code
from node.kernels.record.filter_record import RING, default_config
from node.kernels.record.node_record import SETTINGS, new_node
from node.kernels.turns.creep import follow_creep

Array = npt.NDArray[np.float64]
G = 9.81  # m/s^2
TILT = 0.02 * DEG  # rad, of one sample
BIAS_STD, BIAS_TAU, NOISE = 4.941e-3 * DEG, 15.87, 7.313e-3 * DEG  # of the z gyroscope, thesis Table V.1
KNOWN = 3e-3 * DEG  # rad/s, of the bias as the string comes to rest
CYCLES = 76  # of a rest of 40 s


class Resting:
    """A node below a head at rest, told nothing but what its sensors read."""

    def __init__(self, lean_deg: float = 2.0) -> None:
        self.nodes = new_node(default_config())
        self.node: Any = self.nodes[0]
        self.settings = np.zeros(1, SETTINGS)
        self.settings["tilt_noise"] = TILT
        self.lean, self.cycles, self.turned = math.radians(lean_deg), 0, 0.0
        self.state, self.creep = self.node["filter"], self.node["guard"]["creep"]
        self.state["mode"] = STILL
        for k in range(3):
            self.state["P"][3 + k, 3 + k] = KNOWN**2
        self.cycle(np.zeros(3), 0.0, resting=False)

    def cycle(self, rate: Array, turn: float, resting: bool = True, noise: float = 0.0, sideways: float = 0.0) -> None:
        """One cycle at mean rates (3, rad/s) in which the tube turns by an angle (rad)."""
        k, state, guard = self.cycles, self.state, self.node["guard"]
        self.turned += 0.5 * turn
        across = G * math.sin(self.lean)
        state["ring_rate"][k % RING] = rate
        state["ring_force"][k % RING] = (
            -across * math.cos(self.turned) + noise,
            across * math.sin(self.turned) + sideways,
            -G * math.cos(self.lean),
        )
        self.turned += 0.5 * turn
        state["ring_start"][k % RING], state["ring_end"][k % RING] = k * PERIOD, (k + 1) * PERIOD
        self.cycles = k + 1
        state["cycles"], state["now"] = k + 1, (k + 1) * PERIOD
        guard["rest_cycles"] = guard["rest_cycles"] + 1 if resting else 0
        follow_creep(self.node, self.settings[0])

    def rest(self, shown_dps: Array, turned_dps: float | None = None) -> Resting:
        """A rest at rates (n,) about z, of which the tube turns by ``turned_dps``, by default all of it."""
        for one in shown_dps.tolist():
            true = one if turned_dps is None else turned_dps
            self.cycle(np.array([0.0, 0.0, one * DEG]), true * DEG * PERIOD)
        return self

    @property
    def doubt_deg(self) -> float:
        """Standard deviation of the yaw that is in doubt."""
        return math.degrees(math.sqrt(self.creep["doubt"]))

    @property
    def codes(self) -> list[int]:
        """Codes of the events put in."""
        return self.node["events"]["ring"]["code"][: self.node["events"]["told"]].tolist()


def run_on(angle_deg: float, within_s: float) -> Array:
    """Mean rates (deg/s) of a string that runs on by an angle, along a smooth step."""
    at = np.clip(np.arange(CYCLES + 1) * PERIOD / within_s, 0.0, 1.0)
    return np.diff(angle_deg * at**2 * (3.0 - 2.0 * at)) / PERIOD


@pytest.mark.parametrize("within_s", [1.0, 2.0, 3.0])
def test_a_string_that_runs_on_is_in_doubt_by_what_it_ran(within_s: float) -> None:
    resting = Resting().rest(run_on(0.1, within_s)[:10])
    assert resting.doubt_deg == pytest.approx(0.1, rel=0.05)
    assert resting.state["systematic_var"] == pytest.approx(resting.creep["doubt"])


def test_a_string_that_creeps_is_in_doubt_by_what_it_crept() -> None:
    resting = Resting().rest(np.full(CYCLES, 0.04))
    assert resting.doubt_deg == pytest.approx(0.04 * (CYCLES - 1) * PERIOD, rel=0.01)
    assert resting.codes == [Code.STRING_TURNED], "once in a rest"


def test_the_end_of_every_rest_leaves_half_of_what_is_in_doubt() -> None:
    resting = Resting().rest(run_on(0.1, 2.0))
    for rests in (1, 2, 3):
        for _ in range(2):
            resting.cycle(np.zeros(3), 0.0, resting=False)
            assert resting.doubt_deg == pytest.approx(0.1 / math.sqrt(2.0) ** rests, rel=0.05)
        resting.rest(np.zeros(40))


def test_a_rest_too_short_to_be_looked_at_takes_no_doubt_back() -> None:
    resting = Resting().rest(run_on(0.1, 2.0)[:10])
    resting.cycle(np.zeros(3), 0.0, resting=False)
    assert resting.doubt_deg == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("angle_deg", [0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.2])
@pytest.mark.parametrize("within_s", [1.0, 3.0])
def test_what_is_in_doubt_covers_the_turn_and_is_no_more_than_it(angle_deg: float, within_s: float) -> None:
    """Over the first ten cycles the noise of a healthy gyroscope is 0.02 deg at most: 3.5 times that is in doubt."""
    doubt = Resting().rest(run_on(angle_deg, within_s)[:10]).doubt_deg
    assert doubt == 0.0 or angle_deg / 3.0 < doubt < 1.05 * angle_deg
    assert doubt > 0.0 or angle_deg < 0.07


def test_the_doubt_grows_with_the_turn() -> None:
    doubts = [Resting().rest(run_on(angle, 2.0)[:10]).doubt_deg for angle in np.linspace(0.02, 0.15, 27)]
    assert doubts == sorted(doubts)
    shares = [doubt / angle for doubt, angle in zip(doubts, np.linspace(0.02, 0.15, 27), strict=True) if doubt]
    assert 0.4 < shares[0] < 0.75, "by its chance"
    assert shares[-1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("lean_deg", "seen"), [(2.0, False), (20.0, True), (30.0, True), (60.0, True)])
def test_gravity_shows_a_turn_that_the_gyroscope_takes_for_a_bias(lean_deg: float, seen: bool) -> None:
    """At 0.006 deg/s, as a bias may wander, where half of a sample's tilt over the lean's sine is 0.03 deg at most."""
    resting = Resting(lean_deg).rest(np.full(CYCLES, 0.0), turned_dps=0.006)
    crept = 0.006 * CYCLES * PERIOD
    assert resting.doubt_deg == (pytest.approx(crept, rel=0.15) if seen else 0.0)
    assert not resting.codes, "variance, and no event"


def test_an_honest_rest_of_a_tube_that_leans_is_hardly_ever_in_doubt() -> None:
    random, doubted, rests = np.random.default_rng(6), 0, 200
    for _ in range(rests):
        resting = Resting(30.0)
        for _ in range(CYCLES):
            white = random.standard_normal(3) * NOISE / math.sqrt(PERIOD)
            noise, sideways = random.standard_normal(2) * TILT * G
            resting.cycle(white, 0.0, noise=float(noise), sideways=float(sideways))
        doubted += resting.creep["doubt"] > 0.0
    assert doubted <= 0.03 * rests


def test_a_sensor_that_warms_up_is_no_string_that_turns() -> None:
    resting = Resting()
    for k in range(CYCLES):
        resting.cycle(np.full(3, 0.002 * k * DEG), 0.0)
    assert resting.creep["doubt"] == 0.0


@pytest.mark.parametrize(("axis", "stays"), [(0, True), (1, True), (2, False)])
def test_other_axes_that_move_later_take_back_no_turn_that_was_seen_before(axis: int, stays: bool) -> None:
    """A string that ran on, and later a bias that wanders across; where all move on it is a sensor that warms up."""
    resting = Resting().rest(run_on(0.1, 1.0)[:10])
    for k in range(CYCLES):
        drift = 0.004 * k * DEG
        resting.cycle(np.full(3, drift) if axis == 2 else drift * np.eye(3)[axis], 0.0)
    assert (resting.doubt_deg == pytest.approx(0.1, rel=0.1)) == stays
    assert stays or resting.doubt_deg == 0.0


@pytest.mark.parametrize("lean_deg", [15.0, 30.0, 60.0])
def test_gravity_denies_a_turn_that_is_a_bias(lean_deg: float) -> None:
    resting = Resting(lean_deg).rest(np.full(CYCLES, 0.05), turned_dps=0.0)
    assert resting.creep["doubt"] == 0.0
    assert resting.state["systematic_var"] == 0.0
    assert not resting.codes


def test_gravity_cannot_deny_it_where_it_has_no_tool_face() -> None:
    resting = Resting(0.2).rest(np.full(CYCLES, 0.05), turned_dps=0.0)
    assert resting.doubt_deg == pytest.approx(0.05 * (CYCLES - 1) * PERIOD, rel=0.01)


def test_gravity_agrees_with_a_string_that_ran_on_before_it_was_looked_at() -> None:
    assert Resting(30.0).rest(run_on(0.5, 1.0)).doubt_deg == pytest.approx(0.5, rel=0.02)


def test_a_tube_in_the_slips_hangs_on_no_head() -> None:
    resting = Resting()
    resting.state["mode"] = HELD
    assert resting.rest(np.full(CYCLES, 0.05)).creep["doubt"] == 0.0


def test_honest_rests_are_hardly_ever_in_doubt() -> None:
    """A bias that wanders as the Allan curve says, and the noise of the rates."""
    random, doubted, rests = np.random.default_rng(5), 0, 400
    decay = math.exp(-PERIOD / BIAS_TAU)
    for _ in range(rests):
        steps = random.standard_normal((CYCLES, 3)) * BIAS_STD * math.sqrt(1.0 - decay * decay)
        bias = random.standard_normal(3) * KNOWN
        resting = Resting()
        for k in range(CYCLES):
            bias = decay * bias + steps[k]
            white = random.standard_normal(3) * NOISE / math.sqrt(PERIOD)
            resting.cycle(bias + white, 0.0, noise=float(random.standard_normal()) * TILT * G)
        doubted += resting.creep["doubt"] > 0.0
    assert doubted <= 0.03 * rests


def test_a_bias_that_is_just_known_is_no_turn() -> None:
    """The rest of a first start, in which the constant bias is learnt: what was before it is none."""
    resting, biased = Resting(), np.array([0.0, 0.0, 0.3 * DEG])
    resting.state["mode"] = STATIC_BIAS
    for _ in range(20):
        resting.cycle(biased, 0.0)
    resting.state["mode"], resting.state["static_bias"] = STILL, biased
    for _ in range(CYCLES):
        resting.cycle(biased, 0.0)
    assert resting.creep["doubt"] == 0.0


def test_a_bias_that_wandered_before_the_rest_goes_back() -> None:
    resting = Resting()
    resting.state["bias"][2] = 0.015 * DEG
    resting.cycle(np.zeros(3), 0.0, resting=False)
    for k in range(CYCLES):
        resting.cycle(np.array([0.0, 0.0, 0.015 * DEG * math.exp(-(k + 1) * PERIOD / BIAS_TAU)]), 0.0)
    assert resting.creep["doubt"] == 0.0
    assert abs(resting.creep["angle"][2]) < 0.001 * DEG


@pytest.mark.parametrize("aidings_missed", [0, 3])
def test_a_head_that_starts_is_no_string_that_turns(aidings_missed: int) -> None:
    """Of a start in the cycle after an aiding the node hears with the next, or later where these are lost."""
    resting, spin = Resting().rest(np.zeros(40)), np.array([0.0, 0.0, 0.7 * DEG])
    resting.cycle(spin, 0.37 * DEG)
    for k in range(aidings_missed):
        resting.state["now_rate"] = (k + 1) * 20.0 * DEG
        resting.cycle((k + 1) * 20.0 * spin, 10.0 * (k + 1) * DEG)
    resting.cycle(60.0 * spin, 30.0 * DEG, resting=False)
    assert resting.creep["doubt"] == 0.0


@pytest.mark.parametrize("of_drive", [{"torque": 200.0}, {"holding": 1}, {"wound": 1}])
def test_what_the_drive_turns_a_string_by_is_its_twist_and_no_doubt(of_drive: dict[str, float]) -> None:
    """Each by itself: a torque in the aiding, a drive that holds, and one that has not let go yet."""
    twisting = Resting(0.0)
    for name, value in of_drive.items():
        twisting.node["twist"][name] = value
    assert twisting.rest(np.full(CYCLES, 0.1)).doubt_deg == 0.0
    assert Resting(0.0).rest(np.full(CYCLES, 0.1)).doubt_deg > 1.0
