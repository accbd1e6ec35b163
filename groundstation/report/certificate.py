"""Calibration certificates as PDF: the same sheet and date give the same bytes, wherever they are made."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, Literal

import typst

from groundstation.errors import GroundError
from groundstation.report.figure_panels import Panel, render_panels
from groundstation.report.sheet import Sheet
from groundstation.report.word_tables import ENGLISH, labels_of, word_table

LABELS = {
    "kind": "Calibration certificate", "day": "Date", "record": "Record", "record_hash": "SHA-256 of the record",
    "block_hash": "SHA-256 of the block", "software": "Software", "warning": "Warning",
}  # fmt: skip
TEMPLATE = Path(__file__).with_name("certificate.typ")


class CertificateError(GroundError, RuntimeError):
    """The certificate could not be set; nothing was written."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Subject and sources of a calibration: words, day, record with its hash, hash of the block, software.

    ``papers`` are names and texts of the laboratory's books: number of the certificate, serial number, next due day.
    """

    subject: str
    day: date
    record: str
    record_sha256: str
    block_sha256: str | None
    software: str
    papers: tuple[tuple[str, str], ...] = ()
    language: str = ENGLISH


def template_data(sheet: Sheet, panels: Sequence[Panel], identity: Identity) -> str:
    """Everything the template sets, as JSON, in the language of its identity; figures as SVG text."""
    words = word_table(identity.language)
    say = words.every
    return json.dumps(
        {
            "labels": labels_of(LABELS, identity.language),
            "language": identity.language,
            "title": say(sheet.title),
            "subject": identity.subject,
            "day": identity.day.isoformat(),
            "record": identity.record,
            "record_sha256": identity.record_sha256,
            "block_sha256": identity.block_sha256,
            "software": identity.software,
            "papers": words.facts(identity.papers),
            "facts": words.facts(sheet.facts),
            "warnings": say(sheet.warnings),
            "tables": [
                {"title": say(t.title), "columns": say(list(t.columns)), "rows": words.rows(t.rows)}
                for t in sheet.tables
            ],
            "figures": [
                {"caption": say(panel.caption), "svg": render_panels([panel], "svg", identity.language).decode()}
                for panel in panels
            ],
        }
    )


def typeset_pdf(data: str, day: date) -> bytes:
    """PDF of the JSON of ``template_data``; ``day`` is the document's date."""
    return _compiled(data, day, "pdf")[0]


def typeset_png_pages(data: str, day: date, ppi: float = 110.0) -> list[bytes]:
    """The pages as PNG."""
    return _compiled(data, day, "png", ppi)


def certificate_pdf(sheet: Sheet, panels: Sequence[Panel], identity: Identity) -> bytes:
    """PDF of a sheet and its figures."""
    return typeset_pdf(template_data(sheet, panels, identity), identity.day)


def _compiled(data: str, day: date, form: Literal["pdf", "png"], ppi: float | None = None) -> list[bytes]:
    stamp = datetime(day.year, day.month, day.day, tzinfo=UTC)
    try:
        made: Any = typst.compile(
            TEMPLATE, format=form, ppi=ppi, sys_inputs={"data": data}, ignore_system_fonts=True, timestamp=stamp
        )
    except typst.TypstError as error:
        raise CertificateError(f"certificate: {error.message}") from error
    return made if isinstance(made, list) else [made]
