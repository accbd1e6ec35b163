"""``borechain calibrate mwd``, ``magnetometer`` and ``qc``: the sixty coefficients of an MWD tool and its control."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.calibrate.calibration_output import (
    WantedFiles,
    deliver_calibration,
    file_argument,
    full_scale_option,
    landing_options,
    output_options,
)
from borechain.cli.calibrate.linear import jig_option
from borechain.cli.faults import plain_faults
from groundstation.report.calibrations.calibration_request import MagnetometerRequest, MwdRequest, QualityRequest
from telemetry.runtime.typed_options import gather_options

calibration_path = click.Path(path_type=Path, dir_okay=False)
parameters_option = click.option(
    "--parameters",
    type=click.Choice(["12", "30"]),
    required=True,
    help="12 for a record at one temperature, 30 for a record over temperature.",
)
accelerometers_option = click.option(
    "--accelerometers", type=calibration_path, help="Calibration of the accelerometers, a file of `mwd --out`."
)


@click.command()
@gather_options(
    file_argument,
    parameters_option,
    click.option(
        "--tool-face", is_flag=True, help="Align the solution with the jig's tool faces; otherwise m_AB = m_BA."
    ),
    jig_option,
    *landing_options,
    wanted=WantedFiles,
    request=MwdRequest,
)
@plain_faults
def mwd(request: MwdRequest, wanted: WantedFiles) -> None:
    """Coefficients of the accelerometers of an MWD tool from voltages at the tilts of a jig.

    \b
    Examples:
      borechain calibrate mwd scenarios/instruments/mwd-room.csv --parameters 12
      borechain calibrate mwd scenarios/instruments/mwd-oven.csv --parameters 30 --out accelerometers.json
    """
    deliver_calibration(request, wanted)


@click.command()
@gather_options(
    file_argument,
    parameters_option,
    accelerometers_option,
    click.option(
        "--field-ut",
        "--field",
        "field_ut",
        type=click.FloatRange(1.0, 100.0),
        help="Strength of the site's magnetic field, uT.",
    ),
    click.option("--dip-deg", type=click.FloatRange(-90.0, 90.0), help="Dip of the site's field below the horizontal."),
    *landing_options,
    wanted=WantedFiles,
    request=MagnetometerRequest,
)
@plain_faults
def magnetometer(request: MagnetometerRequest, wanted: WantedFiles) -> None:
    """Coefficients of the magnetometers of an MWD tool, with the site's field and dip as references.

    The vertical comes from --accelerometers, or from accelerometers calibrated on the same record. Field and dip
    that are not given are read from the columns field_ut,dip_deg of FILE.

    \b
    Example:
      borechain calibrate magnetometer scenarios/instruments/mwd-oven.csv --parameters 30 --field-ut 50 --dip-deg 65
    """
    deliver_calibration(request, wanted)


@click.command()
@gather_options(
    file_argument,
    accelerometers_option,
    click.option(
        "--magnetometers", type=calibration_path, help="Calibration of the magnetometers, of `magnetometer --out`."
    ),
    full_scale_option,
    *output_options,
    wanted=WantedFiles,
    request=QualityRequest,
)
@plain_faults
def qc(request: QualityRequest, wanted: WantedFiles) -> None:
    """Check a tool: readings at twelve tool faces of one attitude must agree in inclination, azimuth and G_L.

    A triad without a calibration file has the nominal coefficients. The exit status is 0 whether the tool passes or
    not: read `passed`.

    \b
    Example:
      borechain calibrate qc scenarios/instruments/mwd-control.csv --accelerometers a.json --magnetometers m.json
    """
    deliver_calibration(request, wanted)
