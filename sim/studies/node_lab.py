"""The laboratory string of thesis 4.2 in one process: still, 20 turns at 71 deg/s, still again, under a given aiding.

The firmware of every node runs on the sensors of the world as in ``chain``; what differs is the aiding, which comes and
goes, is late or is dated by its arrival. Thesis 4.2 rests from 350 to 550 s; here that window opens with the stop, so
what the last outage left in the yaw counts. The phase of the aiding against the stop is drawn for every seed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.resolve import angles, resolve
from node.firmware.encoder import COUNTS_PER_TURN, EDGE_STD, EncoderNode, EncoderSample
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.settings import Joint, Kernel, TubeSettings
from node.firmware.tube import Tube
from node.kernels.angles import wrap
from node.kernels.layout import PERIOD, Scheme
from sim.rig.plain_encoder import PlainEncoder
from sim.studies.fresh import fresh_tube
from sim.studies.links import Link, OnOff
from sim.world.borehole import Borehole
from sim.world.disc import Disc
from sim.world.imu_errors import ImuErrors, gauss_markov, single_samples
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import AccelerometerSection, GyroSection
from sim.world.truth import TubeTruth
from telemetry.messages import Aiding, SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
BEGIN, STOP, END = 1000.0, 350.0, 550.0  # s; rig time at zero, then seconds after it. Source: thesis 4.2
RUN_IN = 20.0  # s, of turning before the yaw is judged as rotating, and of rest before it is judged as settled
INCLINATION = math.radians(2.0)
TURN = Trapezoid(20.0 * math.tau, math.radians(71.0), math.radians(35.0))
STREAMS = 4200  # of random numbers, apart from those of other experiments


@dataclass(frozen=True, slots=True)
class LabSetup:
    """One string and its aiding; s, rad. ``config`` overrides fields of the firmware's configuration."""

    link: Link = OnOff()  # noqa: RUF009
    hops: int = 1
    delay: float = 0.0  # from the edge to its arrival, beside ``latency``; with it below a cycle
    dated_by_arrival: bool = False  # the node takes the aiding as valid when it arrives
    latency: float = 3e-3  # each hop
    loss: float = 0.0  # each hop
    clock_std: float = 0.2e-3  # each joint, constant
    clock_wander_std: float = 0.03e-3  # each joint, Gauss-Markov
    clock_wander_tau: float = 60.0
    clock_told: float | None = None  # each joint, what a node's clock says of itself; None is clock_std
    bias_step_dps: float = 0.0  # of the z gyroscope, from the first turn on: what the bias of the boot left over
    gyroscope: GyroSection = GyroSection()  # noqa: RUF009
    accelerometer: AccelerometerSection = AccelerometerSection(bias_std_deg=0.0)  # noqa: RUF009
    config: tuple[tuple[str, float], ...] = ()
    kernel: Kernel = "float64"
    scheme: Scheme = Scheme.FORWARD
    counts_per_turn: int | None = None  # of an encoder that is read without edge times; None is that of the firmware
    instantaneous: bool = False  # the gyroscope is read once at the end of a cycle, not averaged over it
    renumbered: bool = False  # at rest every cycle's aiding counts as a new measurement


@dataclass(frozen=True, slots=True)
class LabRun:
    """What one seed left: yaw errors (cycles, hops) rad and the rest, hop by hop."""

    error: Array  # rad, at the end of every cycle
    var: Array  # rad^2, what the node says of it
    bias_error: Array  # rad/s, z gyroscope, estimate minus truth
    azimuth_error: Array  # (hops,) rad, mean force and mean yaw of the window of rest
    survey_error: Array  # (hops,) rad, of the node's own survey; NaN if it made none


def motion_of(first_angle: float) -> Motion:
    """Still, 20 turns, still."""
    return Motion(BEGIN, STOP - TURN.duration, 5.0, END - STOP, 1.0, TURN, 1, 1.0, first_angle)


CYCLES = math.floor((END + 1.0) / PERIOD)
ENDS: Array = PERIOD * np.arange(1.0, CYCLES + 1.0)  # s after zero
REST: Mask = (ENDS - PERIOD >= STOP) & (ENDS <= END)
SETTLED: Mask = (ENDS >= STOP + RUN_IN) & (ENDS <= END)
ROTATING: Mask = (STOP - TURN.duration + RUN_IN <= ENDS) & (STOP - TURN.ramp >= ENDS)
FIRST_PERIOD = 50.0  # s, of turning, after which a link of 20 s on and 30 s off was heard for all of its 20 s
ONCE_AIDED: Mask = ROTATING & (STOP - TURN.duration + FIRST_PERIOD <= ENDS)


class Lab:
    """Nodes, truth and errors of one seed."""

    def __init__(self, setup: LabSetup, seed: int) -> None:
        self._setup = setup
        self._streams = np.random.SeedSequence([seed, STREAMS]).spawn(setup.hops + 2)
        random = _generator(self._streams[0])
        self._motion = motion_of(float(random.uniform(0.0, math.tau)))
        self._disc = Disc(self._motion, COUNTS_PER_TURN, EDGE_STD, _generator(self._streams[-1]))
        phase = float(random.uniform(0.0, 1.0)) * setup.link.repeats
        self._passes = setup.link.passes(ENDS + phase)
        joints = random.uniform(-math.pi, math.pi, setup.hops)
        self._true = np.cumsum(joints)
        self._clocks = _clock_errors(setup, random)
        self._lost = random.random((CYCLES, setup.hops)) < setup.loss
        self._drive = self._motion.drive(BEGIN + ENDS)[0]
        self._sensors = [
            _Sensor(setup, self._motion, float(a), s) for a, s in zip(self._true, self._streams[1:-1], strict=True)
        ]
        self._tubes = [_tube(setup, k, [*joints, 0.0]) for k in range(setup.hops)]
        self._estimates: list[Aiding | None] = [None] * setup.hops  # of the last cycle, by scheme ``estimate``
        self._plain = PlainEncoder(setup.counts_per_turn) if setup.counts_per_turn is not None else None

    def run(self) -> LabRun:
        """Let it rest, turn and rest."""
        encoder, shape = EncoderNode(), (CYCLES, self._setup.hops)
        yaw, var, bias = np.empty(shape), np.empty(shape), np.empty(shape)
        surveys: list[SurveyMeasurement | None] = [None] * self._setup.hops
        for cycle in range(CYCLES):
            for k, tube in enumerate(self._tubes):
                surveys[k] = self._cycle(k, cycle) or surveys[k]
                state = tube.state
                yaw[cycle, k], var[cycle, k] = tube.yaw, tube.yaw_var
                bias[cycle, k] = state["static_bias"][2] + state["bias"][2]
            measured = self._measure(encoder, BEGIN + ENDS[cycle])
            self._relay(cycle, replace(measured, sequence=cycle) if self._setup.renumbered else measured)
        error = _wrapped(yaw - self._drive[:, None] - self._true[None, :])
        azimuth = [self._azimuth_error(k, yaw[REST, k], var[REST, k]) for k in range(self._setup.hops)]
        truth = np.stack([s.bias for s in self._sensors], axis=1)
        return LabRun(error, var, bias - truth, np.array(azimuth), np.array([_survey_error(s) for s in surveys]))

    def _cycle(self, k: int, cycle: int) -> SurveyMeasurement | None:
        wx, wy, wz, fx, fy, fz = self._sensors[k].samples[cycle]
        end = BEGIN + float(ENDS[cycle])
        told = self._setup.clock_std if self._setup.clock_told is None else self._setup.clock_told
        around = RigContext(True, k + 1, end, told**2 * (k + 1), True)
        said = list(self._tubes[k].on_cycle(ImuReading(end - PERIOD, end, (wx, wy, wz), (fx, fy, fz)), around))
        self._estimates[k] = next((message for message in said if isinstance(message, Aiding)), None)
        return next((message for message in said if isinstance(message, SurveyMeasurement)), None)

    def _measure(self, encoder: EncoderNode, end: float) -> Aiding:
        if self._plain is not None:
            return self._plain.on_cycle(float(self._motion.drive(np.array([end]))[0][0]), end)
        count, edge_at, earlier = self._disc.sample(end)
        return encoder.on_cycle(EncoderSample(count, edge_at, True, earlier=earlier), end)

    def _relay(self, cycle: int, measured: Aiding) -> None:
        """Down the string, before the next cycle ends: every node hands on what came."""
        aiding: Aiding | None = measured if self._passes[cycle] else None
        for k, tube in enumerate(self._tubes):
            if aiding is None or self._lost[cycle, k]:
                return
            hops = 1 if self._setup.scheme is Scheme.ESTIMATE else k + 1
            age = self._setup.delay + hops * self._setup.latency
            valid_at = aiding.valid_at + (age if self._setup.dated_by_arrival else 0.0)
            passed = tube.on_aiding(aiding, valid_at + float(self._clocks[cycle, k]))
            aiding = self._estimates[k] if self._setup.scheme is Scheme.ESTIMATE else passed

    def _azimuth_error(self, k: int, yaw: Array, var: Array) -> float:
        force = np.array(self._sensors[k].samples)[REST, 3:]
        mean = float(yaw[0] + np.mean(_wrapped(yaw - yaw[0])))
        return _azimuth(force.mean(axis=0), np.cov(force.T) / len(force), mean, float(var.mean()))


class _Sensor:
    """Readings of one node over the run (cycles of six) and the true bias of its z gyroscope (cycles,) rad/s."""

    def __init__(self, setup: LabSetup, motion: Motion, angle: float, stream: np.random.SeedSequence) -> None:
        hole = Borehole.straight(INCLINATION)
        a, ends = setup.accelerometer, BEGIN + ENDS
        truth = TubeTruth(hole, motion, 0.0, angle, a.radius_m, a.gravity_mps2)
        rate, force = truth.cycle_means(ends, PERIOD)
        sensor = setup.gyroscope
        if setup.instantaneous:
            rate, sensor = truth.rate(ends), single_samples(sensor, PERIOD)
        step = math.radians(setup.bias_step_dps) * (ends > BEGIN + STOP - TURN.duration)
        rate[:, 2] += step
        random = _generator(stream)
        gyro = ImuErrors(sensor, a).gyro(random, rate, force, PERIOD)
        turning = (motion.drive(ends)[1] > 0.0).astype(float)
        acceleration = ImuErrors(setup.gyroscope, a).accelerations(random, force, turning)
        self.samples: list[list[float]] = np.concatenate([gyro, acceleration], axis=1).tolist()
        # the same draws without white noise, scale and rounding
        clean = setup.gyroscope.model_copy(
            update={"noise_dps_rthz": (0.0, 0.0, 0.0), "scale_factor_std": 0.0, "resolution_dps": 0.0}
        )
        drawn = ImuErrors(clean, a).gyro(_generator(stream), np.zeros_like(rate), force, PERIOD)
        self.bias: Array = drawn[:, 2] + step


def _generator(stream: np.random.SeedSequence) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(stream))


def _tube(setup: LabSetup, k: int, joints: list[float]) -> Tube:
    settings = TubeSettings(
        k + 1,
        drive_joint=Joint(joints[0]),
        lower_joint=Joint(joints[k + 1]),
        scheme=setup.scheme,
        state_every=10**9,
        kernel=setup.kernel,
    )
    return fresh_tube(settings, setup.config)


def _clock_errors(setup: LabSetup, random: np.random.Generator) -> Array:
    """Error of every node's rig time (cycles, hops), s: those of the joints above, added up.

    A node dates its own cycles by its own crystal; what is wrong is when it takes an aiding to be valid.
    """
    constant = setup.clock_std * random.standard_normal(setup.hops)
    std = np.full(3, setup.clock_wander_std)
    wander = [gauss_markov(random, CYCLES, std, setup.clock_wander_tau, PERIOD)[:, 0] for _ in range(setup.hops)]
    return np.cumsum(constant + np.stack(wander, axis=1), axis=1)


def _wrapped(angle: Array) -> Array:
    return np.asarray(np.mod(angle + math.pi, math.tau) - math.pi)


def _azimuth(force: Array, cov: Array, yaw: float, yaw_var: float) -> float:
    """Azimuth of the tube in (-pi, pi]; the hole leans north, so it is the error."""
    direction = resolve(force, cov, yaw, yaw_var).direction
    return wrap(angles(direction.lean, direction.down)[1])


def _survey_error(survey: SurveyMeasurement | None) -> float:
    if survey is None:
        return math.nan
    mean = survey.imus[0]
    return _azimuth(np.array(mean.force), np.array(mean.force_cov), survey.yaw, survey.yaw_var)


def run_seed(job: tuple[LabSetup, int]) -> LabRun:
    """One seed, for a pool of processes."""
    setup, seed = job
    return Lab(setup, seed).run()
