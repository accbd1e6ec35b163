"""``borechain calibrate apply``: a record in time with its calibration, beside what it was before."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.calibrate.calibration_output import file_argument, write_files_whole
from borechain.cli.calibrate.record_options import rate_option, record_options
from borechain.cli.console_tables import table_console
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix
from groundstation.report.calibrations.calibration_request import STANDARD_GRAVITY, RecordWords
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from groundstation.calibration.applied_series import AppliedSeries

PATH = click.Path(path_type=Path, dir_okay=False)
COLUMNS = {"gyroscope": "g{}_rads", "accelerometer": "a{}_mps2", "magnetometer": "m{}_t"}


@click.command()
@gather_options(
    file_argument,
    rate_option,
    *record_options,
    click.option(
        "--calibration",
        "calibrations",
        type=PATH,
        multiple=True,
        required=True,
        help="A .json file of borechain calibrate, one a sensor. Repeatable.",
    ),
    click.option(
        "--gravity",
        type=click.FloatRange(9.7, 9.9),
        default=STANDARD_GRAVITY,
        show_default=True,
        help="Gravity of the place, m/s2.",
    ),
    click.option("--out", type=PATH, help="The calibrated readings as .csv, in SI, which every command reads."),
    click.option("--plot", type=PATH, help="Every axis before and after, as .svg, .png or .pdf."),
    json_option,
    words=RecordWords,
)
@plain_faults
def apply(
    file: Path,
    rate: float | None,
    calibrations: tuple[Path, ...],
    gravity: float,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
    words: RecordWords,
) -> None:
    """Apply calibrations to a record of an IMU in time, and say what they change: the readings before and after.

    Of a sensor at rest the length of each reading is known: gravity of an accelerometer, nothing of a gyroscope.

    \b
    Example:
      borechain calibrate apply logger.csv --calibration accelerometer.json --calibration gyroscope.json --plot both.svg
    """
    from groundstation.calibration.applied_series import apply_calibration
    from groundstation.calibration.block import read_calibration
    from telemetry.records.imu_record import read_imu_record

    _check_paths([file, *calibrations], out, plot)
    blocks = [read_calibration(path) for path in calibrations]
    if len({block.sensor for block in blocks}) < len(blocks):
        raise InputFault("--calibration: expected one a sensor, got two of the same")
    record = read_imu_record(file, words.to_reading(rate))
    found = [apply_calibration(record, block) for block in blocks]
    files = {} if out is None else {out: _table_of(found)}
    if plot is not None:
        from groundstation.report.calibration_plots import series_panels
        from groundstation.report.figure_panels import render_panels

        files[plot] = render_panels(series_panels(found), plot.suffix[1:])
    write_files_whole(files)
    rows = [row for series in found for row in _rows_of(series, gravity)]
    if as_json:
        click.echo(json.dumps({"sensors": rows, "readings": len(found[0].times)}))
    else:
        _show(rows, list(files))


def _check_paths(read: Sequence[Path], out: Path | None, plot: Path | None) -> None:
    written = [path for path in (out, plot) if path is not None]
    if len({path.resolve() for path in (*read, *written)}) < len(read) + len(written):
        raise InputFault("expected different files for the record, --calibration, --out and --plot")
    check_suffix("--out", out, ".csv")
    check_suffix("--plot", plot, *PLOT_FORMATS)


def _rows_of(series: AppliedSeries, gravity: float) -> list[dict[str, Any]]:
    """Figures of a sensor before and after."""
    from groundstation.calibration.applied_series import UNITS, series_figures

    rows = []
    for when, readings in (("before", series.before), ("after", series.after)):
        figures = series_figures(series.sensor, readings, gravity)
        off = figures.off if figures.off == figures.off else None
        row = {"sensor": series.sensor, "unit": UNITS[series.sensor], "when": when}
        rows.append(row | {"mean": figures.mean.tolist(), "std": figures.std.tolist(), "off": off})
    return rows


def _table_of(found: Sequence[AppliedSeries]) -> bytes:
    """Times and calibrated readings as CSV."""
    import numpy as np

    names = [COLUMNS[series.sensor].format(axis) for series in found for axis in "xyz"]
    values = np.hstack([found[0].times[:, None], *(series.after for series in found)])
    text = io.StringIO()
    np.savetxt(text, values, fmt="%.10g", delimiter=",", header=",".join(["time_s", *names]), comments="")
    return text.getvalue().encode()


def _show(rows: Sequence[dict[str, Any]], files: Sequence[Path]) -> None:
    """Table for people."""
    from rich.table import Table

    paper, table = table_console(100), Table()
    for name in ("sensor", "", "mean x", "y", "z", "std x", "y", "z", "off", "unit"):
        table.add_column(name, justify="left" if name in ("sensor", "", "unit") else "right")
    for row in rows:
        numbers = [f"{value:.4g}" for value in (*row["mean"], *row["std"])]
        off = "" if row["off"] is None else f"{row['off']:.4g}"
        table.add_row(row["sensor"], row["when"], *numbers, off, row["unit"])
    paper.print(table)
    for path in files:
        paper.print(f"wrote {path}", soft_wrap=True, highlight=False)
