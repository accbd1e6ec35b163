"""One tube: takes aiding and IMU readings, gives aiding, state, surveys and events."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator

import numpy as np

from node.firmware.alignment_orders import alignment_in_use, order_alignment
from node.firmware.block_trial import record_of, recorrect_ring
from node.firmware.event_table import take_events
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.kernel_choice import kernel_of
from node.firmware.reporter import NodeReporter
from node.firmware.static_record import begin_record, static_record
from node.firmware.tube_settings import TubeSettings, bounded_by_circle, settings_record
from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.arithmetic.quantity import NONE
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.resets import forget_bias, lose_tilt
from node.kernels.record.filter_record import UNKNOWN_YAW_VAR, Scheme
from node.kernels.record.node_record import AIDING, MOMENT, READING, SPLIT
from node.kernels.record.sensor_record import PARAMETERS
from node.kernels.sensors.aligner import FASTEST, Reason, drop_alignment, refuse_alignment
from node.kernels.sensors.cluster import begin_cluster
from node.kernels.step.node_step import (
    ADMITTED,
    ONWARD,
    SAY_ESTIMATE,
    SAY_EVENTS,
    SAY_RECORD,
    SAY_REVISION,
    SAY_STATE,
    SAY_SURVEY,
    is_quiet,
    is_standing,
)
from node.kernels.string.twist import twist_var
from telemetry.frozen import replace
from telemetry.messages import (
    Aiding,
    Event,
    NodeFlag,
    NodeState,
    Scalar,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    Value,
)
from telemetry.parameters import SHORT_HASH, ParameterBlock

PUT_AIDING = struct.Struct(f"{AIDING}d").pack_into  # a third of what numpy takes for a dozen numbers
NO_PARTS = (0.0,) * (READING - SPLIT)
LONGEST_WORTH = 1e9  # s, of a saved yaw: a string that is said never to turn unseen

Said = Aiding | SurveyMeasurement | StaticRecord | Event | NodeState


class Tube:
    """One node: its record, and what it says of it.

    Parameters
    ----------
    settings : what the crew entered
    configs : one-element array of dtype ``CONFIG``, read once
    nodes : one-element array of dtype ``NODE``, owned by the caller
    next_sequence : source of the numbers of surveys and events, kept across restarts by the caller
    restored : the record comes from a saved one
    parameters : block in use; None is the identity
    corrections : (1 + IMUs,) of dtype ``PARAMETERS``, where the step reads the block in use and each IMU's own
        correction, owned by the caller; None: by the node
    integers : memory of the kernel in integers, one-element array of dtype ``INTEGERS``, likewise
    """

    def __init__(
        self,
        settings: TubeSettings,
        configs: Array,
        nodes: Array,
        next_sequence: Callable[[], int],
        *,
        restored: bool,
        parameters: ParameterBlock | None = None,
        corrections: Array | None = None,
        integers: Array | None = None,
    ) -> None:
        self.settings = settings
        nodes["config"] = configs
        nodes["config"]["intersection"] = int(settings.scheme is Scheme.INTERSECTION)
        self.nodes, self.node = nodes, nodes[0]
        self.config = self.node["config"]
        self.state, self._mount = self.node["filter"], self.node["mount"]
        self._down = tuple(nodes[f"down_{name}"] for name in ("systematic", "offset", "torsion"))  # arrays of one
        self._settings_record = settings_record(settings, configs)
        self._next_sequence = next_sequence
        self.reporter = NodeReporter(settings, nodes, next_sequence, restored=restored)
        self._restored, self._worth = restored, self._saved_yaw_worth()
        count = len(settings.imus)
        if count > 1:
            begin_cluster(self.node, self._settings_record[0])
        self._loop = kernel_of(settings.kernel, integers)
        own = [ParameterBlock(settings.tube, 0, imu.gyroscope, imu.accelerometer) for imu in settings.imus]
        self._corrections = np.zeros(1 + count, PARAMETERS) if corrections is None else corrections
        self._corrections[:] = np.concatenate([record_of(block) for block in (own[0], *own)])
        self._readings, self._moment, self._aiding = np.zeros((count, READING)), np.zeros(MOMENT), np.zeros(AIDING)
        self.parameters = parameters or ParameterBlock(settings.tube, 0)
        self.use(self.parameters)

    def on_aiding(self, aiding: Aiding, valid_local: float, clock_var: float = 0.0) -> Aiding | None:
        """Take the reference from the upper end, valid at ``valid_local`` (s, own clock); returns what goes down.

        ``clock_var`` (s^2): of the clock by which its time was found. ``forward`` hands the encoder's measurement
        on unchanged, at once; the others wait for the cycle.
        """
        a, taken = aiding, self._aiding
        PUT_AIDING(
            *(taken.data, 0, a.yaw, a.yaw_var, a.systematic_var, a.offset, a.rate, valid_local, a.sequence, a.hops),
            *(a.torque, a.torsion_var, a.under_torque, clock_var),
        )
        if not self._loop.aiding(self.nodes, self._settings_record, taken) & ONWARD:
            return None
        systematic_var, offset, torsion_var = self._down
        return Aiding(
            a.yaw,
            a.yaw_var,
            bounded_by_circle(float(systematic_var[0])),
            float(offset[0]),
            a.rate,
            a.valid_at,
            a.sequence,
            a.hops + 1,
            a.torque,
            float(torsion_var[0]),
            a.under_torque,
            a.epoch,
            a.seal,
        )

    def on_cycle(self, reading: ImuReading, context: RigContext) -> list[Said]:
        """Take a cycle's reading in; returns what there is to say."""
        around = (context.joined, context.hops, context.clock_var, context.synchronised)
        self._moment[:] = (reading.start, reading.end, *around, context.stepped, context.drift_std)
        rows = self._readings
        rows[0] = _row_of(reading)
        for k in range(1, len(rows)):
            rows[k] = _row_of(reading.others[k - 1]) if k <= len(reading.others) else math.nan
        says = self._loop.step(self.nodes, self._settings_record, self._corrections, rows, self._moment)
        return [] if says in (0, ADMITTED) else list(self.say(says, reading.end, context))

    @property
    def settings_record(self) -> Array:
        """The settings as ``node_step`` takes them, one-element array of dtype ``SETTINGS``; they do not change."""
        return self._settings_record

    def boot_event(self, rig_now: float) -> Event:
        """Report that the node started, and whether with its saved yaw."""
        arguments: dict[str, Scalar] = {"yaw_deg": self.yaw / DEG}
        if not self._restored:
            return self.reporter.event("booted", Severity.INFO, rig_now, arguments)
        return self.reporter.event("restored", Severity.INFO, rig_now, arguments | {"worth_h": self._worth / 3600.0})

    def _saved_yaw_worth(self) -> float:
        """Outage (s) after which a string at rest may have turned unseen by the yaw's sigma; 0 of an unknown yaw."""
        if not self.state["yaw_known"] or self.yaw_var >= UNKNOWN_YAW_VAR:
            return 0.0
        walk_var = float(self.config["still_walk"]) ** 2
        return min(self.yaw_var / walk_var, LONGEST_WORTH) if walk_var > 0.0 else LONGEST_WORTH

    @property
    def raw(self) -> ImuReading:
        """Raw reading of the newest cycle, of all IMUs together; its times are not told."""
        node = self.node
        (wx, wy, wz), (fx, fy, fz) = node["raw_rate"].tolist(), node["raw_force"].tolist()
        return ImuReading(math.nan, math.nan, (wx, wy, wz), (fx, fy, fz), float(node["temperature"]))

    def take_survey(self) -> None:
        """Measure this station again at the next settled cycle of the present or the next stop."""
        self.state["surveyed"] = 0

    def start_record(self, seconds: object, command: int) -> str:
        """Average raw readings for ``seconds`` from the next cycle on; returns why not, or nothing."""
        return begin_record(self.node["recording"], seconds, command, standing=self.standing)

    def align(self, method: object, turns: object) -> str:
        """Find the tube's axis in the coming slow turns, or drop the offset in use; returns why not, or nothing."""
        if method == "none":
            drop_alignment(self.node, self._settings_record[0], int(Reason.ORDERED))
            return ""
        if self.state["mode"] == STATIC_BIAS:
            return "the static bias is not known yet"
        if self.reporter.sensor_flags:
            return "a sensor is faulty"
        if abs(rate := float(self.state["now_rate"])) > FASTEST:
            return f"too fast: {abs(rate) / DEG:.3g} deg/s, expected at most {FASTEST / DEG:g}"
        return order_alignment(self.node, method, turns)

    @property
    def alignment(self) -> dict[str, Value]:
        """The alignment in use: method and angles (rad) of each IMU."""
        return alignment_in_use(self._mount, len(self.settings.imus))

    def prepare(self, block: ParameterBlock) -> None:
        """Forget what was learnt under the present block and would be wrong under ``block``."""
        if block.accelerometer != self.parameters.accelerometer:
            drop_alignment(self.node, self._settings_record[0], int(Reason.OTHER_ACCELEROMETER))
        if block.gyroscope != self.parameters.gyroscope:
            if self.node["aligner"]["method"]:
                refuse_alignment(self.node, int(Reason.OTHER_GYROSCOPE), 0, NONE, NONE)
            forget_bias(self.state, self.config)
        if block.accelerometer != self.parameters.accelerometer:
            lose_tilt(self.state)

    def use(self, block: ParameterBlock) -> None:
        """Correct readings by ``block`` from the next cycle on."""
        recorrect_ring(self.state, self.parameters, block, float(self.node["temperature"]))
        self.parameters = block
        self.state["smoothing"] = 0
        self._corrections[0] = record_of(block)[0]
        self._block = (block.version, block.sha256()[:SHORT_HASH])

    @property
    def quiet(self) -> bool:
        """Whether the node stands still by the block and the bias in use."""
        return bool(is_quiet(self.node))

    @property
    def standing(self) -> bool:
        """Whether the node may be at rest: quiet, or slow and without a bias, whose offset may look like a rate."""
        return bool(is_standing(self.node))

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
        return self.reporter.flags(context, now)

    def say(self, says: int, end: float, context: RigContext) -> Iterator[Said]:
        """What the step has to say of the cycle that ended at ``end`` (s, own clock), in order."""
        reporter = self.reporter
        if says & SAY_EVENTS:
            yield from reporter.pending_events(take_events(self.node["events"]), context)
        if says & SAY_RECORD:
            record = static_record(
                self.node["recording"], self.settings.tube, end, context.rig_now, self._next_sequence
            )
            yield record or reporter.event("static_record_empty", Severity.ERROR, context.rig_now, {})
        if says & SAY_SURVEY:
            yield reporter.survey(end, context)
        if says & SAY_REVISION and (revised := reporter.revised_survey(end, context)) is not None:
            yield revised
        if says & SAY_ESTIMATE:
            yield self._of_estimate(reporter.estimate(context))
        if says & SAY_STATE:
            yield reporter.report(end, context, self._block)

    def _of_estimate(self, aiding: Aiding) -> Aiding:
        """The node's own yaw as aiding, with the twist that it was aided under."""
        twist = self.node["twist"]
        var = float(twist_var(twist))
        joints = max(aiding.systematic_var - var, 0.0)
        torque, holding = float(twist["torque"]), bool(twist["holding"])
        return replace(aiding, systematic_var=joints, torque=torque, torsion_var=var, under_torque=holding)


def _row_of(reading: ImuReading) -> tuple[float, ...]:
    head = (*reading.rate, *reading.force, reading.temperature, reading.saturated, reading.late, reading.late_std)
    return (*head, 1.0, *reading.parts) if reading.parts else (*head, *NO_PARTS)
