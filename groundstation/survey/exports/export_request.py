"""What is exported: a hole of a survey, or the columns of a wall, in one of the formats."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.exports.ags_export import ags_bytes
from groundstation.survey.exports.diggs_export import diggs_bytes
from groundstation.survey.exports.dxf_export import dxf_bytes
from groundstation.survey.exports.export_hole import ExportHole, ExportSite
from groundstation.survey.exports.geojson_export import geojson_bytes
from groundstation.survey.exports.ifc_export import ifc_bytes
from groundstation.survey.exports.las_export import las_bytes
from groundstation.survey.exports.witsml_export import witsml_bytes
from groundstation.survey.requests.site_place import site_words
from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_verdict import OPEN, Judgement
from groundstation.survey.well.methods import station_positions

if TYPE_CHECKING:
    from groundstation.survey.requests.survey_answer import SurveyAnswer

FORMATS: dict[str, Callable[[ExportSite], bytes]] = {
    "ags": ags_bytes, "diggs": diggs_bytes, "dxf": dxf_bytes, "geojson": geojson_bytes, "ifc": ifc_bytes,
    "las": las_bytes, "witsml": witsml_bytes,
}  # fmt: skip
ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # east, north, up of north, east, down


def site_of_survey(answer: SurveyAnswer, name: str, day: datetime.date) -> ExportSite:
    """The hole of a survey."""
    found = answer.found
    grid = found.frame.grid
    axis = found.positions @ ENU.T if grid is None else grid.of_places(found.positions)[:, [1, 0, 2]]
    hole = ExportHole(
        name, found.md, np.degrees(found.record.inclination), np.degrees(found.azimuth) % 360.0, found.positions, axis,
        found.uncertainty.cov, north=found.frame.answer, magnetic=answer.tool.asks_for("BField"),
    )  # fmt: skip
    warnings = [f"WARNING {row['text']}" for row in answer.result["warnings"]]
    remarks = (f"instrument {answer.instrument}", site_words(answer.result["site"]), *warnings)
    crs = "" if grid is None else answer.request.site.grid_crs or ""
    return ExportSite(name, (hole,), crs=crs, remarks=remarks, day=day.isoformat())


def site_of_wall(wall: Wall, judgement: Judgement, day: datetime.date, crs: str = "") -> ExportSite:
    """Columns of a wall that were surveyed, each with the verdict of the joints that it is part of.

    Raises
    ------
    SurveyError
        When none was surveyed.
    """
    holes = []
    for k, (plan, survey) in enumerate(zip(wall.plans, wall.holes, strict=True)):
        if not len(survey.md):
            continue
        local = station_positions(wall.file.assumed.method, survey.md, survey.inclination, survey.azimuth)
        places = np.array(plan.design.head) + local
        grid = wall.file.grid
        axis = places @ ENU.T if grid is None else grid.of_places(places)[:, [1, 0, 2]]
        design = plan.design.points_at(survey.md[-1:])[0] - np.array(plan.design.head)
        holes.append(
            ExportHole(
                plan.design.name, survey.md, np.degrees(survey.inclination), np.degrees(survey.azimuth) % 360.0, local,
                axis, survey.covs, plan.design.radius, _verdict(wall, judgement, k), wall.file.north,
                (local[-1] - design)[:2], plan.tool.asks_for("BField"),
            )
        )  # fmt: skip
    if not holes:
        raise SurveyError(f"{wall.file.path}: no column was surveyed; nothing is to be exported")
    remarks = tuple(f"WARNING {warning.text}" for warning in wall.warnings)
    return ExportSite(
        wall.file.name, tuple(holes), judgement.verdict.value, crs if wall.file.grid is not None else "", remarks,
        day.isoformat(), wall.file.project, wall.file.client,
    )  # fmt: skip


def _verdict(wall: Wall, judgement: Judgement, k: int) -> str:
    """Worst finding of a column, of its joints and of the columns at their other ends; a tight one has none."""
    beside = {k, *wall.pairs[np.any(wall.pairs == k, axis=1)].ravel().tolist()}
    names = [wall.plans[n].design.name for n in beside]
    own = wall.plans[k].design.name
    mine = {finding.kind for finding in judgement.findings if finding.what in (*names, "wall") or finding.is_about(own)}
    if mine & set(OPEN):
        return "not tight"
    return "not proven" if mine else "tight"


def exported_bytes(site: ExportSite, form: str, hole: str | None = None) -> bytes:
    """File of a format; of one hole where it is named.

    Raises
    ------
    SurveyError
        When the format or the hole is not known, a number is none, or the format cannot say it.
    """
    if form not in FORMATS:
        raise SurveyError(f"--format: expected one of {', '.join(FORMATS)}, got {form!r}")
    if hole is not None:
        some = tuple(one for one in site.holes if one.name == hole)
        if not some:
            raise SurveyError(f"--hole {hole}: expected one of {', '.join(one.name for one in site.holes)}")
        site = replace(site, holes=some)
    for one in site.holes:
        if not all(math.isfinite(x) for x in one.axis.ravel().tolist()):
            raise SurveyError(f"{one.name}: its axis has no numbers to export")
    return FORMATS[form](site.in_plain_lines())
