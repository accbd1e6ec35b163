"""Reports as PDF: facts, a verdict, sections with tables and figures, where it all comes from, room to sign.

Pure: the same document gives the same bytes, wherever it is made. The day and the digests of what was read are given.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, Literal

import typst

from groundstation.errors import GroundError

TEMPLATE = Path(__file__).with_name("report.typ")
SIGNED_BY = ("Surveyed", "Checked", "Accepted for the client")
Facts = Sequence[tuple[str, str]]


class ReportError(GroundError, RuntimeError):
    """The report could not be set; nothing was written."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Sources of a report: the day, the software, and every input by name with its SHA-256."""

    day: date
    software: str
    inputs: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class ReportSection:
    """One heading: words, facts, a table of finished text (``marked`` rows stand out) and a figure as SVG."""

    title: str
    words: Sequence[str] = ()
    facts: Facts = ()
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    marked: Sequence[int] = ()
    figure: str | None = None
    new_page: bool = False


@dataclass(frozen=True, slots=True)
class Document:
    """A whole report; ``good`` is how the verdict is drawn."""

    kind: str
    title: str
    subject: str
    verdict: str
    good: bool
    facts: Facts
    sections: Sequence[ReportSection]
    origin: Origin
    signed_by: Sequence[str] = SIGNED_BY


def report_pdf(document: Document) -> bytes:
    """PDF of a report.

    Raises
    ------
    ReportError
        When it cannot be set.
    """
    return _set(document, "pdf")[0]


def report_pages(document: Document, ppi: float = 110.0) -> list[bytes]:
    """The pages as PNG; errors as ``report_pdf``."""
    return _set(document, "png", ppi)


def _set(document: Document, form: Literal["pdf", "png"], ppi: float | None = None) -> list[bytes]:
    content = asdict(document) | {"day": document.origin.day.isoformat()}
    content["origin"] = {"software": document.origin.software, "inputs": [list(i) for i in document.origin.inputs]}
    day = document.origin.day
    stamp = datetime(day.year, day.month, day.day, tzinfo=UTC)
    try:
        made: Any = typst.compile(
            TEMPLATE, format=form, ppi=ppi, sys_inputs={"data": json.dumps(content)}, ignore_system_fonts=True,
            timestamp=stamp,
        )  # fmt: skip
    except typst.TypstError as error:
        raise ReportError(f"report: {error.message}") from error
    return made if isinstance(made, list) else [made]
