"""Reports as PDF: facts, a verdict, sections with tables and figures, where it all comes from, room to sign.

Pure: the same document gives the same bytes, wherever it is made. The day and the digests of what was read are given.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, Literal

import typst

from groundstation.errors import GroundError
from groundstation.report.word_tables import ENGLISH, NOT_STATED, labels_of, word_table

TEMPLATE = Path(__file__).with_name("report.typ")
SIGNED_BY = ("Surveyed", "Checked", "Accepted for the client")
AS_BUILT = "as built"  # subject of what has no project
LABELS = {"day": "Date", "sources": "What this rests on", "software": "Software", "sign": "name, date, signature"}
TRANSLATED = ("kind", "title", "verdict", "signed_by")
TRANSLATED_OF_SECTIONS = ("title", "words", "columns")
Facts = Sequence[tuple[str, str]]


class ReportError(GroundError, RuntimeError):
    """The report could not be set; nothing was written."""


@dataclass(frozen=True, slots=True)
class ReportPapers:
    """What the books say of a document: its number and revision, who made it and for whom, its language and logo."""

    number: str = ""
    revision: str = ""
    contractor: str = ""
    client: str = ""
    language: str = ENGLISH
    logo: str = ""  # an SVG

    def facts(self) -> list[tuple[str, str]]:
        """Lines at the top of every report."""
        told = (("Document", self.number), ("Revision", self.revision), ("Contractor", self.contractor))
        return [(name, text or NOT_STATED) for name, text in told]


@dataclass(frozen=True, slots=True)
class Origin:
    """Sources of a report: the day, the software, every input by name with its SHA-256, and its papers."""

    day: date
    software: str
    inputs: Sequence[tuple[str, str]]
    papers: ReportPapers = field(default_factory=ReportPapers)


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


def document_content(document: Document) -> dict[str, Any]:
    """What the template sets, in the document's language; errors as ``word_table``."""
    origin, papers = document.origin, document.origin.papers
    content = asdict(document) | {"day": origin.day.isoformat()}
    content["facts"] = [*papers.facts(), *content["facts"]]
    content["origin"] = {"software": origin.software, "inputs": [list(i) for i in origin.inputs]}
    words = word_table(papers.language)
    content |= {name: words.every(content[name]) for name in TRANSLATED} | {"facts": words.facts(content["facts"])}
    content["origin"]["inputs"] = words.rows(content["origin"]["inputs"])
    for section in content["sections"]:
        section |= {name: words.every(section[name]) for name in TRANSLATED_OF_SECTIONS}
        section |= {"facts": words.facts(section["facts"]), "rows": words.rows(section["rows"])}
    if content["subject"] == AS_BUILT:
        content["subject"] = words.text(AS_BUILT)
    labels = labels_of(LABELS, papers.language)
    return content | {"labels": labels, "language": papers.language, "logo": papers.logo or None}


def _set(document: Document, form: Literal["pdf", "png"], ppi: float | None = None) -> list[bytes]:
    content = document_content(document)
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
