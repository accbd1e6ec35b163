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
from borechain.cli.calibrate.record_options import rate_option, record_options
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import AllanRequest, RecordWords
from telemetry.runtime.typed_options import gather_options


@click.command()
@gather_options(
    file_argument,
    rate_option,
    click.option(
        "--sensor",
        type=click.Choice(["gyroscope", "accelerometer", "magnetometer"]),
        help="Sensor of the record.  [default: the first of these that it has]",
    ),
    click.option(
        "--unit",
        default="",
        help="Unit of the answer, and of the columns x,y,z.  [default: that of the record, else deg/s]",
    ),
    *record_options,
    full_scale_option,
    *output_options,
    wanted=WantedFiles,
    words=RecordWords,
    request=AllanRequest,
)
@plain_faults
def allan(request: AllanRequest, wanted: WantedFiles) -> None:
    """Allan deviation of a static record of an IMU, as its logger wrote it (docs/calibration.md).

    Angle random walk N and bias floor F are fitted, with 95 % intervals; the values read off the curve are given too.

    \b
    Examples:
      borechain experiment records --out out/records
      borechain allan out/records/static.npy --rate 65 --plot out/allan.svg
      borechain allan counts.npy --rate 100 --gyro '0.05 deg/s'
      borechain allan logger.csv --sensor accelerometer --from 60 --without 120..130
    """
    deliver_calibration(request, wanted)
