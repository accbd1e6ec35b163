"""``borechain calibrate rests``: both sensors of an IMU that was laid down here and there."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.calibrate.calibration_output import (
    WantedFiles,
    deliver_calibration,
    file_argument,
    force_option,
    output_options,
)
from borechain.cli.calibrate.record_options import rate_option, record_options
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import STANDARD_GRAVITY, RecordWords, RestsRequest
from telemetry.runtime.typed_options import gather_options


@click.command()
@gather_options(
    file_argument,
    rate_option,
    click.option(
        "--gravity",
        type=click.FloatRange(9.7, 9.9),
        default=STANDARD_GRAVITY,
        show_default=True,
        help="Gravity of the place, m/s2.",
    ),
    click.option(
        "--gyroscope-out",
        type=click.Path(path_type=Path, dir_okay=False),
        help="The gyroscope's calibration as a .json file; --out is the accelerometer's.",
    ),
    *record_options,
    force_option,
    *output_options,
    wanted=WantedFiles,
    words=RecordWords,
    request=RestsRequest,
)
@plain_faults
def rests(request: RestsRequest, wanted: WantedFiles, gyroscope_out: Path | None) -> None:
    """Accelerometer and gyroscope from a record of rests at attitudes that need not be known.

    Lay the sensor down for five seconds, turn it, lay it down on another side or edge: twenty times or more, all
    sides. The rests are found by the scatter of the readings; the accelerometer feels gravity at each, and the
    gyroscope has to turn gravity of one rest into that of the next.

    \b
    Examples:
      borechain calibrate rests logger.csv --out accelerometer.json --gyroscope-out gyroscope.json
      borechain calibrate rests raw.log --columns ax_mps2,ay_mps2,az_mps2,gx_rads,gy_rads,gz_rads --rate 100
    """
    deliver_calibration(request, wanted, gyroscope_out)
