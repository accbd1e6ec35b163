"""Every key of a scenario file, its range, its unit and what it means; unknown keys are refused.

Degrees and milliseconds at this edge only.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from node.firmware.kernel_choice import CHIP, LIBRARY, LOOPS
from node.kernels.record.sensor_record import MAX_IMUS
from sim.world.path_section import PathSection
from sim.world.radio_section import RadioSection
from sim.world.rough_section import RoughSection
from sim.world.section import Angle, NotNegative, Positive, Probability, ScenarioSection, Triple
from sim.world.site_section import SiteSection
from sim.world.told_section import ToldSection
from telemetry.messages import MAX_TUBE

VERSION = 1  # of the format
EXACTLY_DEG = 1e-12  # stated of what a world has no error in: a standard error of zero is refused


class RigSection(ScenarioSection):
    """The string."""

    tubes: int = Field(ge=1, le=MAX_TUBE, description="tubes of the string at the end")
    tube_length_m: Positive = Field(le=50.0, description="length of every tube")
    tubes_at_start: int = Field(0, ge=0, description="of them in the hole at the start; the others are added on top")
    depth_at_start_m: NotNegative | None = Field(
        None, description="of the bit; that of all tubes if absent, less where the top one still sticks out"
    )

    @property
    def hanging(self) -> float:
        """Length (m) of the tubes at the start."""
        return self.tube_length_m * self.tubes_at_start

    @property
    def depth_at_start(self) -> float:
        """Depth (m) of the bit at the start."""
        return self.hanging if self.depth_at_start_m is None else self.depth_at_start_m


class ScheduleSection(ScenarioSection):
    """Times of one tube, s."""

    begin_s: Positive = Field(1000.0, description="rig time at the start; never zero")
    add_s: float = Field(
        60.0, ge=10.0, description="string held while a tube is added; a node needs 50 s to find its bias"
    )
    joint_s: float = Field(5.0, ge=4.0, description="of it, joint open; shorter than add_s")
    stop_s: float = Field(32.0, ge=22.0, description="standing still after drilling; a survey needs 20 s")
    finish_s: float = Field(20.0, ge=5.0, description="after the last stop, for what is still on its way")
    blocks: int | None = Field(
        None, ge=1, le=1000, description="of adding or holding, drilling and stopping; one a tube if absent"
    )


class RotationSection(ScenarioSection):
    """Turning of the string while one tube is drilled."""

    rate_dps: float = Field(71.0, gt=0.0, description="constant rate, deg/s")
    acceleration_dps2: Positive = Field(35.0, description="of the ramps")
    turns: float = Field(20.0, gt=0.0, description="of one block, for one tube length")
    advance_m: NotNegative | None = Field(None, description="of the bit in one block; one tube length if absent")


class JointSection(ScenarioSection):
    """Constant angular errors, 1 sigma."""

    reading_std_deg: NotNegative = Field(0.05, description="of the scribe marks at a joint")
    mount_std_deg: NotNegative = Field(0.05, description="of the IMU against the tube's marks, about the axis")
    mount_tilt_std_deg: float = Field(
        0.0, ge=0.0, le=3.0, description="of each IMU against the tube's axis, pitch and roll; an alignment finds it"
    )
    unseen_std_deg: NotNegative = Field(0.0, description="what the string below turns unseen at each make-up")
    head_turn_deg: NotNegative = Field(0.0, description="about how far the head turns, free of the string, at each")


class SetupSection(ScenarioSection):
    """What the crew tells of the rig, each with the standard error that it states."""

    untold: tuple[Literal["north", "collar", "joints", "mounts", "stick-up"], ...] = Field(
        (), description="what the crew does not tell, of north, collar, joints, mounts and stick-up"
    )
    unchecked: tuple[Literal["north", "stick-up"], ...] = Field(
        (), description="of what it tells, and no reading shows, what it does not check by a second reading"
    )
    north_std_deg: Positive = Field(EXACTLY_DEG, description="stated of the encoder's zero against north")
    collar_std_deg: Positive = Field(EXACTLY_DEG, description="stated of the direction at the collar, each way")
    stick_up_std_m: Positive = Field(0.01, description="stated of the stick-up, read by hand with a rule")


class TorsionSection(ScenarioSection):
    """Twist of the string by the drilling torque; without this table the string is rigid."""

    outer_diameter_m: Positive = Field(0.060, le=1.0, description="of every tube")
    inner_diameter_m: NotNegative = Field(0.050, description="smaller than the outer one")
    shear_modulus_gpa: float = Field(79.3, ge=1.0, le=1000.0, description="of steel")
    bit_torque_nm: NotNegative = Field(500.0, le=1e5, description="while drilling, felt by every tube")
    wall_friction_nm_per_m: NotNegative = Field(0.0, le=1e4, description="of each metre of string in the hole")
    wind_s: Positive = Field(2.0, le=60.0, description="from the drive's start until the torque is full")
    release_after_s: float = Field(0.0, ge=0.0, le=600.0, description="torque held after the drive's stop")
    release_s: Positive = Field(3.0, le=60.0, description="then, until it is gone")
    trapped_fraction: float = Field(
        0.01, ge=0.0, le=0.5, description="of the twist, kept by friction after a stop; 1 sigma, drawn at each"
    )
    stick_slip: float = Field(0.0, ge=0.0, le=1.0, description="swing of the torque while drilling, of its full size")
    stick_slip_hz: float = Field(0.2, gt=0.0, le=0.9, description="of the swing")


class GyroSection(ScenarioSection):
    """Gyroscope of every node, axes x, y, z."""

    noise_dps_rthz: Triple = Field((8.538e-3, 6.799e-3, 7.313e-3), description="angle random walk")
    bias_std_dps: Triple = Field((1.2545e-2, 5.869e-3, 4.941e-3), description="Gauss-Markov part")
    bias_tau_s: Positive = 15.87
    constant_bias_dps: tuple[float, float, float] = (0.02, -0.01, -0.02)
    constant_bias_std_dps: NotNegative = 0.005
    scale_factor_std: NotNegative = 1e-3
    misalignment_std_deg: NotNegative = Field(0.0, description="left after calibration")
    g_sensitivity_dps_per_g: NotNegative = 0.0
    bias_step_dps: float = Field(0.0, description="of the z axis, from the first turning on")
    instantaneous: bool = Field(False, description="read once at the end of a cycle, not averaged over it")
    increments: bool = Field(False, description="tells the turn about z in every eighth of a cycle; a FIFO always does")
    range_dps: Positive = 500.0
    resolution_dps: NotNegative = Field(2.6e-3, description="500 deg/s / 32768 over 34 readings of one cycle")


class AccelerometerSection(ScenarioSection):
    """Accelerometer of every node, as its readings come: the sensor's own, or what a calibration has left of it."""

    noise_deg: NotNegative = Field(0.02, description="one 1.9 Hz sample, as a tilt")
    bias_std_deg: NotNegative = Field(
        0.06, description="each axis, as a tilt: 1 mg of a sensor that is not calibrated; 0.002 of one that is"
    )
    vibration_mps2: NotNegative = Field(0.05, description="while drilling")
    radius_m: NotNegative = Field(0.02, description="of the IMU from the tube axis")
    gravity_mps2: Positive = 9.81


class EncoderSection(ScenarioSection):
    """Encoder of the drive head."""

    counts_per_turn: int = Field(4096, ge=16, description="1024 lines in quadrature")
    edge_std_deg: NotNegative = Field(0.003, description="error of a line's place, constant for every line")
    edge_times: bool = Field(True, description="the counter times its edges; else a count is read once a cycle")
    phase: Literal["locked", "random"] = Field(
        "locked", description="of the tubes' cycles against the encoder's: at one time, or drawn for each tube"
    )


class ClockSection(ScenarioSection):
    """Clocks of the nodes against the encoder's; the last four where ``medium.link`` is off."""

    offset_std_s: NotNegative = 20.0
    drift_std_ppm: NotNegative = 10.0
    joint_std_ms: NotNegative = Field(0.2, description="of rig time across each joint, constant")
    wander_std_ms: NotNegative = Field(0.03, description="of it across each joint, Gauss-Markov")
    wander_tau_s: Positive = Field(60.0, description="of the wander")
    stated_std_ms: NotNegative | None = Field(None, description="what a node takes joint_std_ms for, if not the truth")


class MediumSection(ScenarioSection):
    """One hop between two tube ends."""

    link: Literal["on", "off"] = Field(
        "on", description="off: aiding goes from firmware to firmware without frames; for studies of many seeds"
    )
    delay_ms: NotNegative = Field(0.0, lt=500.0, description="of the aiding beside its hops, where the link is off")
    dated_by: Literal["validity", "arrival"] = Field(
        "validity", description="when a node takes an aiding to be valid, where the link is off"
    )

    latency_ms: NotNegative = Field(3.0, description="at least 0.5 where the link is on")
    jitter_ms: NotNegative = Field(0.3, description="mean of the exponential part")
    loss: Probability = Field(0.01, description="of a frame by cable; by radio its margin decides")
    duplicate: Probability = 0.001
    corrupt: Probability = Field(0.0, description="one bit of a frame's copy is flipped")
    transports: tuple[Literal["zenoh", "can", "can-classic"], ...] = Field(
        ("zenoh",), min_length=1, description="that carry the frames, from the joint above tube 1 on in turn"
    )

    @property
    def latency(self) -> float:
        """Latency, s."""
        return self.latency_ms * 1e-3

    @property
    def jitter(self) -> float:
        """Jitter, s."""
        return self.jitter_ms * 1e-3


class AidingSection(ScenarioSection):
    """When the encoder is heard at all, where the link is off; the phase is drawn for each seed."""

    on_s: Positive = Field(20.0, description="heard for so long")
    off_s: NotNegative = Field(0.0, description="and then not for so long")
    every_s: Positive | None = Field(None, description="one measurement at a time, instead of on and off")
    renumbered: bool = Field(False, description="at rest every cycle's aiding counts as a new measurement")


def known_kernel(name: str) -> str:
    """Name of a kernel that a node can run now.

    Raises
    ------
    PydanticCustomError
        When there is none of that name.
    """
    known = [other for other in LOOPS if other not in {CHIP, LIBRARY}]
    if name not in known:
        raise PydanticCustomError("kernel", "expected one of {known}", {"known": ", ".join(known)})
    return name


KernelName = Annotated[str, AfterValidator(known_kernel)]


class NodeSection(ScenarioSection):
    """Firmware settings of every node."""

    scheme: Literal["forward", "estimate", "intersection"] = Field(
        "forward", description="what is relayed: the encoder's measurement, or estimates (the two negative controls)"
    )
    kernel: KernelName = Field("float64", description="the loop in floats or in integers")
    torsion: Literal["gate", "variance", "ignore"] = Field(
        "gate", description="aiding under torque: not used, or with a variance; ignore: the rig knows no torque"
    )
    joints: Literal["marks", "solved", "both"] = Field(
        "marks", description="after a tube was added: scribe marks, the saved yaw, or both by inverse variance"
    )
    tuning: dict[str, float] = Field(
        default_factory=dict, description="fields of the filter's configuration, where the link is off"
    )
    imus: int = Field(1, ge=1, le=MAX_IMUS, description="in every tube")
    imu_noise: tuple[Annotated[float, Field(ge=0.01, le=100.0)], ...] = Field(
        (), description="of each IMU of a tube, times that of gyroscope and accelerometer; 1 where it is absent"
    )


class PlanLegSection(ScenarioSection):
    """One leg of the design: a length held, built or turned at even rates, or an arc to a direction."""

    length_m: Positive | None = Field(None, description="what the rates and the direction to reach give, if absent")
    build_deg_per_m: float = 0.0
    turn_deg_per_m: float = 0.0
    to_inclination_deg: float | None = Field(None, ge=0.0, le=180.0)
    to_azimuth_deg: float | None = None


class DesignSection(ScenarioSection):
    """The column that the hole is to become, as the ground station judges it."""

    inclination_deg: float = Field(0.0, ge=0.0, le=180.0)
    azimuth_deg: float = 0.0
    length_m: Positive | None = Field(None, description="of the axis; what the tubes reach if absent")
    radius_m: Positive = Field(0.6, description="of the finished column")
    tolerance: Literal["en-12716", "5-cm", "0.27-deg"] = "en-12716"
    leg: tuple[PlanLegSection, ...] = Field((), description="legs from the direction above, in place of one straight")


class DriftSection(ScenarioSection):
    """What became of the sensors since their last calibration, drawn for each tube and constant over the run."""

    accelerometer_scale_std: float = Field(0.0, ge=0.0, le=0.04, description="of each axis")
    accelerometer_misalignment_std_deg: float = Field(0.0, ge=0.0, le=2.0, description="of each axis to each other")
    accelerometer_bias_std_mps2: float = Field(0.0, ge=0.0, le=0.4, description="of each axis")
    gyroscope_bias_std_dps: float = Field(0.0, ge=0.0, le=0.1, description="of each axis; a node learns it at rest")


class CalibrationSection(ScenarioSection):
    """A rack in which all tubes are calibrated, joined, before the first is drilled in; see docs/calibration.md."""

    attitudes_deg: tuple[tuple[Angle, Angle], ...] = Field(
        min_length=9, description="pitch and roll, deg; gravity's direction is (sin p, cos p sin r, cos p cos r)"
    )
    lead_s: float = Field(20.0, ge=15.0, description="at the first attitude, until every node has rig time")
    hold_s: float = Field(30.0, ge=15.0, description="at rest at each attitude; 8 s more than record_s")
    move_s: float = Field(8.0, ge=4.0, description="from one attitude to the next")
    record_s: float = Field(20.0, ge=5.0, description="of the static record at each attitude")
    apply_s: float = Field(120.0, ge=60.0, description="at rest after the last attitude, for the upload")
    attitude_std_deg: NotNegative = Field(0.01, description="of the rack, about each axis, at each attitude")


class ScenarioFile(ScenarioSection):
    """A whole scenario file."""

    version: int = Field(VERSION, ge=1, description="of this format; a newer one is refused")
    rig: RigSection
    path: PathSection
    schedule: ScheduleSection = ScheduleSection()
    rotation: RotationSection = RotationSection()
    joints: JointSection = JointSection()
    setup: SetupSection = SetupSection()
    torsion: TorsionSection | None = None
    gyroscope: GyroSection = GyroSection()
    accelerometer: AccelerometerSection = AccelerometerSection()
    encoder: EncoderSection = EncoderSection()
    clocks: ClockSection = ClockSection()
    medium: MediumSection = MediumSection()
    radio: RadioSection | None = Field(None, description="between the tubes; a cable without this table")
    aiding: AidingSection = AidingSection()
    node: NodeSection = NodeSection()
    design: DesignSection = DesignSection()
    drift: DriftSection | None = None
    told: ToldSection = Field(ToldSection(), description="what the crew tells wrongly")
    calibration: CalibrationSection | None = None
    site: SiteSection | None = Field(
        None, description="a wall whose holes are drilled one after the other, each straight in place of the path"
    )
    rough: RoughSection | None = Field(None, description="what a field does to the string; without this table nothing")
    disturbance: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="disturbances with a table of their own, see sim.world.disturbance"
    )
    faults: tuple[str, ...] = ()

    @property
    def least_blocks(self) -> int:
        """One for the tubes at the start, or the first one, and one for each that is added."""
        return self.rig.tubes - max(self.rig.tubes_at_start, 1) + 1

    @property
    def blocks(self) -> int:
        """Of turning and resting."""
        return self.schedule.blocks or self.least_blocks

    @property
    def depth(self) -> float:
        """Depth (m) of the bit at the end."""
        advance = self.rotation.advance_m
        return self.rig.depth_at_start + self.blocks * (self.rig.tube_length_m if advance is None else advance)
