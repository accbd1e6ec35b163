"""Settings of one node, validated where they enter and plain inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from node.errors import NodeConfigurationError
from node.firmware.imu_settings import ImuSettings
from node.firmware.kernel_choice import LOOPS
from node.firmware.sensor_limits import USUAL_LIMITS, SensorLimits
from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.record.filter_record import Scheme
from node.kernels.record.node_record import SETTINGS
from node.kernels.record.sensor_record import MAX_IMUS
from telemetry.messages import MAX_TUBE, UNKNOWN_YAW_STD
from telemetry.records.noise_file import GyroNoise

Kernel: TypeAlias = Literal["float64", "fixed"]
KERNELS: Final = get_args(Kernel)
TorsionRule: TypeAlias = Literal["gate", "variance"]
MAX_REACH: Final = 8  # tubes away
JointRule: TypeAlias = Literal["marks", "solved", "both"]


@dataclass(frozen=True, slots=True)
class MakeUpAngle:
    """A make-up angle as read from the scribe marks: yaw of the lower part minus yaw of the upper part."""

    angle: float = 0.0  # rad
    std: float = 0.0  # rad, constant error of the reading

    @property
    def is_told(self) -> bool:
        """Whether anything was read from the marks: below the joint a yaw is known."""
        return self.std < UNKNOWN_YAW_STD


UNTOLD: Final = MakeUpAngle(0.0, UNKNOWN_YAW_STD)  # below a joint whose angle is not told the yaw may be any


@dataclass(frozen=True, slots=True)
class PassedTube:
    """The joints of a tube above, for the time when it is silent and the one beyond it is heard."""

    drive_joint: MakeUpAngle = MakeUpAngle()
    lower_joint: MakeUpAngle = MakeUpAngle()


@dataclass(frozen=True, slots=True)
class TubeSettings:
    """What the crew knows of a tube when it is powered on."""

    tube: int
    drive_joint: MakeUpAngle = MakeUpAngle()  # to the drive head, while this is the top tube
    lower_joint: MakeUpAngle = MakeUpAngle()  # to the tube below
    mount_std: float = 0.0  # rad, IMU against the tube's marks, about the tube axis
    scheme: Scheme = Scheme.FORWARD
    state_every: int = 2  # cycles from one report to the next
    aiding_old_after: float = 3.0  # s
    kernel: str = "float64"  # of the loop, see ``LOOPS``; fixed is for a controller without floats
    limits: SensorLimits = USUAL_LIMITS  # of its IMU
    stiffness: float = math.inf  # N m/rad, G J / L of this tube; infinite: rigid
    torsion: TorsionRule = "gate"  # aiding under torque: not used, or used with the variance of the twist
    joints: JointRule = "marks"  # source of the angle of a joint made up above
    unseen_std: float = 0.01 * DEG  # rad, what may turn unseen while a joint is made up
    imus: tuple[ImuSettings, ...] = (ImuSettings(),)  # of its cluster
    reach: int = 1  # tubes away that its radio hears; beyond 1 tubes are numbered from the lowest up, without a gap
    gyro_noise: GyroNoise | None = None  # of its own sensors, by a record at rest; None: that of the configuration
    above: tuple[PassedTube, ...] = ()  # the next tubes above, nearest first; reach - 1 of them are used

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        ConfigurationError
            With the field, its range and what was given.
        """
        require_setting(1 <= self.tube <= MAX_TUBE, f"tube: expected 1..{MAX_TUBE}, got {self.tube}")
        require_setting(self.state_every >= 1, f"state_every: expected at least 1 cycle, got {self.state_every}")
        require_setting(1 <= self.reach <= MAX_REACH, f"reach: expected 1..{MAX_REACH} tubes, got {self.reach}")
        age = self.aiding_old_after
        require_setting(math.isfinite(age) and age > 0.0, f"aiding_old_after: expected a time in s, got {age}")
        count = len(self.imus)
        require_setting(1 <= count <= MAX_IMUS, f"imus: expected 1..{MAX_IMUS} IMUs, got {count}")
        require_setting(self.kernel in LOOPS, f"kernel: expected one of {', '.join(LOOPS)}, got {self.kernel}")
        alone = self.kernel != "float64" and self.scheme is Scheme.INTERSECTION
        require_setting(
            not alone, f"scheme: expected forward or estimate with the kernel {self.kernel}, got intersection"
        )
        require_setting(self.stiffness > 0.0, f"stiffness: expected more than 0 N m/rad, got {self.stiffness}")
        for name, rule, rules in (
            ("torsion", self.torsion, get_args(TorsionRule)),
            ("joints", self.joints, get_args(JointRule)),
        ):
            require_setting(rule in rules, f"{name}: expected one of {', '.join(rules)}, got {rule}")
        solvable = self.joints == "marks" or self.scheme is Scheme.FORWARD
        require_setting(solvable, f"joints: expected marks with a scheme other than forward, got {self.joints}")
        for name, std in (
            ("drive_joint.std", self.drive_joint.std),
            ("lower_joint.std", self.lower_joint.std),
            ("mount_std", self.mount_std),
            ("unseen_std", self.unseen_std),
        ):
            require_setting(
                math.isfinite(std) and std >= 0.0, f"{name}: expected a standard deviation in rad, got {std}"
            )
        for name, angle in (
            ("drive_joint.angle", self.drive_joint.angle),
            ("lower_joint.angle", self.lower_joint.angle),
        ):
            require_setting(math.isfinite(angle), f"{name}: expected an angle in rad, got {angle}")


def bounded_by_circle(variance: float) -> float:
    """A systematic variance (rad^2) as it is handed down: of any number of angles that may be any it is that of one.

    Without the bound thirty joints that were not told would be more than a message says.
    """
    return min(variance, UNKNOWN_YAW_STD**2)


def require_setting(condition: bool, message: str) -> None:
    """Raise ``NodeConfigurationError`` with ``message`` unless ``condition``."""
    if not condition:
        raise NodeConfigurationError(message)


def settings_record(settings: TubeSettings, configs: Array) -> Array:
    """Settings as the step reads them, one record of dtype ``SETTINGS``; ``configs`` is the node's configuration."""
    made = np.zeros(1, SETTINGS)
    record, limits = made[0], settings.limits
    record["drive_angle"], record["drive_var"] = settings.drive_joint.angle, settings.drive_joint.std**2
    record["lower_angle"], record["lower_var"] = settings.lower_joint.angle, settings.lower_joint.std**2
    record["unseen_var"] = settings.unseen_std**2
    record["scheme"], record["state_every"] = int(settings.scheme), settings.state_every
    record["torsion_gate"], record["joints"] = (
        int(settings.torsion == "gate"),
        get_args(JointRule).index(settings.joints),
    )
    record["stamp_walk"] = configs["stamp_walk"][0]
    for name in ("stiffness", "aiding_old_after"):
        record[name] = getattr(settings, name)
    count = len(settings.imus)
    record["imus"], record["tilt_noise"] = count, configs["force_std"][0] / configs["gravity"][0]
    record["place"][:count] = [imu.offset for imu in settings.imus]
    record["noise"][:count] = [imu.noise for imu in settings.imus]
    record["weight"][:count] = np.array([imu.noise for imu in settings.imus]) ** -2.0
    for name in ("gyro_noise", "bias_std", "force_std"):
        record[f"plain_{name}"] = configs[name][0]
    for name in ("rate_range", "force_range", "repeats_together", "repeats_alone"):
        record[name] = getattr(limits, name)
    return made
