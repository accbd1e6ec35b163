"""Report of a wall, a shaft or a grid: verdict and reasons, columns, joints, remedies, instruments, picture."""

from __future__ import annotations

import math
from datetime import date

import numpy as np

from groundstation.errors import SurveyError
from groundstation.report.column_report import CHECKED, ColumnRecord, ReportSite, column_report, tolerance_text
from groundstation.report.document import (
    AS_BUILT,
    Document,
    Origin,
    ReportPapers,
    ReportSection,
    report_pdf,
)
from groundstation.report.figure_words import svg_in
from groundstation.report.plane_words import name_axes
from groundstation.report.plots_wall import wall_figure
from groundstation.report.word_tables import NOT_STATED
from groundstation.survey.wall.column_errors import survey_errors
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_columns import state_words
from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_joints import worst_depths, worst_joint
from groundstation.survey.wall.wall_verdict import Judgement, WallVerdict, joint_name
from groundstation.survey.well.error_columns import position_covariance
from groundstation.survey.well.error_sources import WellSurvey
from groundstation.survey.well.methods import station_positions

WORDS = {
    WallVerdict.TIGHT: "tight",
    WallVerdict.NOT_PROVEN: "not proven to be tight",
    WallVerdict.NOT_TIGHT: "NOT TIGHT",
}
CONTAINED = "errors of the instrument, setting out, how a hole runs where it was not surveyed; no mistakes"


def site_of(wall: Wall) -> ReportSite:
    """Site of a report, from the wall's file."""
    file = wall.file
    depths = file.depth_reference
    if file.depths_read_from != depths:
        height = "by column" if file.reference_height is None else f"{file.reference_height:g} m above it"
        depths = f"{depths} (stations were read from the {file.depths_read_from}, {height})"
    north = file.north
    if file.stations_north != north:
        north += f" north; stations were read from {file.stations_north}"
    return ReportSite(file.project, file.client, north, depths, file.height_datum, file.grid)


def column_records(wall: Wall, judgement: Judgement) -> list[ColumnRecord]:
    """Every column of a wall with what was found about it."""
    return [_record(wall, judgement, k) for k in range(len(wall.plans))]


def _record(wall: Wall, judgement: Judgement, k: int) -> ColumnRecord:
    plan, hole, built = wall.plans[k], wall.holes[k], wall.built
    name, count = plan.design.name, len(hole.md)
    places, covs = np.zeros((count, 3)), np.zeros((count, 3, 3))
    if count > 1:
        places = station_positions(wall.file.assumed.method, hole.md, hole.inclination, hole.azimuth)
        survey = WellSurvey(hole.md, hole.inclination, hole.azimuth, places[:, 2], hole.record)
        told = hole.covs
        covs = position_covariance(survey_errors(survey, plan.tool, wall.file.assumed)) if told is None else told
    covs = covs + plan.head_std**2 * np.diag([1.0, 1.0, 0.0])
    actions = [f.text[0].upper() + f.text[1:] + "." for f in judgement.findings if f.is_about(name)]
    actions += remedy_lines(wall, judgement, k)
    return ColumnRecord(
        plan.design, state_words(plan, built, k), plan.tool, plan.serial, plan.calibration, plan.head_std, hole.md,
        hole.inclination, hole.azimuth, np.array(plan.design.head) + places, covs,
        float(built.surveyed[k]) if built.surveyed[k] > 0.0 else math.nan,
        float(built.ends[k]) if math.isfinite(built.ends[k]) else math.nan, actions, hole.times,
        [warning.text for warning in wall.warnings if warning.what == name],
    )  # fmt: skip


def remedy_lines(wall: Wall, judgement: Judgement, of: int | None = None) -> list[str]:
    """The columns that would close open joints, in words and in the site's frame; one that closes several stands once.

    ``of`` : a column, whose joints alone count
    """
    places: dict[tuple[str, float, float, bool], list[str]] = {}
    for joint, extra in judgement.extras:
        pair = judgement.joints.pairs[joint]
        if of is not None and of not in pair:
            continue
        north, east, _ = (np.array([extra.north, extra.east, extra.from_depth]) @ wall.built.frame).tolist()
        place = f"north {north + 0.0:.3f} m, east {east + 0.0:.3f} m"
        if wall.file.grid is not None:
            northing, easting, _ = wall.file.grid.of_places(np.array([north, east, 0.0])).tolist()
            place += f" (N {northing:.3f} m, E {easting:.3f} m)"
        key = (place, extra.from_depth, extra.to_depth, extra.closes)
        places.setdefault(key, []).append(joint_name(wall.columns, pair))
    return [
        f"A column at {place} from {top:g} to {bottom:g} m {'closes' if closes else 'alone does not close'} "
        f"joint{'s' if len(names) > 1 else ''} {' and '.join(names)}."
        for (place, top, bottom, closes), names in places.items()
    ]


def report_on(wall: Wall, judgement: Judgement, column: str | None, origin: Origin) -> Document:
    """Report of the whole wall, or of one ``column`` of it by name."""
    if column is None:
        return wall_report(wall, judgement, origin)
    records = {record.design.name: record for record in column_records(wall, judgement)}
    return column_report(records[column], site_of(wall), origin)


def wall_report(wall: Wall, judgement: Judgement, origin: Origin) -> Document:
    """Report of a wall."""
    file, site, records = wall.file, site_of(wall), column_records(wall, judgement)
    whole = judgement.system
    radii = sorted({plan.design.radius for plan in wall.plans})
    facts = [
        *site.facts(),
        ("Columns and joints", f"{len(wall.plans)} columns, {len(wall.pairs)} joints, {file.layout}"),
        ("Radius of a column", f"{' and '.join(f'{r:g}' for r in radii)} m{_scatter(wall)}"),
        ("Required thickness of a joint", f"{file.thickness:g} m"),
        ("To be tight", tight_words(wall)),
        ("Tolerance", tolerance_text(file.tolerance)),
        (
            "P(anything open or too thin)",
            f"{whole.probability:.2g} (standard error {whole.standard_error:.1g}), allowed {file.allowed:g}",
        ),
        ("Site", site_text(wall)),
        ("Times of the surveys", times_words(records)),
        ("Serial and calibration of the instruments", stated_words(records)),
        ("Check of the data", check_words(wall)),
        ("What the ± contains", CONTAINED),
    ]
    joint, _ = worst_joint(judgement.joints)
    title = f"{len(wall.pairs)} joints: {WORDS[judgement.verdict].lower()}"
    extra = dict(judgement.extras).get(joint)
    words = name_axes(wall.built.frame)
    picture = wall_figure(wall.built.columns, judgement.joints, file.thickness, extra, title, words=words)
    drawn = svg_in(picture, origin.papers.language)
    sections = [
        ReportSection("Reasons", [f.text[0].upper() + f.text[1:] + "." for f in judgement.findings] or ["None."]),
        ReportSection("What is to be done", remedy_lines(wall, judgement) or ["Nothing."]),
        _instruments_section(records),
        _columns_section(records),
        _joints_section(wall, judgement),
        *_voids_sections(wall, judgement),
        *_closing_sections(wall),
        ReportSection("Joints over depth, plan, and the worst joint", figure=drawn, new_page=True),
    ]
    good = judgement.verdict is WallVerdict.TIGHT
    verdict = f"The wall is {WORDS[judgement.verdict]}"
    return Document("Wall report", file.name, site.project or AS_BUILT, verdict, good, facts, sections, origin)


def site_text(wall: Wall) -> str:
    """Gravity, and where an instrument is magnetic its field."""
    site = wall.file.assumed.site
    words = f"gravity {site.gravity:.5f} m/s^2"
    if not any(plan.tool.asks_for("BField") for plan in wall.plans):
        return words
    dip, declination = math.degrees(site.dip), math.degrees(site.declination)
    return f"{words}; field {site.b_field:.1f} nT, dip {dip:.3f} deg, declination {declination:.3f} deg"


def stated_words(records: list[ColumnRecord]) -> str:
    """Of how many surveyed columns the instrument is told, so that the first page says where it is not."""
    return _count_words([bool(r.serial and r.calibration) for r in records if math.isfinite(r.surveyed_md)])


def times_words(records: list[ColumnRecord]) -> str:
    """Of how many surveyed columns the times of the surveys are told; the report of each has them."""
    return _count_words([record.times is not None for record in records if math.isfinite(record.surveyed_md)])


def _count_words(flags: list[bool]) -> str:
    told = sum(flags)
    if told == len(flags) and flags:
        return f"stated of all {told} columns that were surveyed"
    return f"stated of {told} of {len(flags)} columns that were surveyed" if told else NOT_STATED


def check_words(wall: Wall) -> str:
    """How many values are missing, or hardly can be; each is a reason below."""
    count = len(wall.warnings)
    return f"warnings: {count}" if count else CHECKED


def tight_words(wall: Wall) -> str:
    """Depths between which the joints are to be tight."""
    ends = {f"{top:g} to {bottom:g} m" for top, bottom in wall.tight_depths.tolist()}
    return ends.pop() if len(ends) == 1 else "from the upper head to the lower toe of each joint"


def _scatter(wall: Wall) -> str:
    cv = sorted({layer.radius_cv for layer in wall.file.assumed.layers})
    if cv == [0.0]:
        return ", taken as known exactly"
    return f", coefficient of variation {' to '.join(f'{value:g}' for value in cv)}"


def _columns_section(records: list[ColumnRecord]) -> ReportSection:
    columns = (
        "column",
        "north m",
        "east m",
        "length m",
        "surveyed m",
        "dev. mm",
        "sigma mm",
        "allowed mm",
        "used",
        "at m",
    )
    rows, marked = [], []
    for k, record in enumerate(records):
        found = record.deviations() if math.isfinite(record.surveyed_md) else []
        head = (f"{record.design.head[0]:.3f}", f"{record.design.head[1]:.3f}", f"{record.design.length:g}")
        if not found:
            marked.append(k)
            rows.append((record.design.name, *head, record.state, *("–",) * 5))
            continue
        d = max(found, key=lambda d: (d.ratio if math.isfinite(d.ratio) else 0.0, d.md))
        if d.ratio >= 1.0 or min(record.drilled_md, record.surveyed_md) < record.design.length - 0.05:
            marked.append(k)
        numbers = (f"{1e3 * d.size:.1f}", f"{1e3 * d.std:.1f}", f"{1e3 * d.limit:.1f}", f"{d.ratio:.0%}", f"{d.md:g}")
        rows.append((record.design.name, *head, f"{record.surveyed_md:g}", *numbers))
    words = (
        "Each column at the depth where it uses most of its tolerance; marked: beyond it, or not known to its toe.",
    )
    return ReportSection(
        "Columns: set out, and as built", words, columns=columns, rows=rows, marked=marked, new_page=True
    )


def _joints_section(wall: Wall, judgement: Judgement) -> ReportSection:
    judged, required = judgement.joints, wall.file.thickness
    doubtful = worst_depths(judged)
    thin = np.argmin(np.where(np.isfinite(judged.thickness), judged.thickness, np.inf), axis=1)
    rows, marked = [], []
    for j, pair in enumerate(judged.pairs):
        thickness, chance = float(judged.thickness[j, thin[j]]), float(judged.probability[j, doubtful[j]])
        state = max((s for s in judged.states[j].tolist() if s != ColumnState.OUTSIDE), default=ColumnState.OUTSIDE)
        if not thickness >= required or chance > wall.file.allowed or state != ColumnState.SURVEYED:
            marked.append(j)
        shown = f"{thickness:.3f}" if math.isfinite(thickness) else "open"
        depths = f"{wall.columns.depths[thin[j]]:g}", f"{wall.columns.depths[doubtful[j]]:g}"
        name = joint_name(wall.columns, pair)
        rows.append((name, ColumnState(int(state)).name.lower(), shown, depths[0], f"{chance:.2g}", depths[1]))
    columns = ("joint", "known as", "thinnest m", "at m", "P(too thin)", "at m")
    words = (
        f"Required: {required:g} m; marked: thinner, open, not known, or P(too thin) above {wall.file.allowed:g}.",
    )
    return ReportSection("Joints", words, columns=columns, rows=rows, marked=marked)


def _voids_sections(wall: Wall, judgement: Judgement) -> list[ReportSection]:
    """Voids of a grid: every depth that has one, or where one is likelier than allowed, and the likeliest."""
    chance, columns = judgement.void_chance, wall.columns
    if chance is None:
        return []
    allowed, likeliest = wall.file.allowed, int(np.argmax(chance.probability))
    rows: list[tuple[str, ...]] = []
    marked: list[int] = []
    for z, depth in enumerate(columns.depths.tolist()):
        area = sum(hole.void.area for hole in judgement.voids if hole.depth == depth)
        is_bad = bool(area > 0.0 or chance.probability[z] > allowed)
        if not is_bad and z != likeliest:
            continue
        if is_bad:
            marked.append(len(rows))
        three = chance.columns[z]
        between = "–" if three is None else ", ".join(columns.names[k] for k in three)
        rows.append((f"{depth:g}", f"{1e4 * area:.0f}", f"{chance.probability[z]:.2g}", between))
    words = (
        f"Depths with a void as surveyed, or with P(void) above {allowed:g}, marked; and the depth of the largest.",
    )
    heads = ("depth m", "area cm\u00b2", "P(void)", "likeliest between")
    return [ReportSection("Voids between the columns", words, columns=heads, rows=rows, marked=marked)]


def _closing_sections(wall: Wall) -> list[ReportSection]:
    """Section on the closing of the wall, a row a day of drilling."""
    rows = []
    for stage in wall.stages:
        spacing = ("–", "–", "–")
        if stage.widest is not None:
            joint, depth, width = stage.widest
            name = joint_name(wall.columns, wall.pairs[joint])
            spacing = (f"{width:.3f}", name, f"{wall.columns.depths[depth]:g}")
        drilled, closed = _names(stage.drilled, wall.columns.names), f"{100.0 * stage.closed:.1f}"
        rows.append((stage.day.isoformat(), drilled, closed, str(stage.open_joints), *spacing))
    heads = ("day", "drilled", "closed %", "open joints", "widest m", "joint", "at m")
    words = (
        "Share of all joints and depths that are as thick as required, and the widest spacing of columns that stand.",
    )
    return [ReportSection("How it closed", words, columns=heads, rows=rows)] if rows else []


def _instruments_section(records: list[ColumnRecord]) -> ReportSection:
    groups: dict[tuple[str, str, str], list[str]] = {}
    for record in (record for record in records if math.isfinite(record.surveyed_md)):
        key = (record.tool.name, record.serial or "not stated", record.calibration or "not stated")
        groups.setdefault(key, []).append(record.design.name)
    order = [record.design.name for record in records]
    rows = [(*key, _names(names, order)) for key, names in groups.items()]
    return ReportSection("Instruments", columns=("error model", "serial", "calibration", "columns"), rows=rows)


def _names(names: list[str], order: list[str]) -> str:
    """Some columns by name, those that stand next to each other as from the first to the last."""
    runs: list[list[str]] = []
    for k, name in enumerate(order):
        if name in names:
            if k and runs and runs[-1][-1] == order[k - 1]:
                runs[-1].append(name)
            else:
                runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)


def wall_report_pdf(
    wall: Wall, judgement: Judgement, column: str | None, day: date, version: str, papers: ReportPapers
) -> bytes:
    """Report of the wall, or of one of its columns, as a document to be signed.

    Raises
    ------
    SurveyError
        When the wall has no such column.
    """
    names = [plan.design.name for plan in wall.plans]
    if column is not None and column not in names:
        raise SurveyError(f"--column: expected one of {', '.join(names)}, got {column}")
    digests = [(f"SHA-256 of {name}", digest) for name, digest in wall.file.digests()]
    return report_pdf(report_on(wall, judgement, column, Origin(day, version, digests, papers)))
