"""What is known now as a report to be signed: the wall around the hole that is drilled, or that hole alone."""

from __future__ import annotations

import asyncio
import hashlib
from datetime import UTC, datetime

from groundstation.errors import GroundError
from groundstation.gateway.page.request_guard import RequestError
from groundstation.service.answers.csv_tables import table_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import find_path
from groundstation.service.answers.wall_views import survey_of
from groundstation.service.hole.live_wall import Neighbourhood

SUBJECTS = ("wall", "hole")
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

    async def pdf(self, subject: str) -> tuple[str, bytes]:
        """Name and bytes of the PDF about ``subject``.

        Raises
        ------
        RequestError
            When there is no such report, or not now.
        """
        wall = self._model.wall
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
                report_of, found, wall.hole if subject == "hole" else None, inputs, self._software
            )
        except GroundError as error:
            raise RequestError(409, str(error)) from error
        except ImportError as error:
            raise RequestError(501, f"report: {error.name} is missing; install borechain[ground]") from error
        finally:
            self._is_busy = False
        return f"{wall.hole}-{subject}.pdf", made


def report_of(found: Neighbourhood, hole: str | None, inputs: Inputs, software: str) -> bytes:
    """PDF of a wall as judged, or of one hole of it, dated today (UTC).

    Raises
    ------
    SurveyError, ReportError
        When nothing can be judged yet, or the report cannot be set.
    """
    from groundstation.errors import SurveyError
    from groundstation.report.document import Origin, report_pdf
    from groundstation.report.wall_report import report_on

    if found.judgement is None:
        raise SurveyError(f"report: nothing to report yet: {found.problem}")
    digests = [(f"SHA-256 of {name}", digest) for name, digest in inputs]
    origin = Origin(datetime.now(UTC).date(), software, digests)
    return report_pdf(report_on(found.wall, found.judgement, hole, origin))
