"""Options of what is told of an IMU's record, shared by every command that reads one."""

from __future__ import annotations

import math

import click

rate_option = click.option(
    "--rate", type=click.FloatRange(1.0, 1e6), metavar="HZ", help="Rows a second, of a record without times."
)
record_options = (
    click.option(
        "--columns", default="", metavar="NAMES", help="Names of the columns in their order, as time_us,gx_dps,..,-."
    ),
    click.option("--gyro", default="", metavar="UNIT", help="One of its numbers of the gyroscope, as '0.05 deg/s'."),
    click.option("--accel", default="", metavar="UNIT", help="The same of the accelerometer, as '0.000244 g'."),
    click.option("--mag", default="", metavar="UNIT", help="The same of the magnetometer, as '0.15 uT'."),
    click.option("--from", "begin", type=float, default=0.0, metavar="S", help="Leave out what is before, s."),
    click.option("--to", "end", type=float, default=math.inf, metavar="S", help="Leave out what comes after, s."),
    click.option(
        "--without", multiple=True, metavar="S..S", help="Leave out a stretch, as 120..130 s after the first row."
    ),
)  # of RecordWords
