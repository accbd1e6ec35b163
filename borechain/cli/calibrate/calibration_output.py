"""What every calibration command shares: its files, which land whole or not at all, and what it prints."""

from __future__ import annotations

import contextlib
import datetime
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain import __version__
from borechain.cli.console_tables import table_console
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.report_options import LANGUAGES
from borechain.cli.shared_options import json_option
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix
from groundstation.report.calibrations.calibration_request import UNITS
from telemetry.runtime.command_line import check_installed

if TYPE_CHECKING:
    from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
    from groundstation.report.calibrations.calibration_request import CalibrationRequest
    from groundstation.report.sheet import Sheet

file_argument = click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
full_scale_option = click.option(
    "--full-scale",
    type=click.FloatRange(0.0, min_open=True),
    default=1e30,
    help="Range of the sensor, in the unit of its readings; a saturated reading is refused.",
)
force_option = click.option(
    "--force", is_flag=True, help="Land a calibration that a gate refuses; its file and certificate say so."
)
PATH = click.Path(path_type=Path, dir_okay=False)
output_options = (
    click.option("--out", type=PATH, help="Result as a .json file, with the record it was made from."),
    click.option("--plot", type=PATH, help="Figures as .svg, .png or .pdf."),
    click.option("--certificate", type=PATH, help="Certificate as PDF."),
    click.option("--date", type=click.DateTime(["%Y-%m-%d"]), help="Day of the calibration.  [default: today, UTC]"),
    click.option("--subject", help="What was calibrated, for the certificate.  [default: name of FILE]"),
    click.option("--serial", default="", help="Serial number of what was calibrated, for the certificate."),
    click.option("--number", default="", help="Number of the certificate."),
    click.option("--due", type=click.DateTime(["%Y-%m-%d"]), help="Day of the next calibration, for the certificate."),
    click.option(
        "--language", type=click.Choice(LANGUAGES), default="en", show_default=True, help="Of the certificate."
    ),
    json_option,
)  # of WantedFiles
landing_options = (full_scale_option, force_option, *output_options)  # of a calibration that gates may refuse
unit_option = click.option(
    "--unit", type=click.Choice(list(UNITS)), default="deg/s", show_default=True, help="Unit of FILE."
)


@dataclass(frozen=True, slots=True)
class WantedFiles:
    """Files to write and how to print."""

    file: Path
    out: Path | None
    plot: Path | None
    certificate: Path | None
    date: datetime.datetime | None
    subject: str | None
    as_json: bool
    serial: str = ""
    number: str = ""
    due: datetime.datetime | None = None
    language: str = "en"

    @property
    def day(self) -> datetime.date:
        """Day of the calibration, that of today in UTC by default."""
        return (self.date or datetime.datetime.now(datetime.UTC)).date()

    @property
    def papers(self) -> tuple[tuple[str, str], ...]:
        """What the laboratory's books say of the certificate, as far as it is told."""
        due = self.due.date().isoformat() if self.due is not None else ""
        told = (("Certificate", self.number), ("Serial number", self.serial), ("Next due", due))
        return tuple((name, text) for name, text in told if text)

    def check(self, *more: Path) -> None:
        """Refuse paths that cannot be meant, and what is not installed, before anything is computed."""
        paths = [self.file, *more, *filter(None, (self.out, self.plot, self.certificate))]
        if len({path.resolve() for path in paths}) < len(paths):
            raise InputFault("expected different files for the record, --out, --plot and --certificate")
        if self.due is not None and self.due.date() <= self.day:
            raise InputFault(f"--due: expected a day after that of the calibration, {self.day}, got {self.due.date()}")
        check_suffix("--plot", self.plot, *PLOT_FORMATS)
        check_suffix("--certificate", self.certificate, ".pdf")
        for path in (self.out, *more):
            check_suffix("--out", path, ".json")
        if self.plot is not None or self.certificate is not None:
            check_installed("matplotlib", "typst")


def deliver_calibration(request: CalibrationRequest, wanted: WantedFiles, gyroscope_out: Path | None = None) -> None:
    """Calibrate, make every file, land them all, then print; ``gyroscope_out`` of a record of two sensors."""
    from borechain import api

    wanted.check(*filter(None, (gyroscope_out,)))
    day = wanted.day
    outcome = api.calibrate(request, day)
    files: dict[Path, bytes] = {}
    if wanted.out is not None:
        files[wanted.out] = outcome.document.encode()
    if gyroscope_out is not None:
        if outcome.gyroscope_document is None:
            raise InputFault(f"--gyroscope-out: {outcome.result['why_no_gyroscope']}")
        files[gyroscope_out] = outcome.gyroscope_document.encode()
    if wanted.plot is not None or wanted.certificate is not None:
        files |= rendered_files(outcome, wanted, day)
    write_files_whole(files)
    if wanted.as_json:
        click.echo(json.dumps(outcome.result, allow_nan=False))
    else:
        show_sheet(outcome.sheet, list(files))


def rendered_files(outcome: CalibrationOutcome, wanted: WantedFiles, day: datetime.date) -> dict[Path, bytes]:
    """Plot and certificate."""
    from groundstation.report.certificate import Identity, certificate_pdf
    from groundstation.report.figure_panels import render_panels

    panels, files = outcome.panels(), {}
    if wanted.plot is not None:
        files[wanted.plot] = render_panels(panels, wanted.plot.suffix[1:])
    if wanted.certificate is not None:
        subject, record = wanted.subject or wanted.file.stem, wanted.file
        hashes = (outcome.record_sha256, outcome.block_sha256)
        identity = Identity(subject, day, record.name, *hashes, __version__, wanted.papers, wanted.language)
        files[wanted.certificate] = certificate_pdf(outcome.sheet, panels, identity)
    return files


def write_files_whole(files: dict[Path, bytes]) -> None:
    """Write drafts of all files and rename them only when every one is on the disk."""
    drafts = {path: path.with_name(f".{path.name}.{os.getpid()}.draft") for path in files}
    landed: list[str] = []
    path = Path()
    try:
        for path, content in files.items():
            with drafts[path].open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        for path, draft in drafts.items():
            draft.replace(path)
            landed.append(str(path))
    except OSError as error:
        told = f"already written: {', '.join(landed)}" if landed else "nothing was written"
        raise EnvironmentFault(f"{path}: {error.strerror}; {told}") from error
    finally:
        for draft in drafts.values():
            with contextlib.suppress(OSError):
                draft.unlink()


def show_sheet(sheet: Sheet, files: Sequence[Path]) -> None:
    """Print a sheet for people."""
    from rich.table import Table

    paper = table_console(110)
    paper.print(sheet.title, style="bold")
    for name, value in sheet.facts:
        paper.print(f"{name:24} {value}", soft_wrap=True, highlight=False)
    for given in sheet.tables:
        table = Table(title=given.title, title_justify="left")
        for k, column in enumerate(given.columns):
            table.add_column(column, justify="right" if k else "left")
        for row in given.rows:
            table.add_row(*row)
        paper.print(table)
    for warning in sheet.warnings:
        paper.print(f"warning: {warning}", style="yellow", soft_wrap=True, highlight=False)
    for path in files:
        paper.print(f"wrote {path}", soft_wrap=True, highlight=False)
