"""``borechain calibrate temperature``: bias and matrix of a triad as polynomials in the temperature."""

from __future__ import annotations

import click

from borechain.cli.calibrate.calibration_output import (
    WantedFiles,
    deliver_calibration,
    file_argument,
    landing_options,
    unit_option,
)
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import TemperatureRequest
from telemetry.runtime.typed_options import gather_options


@click.command()
@gather_options(
    file_argument,
    unit_option,
    click.option(
        "--bias-degree", type=click.IntRange(0, 3), default=2, show_default=True, help="Highest power of the bias."
    ),
    click.option(
        "--matrix-degree", type=click.IntRange(0, 3), default=1, show_default=True, help="Highest power of the matrix."
    ),
    *landing_options,
    wanted=WantedFiles,
    request=TemperatureRequest,
)
@plain_faults
def temperature(request: TemperatureRequest, wanted: WantedFiles) -> None:
    """Bias and matrix of a triad over the temperature, from means at known truths and four temperatures or more.

    FILE has the columns temperature_c,true_x,true_y,true_z,x,y,z: what the sensor felt or how it was turned, and what
    it read. A node applies the polynomials of the file of --out by its own thermometer.

    \b
    Examples:
      borechain calibrate temperature oven.csv --unit g --out accelerometer.json
      borechain calibrate temperature oven-gyro.csv --out gyroscope.json --certificate gyroscope.pdf
    """
    deliver_calibration(request, wanted)
