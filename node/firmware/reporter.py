"""What a node says of itself: its yaw and the trust in it, events, surveys, its state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from node.firmware.alignment_orders import angles_of
from node.firmware.inputs import RigContext
from node.firmware.pending_event import PendingEvent
from node.firmware.tube_settings import TubeSettings, bounded_by_circle
from node.kernels.arithmetic.angles import from_binary, wrap_angle
from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.record.filter_record import Err
from telemetry.frozen import replace
from telemetry.messages import (
    Aiding,
    Event,
    ImuMean,
    NodeFlag,
    NodeMode,
    NodeState,
    Scalar,
    Severity,
    SurveyMeasurement,
)

# flags as integers: an operation on members takes ten times as long
SENSOR_FAULT, YAW_UNTRUSTED = int(NodeFlag.SENSOR_FAULT), int(NodeFlag.YAW_UNTRUSTED)
AIDING_OLD, INNOVATION_REJECTED = int(NodeFlag.AIDING_OLD), int(NodeFlag.INNOVATION_REJECTED)
RATE_EXCEEDED, RESTORED = int(NodeFlag.RATE_EXCEEDED), int(NodeFlag.RESTORED)
CLOCK_UNSYNCHRONISED, BIAS_UNKNOWN = int(NodeFlag.CLOCK_UNSYNCHRONISED), int(NodeFlag.BIAS_UNKNOWN)
DRIVE_UNTOLD, LOWER_UNTOLD = int(NodeFlag.DRIVE_UNTOLD), int(NodeFlag.LOWER_UNTOLD)
STATIC_BIAS = int(NodeMode.STATIC_BIAS)
VAR_FLOOR = (0.001 * DEG) ** 2
VAR_CEILING = 100.0  # rad^2, the largest that a message says; a yaw of that variance is any yaw


class NodeReporter:
    """One node's words.

    Parameters
    ----------
    settings : what the crew entered
    nodes : the node's record, a one-element array
    next_sequence : source of the numbers of surveys and events
    restored : the state comes from a saved one
    """

    def __init__(
        self, settings: TubeSettings, nodes: Array, next_sequence: Callable[[], int], *, restored: bool
    ) -> None:
        self._settings, self._node, self._config = settings, nodes[0], nodes[0]["config"]
        self._state = self._node["filter"]
        self._next_sequence = next_sequence
        self._restored = restored
        self._surveyed: SurveyMeasurement | None = None  # as it was said last
        has_tube_below = settings.tube > 1  # tubes are numbered from the lowest up
        self._below = LOWER_UNTOLD if has_tube_below and not settings.lower_joint.is_told else 0
        self._on_top = 0 if settings.drive_joint.is_told else DRIVE_UNTOLD  # it says so while it hangs from the drive

    @property
    def sensor_flags(self) -> NodeFlag:
        """What a reader of the node's yaw must know of its sensors."""
        return NodeFlag(self._sensor_bits())

    def _sensor_bits(self) -> int:
        bits, guard = 0, self._node["guard"]
        if guard["gyro"]["fault"]:
            bits |= SENSOR_FAULT | YAW_UNTRUSTED
        if guard["force"]["fault"]:
            bits |= SENSOR_FAULT
        if guard["ratio"]["told"]:
            bits |= YAW_UNTRUSTED
        return bits

    @property
    def yaw(self) -> float:
        """Yaw at the end of the newest cycle, rad in [0, 2 pi)."""
        return float(from_binary(self._state["now_yaw"]))

    @property
    def yaw_var(self) -> float:
        """Random variance of ``yaw``, rad^2."""
        return _sayable(float(self._state["now_P"][Err.YAW, Err.YAW]))

    @property
    def systematic_var(self) -> float:
        """Variance of the constant errors of every joint above, of the twist and of this node's mount, rad^2."""
        return float(self._state["systematic_var"]) + self._settings.mount_std**2

    def flags(self, context: RigContext, now: float) -> NodeFlag:
        """What the node says of the trust in its own yaw at ``now`` (s, own clock)."""
        state, bits = self._state, self._sensor_bits() | self._below
        if context.hops == 1:
            bits |= self._on_top
        if not state["yaw_known"]:
            bits |= YAW_UNTRUSTED
        if now - state["last_aided"] > self._settings.aiding_old_after:
            bits |= AIDING_OLD
        if state["rejected"]:
            bits |= INNOVATION_REJECTED
        if state["rate_exceeded"]:
            bits |= RATE_EXCEEDED
        if self._restored:
            bits |= RESTORED
        if not context.synchronised:
            bits |= CLOCK_UNSYNCHRONISED
        if state["mode"] == STATIC_BIAS:
            bits |= BIAS_UNKNOWN
        return NodeFlag(bits)

    def pending_events(self, pending: Iterable[PendingEvent], context: RigContext) -> Iterator[Event]:
        """Events of the parts of the firmware that have no number of their own for them."""
        for code, severity, arguments in pending:
            yield self.event(code, severity, context.rig_now, arguments)

    def event(self, code: str, severity: Severity, rig_now: float, arguments: dict[str, Scalar]) -> Event:
        """One event, numbered."""
        return Event(self._settings.tube, self._next_sequence(), rig_now, severity, code, arguments)

    def survey(self, end: float, context: RigContext) -> SurveyMeasurement:
        """Measurement of this station, which ended at ``end`` (s, own clock); of a cluster without means the fused."""
        state = self._state
        self._surveyed = SurveyMeasurement(
            tube=self._settings.tube,
            sequence=self._next_sequence(),
            station_at=context.rig_now,
            hops=context.hops,
            imus=self._cluster_means() or (mean_of(state["survey_force"], state["survey_force_cov"]),),
            yaw=self.yaw,
            yaw_var=self.yaw_var,
            systematic_var=self.systematic_var,
            samples=int(self._config["survey_samples"]),
            settle_time=end - float(state["stopped_at"]),
            flags=self.flags(context, end),
            epoch=context.epoch,
        )
        return self._surveyed

    def revised_survey(self, end: float, context: RigContext) -> SurveyMeasurement | None:
        """The last survey again, by its time, with the yaw that it had by what came since; None before the first.

        It is trusted as the node is now, but for its time, which is the one that it was given.
        """
        if self._surveyed is None:
            return None
        state, undated = self._state, self._surveyed.flags & NodeFlag.CLOCK_UNSYNCHRONISED
        self._surveyed = replace(
            self._surveyed,
            sequence=self._next_sequence(),
            yaw=float(from_binary(state["surveyed_yaw"])),
            yaw_var=_sayable(float(state["surveyed_var"])),
            systematic_var=float(self._node["revision"]["systematic"]) + self._settings.mount_std**2,
            flags=self.flags(context, end) & ~NodeFlag.CLOCK_UNSYNCHRONISED | undated,
        )
        return self._surveyed

    def _cluster_means(self) -> tuple[ImuMean, ...]:
        """Those of the IMUs of a cluster that were in use over the whole of the last survey."""
        count, cluster = len(self._settings.imus), self._node["cluster"]
        if count == 1:
            return ()
        used = np.flatnonzero(cluster["survey_used"][:count])
        return tuple(mean_of(cluster["survey_force"][k], cluster["survey_force_cov"][k]) for k in used)

    def estimate(self, context: RigContext) -> Aiding:
        """The node's own yaw as aiding for the tube below."""
        below = self._settings.lower_joint
        return Aiding(
            yaw=self.yaw,
            yaw_var=self.yaw_var,
            systematic_var=bounded_by_circle(float(self._state["systematic_var"]) + below.std**2),
            offset=wrap_angle(below.angle),
            rate=float(self._state["now_rate"]),
            valid_at=context.rig_now,
            sequence=int(self._state["cycles"]),
            hops=max(context.hops, 1),
        )

    def report(self, end: float, context: RigContext, block: tuple[int, bytes]) -> NodeState:
        """Account at ``end`` (s, own clock); ``block`` is version and short hash of the parameters in use."""
        state, mount = self._state, self._node["mount"]
        bias_x, bias_y, bias_z = (state["static_bias"] + state["bias"]).tolist()
        pitch, roll = angles_of(mount["axis"][0])
        return NodeState(
            tube=self._settings.tube,
            at=context.rig_now,
            hops=context.hops,
            mode=self._mode(aligning=bool(mount["aligning"])),
            yaw=self.yaw,
            yaw_var=self.yaw_var,
            systematic_var=self.systematic_var,
            gyro_bias=(bias_x, bias_y, bias_z),
            scale_factor=float(state["scale"]),
            innovation=float(state["innovation"]),
            innovation_var=float(state["innovation_var"]),
            aiding_age=end - float(state["last_aided"]),
            clock_var=context.clock_var,
            flags=self.flags(context, end),
            cycles=int(self._node["cycles"]),
            overruns=int(self._node["overruns"]),
            parameters_version=block[0],
            parameters_hash=block[1],
            alignment=(pitch, roll, float(mount["std"][0].max())),
        )

    def _mode(self, *, aligning: bool) -> NodeMode:
        """State of the node: what the kernels follow, unless a sensor fails or an alignment is under way."""
        if self._sensor_bits() & SENSOR_FAULT:
            return NodeMode.FAULT
        return NodeMode.ALIGNMENT if aligning else NodeMode(int(self._state["mode"]))


def _sayable(variance: float) -> float:
    """A random variance (rad^2) within what a message says."""
    return min(max(variance, VAR_FLOOR), VAR_CEILING)


def mean_of(force: Array, cov: Array) -> ImuMean:
    """Mean force (3) of an IMU and its covariance (3, 3), as they are sent."""
    fx, fy, fz = force.tolist()
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = cov.tolist()
    return ImuMean((fx, fy, fz), ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz)))
