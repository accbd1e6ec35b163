"""``borechain calibrate``: records of a laboratory to matrices, coefficients and verdicts."""

from __future__ import annotations

import click

from borechain.cli.calibrate.accuracy_command import accuracy
from borechain.cli.calibrate.apply_command import apply
from borechain.cli.calibrate.linear import attitudes, turntable
from borechain.cli.calibrate.mwd import magnetometer, mwd, qc
from borechain.cli.calibrate.record_reader import record_reader
from borechain.cli.calibrate.rests_command import rests
from borechain.cli.calibrate.temperature_command import temperature


@click.group()
def calibrate() -> None:
    """Calibrate sensors from laboratory records, and check a calibrated tool.

    Formats and models are described in docs/calibration.md. An invalid record is refused with
    its line, and nothing is written.

    \b
    Examples:
      borechain calibrate turntable gyroscope.csv --reference 720 --out gyroscope.json --certificate gyroscope.pdf
      borechain calibrate attitudes accelerometer.csv --plot accelerometer.svg
      borechain calibrate mwd scenarios/instruments/mwd-oven.csv --parameters 30 --out accelerometers.json
    """


for command in (turntable, attitudes, mwd, magnetometer, qc, record_reader, rests, temperature, accuracy, apply):
    calibrate.add_command(command)
