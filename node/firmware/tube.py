"""One tube: takes aiding and IMU readings, gives aiding, state, surveys and events."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from node.firmware.alignment import FASTEST, Aligner, alignment_in_use, realign
from node.firmware.block_trial import forget_bias, forget_tilt, record_of, recorrect
from node.firmware.coarse_level import level_coarsely
from node.firmware.imu_fusion import ImuFusion
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.kernel_choice import kernel_of
from node.firmware.make_up import MakeUp
from node.firmware.reporter import Reporter
from node.firmware.sensor_guard import SensorGuard
from node.firmware.settings import TubeSettings
from node.firmware.static_record import StaticRecorder
from node.firmware.time_stamp import TimeStampPrior
from node.firmware.torsion import TubeTorsion
from node.kernels.alignment import new_mount
from node.kernels.angles import wrap
from node.kernels.calibration import USUAL
from node.kernels.layout import DEG, Array, Scheme, Status, new_state
from node.kernels.modes import STATIC_BIAS
from telemetry.messages import (
    Aiding,
    Event,
    NodeFlag,
    NodeState,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    Value,
)
from telemetry.parameters import SHORT_HASH, ParameterBlock

STILL_CYCLES = 4  # after which a node takes itself for standing
LARGEST_OFFSET = 6.0 * DEG  # rad/s, zero-rate offset of a gyroscope never calibrated; the slow alignment turn is faster


class Tube:
    """State of one node and what it does at each event.

    Parameters
    ----------
    settings : what the crew entered
    config, state : one-record arrays of dtype ``CONFIG`` and ``STATE``, owned by the caller
    next_sequence : source of the numbers of surveys and events, kept across restarts by the caller
    restored : the state comes from a saved one
    parameters : block in use; None is the identity
    mount : one-record array of dtype ``MOUNT``, owned by the caller; None is that of an IMU never aligned
    """

    def __init__(
        self,
        settings: TubeSettings,
        config: Array,
        state: Array,
        next_sequence: Callable[[], int],
        *,
        restored: bool,
        parameters: ParameterBlock | None = None,
        mount: Array | None = None,
    ) -> None:
        self.settings = settings
        self._mount = new_mount() if mount is None else mount
        self._configs = config
        self.config = config[0]
        self._states = state
        self.config["intersection"] = int(settings.scheme is Scheme.INTERSECTION)
        self.state = state[0]
        self._next_sequence = next_sequence
        self._restored = restored
        self.reporter = Reporter(settings, state, config, next_sequence, restored=restored)
        self._noticed = Status.NONE  # between cycles
        self.raw: ImuReading | None = None  # of the last cycle, of all IMUs together
        self._recorder = StaticRecorder()
        self._guard = SensorGuard(state, config, settings.limits)
        self._torsion = TubeTorsion(settings, state)
        self._make_up = MakeUp(settings, state)
        self._aligner = Aligner(self._mount, settings.imus, float(self.config["force_std"] / self.config["gravity"]))
        self._fusion = ImuFusion(settings, self._mount, state, config)
        self._axes, self._cluster = self._fusion.axes, self._fusion.cluster
        self._time_stamp = TimeStampPrior(state, config)
        self._slow_cycles = 0  # in a row, not faster than the offset of a gyroscope never calibrated
        self._temperature = USUAL
        self._run_cycle, self._offer_aiding = kernel_of(settings.kernel)
        self.parameters = parameters or ParameterBlock(settings.tube, 0)
        self.use(self.parameters)

    def on_aiding(self, aiding: Aiding, valid_local: float) -> Aiding | None:
        """Take the reference from the upper end, valid at ``valid_local`` (s, own clock); returns what goes down.

        ``forward`` hands the encoder's measurement on unchanged, at once; the others wait for the cycle.
        """
        joint = self.settings.drive_joint if aiding.hops == 0 else None
        offset = wrap(aiding.offset + (joint.angle if joint else 0.0))
        systematic_var = aiding.systematic_var + (joint.std**2 if joint else 0.0)
        twist_var = self._torsion.reaches(aiding)
        offset, systematic_var = self._make_up.follow(aiding, offset, systematic_var, self._torsion.var, twist_var)
        if self._guard.gate_aiding(aiding, offset, valid_local) and self._torsion.gate_aiding(aiding, valid_local):
            self._noticed |= Status(
                self._offer_aiding(
                    self.state,
                    self.config,
                    aiding.yaw,
                    aiding.yaw_var,
                    systematic_var + self._torsion.var,
                    offset,
                    valid_local,
                    aiding.sequence,
                    aiding.hops,
                )
            )
        if self.settings.scheme is not Scheme.FORWARD:
            return None
        below = self.settings.lower_joint
        return replace(
            aiding,
            offset=wrap(offset + below.angle),
            systematic_var=systematic_var + below.std**2,
            hops=aiding.hops + 1,
            torsion_var=twist_var,
        )

    def on_cycle(
        self, reading: ImuReading, context: RigContext
    ) -> Iterator[Aiding | SurveyMeasurement | StaticRecord | Event | NodeState]:
        """Correct the reading, run one execution cycle and yield what there is to say."""
        self.raw = reading
        if not self._guard.admits(reading.start, reading.end):
            yield from self._sensor_events(context)
            return
        reading = self.raw = self._fusion.fuse(reading, self._correction, self._expected(), heard=self._guard.heard)
        rate, force = self._fusion.rate, self._fusion.force
        self._temperature = reading.temperature
        raw = (reading.rate, reading.force)
        self._guard.before(raw, rate, force, saturated=reading.saturated, at=reading.end)
        self._time_stamp.follow(context)
        level_coarsely(self.state, self.config, rate, force)
        self._slow_cycles = self._slow_cycles + 1 if max(map(abs, rate)) < LARGEST_OFFSET else 0
        reporter = self.reporter
        if reporter.cycles and reading.start - self.state["now"] > 0.5 * (reading.end - reading.start):
            reporter.overruns += 1
        status = self._noticed | self._run(reading, 1 if context.joined else 0)
        self._noticed = Status.NONE
        reporter.cycles += 1
        if Status.FILTER_FAULT in status:
            self._start_over()
        self._guard.after(status, reading.end)
        self._follow_alignment(reading)
        if self._cluster is not None and self.quiet:
            self._cluster.learn_offsets(self._fusion.rates)
        yield from self._sensor_events(context)
        yield from reporter.pending_events([*self._make_up.drain_events(), *self._torsion.drain_events()], context)
        yield from reporter.events(status, context)
        yield from self._record(reading, context)
        if Status.SURVEY_READY in status:
            samples = int(self.config["survey_samples"])
            imus = self._cluster.survey(samples) if self._cluster is not None else ()
            yield reporter.survey(reading.end, context, imus, self._guard.flags)
        if self.settings.scheme is not Scheme.FORWARD and self.state["yaw_known"]:
            yield self._torsion.of_estimate(reporter.estimate(context))
        if status & ~Status.AIDED or reporter.cycles % self.settings.state_every == 0:
            yield reporter.report(reading.end, context, self._guard.flags, self._mount[0], self._block)

    def boot_event(self, rig_now: float) -> Event:
        """Report that the node started, and whether with its saved yaw."""
        return self.reporter.event(
            "restored" if self._restored else "booted", Severity.INFO, rig_now, {"yaw_deg": self.yaw / DEG}
        )

    def take_survey(self) -> None:
        """Measure this station again at the next settled cycle of the present or the next stop."""
        self.state["surveyed"] = 0

    def start_record(self, seconds: object, command: int) -> str:
        """Average raw readings for ``seconds`` from the next cycle on; returns why not, or nothing."""
        return self._recorder.start(seconds, command, standing=self.standing)

    def align(self, method: object, turns: object) -> str:
        """Find the tube's axis in the coming slow turns, or drop the offset in use; returns why not, or nothing."""
        if method == "none":
            self._drop_alignment("ordered")
            return ""
        if self.state["mode"] == STATIC_BIAS:
            return "the static bias is not known yet"
        if self._guard.flags:
            return "a sensor is faulty"
        if abs(rate := float(self.state["now_rate"])) > FASTEST:
            return f"too fast: {abs(rate) / DEG:.3g} deg/s, expected at most {FASTEST / DEG:g}"
        return self._aligner.start(method, turns)

    @property
    def alignment(self) -> dict[str, Value]:
        """The alignment in use: method and angles (rad) of each IMU."""
        return alignment_in_use(self._mount, len(self._axes))

    def prepare(self, block: ParameterBlock) -> None:
        """Forget what was learnt under the present block and would be wrong under ``block``."""
        if block.accelerometer != self.parameters.accelerometer:
            self._drop_alignment("another block for the accelerometer")
        if block.gyroscope != self.parameters.gyroscope:
            if self._aligner.running:
                self._aligner.stop("another block for the gyroscope")
            forget_bias(self._states, self._configs)
        if block.accelerometer != self.parameters.accelerometer:
            forget_tilt(self._states)

    def use(self, block: ParameterBlock) -> None:
        """Correct readings by ``block`` from the next cycle on."""
        recorrect(self._states, self.parameters, block, self._temperature)
        self.parameters = block
        self._correction = record_of(block)
        self._block = (block.version, block.sha256()[:SHORT_HASH])

    @property
    def quiet(self) -> bool:
        """Whether the node stands still by the block and the bias in use."""
        return int(self.state["still_cycles"]) >= STILL_CYCLES

    @property
    def standing(self) -> bool:
        """Whether the node may be at rest: quiet, or slow and without a bias, whose offset may look like a rate."""
        return self.quiet or (self.state["mode"] == STATIC_BIAS and self._slow_cycles >= STILL_CYCLES)

    @property
    def yaw(self) -> float:
        """Yaw at the end of the newest cycle, rad in [0, 2 pi)."""
        return self.reporter.yaw

    @property
    def yaw_var(self) -> float:
        """Random variance of ``yaw``, rad^2."""
        return self.reporter.yaw_var

    @property
    def systematic_var(self) -> float:
        """Variance of the constant errors of every joint above, of the twist and of this node's mount, rad^2."""
        return self.reporter.systematic_var

    def flags(self, context: RigContext, now: float) -> NodeFlag:
        """What the node says of the trust in its own yaw at ``now`` (s, own clock)."""
        return self.reporter.flags(self._guard.flags, context, now)

    def _run(self, reading: ImuReading, joined: int) -> Status:
        """One cycle of the loop; under torque it takes no survey, and that of this stop stays due."""
        state, due = self.state, not self.state["surveyed"]
        waits = due and self._torsion.holds_survey(reading.end)
        if waits:
            state["surveyed"] = 1
        rate, force = self._fusion.rate, self._fusion.force
        status = self._run_cycle(state, self.config, rate, force, reading.start, reading.end, joined)
        if waits:
            state["surveyed"] = 0
        return Status(status)

    def _expected(self) -> Array:
        """Rate (rad/s) and force (m/s^2) that the node would read in this cycle if nothing had changed: (6,)."""
        state = self.state
        rate = state["static_bias"] + state["bias"]
        rate[2] += self._guard.spin
        return np.concatenate([rate, -float(self.config["gravity"]) * state["now_down"]])

    def _follow_alignment(self, reading: ImuReading) -> None:
        if not self._aligner.running:
            return
        before = self._axes.copy()
        used = np.full(len(before), not self._guard.flags)
        if self._cluster is not None:
            used &= self._cluster.used
        rate = float(self.state["now_rate"])
        aided = reading.end - float(self.state["last_aided"]) <= self.settings.aiding_old_after
        yaw = self.yaw if aided else math.nan
        if self._aligner.on_turn_sample(self._fusion.unaligned, rate, yaw, reading.start, reading.end, used):
            realign(self._states, before, self._axes)

    def _drop_alignment(self, reason: str) -> None:
        before = self._axes.copy()
        self._aligner.drop(reason)
        realign(self._states, before, self._axes)

    def _sensor_events(self, context: RigContext) -> Iterator[Event]:
        cluster = self._cluster.drain_events() if self._cluster is not None else []
        pending = [*self._guard.drain_events(), *self._aligner.drain_events(), *cluster]
        return self.reporter.pending_events(pending, context)

    def _record(self, reading: ImuReading, context: RigContext) -> Iterator[StaticRecord | Event]:
        recorder = self._recorder
        if not recorder.running:
            return
        temperature = reading.temperature if math.isfinite(reading.temperature) else USUAL
        recorder.append_reading(reading.rate, reading.force, temperature, reading.start, standing=self.standing)
        if recorder.is_due(reading.end):
            record = recorder.finish(self.settings.tube, reading.end, context.rig_now, self._next_sequence)
            yield record or self.reporter.event("static_record_empty", Severity.ERROR, context.rig_now, {})

    def _start_over(self) -> None:
        """Invalid covariance: restart the filter, keep the constant bias."""
        keep = {name: self.state[name].copy() for name in ("static_bias", "static_bias_var", "mode")}
        fresh = new_state(self._configs)[0]
        for name in fresh.dtype.names or ():
            self.state[name] = keep.get(name, fresh[name])
