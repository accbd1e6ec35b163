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
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.firmware.encoder import EncoderNode, EncoderSample
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.reporter import VAR_FLOOR
from node.firmware.tube import Tube
from node.kernels.address import firmware
from node.kernels.calibration import PARAMETERS, USUAL
from node.kernels.layout import PERIOD, Err, Scheme, default_config
from node.kernels.record import (
    CLOCK_VAR,
    END,
    HOPS,
    JOINED,
    MOMENT,
    READING,
    SATURATED,
    START,
    SYNCHRONISED,
    TEMPERATURE,
    new_node,
)
from node.kernels.step import ADMITTED
from node.kernels.string import string_aiding, string_step
from sim.errors import ScenarioError
from sim.rig.plain_encoder import PlainEncoder
from sim.world.imu_errors import gauss_markov
from sim.world.rough_imu import GYRO_CLIPPED
from sim.world.scenario import AidingSection
from sim.world.streams import Stream, stream
from sim.world.world import World
from telemetry.messages import Aiding, Event, Message, NodeState, SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Sample = list[float]  # three rates (rad/s), three forces (m/s^2)
Spoil = Callable[[int, int, Sample], Sample]
SILENT_AFTER = 3.5  # s, until a node takes the neighbour above for gone
NEVER = 10**9  # cycles
TURN_OF_BINARY = math.tau / 2.0**32


@dataclass(frozen=True, slots=True)
class Survey:
    """One survey, judged at the cycle that made it."""

    cycle: int
    tube: int
    error: float  # rad, yaw with all constant errors, less the truth
    measurement: SurveyMeasurement


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


class Tables(NamedTuple):
    """Of all tubes, tube 1 first: settings, readings (cycles, tubes, 1, 8), times, what each says."""

    crews: Array
    readings: Array
    moments: Array
    says: npt.NDArray[np.int64]


class DirectString:
    """One string of one world.

    ``clock_shifts`` moves the clock of a tube by so many seconds, a plain field to be changed by whoever tests.

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
        self._step, self._aid = firmware()
        count, self._imus = world.scenario.tubes, self._file.node.imus
        config = self._tuned_config()
        # the records of all tubes in one array, so that a cycle is read off in a few operations
        self.nodes = np.repeat(new_node(config), count)
        self._corrections = np.zeros((count, 1 + self._imus), PARAMETERS)
        self.tubes = {tube: self._fresh_tube(tube, config, state_every) for tube in range(1, count + 1)}
        self._encoder = EncoderNode(torque=world.torque_settings())
        sensor = self._file.encoder
        self._plain = None if sensor.edge_times else PlainEncoder(sensor.counts_per_turn)
        self.passes = aiding_passes(self._file.aiding, world.ends - world.begin, world.seed)
        self._lost = self._losses()
        self._clocks = self._clock_errors()
        self._phases = {tube: world.phase(tube) for tube in self.tubes}
        self._phase_of = np.array([self._phases[tube] for tube in self.tubes])
        clocks = self._file.clocks
        stated = clocks.joint_std_ms if clocks.stated_std_ms is None else clocks.stated_std_ms
        self._clock_var = (1e-3 * stated) ** 2 * np.arange(1, count + 1)  # s^2, by hops
        self._adds = [phase for phase in world.phases if phase.kind == "add"]
        self._tables = self._stack_tables()
        self.clock_shifts: dict[int, float] = {}
        self._mount_var = math.radians(self._file.joints.mount_std_deg) ** 2
        forward = all(tube.settings.scheme is Scheme.FORWARD for tube in self.tubes.values())
        self._hands_on = forward and self._file.node.kernel == "float64" and self._imus == 1
        self._own: dict[int, Aiding | None] = {}  # what each node said in its cycle, by the schemes of estimates
        self.run = self._empty_run()

    def drill(self) -> StringRun:
        """Every cycle of the schedule; returns what the nodes knew."""
        for _ in self.steps():
            pass
        return self.run

    def steps(self) -> Iterator[int]:
        """Cycle by cycle, each yielded when it is done, so that a study may act between two."""
        for cycle in range(self.world.cycles):
            end = self.world.cycle_end(cycle)
            string = self._string_at(end)
            measured = self._measure(cycle, end)
            locked = self._file.encoder.phase == "locked"
            if not locked:
                self._relay(cycle, measured, string, end)
            self._keep(cycle, string, self._run_cycles(cycle, string, end))
            if locked:  # cycles end with the encoder's, and what it measures then arrives after them
                self._relay(cycle, measured, string, end)
            yield cycle

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

    def _stack_tables(self) -> Tables:
        """What the compiled string takes beside the nodes' own records."""
        world, count = self.world, len(self.tubes)
        if self._imus > 1:
            none = np.zeros(0)
            return Tables(none, none, none, np.zeros(0, np.int64))
        readings = np.zeros((world.cycles, count, 1, READING))
        readings[..., TEMPERATURE] = USUAL
        for tube in self.tubes:
            readings[:, tube - 1, 0, :TEMPERATURE] = world.imu_samples(tube)
            if world.scenario.file.rough is not None:
                found = world.rough_cycles(tube)
                readings[:, tube - 1, 0, TEMPERATURE] = found.temperature
                readings[:, tube - 1, 0, SATURATED] = found.clipped & GYRO_CLIPPED
        crews = np.concatenate([tube.crew for tube in self.tubes.values()])
        return Tables(crews, readings, np.zeros((count, MOMENT)), np.zeros(count, np.int64))

    def _run_cycles(self, cycle: int, string: Sequence[int], end: float) -> Mapping[int, Sequence[Message]]:
        """A cycle of every tube: all that are plain in one call, the others one by one."""
        plain = self._spoil is None and self._imus == 1
        together = [tube for tube in string if plain and self.tubes[tube].runs_together]
        said = self._step_together(cycle, together, string, end) if together else {}
        if len(together) < len(string):
            said |= {tube: self._run_cycle(cycle, tube, string) for tube in string if tube not in together}
            said = {tube: said[tube] for tube in string if tube in said}
        return said

    def _step_together(
        self, cycle: int, together: Sequence[int], string: Sequence[int], end: float
    ) -> dict[int, Sequence[Message]]:
        tables, n = self._tables, len(string)
        mask = np.zeros(n, np.bool_)
        mask[np.array(together) - 1] = True
        moments = tables.moments[:n]
        shifts = np.array([self.clock_shifts.get(tube, 0.0) for tube in range(1, n + 1)]) if self.clock_shifts else 0.0
        moments[:, START] = self.world.cycle_end(cycle - 1) + self._phase_of[:n] + shifts
        moments[:, END] = end + self._phase_of[:n] + shifts
        moments[:, JOINED] = 1.0
        if self._adds:
            moments[:, JOINED] = [self._is_joined(tube, n, end + self._phases[tube]) for tube in range(1, n + 1)]
        moments[:, HOPS] = np.arange(n, 0, -1)
        moments[:, CLOCK_VAR] = self._clock_var[n - 1 :: -1]
        moments[:, SYNCHRONISED] = 1.0
        crews, corrections, readings = tables.crews[:n], self._corrections, tables.readings[cycle]
        string_step(self._step, self.nodes[:n], crews, corrections, readings, moments, mask, tables.says)
        said: dict[int, Sequence[Message]] = {}
        for place in np.flatnonzero(mask & (tables.says[:n] & ~ADMITTED != 0)).tolist()[::-1]:
            tube = place + 1
            around = self._context(tube, n, end + self._phases[tube])
            said[tube] = list(self.tubes[tube].say(int(tables.says[place]), float(moments[place, END]), around))
        return said

    def _run_cycle(self, cycle: int, tube: int, string: Sequence[int]) -> Sequence[Message]:
        phase = self._phases[tube]
        begin, end = self.world.cycle_end(cycle - 1) + phase, self.world.cycle_end(cycle) + phase
        shift = self.clock_shifts.get(tube, 0.0)
        sample = self.world.imu_sample(tube, cycle)
        wx, wy, wz, fx, fy, fz, *more = sample if self._spoil is None else self._spoil(tube, cycle, sample)
        reading = ImuReading(begin + shift, end + shift, (wx, wy, wz), (fx, fy, fz), *more)
        return self.tubes[tube].on_cycle(reading, self._context(tube, string[0], end))

    def _context(self, tube: int, top: int, end: float) -> RigContext:
        """What the link would tell: the new tube's joint is open at once, that below it once it is missed."""
        hops = top - tube + 1
        return RigContext(self._is_joined(tube, top, end), hops, end, float(self._clock_var[hops - 1]), True)

    def _is_joined(self, tube: int, top: int, end: float) -> bool:
        growing = self._is_open(end)
        return not (growing and (tube == top or (tube == top - 1 and self._is_open(end, SILENT_AFTER))))

    def _measure(self, cycle: int, end: float) -> Aiding:
        count, edge_at, rising, torque, earlier = self.world.encoder_sample(end)
        if self._plain is not None:
            head = float(self.world.motion.drive(np.array([end]))[0][0])
            measured = self._plain.on_cycle(head, end)
        else:
            measured = self._encoder.on_cycle(EncoderSample(count, edge_at, bool(rising), torque, earlier=earlier), end)
        return replace(measured, sequence=cycle) if self._file.aiding.renumbered else measured

    def _relay(self, cycle: int, measured: Aiding, string: Sequence[int], end: float) -> None:
        """Down the string: ``forward`` hands on what came, the others what each node said in its cycle."""
        aiding: Aiding | None = measured if self.passes[cycle] and not self._is_open(end) else None
        medium = self._file.medium
        if aiding is not None and self._hands_on:
            self._hand_on(cycle, aiding, string)
            return
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

    def _hand_on(self, cycle: int, aiding: Aiding, string: Sequence[int]) -> None:
        """Hand an aiding down a string whose scheme is ``forward``, as far as it is not lost."""
        tables, medium, hops = self._tables, self._file.medium, len(string)
        lost = np.flatnonzero(self._lost[cycle, :hops])
        reach = int(lost[0]) if len(lost) else hops
        valid = np.full(hops, aiding.valid_at)
        if medium.dated_by == "arrival":
            valid += 1e-3 * medium.delay_ms + medium.latency * np.arange(1, hops + 1)
        error = self._clocks[cycle, :hops]
        if self.clock_shifts:
            error = error + np.array([self.clock_shifts.get(tube, 0.0) for tube in string])
        taken = np.array(
            [
                *(aiding.yaw, aiding.yaw_var, aiding.systematic_var, aiding.offset, aiding.rate, 0.0),
                *(aiding.sequence, aiding.hops, aiding.torque, aiding.torsion_var, aiding.under_torque, 0.0),
            ]
        )
        places = np.array(string) - 1
        string_aiding(self._aid, self.nodes, tables.crews, places, reach, valid + error, taken)

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

    def _keep(self, cycle: int, string: Sequence[int], said: Mapping[int, Sequence[Message]]) -> None:
        """Read off every record of the string, then take what the nodes had to say."""
        run, states = self.run, self.nodes["filter"][: len(string)]
        row = np.s_[cycle, : len(string)]
        run.yaw[row] = states["now_yaw"] * TURN_OF_BINARY
        run.total_error[row] = wrapped(run.yaw[row] - self._truth[row])
        run.systematic_error[row] = self._systematic[row]
        run.var[row] = np.maximum(states["now_P"][:, Err.YAW, Err.YAW], VAR_FLOOR)
        run.systematic_var[row] = states["systematic_var"] + self._mount_var
        run.gyro_bias[row] = states["static_bias"][:, 2] + states["bias"][:, 2]
        self._own = dict.fromkeys(string)
        for tube, messages in said.items():
            for message in messages:
                if isinstance(message, Aiding):
                    self._own[tube] = message
                elif isinstance(message, SurveyMeasurement):
                    run.surveys.append(Survey(cycle, tube, float(run.total_error[cycle, tube - 1]), message))
                elif isinstance(message, Event):
                    run.events.append((cycle, message))
                elif isinstance(message, NodeState):
                    run.states.append((cycle, message))


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
