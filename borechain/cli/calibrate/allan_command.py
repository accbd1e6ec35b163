"""``borechain allan``: what a static record says of a sensor's noise."""

from __future__ import annotations

import click

from borechain.cli.calibrate.calibration_output import (
    WantedFiles,
    deliver_calibration,
    file_argument,
    full_scale_option,
    output_options,
)
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import AllanRequest
from telemetry.runtime.typed_options import gather_options


@click.command()
@gather_options(
    file_argument,
    click.option(
        "--rate", type=click.FloatRange(1.0, 1e6), required=True, metavar="HZ", help="Readings per second of FILE."
    ),
    click.option(
        "--unit", default="deg/s", show_default=True, help="Unit of FILE, shown in the report; nothing is converted."
    ),
    full_scale_option,
    *output_options,
    wanted=WantedFiles,
    request=AllanRequest,
)
@plain_faults
def allan(request: AllanRequest, wanted: WantedFiles) -> None:
    """Allan deviation of a static record: a CSV with the columns x,y,z, or an .npy of shape (n, 3).

    Angle random walk N and bias floor F are fitted, with 95 % intervals; the values read off the curve are given too.

    \b
    Examples:
      borechain experiment records --out out/records
      borechain allan out/records/static.npy --rate 65 --plot out/allan.svg
    """
    deliver_calibration(request, wanted)
