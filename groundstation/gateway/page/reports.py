"""What is known now as a report to be signed: the wall around the hole that is drilled, or that hole alone."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Mapping
from datetime import UTC, datetime
from types import MappingProxyType

from groundstation.errors import GroundError
from groundstation.gateway.page.request_guard import RequestError
from groundstation.report.word_tables import ENGLISH, known_languages
from groundstation.service.answers.csv_tables import table_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import find_path
from groundstation.service.answers.wall_views import survey_of
from groundstation.service.hole.live_wall import Neighbourhood

SUBJECTS = ("wall", "hole")
PAPERS = {
    "language": "code of its language, en by default", "document": "number of the document",
    "revision": "of the document", "contractor": "company that surveyed",
}  # fmt: skip
LONGEST = 80  # characters
NOTHING_ASKED: Mapping[str, str] = MappingProxyType({})
REPORT_WITHIN_S = 20.0  # that one takes on a slow machine, the first after a start
Inputs = list[tuple[str, str]]


class ReportTypesetter:
    """Sets one report at a time, beside the loop that drives the ground station.

    Parameters
    ----------
    model : of the rig
    software : name and version, for the report
    """

    def __init__(self, model: RigModel, software: str) -> None:
        self._model, self._software = model, software
        self._is_busy = False

    async def pdf(self, subject: str, asked: Mapping[str, str] = NOTHING_ASKED) -> tuple[str, bytes]:
        """Name and bytes of the PDF about ``subject``; ``asked`` by the names of ``PAPERS``.

        Raises
        ------
        RequestError
            When there is no such report, or not now.
        """
        wall, papers = self._model.wall, papers_of(asked)
        if subject not in SUBJECTS:
            raise RequestError(404, f"report: expected {' or '.join(SUBJECTS)}, got {subject!r:.40}")
        if wall is None:
            raise RequestError(404, "report: this rig has no wall; see --wall and --hole of borechain ground")
        if self._is_busy:
            raise RequestError(503, "another report is being made", retry_after=REPORT_WITHIN_S)
        found = wall.judged(survey_of(self._model), self._model.string.bit)
        stations = find_path(self._model, "stations")
        text = table_of("stations", stations.fields, stations.show(self._model, {}))
        inputs = [*wall.inputs, ("the stations of this rig", hashlib.sha256(text.encode()).hexdigest())]
        self._is_busy = True
        try:
            made = await asyncio.to_thread(
                report_of, found, wall.hole if subject == "hole" else None, inputs, self._software, papers
            )
        except GroundError as error:
            raise RequestError(409, str(error)) from error
        except ImportError as error:
            raise RequestError(501, f"report: {error.name} is missing; install borechain[ground]") from error
        finally:
            self._is_busy = False
        return f"{wall.hole}-{subject}.pdf", made


def papers_of(asked: Mapping[str, str]) -> dict[str, str]:
    """What is asked of the papers of a report, by the names of ``ReportPapers``.

    Raises
    ------
    RequestError
        When there is no such parameter or language, or a text is longer than a line of a report.
    """
    for name, text in asked.items():
        if name not in PAPERS:
            raise RequestError(400, f"parameter {name[:40]}: expected one of {', '.join(PAPERS)}")
        if len(text) > LONGEST or not text.isprintable():
            raise RequestError(400, f"parameter {name}: expected one line of at most {LONGEST} characters")
    if asked.get("language", ENGLISH) not in known_languages():
        raise RequestError(
            400, f"parameter language: expected one of {', '.join(known_languages())}, got {asked['language']!r:.20}"
        )
    return {"number" if name == "document" else name: text for name, text in asked.items()}


def report_of(
    found: Neighbourhood, hole: str | None, inputs: Inputs, software: str, papers: Mapping[str, str] = NOTHING_ASKED
) -> bytes:
    """PDF of a wall as judged, or of one hole of it, dated today (UTC).

    Raises
    ------
    SurveyError, ReportError
        When nothing can be judged yet, or the report cannot be set.
    """
    from groundstation.errors import SurveyError
    from groundstation.report.document import Origin, ReportPapers, report_pdf
    from groundstation.report.wall_report import report_on

    if found.judgement is None:
        raise SurveyError(f"report: nothing to report yet: {found.problem}")
    digests = [(f"SHA-256 of {name}", digest) for name, digest in inputs]
    origin = Origin(datetime.now(UTC).date(), software, digests, ReportPapers(**papers))
    return report_pdf(report_on(found.wall, found.judgement, hole, origin))
