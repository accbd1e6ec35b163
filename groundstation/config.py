"""Configuration of a ground station, validated where it enters."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import ConfigurationError, SurveyError
from groundstation.plan_settings import PlanSettings
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.path.leg_wander import LegWander
from groundstation.survey.path.stated_curvature import STATED_CURVATURE_DEG, STATED_LENGTH
from groundstation.survey.wall.column_deviation import ColumnDesign, parse_tolerance
from groundstation.survey.well.depth_errors import DepthErrors
from telemetry import keys

SENSOR_BIAS_DEG = 0.06  # of an uncalibrated accelerometer, as a tilt: 1 mg
Positive = Annotated[float, Field(gt=0.0)]
SigmaDeg = Annotated[float, Field(gt=0.0, le=180.0)]
AzimuthDeg = Annotated[float, Field(ge=-720.0, le=720.0)]
Length = Annotated[float, Field(gt=0.0, le=RANGES["depth"].high)]  # m
StickUp = Annotated[float, Field(ge=-20.0, le=20.0)]  # m, as it is told by a command
Joint = Annotated[str, Field(pattern=r"^([1-9][0-9]{0,2}|drive)-[1-9][0-9]{0,2}$")]  # upper tube and lower, such as 4-3
NotNegative = Annotated[float, Field(ge=0.0)]
SmallStd = Annotated[float, Field(ge=0.0, le=100.0)]  # m, or m/m


def within_range(name: str) -> AfterValidator:
    """Validator of a quantity of ``RANGES``, which refuses it by its name, its unit and its range."""

    def check(value: float) -> float:
        if not RANGES[name].low <= value <= RANGES[name].high:
            raise PydanticCustomError("range", "expected {expected}", {"expected": RANGES[name].expected})
        return value

    return AfterValidator(check)


def known_tolerance(text: str) -> str:
    """The text of a tolerance that can be read."""
    try:
        parse_tolerance(text)
    except SurveyError as error:
        raise PydanticCustomError("tolerance", "{text}", {"text": str(error)}) from None
    return text


class GroundConfig(BaseModel):
    """Settings of one ground station; SI and radians, degrees where the name says so."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    rig: str = Field(keys.DEFAULT_RIG, pattern=r"^[A-Za-z0-9_-]{1,64}$")
    folder: Path
    database_url: str | None = Field(None, description="SQLAlchemy URL; SQLite in the folder if absent")
    key_file: Path | None = Field(None, description="key of the rig; without one no parameter block is uploaded")
    keys: Path | None = Field(None, description="keys of the base, file or folder; without them everybody is believed")
    tube_length: Annotated[float, Field(gt=0.0, le=100.0)] = Field(2.0, description="m, of every tube of the tally")
    tube_length_std: SmallStd = Field(1e-3, description="m, of the length of each tube")
    depth_scale_std: SmallStd = Field(5.6e-4, description="m/m, of the depth of the bit")
    depth_offset_std: SmallStd = Field(0.01, description="m, of the stick-up")
    depth_reading_std: SmallStd = Field(2e-3, description="m, of each reading of the depth")
    gravity: Annotated[float, Field(ge=RANGES["gravity"].low, le=RANGES["gravity"].high)] = Field(
        9.81, description="m/s^2, of the site"
    )
    accelerometer_bias_std_deg: float = Field(
        SENSOR_BIAS_DEG, ge=0.0, le=180.0, description="as a tilt; 0.002 where every sensor is calibrated"
    )
    mount_std_deg: float = Field(0.05, ge=0.0, le=180.0, description="of the IMU in its tube, about the axis")
    string_transport: Literal["shortest", "parallel"] = Field(
        "shortest", description="yaw of a tube in a bent hole: that of the head, or as a shaft without twist carries it"
    )
    north_deg: AzimuthDeg = Field(0.0, description="of the encoder's zero, from site north, clockwise")
    north_std_deg: SigmaDeg | None = Field(None, description="of it; not told if absent: any azimuth may be")
    collar_inclination_deg: float | None = Field(
        None, ge=0.0, lt=180.0, description="of the hole at the collar; as the design if absent"
    )
    collar_azimuth_deg: AzimuthDeg | None = None
    collar_std_deg: SigmaDeg | None = Field(None, description="of the direction at the collar, each way")
    joints: tuple[tuple[Joint, float, Positive], ...] = Field(
        (), description="joint, angle and standard error (deg) of those that the nodes were not told"
    )
    stick_up_m: StickUp = Field(0.0, description="of the zero of the depth over the collar")
    stick_up_std_m: Length | None = None
    north_check_deg: AzimuthDeg | None = Field(
        None, description="a second bearing of the encoder's zero, taken by itself"
    )
    north_check_std_deg: SigmaDeg | None = None
    stick_up_check_m: StickUp | None = Field(None, description="a second reading of it: the bit at the collar's edge")
    stick_up_check_std_m: Positive | None = None
    mount_tilt_std_deg: SigmaDeg | None = Field(
        None, description="of an IMU against its tube's axis until it is aligned; as mounted, 0.5, if absent"
    )
    weighting: Weighting = Field(
        Weighting.ADJUSTED, description="how the readings of one station count, or all of the hole in one adjustment"
    )
    play_std_deg: SigmaDeg = Field(0.01, description="of a tube against the hole at a stop, until the looks tell it")
    curvature_std_deg_per_m: Annotated[float, Field(gt=0.0, le=1e6)] = Field(
        STATED_CURVATURE_DEG, description="of the hole's curvature, before the looks"
    )
    curvature_length: Length = Field(STATED_LENGTH, description="m, over which a curvature is forgotten")
    target: Length = Field(30.0, description="m, length of the design axis")
    design_inclination_deg: float = Field(0.0, ge=0.0, le=180.0)
    design_azimuth_deg: AzimuthDeg = 0.0
    plan: PlanSettings | None = Field(None, description="course of the design, in place of the straight axis")
    column_radius: Annotated[float, Field(gt=0.0, le=10.0)] = Field(0.6, description="m, of the finished column")
    tolerance: Annotated[str, AfterValidator(known_tolerance)] = Field(
        "en-12716", description="preset of columns.PRESETS, or the contract's sum such as 50 mm + 1:200"
    )
    steering_deg_per_m: SigmaDeg = Field(0.5, description="the most by which the rig bends a hole back")
    wall: Path | None = Field(None, description="wall file of which this hole is a column")
    hole: str = Field("", description="name of this hole in the wall file")
    station_tolerance: Annotated[float, within_range("station_tolerance")] = Field(
        0.05, description="m, within which two surveys are at the same station"
    )
    stale_after: Annotated[float, within_range("stale_after")] = Field(4.5, description="s without a state of a node")
    depth_rate: Annotated[float, within_range("depth_rate")] = Field(
        0.2, description="m/s, the fastest that the bit is moved"
    )
    depth_gap: Annotated[float, within_range("depth_gap")] = Field(
        5.0, description="s, between two depths that bracket the time of a survey"
    )
    survey_after: Annotated[float, within_range("survey_after")] = Field(
        60.0, description="s of a stop until every tube in the hole must have surveyed"
    )

    @property
    def calibrations(self) -> Path:
        """Folder of the calibrations that can be uploaded."""
        return self.folder / "calibrations"

    @property
    def url(self) -> str:
        """Database to use."""
        return self.database_url or f"sqlite:///{self.folder / 'ground.sqlite'}"

    @model_validator(mode="after")
    def _check_told(self) -> Self:
        """What is told is told with its standard error: without one it would be taken for exact."""
        told = {
            "north_std_deg": self.north_deg != 0.0,
            "collar_std_deg": self.collar_inclination_deg is not None or self.collar_azimuth_deg is not None,
            "stick_up_std_m": self.stick_up_m != 0.0,
        }
        for name, is_told in told.items():
            if is_told and getattr(self, name) is None:
                raise PydanticCustomError("told", "expected {name} beside the value that it is of", {"name": name})
        for value, std in (("north_check_deg", "north_check_std_deg"), ("stick_up_check_m", "stick_up_check_std_m")):
            if (getattr(self, value) is None) != (getattr(self, std) is None):
                raise PydanticCustomError("check", "expected {value} and {std} together", {"value": value, "std": std})
        return self

    @property
    def depth_errors(self) -> DepthErrors:
        """Errors of measured depths."""
        return DepthErrors(self.depth_scale_std, self.depth_offset_std, self.tube_length_std, self.depth_reading_std)

    @property
    def wander(self) -> LegWander:
        """Curvature of the path between the stations."""
        return LegWander(math.radians(self.curvature_std_deg_per_m), self.curvature_length)

    @property
    def design(self) -> ColumnDesign:
        """Axis of the column.

        Raises
        ------
        SurveyError
            When its plan is none.
        """
        allowed, plan = parse_tolerance(self.tolerance), self.plan
        if plan is not None:
            allowed = plan.to_tolerance(allowed)
            return ColumnDesign.of_plan(self.rig, plan.to_plan(), plan.head, self.column_radius, allowed)
        return ColumnDesign(
            self.rig,
            inclination=math.radians(self.design_inclination_deg),
            azimuth=math.radians(self.design_azimuth_deg),
            length=self.target,
            radius=self.column_radius,
            tolerance=allowed,
        )


def checked_config(**settings: Any) -> GroundConfig:
    """Configuration of settings as they were given.

    Raises
    ------
    ConfigurationError
        One line: which setting, what was expected and what came.
    """
    try:
        return GroundConfig(**settings)
    except ValidationError as error:
        first = error.errors()[0]
        if not first["loc"]:
            raise ConfigurationError(first["msg"]) from error
        name = ".".join(str(part) for part in first["loc"])
        raise ConfigurationError(f"{name}: {first['msg']}, got {first['input']!r:.60}") from error
