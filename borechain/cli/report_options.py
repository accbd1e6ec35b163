"""Options that every report shares: what the books say of the document, its language and logo."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.faults import InputFault
from telemetry.bounded_bytes import bounded_bytes
from telemetry.runtime.typed_options import Option

if TYPE_CHECKING:
    from groundstation.report.document import ReportPapers

LANGUAGES = ("en", "de", "es", "fr", "it")
LARGEST_LOGO = 1 << 20  # bytes


def paper_options() -> tuple[Option, ...]:
    """Options of ``PaperRequest``."""
    return (
        click.option("--document", default="", help="Number of the document, for --report."),
        click.option("--revision", default="", help="Revision of the document."),
        click.option("--contractor", default="", help="Company that surveyed, for --report."),
        click.option("--language", type=click.Choice(LANGUAGES), default="en", show_default=True, help="Of --report."),
        click.option("--logo", type=click.Path(path_type=Path, dir_okay=False), help="An .svg file, for --report."),
    )


@dataclass(frozen=True, slots=True)
class PaperRequest:
    """What the books say of a document, as its options take it."""

    document: str
    revision: str
    contractor: str
    language: str
    logo: Path | None

    def to_papers(self, client: str = "") -> ReportPapers:
        """Papers with the logo read.

        Raises
        ------
        InputFault
            When the logo is no SVG of at most 1 MiB.
        """
        from groundstation.report.document import ReportPapers

        logo = "" if self.logo is None else logo_text(self.logo)
        return ReportPapers(self.document, self.revision, self.contractor, client, self.language, logo)


def logo_text(path: Path) -> str:
    """Text of a logo; errors as ``to_papers``."""
    try:
        text = bounded_bytes(path, LARGEST_LOGO).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputFault(f"--logo {path}: {getattr(error, 'strerror', None) or 'not a text'}") from error
    if "<svg" not in text[:2000]:
        raise InputFault(f"--logo {path}: expected an SVG of at most {LARGEST_LOGO >> 20} MiB")
    return text
