"""``borechain calibrate record``: what is understood of an IMU's record, and the record in SI."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.calibrate.calibration_output import file_argument, write_files_whole
from borechain.cli.calibrate.record_options import rate_option, record_options
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option
from groundstation.report.calibrations.calibration_request import RecordWords
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from telemetry.records.imu_record import ImuRecord


@click.command("record")
@gather_options(
    file_argument,
    rate_option,
    *record_options,
    click.option(
        "--out",
        type=click.Path(path_type=Path, dir_okay=False),
        help="The record as .npy for a node: time, wx, wy, wz, fx, fy, fz and, where it has it, temperature, in SI.",
    ),
    json_option,
    words=RecordWords,
)
@plain_faults
def record_reader(file: Path, rate: float | None, out: Path | None, as_json: bool, words: RecordWords) -> None:
    """Say what is understood of an IMU's record: columns, units, times, gaps, readings that are none.

    Every command that takes such a record reads it so: allan, calibrate rests, and a node's replay:FILE and timed:FILE.

    \b
    Examples:
      borechain calibrate record logger.csv
      borechain calibrate record counts.npy --rate 100 --gyro '0.05 deg/s'
      borechain calibrate record raw.log --columns ax_mps2,ay_mps2,az_mps2,gx_rads,gy_rads,gz_rads --rate 100
    """
    from telemetry.records.imu_record import read_imu_record
    from telemetry.records.understood_record import understood_line, understood_object

    found = read_imu_record(file, words.to_reading(rate))
    if out is not None:
        if out.suffix != ".npy" or out.resolve() == file.resolve():
            raise InputFault(f"--out: expected another file that ends in .npy, got {out.name}")
        write_files_whole({out: node_array(found)})
    click.echo(json.dumps(understood_object(found), allow_nan=False) if as_json else understood_line(found))


def node_array(record: ImuRecord) -> bytes:
    """A record as the .npy that a node plays; a gap is a gap there too, by its times."""
    import numpy as np

    columns = [record.times()[:, None], record.triad("gyroscope"), record.triad("accelerometer")]
    if record.temperature is not None:
        columns.append(record.temperature[:, None])
    buffer = io.BytesIO()
    np.save(buffer, np.hstack(columns))
    return buffer.getvalue()
