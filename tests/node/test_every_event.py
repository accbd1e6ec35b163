"""Every code of the step, provoked once: what must happen to a node for it to say so, and that its line can say it."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from node.firmware.event_table import EVENT_TABLE, take_events
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.events import Code
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.frozen import replace
from telemetry.messages import Aiding, Event

G = 9.81
LEAN = 2.0 * DEG
FAST, SLOW = 71.0 * DEG, 7.0 * DEG
AIDING = Aiding(1.0, 2.7e-9, 0.0, 0.0, 0.0, 0.0, 0, 0)
LEARN = 110  # cycles at rest until the constant bias is known
Numbers = tuple[float, float, float]


class Bench:
    """A node in a leaning hole whose readings may be spoilt; it keeps the codes that it told."""

    def __init__(self, settings: TubeSettings | None = None) -> None:
        self.settings = settings or TubeSettings(1)
        self.tube = Tube(self.settings, default_config(), new_node(default_config()), iter(range(10**9)).__next__,
                         restored=False)  # fmt: skip
        self.random = np.random.default_rng(1)
        self.now, self.angle, self.sequence = 1000.0, 1.0, 0
        self.aiding = AIDING
        self.codes: set[Code] = set()
        self.names: set[str] = set()

    def cycles(
        self,
        count: int,
        rate: float = 0.0,
        spoil: Callable[[Numbers, Numbers], tuple[Numbers, Numbers]] = lambda w, f: (w, f),
        *,
        joined: bool = True,
        aided: bool = True,
    ) -> "Bench":
        for _ in range(count):
            middle = self.angle + 0.5 * rate * PERIOD
            down = np.array([-math.sin(LEAN) * math.cos(middle), math.sin(LEAN) * math.sin(middle), math.cos(LEAN)])
            w = np.array([0.0, 0.0, rate]) + 1e-4 * self.random.standard_normal(3)
            f = -G * down + 2e-3 * self.random.standard_normal(3)
            rates, forces = spoil((w[0], w[1], w[2]), (f[0], f[1], f[2]))
            own = ImuReading(self.now, self.now + PERIOD, rates, forces)
            self.angle, self.now = self.angle + rate * PERIOD, self.now + PERIOD
            others = tuple(ImuReading(own.start, own.end, tuple(w.tolist()), tuple(f.tolist()))
                           for _ in self.settings.imus[1:])  # fmt: skip
            said = self.tube.on_cycle(replace(own, others=others), RigContext(joined, 1, self.now, 1e-8, True))
            self.names |= {message.code for message in said if isinstance(message, Event)}
            if aided:
                self.aid(rate=rate)
        return self

    def aid(self, valid_at: float | None = None, **changed: float | bool | int) -> "Bench":
        self.sequence += 1
        told = replace(self.aiding, yaw=self.angle % math.tau, valid_at=self.now, sequence=self.sequence)
        self.tube.on_aiding(replace(told, **changed), self.now if valid_at is None else valid_at)  # type: ignore[arg-type]
        return self


def known(settings: TubeSettings | None = None) -> Bench:
    return Bench(settings).cycles(LEARN)


def held(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    return (1e-4, 2e-4, 3e-4), f


def with_torque(bench: Bench) -> Bench:
    bench.aiding = replace(AIDING, torque=500.0, under_torque=True)
    bench.cycles(5, FAST)
    bench.aiding = replace(AIDING, torque=5.0)
    return bench.cycles(5, FAST)


def with_joint(joints: str, change: float, **aiding: float) -> Bench:
    """A tube comes on top of a string that stands; the marks say ``change`` (rad), the head has not turned."""
    bench = known(TubeSettings(1, joints=joints, stiffness=1e4))  # type: ignore[arg-type]
    bench.cycles(20, FAST).cycles(60)
    bench.aiding = replace(AIDING, hops=1, offset=change, systematic_var=1e-8)
    return bench.aid(**aiding).cycles(2)


def broken(field: str) -> Bench:
    bench = known()
    bench.tube.state[field][...] = math.nan
    return bench.cycles(1, spoil=lambda w, f: ((math.nan,) * 3, f), aided=False)


TWISTED = TubeSettings(1, torsion="variance", stiffness=1e4)
TWO = TubeSettings(1, imus=(ImuSettings(), ImuSettings()))
CASES: dict[Code, Callable[[], Bench]] = {
    Code.BAD_SAMPLE: lambda: known().cycles(2, spoil=lambda w, f: ((math.nan, 0.0, 0.0), f)),
    Code.GYRO_SATURATED: lambda: known().cycles(2, spoil=lambda w, f: ((0.0, 0.0, 500.0 * DEG), f)),
    Code.GYRO_STUCK: lambda: known().cycles(8, spoil=held),
    Code.GYRO_STEP: lambda: known().cycles(30, FAST).cycles(12, FAST, lambda w, f: ((w[0], w[1], w[2] + 0.5 * DEG), f)),
    Code.GYRO_SCALE: lambda: scaled(known()),
    Code.FORCE_SATURATED: lambda: known().cycles(4, spoil=lambda w, f: (w, (80.0, f[1], f[2]))),
    Code.FORCE_STUCK: lambda: known().cycles(8, spoil=lambda w, f: (w, (0.3, 0.0, -9.8))),
    Code.SENSOR_RECOVERED: lambda: known().cycles(2, spoil=lambda w, f: ((0.0, 0.0, 500.0 * DEG), f)).cycles(30),
    Code.CLOCK_JUMPED: lambda: jumped(known()),
    Code.AIDING_UNTIMELY: lambda: known().aid(math.nan).cycles(1),
    Code.STRING_UNDER_TORQUE: lambda: with_torque(known(TWISTED).cycles(5, FAST)),
    Code.STRING_RELEASED: lambda: with_torque(known(TWISTED).cycles(5, FAST)),
    Code.JOINT_SOLVED: lambda: with_joint("solved", 0.0),
    Code.JOINT_CONTRADICTS_MARKS: lambda: with_joint("both", 5.0 * DEG),
    Code.JOINT_NOT_SOLVED: lambda: with_joint("solved", 0.1, rate=1.0),
    Code.STOPPED: known,
    Code.STARTED: lambda: known().cycles(3, FAST),
    Code.JOINT_OPENED: lambda: known().cycles(2, joined=False, aided=False),
    Code.JOINT_CLOSED: lambda: known().cycles(2, joined=False, aided=False).cycles(2),
    Code.BIAS_KNOWN: known,
    Code.REFERENCE_CHANGED: lambda: known().aid(hops=1, offset=0.2).cycles(2, aided=False),
    Code.YAW_RESET: known,
    Code.RATE_EXCEEDED: lambda: known().cycles(2, 360.0 * DEG),
    Code.RATE_RECOVERED: lambda: known().cycles(2, 360.0 * DEG).cycles(2),
    Code.UNREADABLE: lambda: broken("static_bias"),
    Code.FILTER_FAULT: lambda: broken("P"),
    Code.AIDING_REJECTED: lambda: wronged(known()),
    Code.ALIGNMENT_BEGUN: lambda: aligned(0),
    Code.ALIGNMENT_TURNING: lambda: aligned(10),
    Code.ALIGNED: lambda: aligned(120),
    Code.ALIGNMENT_REFUSED: lambda: aligned(10).cycles(2, FAST),
    Code.ALIGNMENT_DROPPED: lambda: dropped(aligned(120)),
    Code.IMU_EXCLUDED: lambda: known(TWO).cycles(8, spoil=held),
    Code.IMU_BACK: lambda: known(TWO).cycles(8, spoil=held).cycles(40),
    Code.BIAS_MOVED: lambda: known().cycles(20, FAST).cycles(20, spoil=warmed),
    Code.AIDING_DOUBTED: lambda: wobbling(known()),
    Code.ENCODER_REVERSED: lambda: known().cycles(4, FAST, aided=False).aid(rate=-FAST).cycles(1, aided=False),
    Code.STRING_TURNED: lambda: known().cycles(20, FAST).cycles(30, spoil=crept),
    Code.AXES_EXCHANGED: lambda: known().cycles(40, FAST, spoil=exchanged),
    Code.ENCODER_RATIO: lambda: halved(known()),
    Code.ENCODER_STANDS: lambda: standing(standing(known().cycles(4, FAST))).cycles(1, aided=False),
}


def crept(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    return (w[0], w[1], w[2] + 0.1 * DEG), (0.0, 0.0, f[2])


def exchanged(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    return (w[1], w[0], w[2]), (f[1], f[0], f[2])


def standing(bench: Bench) -> Bench:
    """A head that turns on while its encoder tells of a rest."""
    return bench.cycles(1, FAST, aided=False).aid(rate=0.0)


def halved(bench: Bench) -> Bench:
    """A head of whose turns the encoder counts half."""
    for _ in range(20):
        bench.cycles(1, FAST, aided=False).aid(yaw=0.5 * bench.angle % math.tau, rate=0.5 * FAST)
    return bench


def warmed(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    x, y, z = w
    return (x + 0.3 * DEG, y + 0.3 * DEG, z + 0.3 * DEG), f


def wobbling(bench: Bench) -> Bench:
    """A gyroscope whose rate swings once in ten cycles, as one that leans does."""
    for k in range(80):
        off = 0.1 * DEG * math.sin(math.tau * k / 10.0)
        bench.cycles(1, FAST, lambda w, f, off=off: ((w[0], w[1], w[2] + off), f))  # type: ignore[misc]
    return bench


def scaled(bench: Bench) -> Bench:
    """A string that speeds up, with a gyroscope whose scale has changed at rest."""
    for k in range(1, 12):
        bench.cycles(1, 6.0 * k * DEG, lambda w, f: ((w[0], w[1], 1.03 * w[2]), f))
    return bench.cycles(10, 66.0 * DEG, lambda w, f: ((w[0], w[1], 1.03 * w[2]), f))


def jumped(bench: Bench) -> Bench:
    bench.now += 1e6
    return bench.cycles(1)


def wronged(bench: Bench) -> Bench:
    bench.angle += 1.0
    return bench.cycles(2)


def aligned(cycles: int) -> Bench:
    bench = known()
    assert bench.tube.align("circle", 1.0) == ""
    return bench.cycles(1).cycles(cycles, SLOW)


def dropped(bench: Bench) -> Bench:
    assert bench.tube.align("none", 1.0) == ""
    return bench.cycles(1)


def test_every_code_has_its_case() -> None:
    assert set(CASES) == set(Code)


@pytest.mark.slow
@pytest.mark.parametrize("code", CASES, ids=lambda code: code.name.lower())
def test_the_code_is_told(code: Code, monkeypatch: pytest.MonkeyPatch) -> None:
    """By its number, for two codes may share a name; and with the arguments that its line promises."""
    told: list[tuple[int, dict[str, object]]] = []

    def watched(events: np.void) -> list[tuple[object, ...]]:
        first, last = int(events["said"]), int(events["told"])
        codes = [int(events["ring"][n % len(events["ring"])]["code"]) for n in range(first, last)]
        said = list(take_events(events))
        told.extend(zip(codes, [arguments for _, _, arguments in said], strict=True))
        return said

    monkeypatch.setattr("node.firmware.tube.take_events", watched)
    bench = CASES[code]()
    assert code in {number for number, _ in told}
    line = EVENT_TABLE[code]
    assert line.name in bench.names
    given = next(arguments for number, arguments in told if number == code)
    assert set(given) <= {name for name, _ in line.arguments} or line.words is not None


@pytest.mark.parametrize("rate", [FAST, -FAST, 0.5 * FAST])
def test_exchanged_axes_are_told_whichever_way_the_string_turns(rate: float) -> None:
    assert "axes_exchanged" in known().cycles(40, rate, spoil=exchanged).names


@pytest.mark.parametrize("towards_deg", range(0, 360, 45))
@pytest.mark.parametrize("off_deg", [0.5, 8.0])
def test_a_mount_that_leans_is_no_exchange_of_axes(off_deg: float, towards_deg: float) -> None:
    """Along x = y it is its own mirror, in force and rate, and it may be larger than the hole leans."""
    towards = towards_deg * DEG
    mount = Rotation.from_rotvec(off_deg * DEG * np.array([-math.sin(towards), math.cos(towards), 0.0]))

    def leaning(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
        (a, b, c), (x, y, z) = mount.apply([w, f]).tolist()
        return (a, b, c), (x, y, z)

    bench = Bench().cycles(LEARN, spoil=leaning)
    for rate in (FAST, 0.5 * FAST, -FAST):
        bench.cycles(40, rate, leaning).cycles(12, spoil=leaning)
    assert "axes_exchanged" not in bench.names
