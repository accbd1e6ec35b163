"""Options of the ground station's command as what its operator knows of the rig and the hole."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from groundstation.page_options import PageRequest, page_options
from groundstation.plan_settings import read_plan
from telemetry.runtime.process_options import PlaceRequest, clock_option, key_option, keys_option, place_options
from telemetry.runtime.typed_options import gather_options

POSITIVE = click.FloatRange(0.0, min_open=True)
WEIGHTINGS = ("bayes", "equal", "linear", "quadratic", "cubic", "adaptive", "adjusted")


@dataclass(frozen=True, slots=True)
class GroundRequest:
    """Rig, design and hole as the options say."""

    tube_length_m: float
    target_m: float
    design_inclination_deg: float
    design_azimuth_deg: float
    plan: Path | None
    column_radius_m: float
    tolerance: str
    steering_deg_per_m: float
    string_transport: str
    north_deg: float
    north_std_deg: float | None
    north_check_deg: float | None
    north_check_std_deg: float | None
    collar_inclination_deg: float | None
    collar_azimuth_deg: float | None
    collar_std_deg: float | None
    joints: tuple[tuple[str, float, float], ...]
    stick_up_m: float
    stick_up_std_m: float | None
    stick_up_check_m: float | None
    stick_up_check_std_m: float | None
    mount_tilt_std_deg: float | None
    weighting: str
    accelerometer_bias_std_deg: float
    mount_std_deg: float
    station_tolerance_m: float
    stale_after_s: float
    depth_rate_mps: float
    depth_gap_s: float
    survey_after_s: float
    wall: Path | None
    hole: str
    database: str | None

    def to_settings(self) -> dict[str, Any]:
        """Settings by the keys of ``GroundConfig``, which looks at their ranges; errors as ``read_plan``."""
        return {
            "tube_length": self.tube_length_m,
            "target": self.target_m,
            "design_inclination_deg": self.design_inclination_deg,
            "design_azimuth_deg": self.design_azimuth_deg,
            "plan": None if self.plan is None else read_plan(self.plan),
            "column_radius": self.column_radius_m,
            "tolerance": self.tolerance,
            "steering_deg_per_m": self.steering_deg_per_m,
            "string_transport": self.string_transport,
            "north_deg": self.north_deg,
            "north_std_deg": self.north_std_deg,
            "north_check_deg": self.north_check_deg,
            "north_check_std_deg": self.north_check_std_deg,
            "joints": self.joints,
            "stick_up_m": self.stick_up_m,
            "stick_up_std_m": self.stick_up_std_m,
            "stick_up_check_m": self.stick_up_check_m,
            "stick_up_check_std_m": self.stick_up_check_std_m,
            "mount_tilt_std_deg": self.mount_tilt_std_deg,
            "collar_inclination_deg": self.collar_inclination_deg,
            "collar_azimuth_deg": self.collar_azimuth_deg,
            "collar_std_deg": self.collar_std_deg,
            "weighting": self.weighting,
            "accelerometer_bias_std_deg": self.accelerometer_bias_std_deg,
            "mount_std_deg": self.mount_std_deg,
            "station_tolerance": self.station_tolerance_m,
            "stale_after": self.stale_after_s,
            "depth_rate": self.depth_rate_mps,
            "depth_gap": self.depth_gap_s,
            "survey_after": self.survey_after_s,
            "wall": self.wall,
            "hole": self.hole,
            "database_url": self.database,
        }


ground_options = gather_options(
    click.option("--tube-length-m", type=POSITIVE, default=2.0, show_default=True, help="Length of every tube."),
    click.option("--target-m", type=POSITIVE, default=30.0, show_default=True, help="Length of the design axis."),
    click.option(
        "--design-inclination-deg",
        type=click.FloatRange(0.0, 180.0),
        default=0.0,
        show_default=True,
        help="Of the design axis; 0 is vertical.",
    ),
    click.option("--design-azimuth-deg", type=float, default=0.0, show_default=True, help="Of the design axis."),
    click.option(
        "--plan",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Course of the design in three dimensions, in place of a straight axis: legs (.toml) or stations (.csv).",
    ),
    click.option(
        "--column-radius-m", type=POSITIVE, default=0.6, show_default=True, help="Radius of the finished column."
    ),
    click.option(
        "--tolerance",
        default="en-12716",
        show_default=True,
        metavar="LIMIT",
        help="Limit of the deviation from the design axis: en-12716, 5-cm, 0.27-deg, or a sum such as '50 mm + 1:200'.",
    ),
    click.option(
        "--steering-deg-per-m",
        type=POSITIVE,
        default=0.5,
        show_default=True,
        help="The most by which this rig bends a hole back; until where a correction still helps follows from it.",
    ),
    click.option(
        "--string-transport",
        type=click.Choice(("shortest", "parallel")),
        default="shortest",
        show_default=True,
        help="Yaw of a tube in a bent hole: that of the head, or as a shaft without twist carries it along.",
    ),
    click.option(
        "--north-deg",
        type=float,
        default=0.0,
        show_default=True,
        help="Where the encoder's zero points, from site north, clockwise.",
    ),
    click.option(
        "--north-std-deg", type=POSITIVE, help="Standard error of --north-deg. Without it no azimuth is known."
    ),
    click.option(
        "--north-check-deg", type=float, help="A second bearing of the encoder's zero. Without it north is not checked."
    ),
    click.option("--north-check-std-deg", type=POSITIVE, help="Standard error of --north-check-deg."),
    click.option(
        "--collar-inclination-deg",
        type=click.FloatRange(0.0, 180.0, max_open=True),
        help="Of the hole at the collar, where the head holds the string  [default: as the design]",
    ),
    click.option("--collar-azimuth-deg", type=float, help="Of the hole at the collar  [default: as the design]"),
    click.option(
        "--collar-std-deg",
        type=POSITIVE,
        help="Standard error of the direction at the collar, each way. Not told it is 1.",
    ),
    click.option(
        "--joint",
        "joints",
        type=(str, float, float),
        multiple=True,
        metavar="JOINT ANGLE STD",
        help="Angle and standard error (deg) of a joint that no node was told: 4-3 12.5 0.05, or drive-4. Repeatable.",
    ),
    click.option("--stick-up-m", type=float, default=0.0, show_default=True, help="Zero of the depth over the collar."),
    click.option("--stick-up-std-m", type=POSITIVE, help="Standard error of --stick-up-m. Not told it is 0.1."),
    click.option("--stick-up-check-m", type=float, help="A second reading of it, the bit at the collar's edge."),
    click.option("--stick-up-check-std-m", type=POSITIVE, help="Standard error of --stick-up-check-m."),
    click.option(
        "--mount-tilt-std-deg",
        type=POSITIVE,
        help="Standard error of an IMU's mounting against its tube's axis, until it is aligned. Not told it is 0.5.",
    ),
    click.option(
        "--weighting",
        type=click.Choice(WEIGHTINGS),
        default=WEIGHTINGS[0],
        show_default=True,
        help="How the measurements of one station are weighted.",
    ),
    click.option(
        "--accelerometer-bias-std-deg",
        type=click.FloatRange(0.0),
        default=0.06,
        show_default=True,
        help="Accelerometer bias as a tilt, standard deviation: 1 mg of the bare sensor, 0.002 of calibrated ones.",
    ),
    click.option(
        "--mount-std-deg",
        type=click.FloatRange(0.0),
        default=0.05,
        show_default=True,
        help="Standard error of an IMU's mounting about its tube's axis.",
    ),
    click.option(
        "--station-tolerance-m",
        type=float,
        default=0.05,
        show_default=True,
        help="Two surveys within this depth are at one station.",
    ),
    click.option(
        "--stale-after-s",
        type=float,
        default=4.5,
        show_default=True,
        help="A tube, or the depth, is silent after so long without a word.",
    ),
    click.option(
        "--depth-rate-mps",
        type=float,
        default=0.2,
        show_default=True,
        help="The fastest that the bit is moved; a depth beyond it jumped.",
    ),
    click.option(
        "--depth-gap-s",
        type=float,
        default=5.0,
        show_default=True,
        help="The longest between two depths that place a survey between them.",
    ),
    click.option(
        "--survey-after-s",
        type=float,
        default=60.0,
        show_default=True,
        help="Of a stop, until every tube in the hole must have surveyed.",
    ),
    click.option(
        "--wall",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Wall file of which this hole is a column: its joints are judged while it is drilled.",
    ),
    click.option("--hole", default="", help="Name of this hole in the wall file."),
    click.option(
        "--database",
        metavar="URL",
        help="Where surveys and alarms are kept, such as postgresql://USER@HOST/NAME; the password from PGPASSWORD or "
        "~/.pgpass  [default: SQLite in the folder]",
    ),
    page_options,
    clock_option,
    key_option,
    keys_option,
    place_options,
    request=GroundRequest,
    place=PlaceRequest,
    served=PageRequest,
)
