"""A wall's answer: verdict, findings, joints, columns, voids and how it closed, as one object for JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.entry.entry_warning import warning_rows
from groundstation.survey.requests.survey_rows import COORDINATES
from groundstation.survey.wall.column_deviation import point_deviation
from groundstation.survey.wall.column_joint import shift_margin
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_columns import state_words
from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_joints import ExtraColumn, Joints, worst_depths, worst_joint
from groundstation.survey.wall.wall_verdict import Finding, Judgement, joint_name
from groundstation.survey.well.trajectory_rows import TrajectoryPoint


def wall_result(found: Wall, judgement: Judgement) -> dict[str, Any]:
    """The object that ``borechain wall --json`` prints."""
    judged, extras = judgement.joints, dict(judgement.extras)
    finite = np.where(np.isfinite(judged.thickness), judged.thickness, np.inf)
    doubtful_at, thinnest = worst_depths(judged), np.argmin(finite, axis=1)
    rows = [joint_row(found, judged, j, int(doubtful_at[j]), int(thinnest[j])) for j in range(len(judged.pairs))]
    tight = [{"tight_from_m": top, "tight_to_m": bottom} for top, bottom in found.tight_depths.tolist()]
    rows = [row | ends for row, ends in zip(rows, tight, strict=True)]
    joint, depth = worst_joint(judged)
    worst_row = joint_row(found, judged, joint, depth, int(thinnest[joint])) | tight[joint]
    return {
        "wall": found.file.name,
        "verdict": judgement.verdict.value,
        "north": found.file.north,
        "stations_north": found.file.stations_north,
        "depth_reference": found.file.depth_reference,
        "read_from": {"depth_reference": found.file.depths_read_from, "height_m": found.file.reference_height},
        "height_datum": found.file.height_datum or None,
        "coordinates_north": None if found.file.grid is None else found.file.grid.north,
        "site": wall_site(found),
        "warnings": warning_rows(found.warnings),
        "findings": [finding_row(finding) for finding in judgement.findings],
        "probability_of_any": judgement.system.probability,
        "probability_of_any_standard_error": judgement.system.standard_error,
        "allowed_probability": found.file.allowed,
        "columns": [column_row(found, k) for k in range(len(found.plans))],
        "required_thickness_m": found.file.thickness,
        "margin": shift_allowance(found),
        "joints": rows,
        "gaps": sum(row["state"] == "missing" or row["thickness_m"] < found.file.thickness for row in rows),
        "doubtful": sum(row["probability"] > found.file.allowed for row in rows),
        "worst": worst_row | {"extra_column": proposed_column(found, extras.get(joint))},
        "extra_columns": [rows[j] | {"extra_column": proposed_column(found, extra)} for j, extra in judgement.extras],
        "largest_spacing": largest_spacing(found, judged),
        "closing": closing_rows(found),
        "voids": void_rows(found, judgement),
        "void_probability": void_probability(found, judgement),
    }


def wall_site(found: Wall) -> dict[str, Any]:
    """The site that errors were computed for; what the file does not state is named by default."""
    site, stated = found.file.assumed.site, found.file.stated
    figures = {
        "gravity_mps2": site.gravity,
        "field_nt": site.b_field,
        "dip_deg": math.degrees(site.dip),
        "declination_deg": math.degrees(site.declination),
        "latitude_deg": math.degrees(site.latitude),
    }
    return figures | {"sources": {key: "stated" if key in stated else "default" for key in figures}}


def finding_row(finding: Finding) -> dict[str, Any]:
    """One reason of the verdict."""
    return {
        "kind": finding.kind.value,
        "what": finding.what,
        "from_m": finding.top,
        "to_m": finding.bottom,
        "probability": finding.probability,
        "text": finding.text,
    }


def void_rows(found: Wall, judgement: Judgement) -> list[dict[str, Any]]:
    """Every void as surveyed, one at each depth."""
    return [
        {
            "depth_m": hole.depth,
            "columns": [found.built.columns.names[k] for k in hole.void.columns],
            "area_m2": hole.void.area,
            "radius_m": hole.void.radius,
            "place_m": list(hole.void.place),
        }
        for hole in judgement.voids
    ]


def void_probability(found: Wall, judgement: Judgement) -> list[dict[str, Any]]:
    """Area and probability of voids at every depth of a grid, and where one is likeliest."""
    chance, columns, rows = judgement.void_chance, found.built.columns, []
    if chance is None:
        return []
    for z, depth in enumerate(columns.depths.tolist()):
        three = chance.columns[z]
        rows.append(
            {
                "depth_m": depth,
                "area_m2": sum(hole.void.area for hole in judgement.voids if hole.depth == depth),
                "probability": float(chance.probability[z]),
                "standard_error": float(chance.standard_error[z]),
                "columns": [] if three is None else [columns.names[k] for k in three],
                "place_m": None if three is None else chance.places[z].tolist(),
            }
        )
    return rows


def proposed_column(found: Wall, extra: ExtraColumn | None) -> dict[str, Any] | None:
    """A proposed column, placed where it is to begin; None where none is needed."""
    if extra is None:
        return None
    place = np.array([extra.north, extra.east, extra.from_depth]) @ found.built.frame
    north, east, down = place.tolist()
    grid = found.file.grid
    coordinates = {} if grid is None else dict(zip(COORDINATES, grid.of_places(place).tolist(), strict=True))
    return coordinates | {
        "north_m": north,
        "east_m": east,
        "down_m": down,
        "from_m": extra.from_depth,
        "to_m": extra.to_depth,
        "closes": extra.closes,
    }


def largest_spacing(found: Wall, judged: Joints) -> list[dict[str, Any]]:
    """Widest joint at every depth; a missing column has no spacing, so its joints stand as null."""
    columns, rows = found.built.columns, []
    for z, depth in enumerate(columns.depths.tolist()):
        missing = np.flatnonzero(judged.states[:, z] == ColumnState.MISSING)
        known = np.where(np.isfinite(judged.distance[:, z]), judged.distance[:, z], -np.inf)
        joint = int(missing[0]) if len(missing) else int(np.argmax(known))
        spacing = None if len(missing) or not np.isfinite(known[joint]) else float(known[joint])
        rows.append({"depth_m": depth, "joint": joint_name(columns, judged.pairs[joint]), "spacing_m": spacing})
    return rows


def closing_rows(found: Wall) -> list[dict[str, Any]]:
    """How it closed, day by day; nothing where no day of drilling is stated."""
    columns, rows = found.built.columns, []
    for stage in found.stages:
        row: dict[str, Any] = {"day": stage.day.isoformat(), "drilled": stage.drilled}
        row |= {"closed_percent": 100.0 * stage.closed, "open_joints": stage.open_joints, "largest_spacing": None}
        if stage.widest is not None:
            joint, depth, spacing = stage.widest
            name, at = joint_name(columns, found.pairs[joint]), float(columns.depths[depth])
            row["largest_spacing"] = {"joint": name, "depth_m": at, "spacing_m": spacing}
        rows.append(row)
    return rows


def shift_allowance(found: Wall) -> dict[str, float] | None:
    """How far one column alone may shift along the wall at its toe; None for a wall without a spacing."""
    if found.file.spacing is None:
        return None
    length = max(plan.design.length for plan in found.plans)
    shift, angle = shift_margin(found.file.radius, found.file.thickness, found.file.spacing, length)
    return {"shift_cm": 100.0 * shift, "deviation_deg": math.degrees(angle)}


def joint_row(found: Wall, judged: Joints, joint: int, depth: int, thinnest: int) -> dict[str, Any]:
    """One joint at the depth where it is most probably too thin; what is missing has no distance: null."""
    columns = found.built.columns
    north, east, _ = (judged.offset[joint, depth] @ found.built.frame[:2]).tolist()
    states = judged.states[joint]
    worst_state = ColumnState(
        int(max((s for s in states.tolist() if s != ColumnState.OUTSIDE), default=ColumnState.OUTSIDE))
    )
    return {
        "joint": joint_name(columns, judged.pairs[joint]),
        "state": worst_state.name.lower(),
        "depth_m": float(columns.depths[depth]),
        "distance_m": json_number(judged.distance[joint, depth]),
        "thickness_m": json_number(judged.thickness[joint, thinnest]),
        "thinnest_at_m": float(columns.depths[thinnest]),
        "probability": float(judged.probability[joint, depth]),
        "moved_apart_cm": json_number(100.0 * math.hypot(north, east)),
        "direction_deg": json_number(math.degrees(math.atan2(east, north)) % 360.0),
    }


def json_number(value: float) -> float | None:
    """A number for JSON, which has no nan."""
    return float(value) if math.isfinite(value) else None


def column_row(found: Wall, k: int) -> dict[str, Any]:
    """State of one column, and its deviation from its design at its last survey."""
    plan, built = found.plans[k], found.built
    row: dict[str, Any] = {
        "column": plan.design.name,
        "state": state_words(plan, built, k),
        "design_length_m": plan.design.length,
        "drilled_to_m": json_number(built.ends[k]),
        "surveyed_to_m": json_number(built.surveyed[k]),
        "md_m": json_number(built.surveyed[k]),
        "instrument": plan.tool.name,
        "serial": plan.serial,
    }
    if not built.surveyed[k] > 0.0:
        missing = ("deviation_cm", "deviation_percent", "direction_deg", "sigma_cm", "used_percent")
        return row | dict.fromkeys(missing)
    head = np.array(plan.design.head)
    cov = built.toe_covs[k] + plan.head_std**2 * np.diag([1.0, 1.0, 0.0])
    point = TrajectoryPoint(float(built.surveyed[k]), plan.design.axis, head + built.toes[k], cov, np.zeros((3, 0)))
    found_ = point_deviation(point, plan.design)
    north, east, _ = (found_.offset @ plan.design.across_at(np.array([found_.along]))[0]).tolist()
    return row | {
        "deviation_cm": 100.0 * found_.size,
        "deviation_percent": 100.0 * found_.size / max(found_.along, 1e-9),
        "direction_deg": math.degrees(math.atan2(east, north)) % 360.0,
        "sigma_cm": 100.0 * math.sqrt(0.5 * float(np.trace(found_.cov))),
        "used_percent": 100.0 * found_.ratio,
    }
