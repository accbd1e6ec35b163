"""``borechain ground`` and ``python -m groundstation``: the ground station of one rig."""

from __future__ import annotations

from pathlib import Path

import click

from telemetry.runtime.command_line import needs, plain_faults
from telemetry.runtime.options import clock_option, key_option, keys_option, place_options

TOLERANCES = ("en-12716", "5-cm", "0.27-deg")
POSITIVE = click.FloatRange(0.0, min_open=True)
WEIGHTINGS = ("bayes", "equal", "linear", "quadratic", "cubic", "adaptive")


@click.command()
@click.option("--tube-length-m", type=POSITIVE, default=2.0, show_default=True, help="Length of every tube.")
@click.option("--target-m", type=POSITIVE, default=30.0, show_default=True, help="Length of the design axis.")
@click.option(
    "--design-inclination-deg",
    type=click.FloatRange(0.0, 180.0),
    default=0.0,
    show_default=True,
    help="Of the design axis; 0 is vertical.",
)
@click.option("--design-azimuth-deg", type=float, default=0.0, show_default=True, help="Of the design axis.")
@click.option("--column-radius-m", type=POSITIVE, default=0.6, show_default=True, help="Radius of the finished column.")
@click.option(
    "--tolerance",
    type=click.Choice(TOLERANCES),
    default=TOLERANCES[0],
    show_default=True,
    help="Limit of the deviation from the design axis.",
)
@click.option(
    "--weighting",
    type=click.Choice(WEIGHTINGS),
    default=WEIGHTINGS[0],
    show_default=True,
    help="How the measurements of one station are weighted.",
)
@click.option(
    "--accelerometer-bias-std-deg",
    type=click.FloatRange(0.0),
    default=0.002,
    show_default=True,
    help="Accelerometer bias left after calibration, as a tilt, standard deviation.",
)
@click.option(
    "--mount-std-deg",
    type=click.FloatRange(0.0),
    default=0.05,
    show_default=True,
    help="Standard error of an IMU's mounting about its tube's axis.",
)
@clock_option
@key_option
@keys_option
@place_options
@needs("scipy", "sqlalchemy")
@plain_faults
def ground(
    tube_length_m: float,
    target_m: float,
    design_inclination_deg: float,
    design_azimuth_deg: float,
    column_radius_m: float,
    tolerance: str,
    weighting: str,
    accelerometer_bias_std_deg: float,
    mount_std_deg: float,
    clock: str,
    key_file: Path | None,
    keys_place: Path | None,
    rig_name: str,
    endpoint: str,
    folder: Path,
) -> None:
    """Run the ground station of one rig.

    \b
    Example:
      borechain ground --folder state/ground --tube-length-m 2
    """
    from groundstation.host import run_ground
    from telemetry.runtime.hosting import Place

    settings = {
        "tube_length": tube_length_m,
        "target": target_m,
        "design_inclination_deg": design_inclination_deg,
        "design_azimuth_deg": design_azimuth_deg,
        "column_radius": column_radius_m,
        "tolerance": tolerance,
        "weighting": weighting,
        "accelerometer_bias_std_deg": accelerometer_bias_std_deg,
        "mount_std_deg": mount_std_deg,
    }
    run_ground(Place(rig_name, endpoint, folder, key_file, keys=keys_place), settings, own_clock=clock == "own")
