"""``borechain pki sign`` and ``verify``: reports with the signature of a person's certificate."""

from __future__ import annotations

import datetime
from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.whole_files import write_whole
from telemetry.bounded_bytes import bounded_bytes
from telemetry.runtime.command_line import InputFault

CHANGED = 3  # exit status
report_argument = click.argument("report", type=click.Path(path_type=Path, dir_okay=False))


@click.command()
@report_argument
@click.option(
    "--certificate",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="Of who signs, NAME.pem as borechain pki person makes it; NAME.key lies beside it.",
)
@click.option(
    "--out", type=click.Path(path_type=Path, dir_okay=False), help="The signed report.  [default: REPORT itself]"
)
@plain_faults
def sign(report: Path, certificate: Path, out: Path | None) -> None:
    """Sign REPORT, a .pdf file of a hole, a column, a wall or a certificate, once you have read it.

    The signature goes into the file, where other readers of PDF show it too; several persons may sign one after the
    other. After that every changed byte is told.

    \b
    Example:
      borechain pki sign K021.pdf --certificate stick/anna.pem
    """
    from borechain.pki.report_signature import sign_report
    from telemetry.errors import KeyFileError

    now = datetime.datetime.now(datetime.UTC).replace(microsecond=0)
    try:
        signed = sign_report(read_report(report), certificate, now)
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    write_whole(out or report, signed)
    click.echo(f"{out or report}: signed by {certificate.stem}")


@click.command()
@report_argument
@click.option(
    "--authority",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="Certificate of the rig's authority, ca.pem of its folder of keys.",
)
@click.pass_context
@plain_faults
def verify(context: click.Context, report: Path, authority: Path) -> None:
    """Say who signed REPORT and whether a byte of it was changed since; exit status 3 where it was, or none signed.

    \b
    Example:
      borechain pki verify K021.pdf --authority stick/ca.pem
    """
    from borechain.pki.pdf_revisions import SignedFileError
    from borechain.pki.report_signature import verify_report
    from telemetry.errors import KeyFileError

    content = read_report(report)
    try:
        signers = verify_report(content, authority)
    except SignedFileError as error:
        click.echo(f"{report}: NOT GOOD: {error}", err=True)
        context.exit(CHANGED)
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    for signer in signers:
        click.echo(
            f"{report}: signed by {signer.name} at {signer.at:%Y-%m-%d %H:%M:%S} UTC, certificate {signer.serial:x}"
        )


def read_report(path: Path) -> bytes:
    """Bytes of a report.

    Raises
    ------
    InputFault
        When it cannot be read or is larger than any report.
    """
    try:
        return bounded_bytes(path)
    except OSError as error:
        raise InputFault(f"{path}: {error.strerror}; expected a report, a .pdf file") from error
