"""An alignment from its order to the survey after it, and everything that can keep it from an end."""

import math
from pathlib import Path

import numpy as np
import pytest

from node.errors import NodeConfigurationError
from node.firmware import static_record
from node.firmware.alignment_orders import FEWEST, METHODS, MOST, tube_rotation
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import Kernel, TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.kernels.sensors.aligner import PATIENCE
from node.process.command_handlers import CommandHandlers
from node.process.tube_process import TubeProcess
from sim.studies.alignment.run import Setup, Turn
from sim.world.world import World
from telemetry.application.commands import COMMANDS, METHOD, SECONDS, TURNS, ObeyedBy
from telemetry.messages import Command, Event, NodeMode, NodeState, Reply, Severity, SurveyMeasurement
from telemetry.parameters import ParameterBlock, SensorParameters

G = 9.81
SLOW = 7.0 * DEG
TILT = (0.8 * DEG, -0.5 * DEG)


class Bored:
    """A tube in a leaning bore, its sensor on a leaning mount, turned as told."""

    def __init__(
        self, lean: float = 2.0 * DEG, tilt: tuple[float, float] = TILT, kernel: Kernel = "float64", shake: float = 1.0
    ) -> None:
        config = default_config()
        self.random = np.random.default_rng(5)
        settings = TubeSettings(1, state_every=1, kernel=kernel)
        numbers = iter(range(10**9)).__next__
        self.tube = Tube(settings, config, new_node(config), numbers, restored=False)
        pitch, roll = tilt
        axis = np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])
        self.frame = tube_rotation(axis).T
        self.lean, self.shake = lean, shake
        self.angle, self.now = 0.4, 1000.0
        self.events: list[Event] = []
        self.states: list[NodeState] = []
        self.surveys: list[SurveyMeasurement] = []

    def reading(self, rate: float) -> list[float]:
        """Rates and forces of one cycle."""
        middle = self.angle + 0.5 * rate * PERIOD
        down = np.array([-math.cos(middle), math.sin(middle), 1.0 / math.tan(self.lean)]) * math.sin(self.lean)
        gyro = self.frame @ np.array([0.0, 0.0, rate]) + 1e-4 * self.random.standard_normal(3)
        force = -G * self.frame @ down + self.shake * 0.02 * DEG * G * self.random.standard_normal(3)
        self.angle += rate * PERIOD
        return [*gyro.tolist(), *force.tolist()]

    def cycles(self, count: int, rate: float = 0.0) -> "Bored":
        for _ in range(count):
            wx, wy, wz, fx, fy, fz = self.reading(rate)
            self.take(ImuReading(self.now, self.now + PERIOD, (wx, wy, wz), (fx, fy, fz)))
        return self

    def take(self, reading: ImuReading) -> None:
        self.now = reading.end
        for said in self.tube.on_cycle(reading, RigContext(True, 1, self.now, 1e-8, True)):
            if isinstance(said, Event):
                self.events.append(said)
            elif isinstance(said, NodeState):
                self.states.append(said)
            elif isinstance(said, SurveyMeasurement):
                self.surveys.append(said)

    def known(self) -> "Bored":
        """Past its static bias."""
        return self.cycles(110)

    def ordered(self, method: str = "circle", turns: float = 2.0) -> "Bored":
        assert self.known().tube.align(method, turns) == ""
        return self

    def turned(self, turns: float = 2.1, rate: float = SLOW) -> "Bored":
        return self.cycles(math.ceil(turns * math.tau / abs(rate) / PERIOD) + 4, rate)

    def codes(self) -> list[str]:
        return [event.code for event in self.events if event.code.startswith("align")]

    def reason(self) -> str:
        """Why the alignment was refused."""
        assert self.codes()[-1] == "alignment_refused"
        event = [event for event in self.events if event.code == "alignment_refused"][-1]
        assert event.severity is Severity.WARNING
        return str(event.arguments["reason"])


@pytest.mark.slow
@pytest.mark.parametrize("kernel", ["float64", "fixed"])
@pytest.mark.parametrize(("method", "sigma_deg"), [("circle", 0.0015), ("extremes", 0.0086)])
@pytest.mark.parametrize("rate", [SLOW, -SLOW, 3.0 * DEG])
def test_an_alignment_tells_every_step_and_finds_the_mount(
    kernel: Kernel, method: str, sigma_deg: float, rate: float
) -> None:
    bored = Bored(kernel=kernel).ordered(method).turned(rate=rate).cycles(50)
    assert bored.codes() == ["alignment_begun", "alignment_turning", "aligned"]
    found = next(event.arguments for event in bored.events if event.code == "aligned")
    for name, tilt in zip(("pitch", "roll"), TILT, strict=True):
        std = float(found[f"{name}_std_deg"])
        assert std < 1.3 * sigma_deg
        assert abs(found[f"{name}_deg"] - tilt / DEG) < 4.0 * std
    assert found["lean_deg"] == pytest.approx(2.0, abs=0.01)
    assert found["method"] == method
    modes = [state.mode for state in bored.states]
    assert NodeMode.ALIGNMENT in modes
    assert modes[-1] in (NodeMode.STILL, NodeMode.SURVEY)
    pitch, roll, std = bored.states[-1].alignment
    assert (pitch, roll) == pytest.approx(TILT, abs=4.0 * std)
    assert bored.tube.alignment["method"] == method


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_the_survey_after_it_is_that_of_the_tube(kernel: Kernel) -> None:
    bored = Bored(kernel=kernel).ordered()
    bored.tube.take_survey()
    bored.cycles(60).turned().cycles(60)
    before, after = bored.surveys[0].imus[0], bored.surveys[-1].imus[0]
    errors = [math.degrees(math.atan2(math.hypot(*m.force[:2]), -m.force[2])) - 2.0 for m in (before, after)]
    assert abs(errors[0]) > 0.2
    assert abs(errors[1]) < 0.02
    np.testing.assert_allclose(bored.tube.state["down"], -np.array(after.force) / G, atol=0.02 * DEG)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 7))
def test_with_the_sensors_of_the_world_a_survey_errs_by_the_mount_before_and_by_noise_after(seed: int) -> None:
    setup = Setup(bias_std_deg=0.002)
    bench = Turn(setup, seed)
    found = {method: bench.run(method) for method in ("none", "circle", "extremes")}
    aligned = {method: abs(math.degrees(found[method].inclination_error)) for method in found}
    assert aligned["circle"] < 0.02
    assert aligned["extremes"] < 0.05
    assert np.abs(bench.tilts).max() < 4.0 * setup.mount_tilt_std_deg * DEG
    expected = math.degrees(error_by_the_mount(bench.world, math.radians(setup.inclination_deg)))
    assert math.degrees(found["none"].inclination_error) == pytest.approx(expected, abs=0.02)


def error_by_the_mount(world: World, inclination: float) -> float:
    """What a survey at the last stop errs while the lean of the IMU is not corrected, rad; the tool face decides."""
    x, y, z = world.sensors.frame(1) @ world.truth(1).force(np.array([world.motion.phases[-1].start]))[0]
    return math.atan2(math.hypot(x, y), -z) - inclination


def test_the_sensor_off_the_axis_needs_its_place_to_be_known() -> None:
    radius, rate = 0.05, 12.0 * DEG
    pulled = rate**2 * radius / G  # rad
    errors = []
    for offset in ((0.0, 0.0), (radius, 0.0)):
        bored = Bored(tilt=(0.0, 0.0))
        bored.tube._settings_record[0]["place"][0] = offset
        bored.ordered("circle", 5.0)
        for _ in range(math.ceil(5.1 * math.tau / rate / PERIOD) + 4):
            wx, wy, wz, fx, fy, fz = bored.reading(rate)
            force = (fx - radius * rate**2, fy, fz)
            bored.take(ImuReading(bored.now, bored.now + PERIOD, (wx, wy, wz), force))
        errors.append(float(next(e for e in bored.events if e.code == "aligned").arguments["pitch_deg"]) * DEG)
    assert errors[0] == pytest.approx(pulled, rel=0.2)
    assert abs(errors[1]) < 0.2 * pulled


def test_a_second_alignment_replaces_the_first() -> None:
    bored = Bored().ordered().turned().cycles(60)
    assert bored.tube.align("extremes", 2.0) == ""
    bored.turned().cycles(60)
    found = [event.arguments for event in bored.events if event.code == "aligned"]
    assert [f["method"] for f in found] == ["circle", "extremes"]
    assert found[1]["pitch_deg"] == pytest.approx(found[0]["pitch_deg"], abs=0.05)


@pytest.mark.parametrize(
    ("method", "turns", "expected"),
    [
        ("square", 2.0, "method"), (None, 2.0, "method"), (["circle"], 2.0, "method"), ("circle", 0.5, "turns"),
        ("circle", 21.0, "turns"), ("circle", math.nan, "turns"), ("circle", True, "turns"), ("circle", "2", "turns"),
    ],
)  # fmt: skip
def test_an_order_that_is_none_is_refused_by_name(method: object, turns: object, expected: str) -> None:
    assert Bored().known().tube.align(method, turns).startswith(expected)


def test_a_node_that_is_not_ready_says_why() -> None:
    assert "static bias" in Bored().cycles(5).tube.align("circle", 2.0)
    assert "too fast" in Bored().known().cycles(5, 71.0 * DEG).tube.align("circle", 2.0)
    assert "under way" in Bored().ordered().tube.align("circle", 2.0)
    faulty = Bored().known()
    faulty.take(ImuReading(faulty.now, faulty.now + PERIOD, (math.nan,) * 3, (math.nan,) * 3))
    assert "sensor" in faulty.tube.align("circle", 2.0)


@pytest.mark.parametrize("rate", [SLOW, -71.0 * DEG])
def test_too_fast_a_turn_ends_it(rate: float) -> None:
    bored = Bored().ordered()
    if rate == SLOW:
        bored.turned(1.0)
    assert "too fast" in bored.cycles(3, 40.0 * DEG).reason()


def test_a_string_that_never_turns_ends_it() -> None:
    bored = Bored().ordered().cycles(math.ceil(PATIENCE / PERIOD) + 2)
    assert "stood still" in bored.reason()
    assert "timed out" in bored.reason()


def test_a_string_that_stops_too_soon_ends_it() -> None:
    assert "too few turns" in Bored().ordered().turned(1.5).cycles(6).reason()


def test_a_turn_that_drags_on_ends_it() -> None:
    bored = Bored().ordered()
    for _ in range(300):
        bored.cycles(3, 2.5 * DEG).cycles(3, 0.3 * DEG)
    assert "timed out" in bored.reason()


def test_a_string_that_turns_back_ends_it() -> None:
    assert "turned back" in Bored().ordered().turned(1.0).cycles(4, -SLOW).reason()


@pytest.mark.parametrize("method", ["circle", "extremes"])
def test_too_little_and_too_much_lean_end_it(method: str) -> None:
    assert "too little lean" in Bored(lean=0.005 * DEG).ordered(method).turned().reason()
    assert "too much lean" in Bored(lean=75.0 * DEG).ordered(method).turned().reason()


def test_a_string_that_shakes_ends_it() -> None:
    bored = Bored().ordered()
    bored.shake = 30.0
    assert "shakes" in bored.turned().reason()


def test_a_mount_beyond_any_mount_ends_it() -> None:
    assert "offset" in Bored(tilt=(14.0 * DEG, 0.0)).ordered().turned().reason()


def test_a_faulty_sensor_ends_it() -> None:
    bored = Bored().ordered().turned(0.5)
    bored.take(ImuReading(bored.now, bored.now + PERIOD, (math.nan,) * 3, (math.nan,) * 3))
    assert "sensor" in bored.reason()


def test_lost_cycles_end_it_and_a_few_do_not() -> None:
    bored = Bored().ordered().turned(0.5)
    bored.now += 10.0
    assert "lost" in bored.cycles(1, SLOW).reason()
    bored = Bored().ordered().turned(0.5)
    bored.now, bored.angle = bored.now + 3.0 * PERIOD, bored.angle + 3.0 * PERIOD * SLOW
    assert bored.turned(2.0).codes()[-1] == "aligned"


def test_what_was_refused_leaves_the_offset_in_use() -> None:
    bored = Bored().ordered().turned().cycles(10)
    kept = bored.tube.node["mount"].tobytes()
    assert bored.tube.align("circle", 2.0) == ""
    bored.turned(1.0).cycles(10)
    assert "too few" in bored.reason()
    assert bored.tube.node["mount"].tobytes() == kept


def test_an_offset_is_dropped_on_order_and_with_its_accelerometer() -> None:
    bored = Bored().ordered().turned().cycles(10)
    assert bored.tube.align("none", 2.0) == ""
    assert bored.cycles(1).codes()[-1] == "alignment_dropped"
    assert bored.tube.alignment == {"method": "none"}
    assert bored.states[-1].alignment == (0.0, 0.0, 0.0)
    bored = Bored().ordered().turned().cycles(10)
    bored.tube.prepare(ParameterBlock(1, 1, gyroscope=SensorParameters(bias=(1e-4, 0.0, 0.0))))
    assert bored.tube.alignment["method"] != "none"
    bored.tube.prepare(ParameterBlock(1, 2, accelerometer=SensorParameters(bias=(0.01, 0.0, 0.0))))
    assert bored.cycles(1).codes()[-1] == "alignment_dropped"
    assert bored.tube.alignment == {"method": "none"}


def test_another_block_for_the_gyroscope_ends_the_alignment_under_way() -> None:
    bored = Bored().ordered()
    bored.tube.prepare(ParameterBlock(1, 1, gyroscope=SensorParameters(bias=(1e-4, 0.0, 0.0))))
    assert "gyroscope" in bored.cycles(1).reason()


class Powered(Bored):
    """The same as a process with a disk."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder
        self.process = TubeProcess(TubeSettings(1), folder)

    def cycles(self, count: int, rate: float = 0.0) -> "Powered":
        for _ in range(count):
            start, self.now = self.now, self.now + PERIOD
            self.process.on_cycle([start, *self.reading(rate)], self.now)
            self.process.take_frames(self.now)
        return self

    def order(self, name: str, **arguments: float | str) -> Reply:
        reply = self.process._commands.obey(Command(1, 1, name, dict(arguments)))
        self.process._save()
        return reply

    def cut(self) -> "Powered":
        self.process = TubeProcess(TubeSettings(1), self.folder)
        return self


def test_an_offset_survives_the_power_and_an_alignment_that_was_cut_is_told(tmp_path: Path) -> None:
    powered = Powered(tmp_path)
    powered.known()
    assert powered.order("alignment").values == {"method": "none"}
    assert powered.order("align", turns=1.0).values == {"method": "circle", "turns": 1.0}
    powered.turned(1.2).cycles(5)
    found = powered.order("alignment").values
    assert found["method"] == "circle"
    assert found["pitch"] == pytest.approx([TILT[0]], abs=4.0 * found["pitch_std"][0])
    kept = powered.process.nodes["mount"].tobytes()
    assert powered.cut().order("alignment").values == found
    assert powered.process.nodes["mount"].tobytes() == kept
    assert powered.cycles(8).order("align", method="extremes").done
    powered.cycles(20, SLOW).cut()
    events: list[tuple[str, object]] = []
    powered.process._send_event = lambda _, code, arguments: events.append((code, arguments))  # type: ignore[method-assign]
    powered.process._announce(5.0, 5.0)
    assert events == [("alignment_refused", {"reason": "the power was cut"})]
    assert powered.process.nodes["mount"].tobytes() == kept
    assert powered.order("align", method="none").detail == "dropped"
    assert powered.cut().order("alignment").values == {"method": "none"}


def test_a_process_refuses_an_order_with_its_reason(tmp_path: Path) -> None:
    powered = Powered(tmp_path)
    assert powered.order("align") == Reply(1, 1, False, "the static bias is not known yet")
    powered.known()
    for arguments, reason in (
        ({"method": "round"}, "method: expected circle, extremes, none, got 'round'"),
        ({"method": True}, "method: expected at most"),
        ({"turns": "two"}, "turns: expected a number in [1, 20], got 'two'"),
        ({"turns": 21.0}, "turns: expected a number in [1, 20], got 21.0"),
        ({"speed": 1.0}, "got speed"),
    ):
        reply = powered.order("align", **arguments)
        assert not reply.done
        assert reason in reply.detail
    assert "alignment, timing, got 'dance'" in powered.order("dance").detail
    assert "seconds" in powered.order("static_record").detail


def test_the_table_of_commands_has_the_bounds_of_the_firmware() -> None:
    assert (SECONDS.quantity.low, SECONDS.quantity.high) == (static_record.SHORTEST, static_record.LONGEST)
    assert (TURNS.quantity.low, TURNS.quantity.high) == (FEWEST, MOST)
    assert METHOD.quantity.choices == (*METHODS, "none")


def test_every_command_of_a_tube_has_its_method() -> None:
    documented = {spec.name for spec in COMMANDS if spec.by is ObeyedBy.TUBE}
    assert documented == {name for name in vars(CommandHandlers) if name[0] != "_"} - {"obey"}


@pytest.mark.parametrize(
    "change", [{"offset": (math.nan, 0.0)}, {"offset": (0.0, 2.0)}, {"noise": 0.0}, {"noise": math.inf}]
)
def test_settings_of_an_imu_that_cannot_be_are_refused_by_name(change: dict) -> None:
    with pytest.raises(NodeConfigurationError, match=next(iter(change))):
        ImuSettings(**change)
