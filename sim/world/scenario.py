"""Scenario files: TOML, every key documented here, unknown keys refused. Degrees and milliseconds at this edge only."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from groundstation.calibration.attitudes import rank_of, true_vectors
from node.kernels.alignment import MAX_IMUS
from sim.errors import ScenarioError
from sim.faults import KillNode, parse_fault
from sim.world.borehole import Borehole, read_displacements, read_stations
from sim.world.parsing import read_toml, validate
from sim.world.radio import check_radio
from sim.world.radio_section import RadioSection
from sim.world.rough_section import RoughSection
from sim.world.section import Angle, NotNegative, Positive, Probability, Section, Triple
from sim.world.shipped import find_scenario
from sim.world.site_section import SiteSection
from telemetry.errors import RadioError
from telemetry.messages import MAX_TUBE

VERSION = 1  # of the format
MAX_RATE_DPS = 57.0 * 6.0  # 57 rev/min: half a turn a cycle is where one sample a cycle aliases
LEAST_LATENCY_MS = 0.5  # of a hop with a link
SURVEY_AFTER = 22.0  # s at rest, for a survey
RECORD_MARGIN = 8.0  # s at an attitude beside its record: the tubes settle and the order travels


class RigSection(Section):
    """The string."""

    tubes: int = Field(ge=1, le=MAX_TUBE, description="tubes of the string at the end")
    tube_length_m: Positive = Field(le=50.0, description="length of every tube")
    tubes_at_start: int = Field(0, ge=0, description="of them in the hole at the start; the others are added on top")
    depth_at_start_m: NotNegative | None = Field(
        None, description="of the bit; that of all tubes if absent, less where the top one still sticks out"
    )


class StraightSection(Section):
    """A straight hole."""

    inclination_deg: float = Field(0.0, ge=0.0, lt=180.0)
    azimuth_deg: Angle = 0.0


class SpiralSection(Section):
    """A hole whose azimuth turns evenly over its length, and its inclination with it."""

    inclination_deg: float = Field(0.0, ge=0.0, le=90.0)
    azimuth_deg: Angle = 0.0
    turn_deg: Angle = Field(0.0, description="of the azimuth, from the collar to the last bit's depth")
    build_deg: float = Field(0.0, ge=-90.0, le=90.0, description="of the inclination, likewise")


class PathSection(Section):
    """The hole; exactly one of the four, files relative to the scenario."""

    displacements: str | None = Field(None, description="CSV md_m,a_cm,b_cm: lateral displacement over one interval")
    stations: str | None = Field(None, description="CSV md_m,inclination_deg,azimuth_deg")
    straight: StraightSection | None = Field(None, description="a hole in one direction, as long as it takes")
    spiral: SpiralSection | None = Field(None, description="a hole whose azimuth turns, as long as it takes")


class ScheduleSection(Section):
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


class RotationSection(Section):
    """Turning of the string while one tube is drilled."""

    rate_dps: float = Field(71.0, gt=0.0, description="constant rate, deg/s")
    acceleration_dps2: Positive = Field(35.0, description="of the ramps")
    turns: float = Field(20.0, gt=0.0, description="of one block, for one tube length")
    advance_m: NotNegative | None = Field(None, description="of the bit in one block; one tube length if absent")


class JointSection(Section):
    """Constant angular errors, 1 sigma."""

    reading_std_deg: NotNegative = Field(0.05, description="of the scribe marks at a joint")
    mount_std_deg: NotNegative = Field(0.05, description="of the IMU against the tube's marks, about the axis")
    mount_tilt_std_deg: float = Field(
        0.0, ge=0.0, le=3.0, description="of each IMU against the tube's axis, pitch and roll; an alignment finds it"
    )
    unseen_std_deg: NotNegative = Field(0.0, description="what the string below turns unseen at each make-up")
    head_turn_deg: NotNegative = Field(0.0, description="about how far the head turns, free of the string, at each")


class TorsionSection(Section):
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


class GyroSection(Section):
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


class AccelerometerSection(Section):
    """Accelerometer of every node, as its readings come: the sensor's own, or what a calibration has left of it."""

    noise_deg: NotNegative = Field(0.02, description="one 1.9 Hz sample, as a tilt")
    bias_std_deg: NotNegative = Field(
        0.06, description="each axis, as a tilt: 1 mg of a sensor that is not calibrated; 0.002 of one that is"
    )
    vibration_mps2: NotNegative = Field(0.05, description="while drilling")
    radius_m: NotNegative = Field(0.02, description="of the IMU from the tube axis")
    gravity_mps2: Positive = 9.81


class EncoderSection(Section):
    """Encoder of the drive head."""

    counts_per_turn: int = Field(4096, ge=16, description="1024 lines in quadrature")
    edge_std_deg: NotNegative = Field(0.003, description="error of a line's place, constant for every line")
    edge_times: bool = Field(True, description="the counter times its edges; else a count is read once a cycle")
    phase: Literal["locked", "random"] = Field(
        "locked", description="of the tubes' cycles against the encoder's: at one time, or drawn for each tube"
    )


class ClockSection(Section):
    """Clocks of the nodes against the encoder's; the last four where ``medium.link`` is off."""

    offset_std_s: NotNegative = 20.0
    drift_std_ppm: NotNegative = 10.0
    joint_std_ms: NotNegative = Field(0.2, description="of rig time across each joint, constant")
    wander_std_ms: NotNegative = Field(0.03, description="of it across each joint, Gauss-Markov")
    wander_tau_s: Positive = Field(60.0, description="of the wander")
    stated_std_ms: NotNegative | None = Field(None, description="what a node takes joint_std_ms for, if not the truth")


class MediumSection(Section):
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


class AidingSection(Section):
    """When the encoder is heard at all, where the link is off; the phase is drawn for each seed."""

    on_s: Positive = Field(20.0, description="heard for so long")
    off_s: NotNegative = Field(0.0, description="and then not for so long")
    every_s: Positive | None = Field(None, description="one measurement at a time, instead of on and off")
    renumbered: bool = Field(False, description="at rest every cycle's aiding counts as a new measurement")


class NodeSection(Section):
    """Firmware settings of every node."""

    scheme: Literal["forward", "estimate", "intersection"] = Field(
        "forward", description="what is relayed: the encoder's measurement, or estimates (the two negative controls)"
    )
    kernel: Literal["float64", "fixed", "published"] = Field(
        "float64", description="the loop in floats, in integers, or in the published feed-forward form"
    )
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


class DesignSection(Section):
    """The column that the hole is to become, as the ground station judges it."""

    inclination_deg: float = Field(0.0, ge=0.0, le=180.0)
    azimuth_deg: float = 0.0
    length_m: Positive | None = Field(None, description="of the axis; what the tubes reach if absent")
    radius_m: Positive = Field(0.6, description="of the finished column")
    tolerance: Literal["en-12716", "5-cm", "0.27-deg"] = "en-12716"


class DriftSection(Section):
    """What became of the sensors since their last calibration, drawn for each tube and constant over the run."""

    accelerometer_scale_std: float = Field(0.0, ge=0.0, le=0.04, description="of each axis")
    accelerometer_misalignment_std_deg: float = Field(0.0, ge=0.0, le=2.0, description="of each axis to each other")
    accelerometer_bias_std_mps2: float = Field(0.0, ge=0.0, le=0.4, description="of each axis")
    gyroscope_bias_std_dps: float = Field(0.0, ge=0.0, le=0.1, description="of each axis; a node learns it at rest")


class CalibrationSection(Section):
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


class ScenarioFile(Section):
    """A whole scenario file."""

    version: int = Field(VERSION, ge=1, description="of this format; a newer one is refused")
    rig: RigSection
    path: PathSection
    schedule: ScheduleSection = ScheduleSection()
    rotation: RotationSection = RotationSection()
    joints: JointSection = JointSection()
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
    calibration: CalibrationSection | None = None
    site: SiteSection | None = Field(
        None, description="a wall whose holes are drilled one after the other, each straight in place of the path"
    )
    rough: RoughSection | None = Field(None, description="what a field does to the string; without this table nothing")
    faults: tuple[str, ...] = ()


class Scenario:
    """A validated scenario: its file's tables, the hole and the faults."""

    def __init__(self, file: ScenarioFile, hole: Borehole, faults: tuple[KillNode, ...]) -> None:
        self.file = file
        self.hole = hole
        self.faults = faults
        self.tubes = file.rig.tubes
        self.tube_length = file.rig.tube_length_m
        self.medium = file.medium

    def drilling(self, name: str) -> Scenario:
        """The same with a hole of its site.

        Raises
        ------
        ScenarioError
            When the site has none of that name.
        """
        holes = {} if self.file.site is None else {hole.name: hole for hole in self.file.site.holes}
        if name not in holes:
            raise ScenarioError(f"hole {name}: expected one of {', '.join(holes) or 'none, the scenario has no site'}")
        lean = math.radians(holes[name].inclination_deg), math.radians(holes[name].azimuth_deg)
        return Scenario(self.file, Borehole.straight(*lean, max(_depth(self.file), 1.0)), self.faults)


def scenario_of(tables: dict[str, Any], faults: tuple[str, ...] = ()) -> Scenario:
    """A scenario of its tables, without a file; its path is ``straight`` or absolute.

    Raises
    ------
    ScenarioError
        As ``load_scenario``.
    """
    where = Path("scenario")
    return _checked(where, validate(where, tables, ScenarioFile, VERSION), faults)


def load_scenario(path: Path, faults: tuple[str, ...] = ()) -> Scenario:
    """Read and check a scenario: a file, or the name of one that comes with the program.

    ``faults`` from the command line join those of the file.

    Raises
    ------
    ScenarioError
        One line: the file, the key or line, what was expected and what came.
    """
    path = find_scenario(path)
    return _checked(path, validate(path, read_toml(path), ScenarioFile, VERSION), faults)


def _checked(path: Path, file: ScenarioFile, faults: tuple[str, ...]) -> Scenario:
    _check_motion(path, file)
    _check_link(path, file)
    _check_torsion(path, file)
    _check_radio(path, file)
    _check_rough(path, file)
    if len(file.node.imu_noise) not in (0, file.node.imus):
        raise ScenarioError(
            f"{path}: node.imu_noise: expected {file.node.imus} factors, one for each of node.imus, "
            f"got {len(file.node.imu_noise)}"
        )
    _check_calibration(path, file.calibration)
    needed = _depth(file)
    hole = _hole(path, file.path, needed)
    if hole.length + 1e-9 < needed:
        raise ScenarioError(
            f"{path}: rig.tubes: {file.rig.tubes} tubes of {file.rig.tube_length_m:g} m need a path of {needed:g} m, "
            f"it ends at {hole.length:g} m; drill fewer tubes or extend the path"
        )
    try:
        own = tuple(parse_fault(text, file.rig.tubes) for text in file.faults)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: faults: {error}") from error
    return Scenario(file, hole, own + tuple(parse_fault(text, file.rig.tubes) for text in faults))


def _check_motion(path: Path, file: ScenarioFile) -> None:
    rate, schedule = file.rotation.rate_dps, file.schedule
    if rate > MAX_RATE_DPS:
        raise ScenarioError(
            f"{path}: rotation.rate_dps: expected at most {MAX_RATE_DPS:g} deg/s (57 rev/min, "
            f"half a turn a cycle), got {rate:g}; turn slower"
        )
    if file.rig.tubes_at_start > file.rig.tubes:
        raise ScenarioError(
            f"{path}: rig.tubes_at_start: expected at most tubes = {file.rig.tubes}, got {file.rig.tubes_at_start}"
        )
    hanging = file.rig.tube_length_m * file.rig.tubes_at_start
    if _depth_at_start(file.rig) > hanging:
        raise ScenarioError(
            f"{path}: rig.depth_at_start_m: expected at most the {hanging:g} m that the tubes at the start reach, "
            f"got {file.rig.depth_at_start_m:g}"
        )
    if _blocks(file) < file.rig.tubes - max(file.rig.tubes_at_start, 1) + 1:
        raise ScenarioError(
            f"{path}: schedule.blocks: expected at least one for each tube that is added, got {schedule.blocks}"
        )
    if schedule.joint_s >= schedule.add_s:
        raise ScenarioError(
            f"{path}: schedule.joint_s: expected less than add_s = {schedule.add_s:g} s, "
            f"got {schedule.joint_s:g}; close the joint before drilling"
        )


def _blocks(file: ScenarioFile) -> int:
    return file.schedule.blocks or file.rig.tubes - max(file.rig.tubes_at_start, 1) + 1


def _depth(file: ScenarioFile) -> float:
    """Depth (m) of the bit at the end."""
    rig, advance = file.rig, file.rotation.advance_m
    return _depth_at_start(rig) + _blocks(file) * (rig.tube_length_m if advance is None else advance)


def _depth_at_start(rig: RigSection) -> float:
    """Depth (m) of the bit at the start."""
    hanging = rig.tube_length_m * rig.tubes_at_start
    return hanging if rig.depth_at_start_m is None else rig.depth_at_start_m


def _check_link(path: Path, file: ScenarioFile) -> None:
    """Settings of a string without a link stand beside ``link = "off"`` only: on a link they would do nothing."""
    if file.medium.link == "off":
        return
    if file.medium.latency_ms < LEAST_LATENCY_MS:
        raise ScenarioError(
            f"{path}: medium.latency_ms: expected at least {LEAST_LATENCY_MS:g} ms, got {file.medium.latency_ms:g}"
        )
    usual = {
        "medium.delay_ms": file.medium.delay_ms == 0.0,
        "medium.dated_by": file.medium.dated_by == "validity",
        "aiding": file.aiding == AidingSection(),
        "encoder.edge_times": file.encoder.edge_times,
        "node.tuning": not file.node.tuning,
    }
    for key, holds in usual.items():
        if not holds:
            raise ScenarioError(f'{path}: {key}: expected medium.link = "off" with it; a link decides that by itself')


def _check_torsion(path: Path, file: ScenarioFile) -> None:
    section, schedule = file.torsion, file.schedule
    if file.node.joints != "marks" and file.node.scheme != "forward":
        raise ScenarioError(
            f"{path}: node.joints: expected marks with the scheme {file.node.scheme}, "
            f"got {file.node.joints}; only forward can solve them"
        )
    if section is None:
        return
    if section.inner_diameter_m >= section.outer_diameter_m:
        raise ScenarioError(
            f"{path}: torsion.inner_diameter_m: expected less than outer_diameter_m = "
            f"{section.outer_diameter_m:g} m, got {section.inner_diameter_m:g}"
        )
    needed = section.release_after_s + section.release_s + SURVEY_AFTER
    if schedule.stop_s < needed:
        raise ScenarioError(
            f"{path}: schedule.stop_s: expected at least {needed:g} s, the release of the torque and "
            f"{SURVEY_AFTER:g} s for a survey, got {schedule.stop_s:g}; stop longer"
        )


def _check_radio(path: Path, file: ScenarioFile) -> None:
    section = file.radio
    if section is None:
        return
    if file.medium.link == "off":
        raise ScenarioError(f'{path}: radio: expected medium.link = "on" with it, got off')
    if section.mode == "pipe" and file.node.joints != "marks":
        raise ScenarioError(
            f"{path}: node.joints: expected marks with a radio in the pipe, got {file.node.joints}; "
            "a tube that hears beyond a silent one knows the marks alone"
        )
    try:
        check_radio(section, file.rig.tube_length_m)
    except RadioError as error:
        raise ScenarioError(f"{path}: radio: {error}") from error


def _check_rough(path: Path, file: ScenarioFile) -> None:
    """What the grid of a rough world does not hold is refused beside it."""
    if file.rough is None:
        return
    vibration = file.rough.vibration
    lowest, highest = vibration.lowest_hz, vibration.highest_hz
    shaken = vibration.turning_g or vibration.resting_g or vibration.torsional_dps
    if shaken and not lowest < highest <= 0.5 * file.rough.samples_hz:
        raise ScenarioError(
            f"{path}: rough.vibration: expected lowest_hz below highest_hz and this at most half of samples_hz = "
            f"{file.rough.samples_hz:g}, got {lowest:g} and {highest:g}"
        )
    usual = {
        "calibration": file.calibration is None,
        "joints.head_turn_deg": file.joints.head_turn_deg == 0.0,
        "encoder.edge_times": file.encoder.edge_times,
        "gyroscope.instantaneous": not file.gyroscope.instantaneous,
    }
    for key, holds in usual.items():
        if not holds:
            raise ScenarioError(
                f"{path}: {key}: expected no such setting beside the table rough; leave out one of them"
            )


def _check_calibration(path: Path, section: CalibrationSection | None) -> None:
    if section is None:
        return
    if section.record_s + RECORD_MARGIN > section.hold_s:
        raise ScenarioError(
            f"{path}: calibration.record_s: expected at most hold_s - {RECORD_MARGIN:g} s = "
            f"{section.hold_s - RECORD_MARGIN:g} s, got {section.record_s:g}; hold longer"
        )
    pitch, roll = np.radians(np.array(section.attitudes_deg)).T
    rank = rank_of(np.column_stack([np.ones(len(pitch)), true_vectors(pitch, roll)]))
    if rank < 4:
        raise ScenarioError(
            f"{path}: calibration.attitudes_deg: expected attitudes that determine bias and matrix (rank 4), "
            f"got rank {rank}; add some of other tilts"
        )


def _hole(path: Path, section: PathSection, length: float) -> Borehole:
    files = [name for name in (section.displacements, section.stations) if name is not None]
    given = len(files) + (section.straight is not None) + (section.spiral is not None)
    if given != 1:
        raise ScenarioError(
            f"{path}: path: expected exactly one of displacements, stations, straight and spiral, got {given}"
        )
    if section.spiral is not None:
        spiral = section.spiral
        turned = (spiral.inclination_deg, spiral.azimuth_deg, spiral.turn_deg, spiral.build_deg)
        inclination, azimuth, turn, build = map(math.radians, turned)
        return Borehole.spiral(inclination, azimuth, turn, max(length, 1.0), build)
    if section.straight is not None:
        straight = section.straight
        end = max(length, 1.0)
        return Borehole.straight(math.radians(straight.inclination_deg), math.radians(straight.azimuth_deg), end)
    source = path.parent / files[0]
    reader = read_displacements if section.displacements is not None else read_stations
    return Borehole(*reader(source), where=str(source))
