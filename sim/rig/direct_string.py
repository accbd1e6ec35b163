"""The string with its link switched off: the firmware of every node on the world's sensors, aiding handed on directly.

Schedule, truth, sensors, joints, torsion and encoder are those of the world that a rig drills in; the firmware is the
node's. What stands for the link are its effects: each hop loses aiding, delays it and adds an error of rig time. There
are no frames, files or processes, so that a study of hundreds of seeds costs minutes. ``medium.link = "off"`` in
a scenario asks for it; ``sim.rig.in_process`` is the string with its link.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.firmware.inputs import RigContext
from node.firmware.reporter import VAR_FLOOR
from node.firmware.tube import Tube
from node.kernels.arithmetic.angles import from_binary, wrap_angle
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Err, Scheme, default_config
from node.kernels.record.integer_node import new_integers
from node.kernels.record.node_record import (
    A_VALID,
    BEHIND,
    END,
    LATE,
    LATE_STD,
    READING,
    SATURATED,
    SPLIT,
    TEMPERATURE,
    new_node,
)
from node.kernels.record.sensor_record import PARAMETERS
from node.kernels.sensors.correction import USUAL
from node.kernels.step.address import BY_ADDRESS, firmware_addresses
from node.kernels.step.node_step import ADMITTED
from node.process.reading import reading_of
from sim.errors import ScenarioError
from sim.rig.encoder_course import is_plain, measured_of
from sim.rig.plain_encoder import PlainEncoder
from sim.rig.string_course import Kept, StringCourse, hand_down, new_desk, run_string
from sim.world.imu_errors import gauss_markov
from sim.world.scenario_file import AidingSection
from sim.world.streams import Stream, stream
from sim.world.world import World
from telemetry.messages import Aiding, Event, Message, NodeState, SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Sample = list[float]  # three rates (rad/s), three forces (m/s^2)
Spoil = Callable[[int, int, Sample], Sample]
SILENT_AFTER = 3.5  # s, until a node takes the neighbour above for gone
NEVER = 10**9  # cycles


@dataclass(frozen=True, slots=True)
class Survey:
    """One survey, judged at the cycle that made it, as it was said first or revised later."""

    cycle: int
    tube: int
    error: float  # rad, yaw with all constant errors, less the truth
    measurement: SurveyMeasurement
    said: int  # cycle in which it was said


@dataclass(slots=True)
class StringRun:
    """What the nodes of one seed knew: arrays are (cycles, tubes), tube 1 first; NaN before a tube is powered."""

    ends: Array  # (cycles,) rig time, s
    turning: Mask  # (cycles,)
    yaw: Array  # rad, at the end of the tube's own cycle
    total_error: Array  # rad, estimate less truth
    systematic_error: Array  # rad, of it the part of joints, mounts and twist
    var: Array  # rad^2, random part as the node states it
    systematic_var: Array  # rad^2, as the node states it
    gyro_bias: Array  # rad/s, z axis, estimate
    surveys: list[Survey] = field(default_factory=list)
    revisions: list[Survey] = field(default_factory=list)  # surveys that were said again, by the cycle of the first
    events: list[tuple[int, Event]] = field(default_factory=list)  # with the cycle
    states: list[tuple[int, NodeState]] = field(default_factory=list)  # with the cycle

    @property
    def error(self) -> Array:
        """Random part of the yaw error (cycles, tubes), rad."""
        return wrapped(self.total_error - self.systematic_error)

    @property
    def total_var(self) -> Array:
        """Stated variance of ``total_error``, rad^2."""
        return self.var + self.systematic_var


class DirectString:
    """One string of one world.

    ``clock_shifts`` moves the clock of a tube by so many seconds, a plain field to be changed by tests.

    Parameters
    ----------
    world : of a scenario whose link is off
    state_every : cycles between two states of a node; by default none is made
    spoil : changes the sample of a tube in a cycle before its firmware reads it

    Raises
    ------
    ScenarioError
        When the scenario has its link on.
    """

    def __init__(self, world: World, *, state_every: int = NEVER, spoil: Spoil | None = None) -> None:
        self.world, self._file = world, world.scenario.file
        if self._file.medium.link != "off":
            raise ScenarioError('medium.link: expected "off" for a string without frames')
        self._spoil = spoil
        count, self._imus = world.scenario.tubes, self._file.node.imus
        config = self._tuned_config()
        # the records of all tubes in one array, so that a cycle is read off in a few operations
        self.nodes = np.repeat(new_node(config), count)
        self._corrections = np.zeros((count, 1 + self._imus), PARAMETERS)
        self._integers = np.repeat(new_integers(), count) if self._file.node.kernel == "fixed" else None
        self.tubes = {tube: self._fresh_tube(tube, config, state_every) for tube in range(1, count + 1)}
        self._encoder = EncoderNode(torque=world.torque_settings())
        sensor = self._file.encoder
        self._plain = None if sensor.edge_times else PlainEncoder(sensor.counts_per_turn)
        self.passes = aiding_passes(self._file.aiding, world.ends - world.begin, world.seed)
        self._lost = self._losses()
        self._clocks = self._clock_errors()
        self._phases = {tube: world.phase(tube) for tube in self.tubes}
        clocks = self._file.clocks
        stated = clocks.joint_std_ms if clocks.stated_std_ms is None else clocks.stated_std_ms
        self._clock_var = (1e-3 * stated) ** 2 * np.arange(1, count + 1)  # s^2, by hops
        self._adds = [phase for phase in world.phases if phase.kind == "add"]
        self._crews = np.concatenate([tube.settings_record for tube in self.tubes.values()])
        self.clock_shifts: dict[int, float] = {}
        self._mount_var = math.radians(self._file.joints.mount_std_deg) ** 2
        self._runs_together = spoil is None and self._imus == 1 and self._file.node.kernel in BY_ADDRESS
        forward = all(tube.settings.scheme is Scheme.FORWARD for tube in self.tubes.values())
        self._hands_on = self._runs_together and forward
        at_once = self._hands_on and is_plain(world)
        self._measured = [] if at_once else self._measure()
        self._own: dict[int, Aiding | None] = {}  # what each node said in its cycle, by the schemes of estimates
        self.run = self._empty_run()
        self._kept = Kept(self.run.yaw, self.run.var, self.run.systematic_var, self.run.gyro_bias)
        self._desk = new_desk(count)
        self._course: StringCourse | None = None
        if self._runs_together:
            vectors = measured_of(world) if at_once else np.array([aiding_vector(said) for said in self._measured])
            self._course = self._course_of(vectors)

    def drill(self) -> StringRun:
        """Every cycle of the schedule; returns what the nodes knew."""
        cycle = 0
        while cycle < self.world.cycles:
            cycle = self._advance(cycle, self.world.cycles)
        return self.run

    def steps(self) -> Iterator[int]:
        """Cycle by cycle, each yielded when it is done, so that a study may act between two."""
        for cycle in range(self.world.cycles):
            self._advance(cycle, cycle + 1)
            yield cycle

    def _advance(self, first: int, last: int) -> int:
        """Run the cycle ``first``, and those after it while no message is due; returns the next cycle."""
        if self._hands_on:
            return self._run_together(first, last)
        string = self._string_at(self.world.cycle_end(first))
        locked = self._file.encoder.phase == "locked"
        if not locked:
            self._relay(first, string)
        if self._runs_together:
            self._run_together(first, first + 1)
        else:
            self._run_one_by_one(first, string)
        if locked:  # cycles end with the encoder's, and what it measures then arrives after them
            self._relay(first, string)
        return first + 1

    def _tuned_config(self) -> Array:
        config = default_config()
        names = config.dtype.names or ()
        for name, value in self._file.node.tuning.items():
            if name not in names:
                raise ScenarioError(f"node.tuning.{name}: expected one of {', '.join(names)}")
            config[0][name] = value
        return config

    def _fresh_tube(self, tube: int, config: Array, state_every: int) -> Tube:
        settings = replace(self.world.tube_settings(tube), state_every=state_every)
        return Tube(
            settings,
            config,
            self.nodes[tube - 1 : tube],
            iter(range(NEVER)).__next__,
            restored=False,
            corrections=self._corrections[tube - 1],
            integers=None if self._integers is None else self._integers[tube - 1 : tube],
        )

    def _losses(self) -> Mask:
        """Whether an aiding is lost on the hop to a tube, (cycles, tubes)."""
        shape = (self.world.cycles, self.world.scenario.tubes)
        return np.asarray(stream(self.world.seed, Stream.AIDING_LOSS).random(shape) < self._file.medium.loss)

    def _clock_errors(self) -> Array:
        """Error of each hop's rig time (cycles, hops), s: those of the joints above, added up.

        A node dates its own cycles by its own crystal; what is wrong is when it takes an aiding to be valid.
        """
        clocks, tubes = self._file.clocks, self.world.scenario.tubes
        random = stream(self.world.seed, Stream.AIDING_CLOCKS)
        constant = 1e-3 * clocks.joint_std_ms * random.standard_normal(tubes)
        std = np.full(3, 1e-3 * clocks.wander_std_ms)
        wander = [gauss_markov(random, self.world.cycles, std, clocks.wander_tau_s, PERIOD)[:, 0] for _ in range(tubes)]
        return np.cumsum(constant + np.stack(wander, axis=1), axis=1)

    def _string_at(self, end: float) -> list[int]:
        """Tubes that are powered, from the top down."""
        added = sum(phase.start <= end for phase in self._adds)
        return list(range(self._file.rig.tubes_at_start + added, 0, -1))

    def _is_open(self, t: float, since: float = 0.0) -> bool:
        """Whether the joint below the head is open, and was for ``since`` s."""
        return any(phase.start + since < t < phase.joint_closed for phase in self._adds)

    def _course_of(self, measured: Array) -> StringCourse:
        """What comes to the nodes, whatever they do; where they do not hand on what comes, no aiding.

        ``measured`` is what the encoder measures in every cycle (cycles, AIDING).
        """
        world, tubes = self.world, list(self.tubes)
        phases = np.array([self._phases[tube] for tube in tubes])
        ends = np.array([world.cycle_end(cycle) for cycle in range(-1, world.cycles)])
        powered = np.array([len(self._string_at(end)) for end in ends[1:]])
        place = np.arange(len(tubes))
        lost = self._lost | (place >= powered[:, None])
        first_lost = np.where(lost.any(axis=1), lost.argmax(axis=1), len(tubes))
        is_sent = self.passes & ~are_open(world, ends[1:]) & self._hands_on
        return StringCourse(
            begins=ends[:-1],
            ends=ends[1:],
            phases=phases,
            powered=powered,
            joined=joined_of(world, powered, phases),
            clock_var=self._clock_var,
            readings=self._readings(),
            measured=measured,
            arrivals=self._arrivals(measured[:, A_VALID]),
            reach=np.where(is_sent, first_lost, 0),
            locked=self._file.encoder.phase == "locked",
        )

    def _readings(self) -> Array:
        """Of one IMU a tube, (cycles, tubes, 1, READING)."""
        world = self.world
        readings = np.zeros((world.cycles, len(self.tubes), 1, READING))
        readings[..., TEMPERATURE] = USUAL
        for tube in self.tubes:
            readings[:, tube - 1, 0, :TEMPERATURE] = world.sensors.samples(tube)
            if world.scenario.file.rough is not None:
                found = world.sensors.rough_cycles(tube)
                readings[:, tube - 1, 0, TEMPERATURE] = found.temperature
                readings[:, tube - 1, 0, SATURATED] = found.clipped
                readings[:, tube - 1, 0, LATE] = found.late
                readings[:, tube - 1, 0, LATE_STD] = found.late_std
            if (parts := world.sensors.parts(tube)) is not None:
                known = np.isfinite(parts[:, 0])
                readings[:, tube - 1, 0, SPLIT] = known
                readings[known, tube - 1, 0, BEHIND:] = parts[known]
        return readings

    def _arrivals(self, measured_at: Array) -> Array:
        """When a node so many hops below takes what was measured at (cycles,) to be valid, (cycles, hops), s."""
        medium, hops = self._file.medium, len(self.tubes)
        valid = np.repeat(measured_at[:, None], hops, axis=1)
        if medium.dated_by == "arrival":
            valid += 1e-3 * medium.delay_ms + medium.latency * np.arange(1, hops + 1)
        return np.asarray(valid + self._clocks)

    def _run_together(self, first: int, last: int) -> int:
        """Take all nodes through cycles in one call, until one has something to say; returns which cycle is next."""
        course, desk = self._course, self._desk
        step, aid = firmware_addresses(self._file.node.kernel)
        if course is None:
            raise ScenarioError("string: expected nodes that run together")
        shifts = np.array([self.clock_shifts.get(tube, 0.0) for tube in self.tubes])
        nodes, crews, integers = self.nodes, self._crews, self._integers
        corrections = self._corrections
        reached = run_string(
            step, aid, nodes, crews, corrections, course, shifts, desk, self._kept, first, last, integers
        )
        self._judge(first, reached)
        cycle = reached - 1
        n, end = int(course.powered[cycle]), float(course.ends[cycle])
        telling = np.flatnonzero(desk.says[:n] & ~ADMITTED).tolist()[::-1]
        said: dict[int, Sequence[Message]] = {}
        for place in telling:
            around = self._context(place + 1, n, end + self._phases[place + 1])
            said[place + 1] = list(
                self.tubes[place + 1].say(int(desk.says[place]), float(desk.moments[place, END]), around)
            )
        self._take(cycle, range(n, 0, -1), said)
        if telling and course.locked:
            hand_down(aid, nodes, crews, course, shifts, desk, cycle, integers)
        return reached

    def _run_one_by_one(self, cycle: int, string: Sequence[int]) -> None:
        said = {tube: self._run_cycle(cycle, tube, string) for tube in string}
        run, powered = self.run, np.s_[cycle, : len(string)]
        known = self.nodes["filter"][: len(string)]
        run.yaw[powered] = [from_binary(yaw) for yaw in known["now_yaw"].tolist()]
        run.var[powered] = known["now_P"][:, Err.YAW, Err.YAW]
        run.systematic_var[powered] = known["systematic_var"]
        run.gyro_bias[powered] = known["static_bias"][:, 2] + known["bias"][:, 2]
        self._judge(cycle, cycle + 1)
        self._take(cycle, string, said)

    def _run_cycle(self, cycle: int, tube: int, string: Sequence[int]) -> Sequence[Message]:
        phase = self._phases[tube]
        begin, end = self.world.cycle_end(cycle - 1) + phase, self.world.cycle_end(cycle) + phase
        shift = self.clock_shifts.get(tube, 0.0)
        sample = self.world.imu_sample(tube, cycle)
        spoilt = sample if self._spoil is None else self._spoil(tube, cycle, sample)
        reading = reading_of((begin + shift, *spoilt), end + shift)
        return self.tubes[tube].on_cycle(reading, self._context(tube, string[0], end))

    def _context(self, tube: int, top: int, end: float) -> RigContext:
        """What the link would tell: the new tube's joint is open at once, that below it once it is missed."""
        hops = top - tube + 1
        return RigContext(self._is_joined(tube, top, end), hops, end, float(self._clock_var[hops - 1]), True)

    def _is_joined(self, tube: int, top: int, end: float) -> bool:
        growing = self._is_open(end)
        return not (growing and (tube == top or (tube == top - 1 and self._is_open(end, SILENT_AFTER))))

    def _measure(self) -> list[Aiding]:
        """What the encoder measures in every cycle."""
        found = []
        for cycle in range(self.world.cycles):
            end = self.world.cycle_end(cycle)
            count, edge_at, rising, torque, earlier = self.world.encoder_sample(end)
            if self._plain is not None:
                head = float(self.world.motion.drive(np.array([end]))[0][0])
                measured = self._plain.on_cycle(head, end)
            else:
                sample = EncoderSample(count, edge_at, bool(rising), torque, earlier=earlier)
                measured = self._encoder.on_cycle(sample, end)
            found.append(replace(measured, sequence=cycle) if self._file.aiding.renumbered else measured)
        return found

    def _relay(self, cycle: int, string: Sequence[int]) -> None:
        """Down the string: ``forward`` hands on what came, the others what each node said in its cycle."""
        end = self.world.cycle_end(cycle)
        aiding: Aiding | None = self._measured[cycle] if self.passes[cycle] and not self._is_open(end) else None
        medium = self._file.medium
        for hop, tube in enumerate(string):
            firmware = self.tubes[tube]
            scheme = firmware.settings.scheme
            passed = None
            if aiding is not None and not self._lost[cycle, hop]:
                travelled = 1e-3 * medium.delay_ms + medium.latency * (hop + 1 if scheme is Scheme.FORWARD else 1)
                late = travelled if medium.dated_by == "arrival" else 0.0
                error = float(self._clocks[cycle, hop]) + self.clock_shifts.get(tube, 0.0)
                passed = firmware.on_aiding(aiding, aiding.valid_at + late + error)
            aiding = passed if scheme is Scheme.FORWARD else self._own.get(tube)

    def _empty_run(self) -> StringRun:
        world, tubes = self.world, self.world.scenario.tubes
        shape = (world.cycles, tubes)
        yaw, total, systematic, var, systematic_var, bias = np.full((6, *shape), math.nan)
        self._truth = np.stack([world.truth(tube).yaw(world.ends + self._phases[tube]) for tube in self.tubes], axis=1)
        self._systematic = np.stack(
            [world.systematic_errors(tube, world.ends + self._phases[tube]) for tube in self.tubes], axis=1
        )
        turning = world.motion.drive(world.ends)[1] > 0.0
        return StringRun(world.ends, turning, yaw, total, systematic, var, systematic_var, bias)

    def _judge(self, first: int, last: int) -> None:
        """Set what the nodes knew in the cycles ``first``..``last`` - 1 beside the truth."""
        run, rows = self.run, np.s_[first:last]
        unknown = np.isnan(run.yaw[rows])
        run.total_error[rows] = wrapped(run.yaw[rows] - self._truth[rows])
        run.systematic_error[rows] = np.where(unknown, math.nan, self._systematic[rows])
        run.var[rows] = np.maximum(run.var[rows], VAR_FLOOR)
        run.systematic_var[rows] += self._mount_var

    def _take(self, cycle: int, string: Sequence[int], said: Mapping[int, Sequence[Message]]) -> None:
        """Take what the nodes had to say."""
        run = self.run
        self._own = dict.fromkeys(string)
        for tube, messages in said.items():
            for message in messages:
                if isinstance(message, Aiding):
                    self._own[tube] = message
                elif isinstance(message, SurveyMeasurement):
                    self._take_survey(cycle, tube, message)
                elif isinstance(message, Event):
                    run.events.append((cycle, message))
                elif isinstance(message, NodeState):
                    run.states.append((cycle, message))

    def _take_survey(self, cycle: int, tube: int, message: SurveyMeasurement) -> None:
        run = self.run
        for first in reversed(run.surveys):
            if (first.tube, first.measurement.station_at) == (tube, message.station_at):
                moved = wrap_angle(message.yaw - first.measurement.yaw)
                run.revisions.append(Survey(first.cycle, tube, first.error + moved, message, cycle))
                return
        run.surveys.append(Survey(cycle, tube, float(run.total_error[cycle, tube - 1]), message, cycle))


def are_open(world: World, t: Array, since: float = 0.0) -> Mask:
    """Whether the joint below the head is open at ``t`` (s), of any shape, and was for ``since`` s."""
    found = np.zeros(t.shape, np.bool_)
    for phase in world.phases:
        if phase.kind == "add":
            found |= (phase.start + since < t) & (t < phase.joint_closed)
    return found


def joined_of(world: World, powered: npt.NDArray[np.int64], later: Array) -> Array:
    """1 where a tube's upper joint is closed for all it knows, (cycles, tubes), else 0.

    Parameters
    ----------
    powered : (cycles,) tubes in the string
    later : (tubes,) s, by which cycles end after the encoder's
    """
    at, place, top = world.ends[:, None] + later, np.arange(len(later)), powered[:, None] - 1
    opened, missed = are_open(world, at), are_open(world, at, SILENT_AFTER)
    return np.where(opened & ((place == top) | ((place == top - 1) & missed)), 0.0, 1.0)


def aiding_vector(aiding: Aiding) -> tuple[float, ...]:
    """What the encoder measured as ``node_aiding`` takes it, (AIDING,)."""
    a = aiding
    above = (a.yaw, a.yaw_var, a.systematic_var, a.offset, a.rate, a.valid_at, a.sequence, a.hops)
    return (*above, a.torque, a.torsion_var, a.under_torque, 0.0)


def aiding_passes(section: AidingSection, t: Array, seed: int) -> Mask:
    """Whether the encoder is heard in each cycle that ends at ``t`` (cycles,) s. Source: update modes, thesis 4.2."""
    every = section.every_s
    repeats = section.on_s + section.off_s if every is None else every
    shifted = t + repeats * float(stream(seed, Stream.AIDING_PHASE).random())
    if every is None:
        return np.asarray(np.mod(shifted, repeats) < section.on_s)
    number = np.floor(shifted / every + 1e-9)  # the first cycle of every interval
    return np.asarray(np.diff(number, prepend=np.floor((shifted[0] - PERIOD) / every + 1e-9)) > 0.0)


def wrapped(angle: Array) -> Array:
    """Angles in [-pi, pi), rad."""
    return np.asarray(np.mod(angle + math.pi, math.tau) - math.pi)
