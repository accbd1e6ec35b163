"""``borechain calibrate turntable`` and ``attitudes``: matrix and bias of a triad."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.calibrate.calibration_output import (
    WantedFiles,
    deliver_calibration,
    file_argument,
    landing_options,
    unit_option,
)
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import AttitudesRequest, TurntableRequest
from telemetry.runtime.typed_options import gather_options

jig_option = click.option(
    "--jig-deg",
    type=click.FloatRange(0.0),
    nargs=2,
    metavar="COMMON RANDOM",
    help="Standard deviations of the attitudes: common to all readings of one setting, and of each reading.",
)
temperature_option = click.option("--temperature-c", type=float, help="Temperature of the record, if it was measured.")


@click.command()
@gather_options(
    file_argument,
    click.option(
        "--reference",
        type=click.FloatRange(0.0, min_open=True),
        required=True,
        help="True rate or specific force of the first column of each pair, in the unit of FILE.",
    ),
    unit_option,
    jig_option,
    temperature_option,
    *landing_options,
    wanted=WantedFiles,
    request=TurntableRequest,
)
@plain_faults
def turntable(request: TurntableRequest, wanted: WantedFiles) -> None:
    """Matrix and bias of a triad from a turn-table record: a row per axis turned, two columns per sensor axis.

    \b
    Examples:
      borechain calibrate turntable tests/data/calibration/calibration_node_a1_gyro.csv --reference 720
      borechain calibrate turntable six-positions.csv --reference 1 --unit g --out accelerometer.json
    """
    deliver_calibration(request, wanted)


@click.command()
@gather_options(
    file_argument,
    click.option(
        "--free-yaw",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="REFERENCE",
        help="Solve for the fixture's yaw too; REFERENCE holds the known matrix: a file of --out, or TOML with "
        "`matrix`.",
    ),
    jig_option,
    temperature_option,
    *landing_options,
    wanted=WantedFiles,
    request=AttitudesRequest,
)
@plain_faults
def attitudes(request: AttitudesRequest, wanted: WantedFiles) -> None:
    """Matrix (m/s2 per g) and bias (m/s2) of an accelerometer from mean readings at preset pitch and roll.

    \b
    Examples:
      borechain calibrate attitudes tests/data/calibration/calibration_vn100_accel.csv
      borechain calibrate attitudes accelerometer.csv --free-yaw mounting.toml --certificate accelerometer.pdf
    """
    deliver_calibration(request, wanted)
