"""What is known now as a file of another program: the hole that is drilled, or the wall around it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from datetime import UTC, date, datetime

from groundstation.errors import SurveyError
from groundstation.gateway.page.request_guard import RequestError
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import find_path
from groundstation.service.answers.wall_views import survey_of
from groundstation.survey.exports.export_hole import ExportSite
from groundstation.survey.exports.export_request import FORMATS, exported_bytes, site_of_wall
from groundstation.survey.exports.live_hole import place_of_text, site_of_live

EXPORTED = ("hole", "wall")
PARAMETERS = ("origin", "grid_crs")
MEDIA = {
    "ags": "text/csv", "diggs": "application/xml", "dxf": "image/vnd.dxf", "geojson": "application/geo+json",
    "ifc": "application/x-step", "las": "text/plain", "witsml": "application/xml",
}  # fmt: skip
ENDINGS = {"diggs": "diggs.xml", "witsml": "witsml.xml"}  # where it is not the name of the format


async def live_export(model: RigModel, what: str, form: str, asked: Mapping[str, str]) -> tuple[str, str, bytes]:
    """Name, media type and bytes of a file; ``asked`` are ``PARAMETERS``.

    Raises
    ------
    RequestError
        When there is no such file, or not yet.
    """
    if what not in EXPORTED:
        raise RequestError(404, f"export: expected {' or '.join(EXPORTED)}, got {what!r:.40}")
    if form not in FORMATS:
        raise RequestError(404, f"export: expected a format of {', '.join(FORMATS)}, got {form!r:.40}")
    if unknown := [name for name in asked if name not in PARAMETERS]:
        raise RequestError(400, f"parameter {unknown[0][:40]}: expected one of {', '.join(PARAMETERS)}")
    try:
        site, hole = live_site(model, what, asked, datetime.now(UTC).date())
        made = await asyncio.to_thread(exported_bytes, site, form, hole)
    except SurveyError as error:
        raise RequestError(409, str(error)) from error
    except ImportError as error:
        raise RequestError(501, f"export: {error.name} is missing; install borechain[files]") from error
    name = model.config.hole or model.config.rig
    return f"{name}-{what}.{ENDINGS.get(form, form)}", MEDIA[form], made


def live_site(
    model: RigModel, what: str, asked: Mapping[str, str], day: date
) -> tuple[ExportSite, str | None]:  # fmt: skip
    """What is exported, and which hole of it alone: of a rig with a wall that hole with its head and its verdict.

    Raises
    ------
    SurveyError, RequestError
        When it is not known yet, or the rig has no wall.
    """
    wall = model.wall
    if wall is None and what == "wall":
        raise RequestError(404, "export: this rig has no wall; see --wall and --hole of borechain ground")
    if wall is None:
        place = place_of_text(asked.get("origin", ""), asked.get("grid_crs", ""))
        trajectory, column = (find_path(model, path).show(model, {}) for path in ("trajectory", "column"))
        return site_of_live(model.config.rig, trajectory, column, place, day), None
    if "origin" in asked:
        raise SurveyError("--origin: the wall's file says where its zero stands")
    found = wall.judged(survey_of(model), model.string.bit)
    if found.judgement is None:
        raise SurveyError(f"export: nothing to export yet: {found.problem}")
    site = site_of_wall(found.wall, found.judgement, day, asked.get("grid_crs", ""))
    return site, wall.hole if what == "hole" else None
