"""``borechain wall``: the joints of a wall, a shaft or a grid, what is not known of it, and whether it is tight."""

from __future__ import annotations

import json
import math
from datetime import UTC, date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain import __version__
from borechain.cli.console_tables import table_console
from borechain.cli.faults import InputFault, plain_faults
from borechain.cli.shared_options import json_option
from borechain.cli.whole_files import PLOT_FORMATS, check_suffix, write_whole
from telemetry.runtime.command_line import check_installed

if TYPE_CHECKING:
    from groundstation.survey.wall.wall_file import Wall
    from groundstation.survey.wall.wall_joints import ExtraColumn, Joints
    from groundstation.survey.wall.wall_verdict import Judgement

SHOWN = 10
NOT_TIGHT = 3  # exit status


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--plot", type=click.Path(path_type=Path, dir_okay=False), help="Thickness over depth as .svg, .png or .pdf."
)
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Report to be signed, a .pdf file.")
@click.option(
    "--column",
    metavar="NAME",
    help="Column that --report is about; without it, the whole wall.",
)
@click.option("--date", type=click.DateTime(["%Y-%m-%d"]), help="Day of the report.  [default: today, UTC]")
@json_option
@click.pass_context
@plain_faults
def wall(
    context: click.Context,
    file: Path,
    plot: Path | None,
    report: Path | None,
    column: str | None,
    date: datetime | None,
    as_json: bool,
) -> None:
    """Judge the wall, shaft or grid in FILE: every joint, every void, what is missing or not surveyed, and the whole.

    The exit status is 0 when it is tight and 3 when it is not, or not proven to be.

    \b
    Examples:
      borechain wall scenarios/walls/wall-40.toml --plot wall.svg
      borechain wall scenarios/walls/wall-40.toml --report wall.pdf
      borechain wall scenarios/walls/wall-40.toml --report K021.pdf --column K021
    """
    from groundstation.survey.wall.wall_file import judge_wall, read_wall
    from groundstation.survey.wall.wall_joints import worst_joint
    from groundstation.survey.wall.wall_verdict import WallVerdict

    check_suffix("--plot", plot, *PLOT_FORMATS)
    check_suffix("--report", report, ".pdf")
    if report is None and (column is not None or date is not None):
        raise InputFault("--column and --date: expected --report FILE.pdf beside them")
    drawn = plot is not None or report is not None
    check_installed("scipy", *(["matplotlib"] if drawn else []), *(["typst"] if report is not None else []))
    found = read_wall(file)
    judgement = judge_wall(found)
    result = result_of(found, judgement)
    if plot is not None:
        from groundstation.report.plots_wall import wall_figure
        from groundstation.report.style import save_figure

        joint, _ = worst_joint(judgement.joints)
        extra = dict(judgement.extras).get(joint)
        title = f"{found.file.name}: {len(found.pairs)} joints, {judgement.verdict.value}"
        save_figure(wall_figure(found.built.columns, judgement.joints, found.file.thickness, extra, title), plot)
    if report is not None:
        write_report(found, judgement, column, (date or datetime.now(UTC)).date(), report)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_wall(result)
    if judgement.verdict is not WallVerdict.TIGHT:
        context.exit(NOT_TIGHT)


def write_report(found: Wall, judgement: Judgement, column: str | None, day: date, path: Path) -> None:
    """Report of the wall, or of one of its columns."""
    from groundstation.report.document import Origin, report_pdf
    from groundstation.report.wall_report import report_on

    names = [plan.design.name for plan in found.plans]
    if column is not None and column not in names:
        raise InputFault(f"--column: expected one of {', '.join(names)}, got {column}")
    digests = [(f"SHA-256 of {name}", digest) for name, digest in found.file.digests()]
    write_whole(path, report_pdf(report_on(found, judgement, column, Origin(day, __version__, digests))))


def result_of(found: Wall, judgement: Judgement) -> dict[str, Any]:
    """The JSON object of the command."""
    import numpy as np

    from groundstation.survey.wall.wall_joints import worst_depths, worst_joint

    judged, extras = judgement.joints, dict(judgement.extras)
    finite = np.where(np.isfinite(judged.thickness), judged.thickness, np.inf)
    doubtful_at, thinnest = worst_depths(judged), np.argmin(finite, axis=1)
    rows = [joint_row(found, judged, j, int(doubtful_at[j]), int(thinnest[j])) for j in range(len(judged.pairs))]
    joint, depth = worst_joint(judged)
    worst_row = joint_row(found, judged, joint, depth, int(thinnest[joint]))
    return {
        "wall": found.file.name,
        "verdict": judgement.verdict.value,
        "north": found.file.north,
        "depth_reference": found.file.depth_reference,
        "read_from": {"depth_reference": found.file.depths_read_from, "height_m": found.file.reference_height},
        "height_datum": found.file.height_datum or None,
        "findings": [
            {
                "kind": finding.kind.value,
                "what": finding.what,
                "from_m": finding.top,
                "to_m": finding.bottom,
                "probability": finding.probability,
                "text": finding.text,
            }
            for finding in judgement.findings
        ],
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
    import numpy as np

    if extra is None:
        return None
    north, east, down = (np.array([extra.north, extra.east, extra.from_depth]) @ found.built.frame).tolist()
    return {
        "north_m": north,
        "east_m": east,
        "down_m": down,
        "from_m": extra.from_depth,
        "to_m": extra.to_depth,
        "closes": extra.closes,
    }


def largest_spacing(found: Wall, judged: Joints) -> list[dict[str, Any]]:
    """Widest joint at every depth; a missing column has no spacing, so its joints stand as null."""
    import numpy as np

    from groundstation.survey.wall.as_built import ColumnState
    from groundstation.survey.wall.wall_verdict import joint_name

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
    from groundstation.survey.wall.wall_verdict import joint_name

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
    from groundstation.survey.wall.column_joint import shift_margin

    if found.file.spacing is None:
        return None
    length = max(plan.design.length for plan in found.plans)
    shift, angle = shift_margin(found.file.radius, found.file.thickness, found.file.spacing, length)
    return {"shift_cm": 100.0 * shift, "deviation_deg": math.degrees(angle)}


def joint_row(found: Wall, judged: Joints, joint: int, depth: int, thinnest: int) -> dict[str, Any]:
    """One joint at the depth where it is most probably too thin; what is missing has no distance: null."""
    from groundstation.survey.wall.as_built import ColumnState
    from groundstation.survey.wall.wall_verdict import joint_name

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
    import numpy as np

    from groundstation.survey.wall.column_deviation import point_deviation
    from groundstation.survey.wall.wall_columns import state_words
    from groundstation.survey.well.trajectory import TrajectoryPoint

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
    north, east, _ = (found_.offset @ plan.design.across).tolist()
    return row | {
        "deviation_cm": 100.0 * found_.size,
        "deviation_percent": 100.0 * found_.size / max(found_.along, 1e-9),
        "direction_deg": math.degrees(math.atan2(east, north)) % 360.0,
        "sigma_cm": 100.0 * math.sqrt(0.5 * float(np.trace(found_.cov))),
        "used_percent": 100.0 * found_.ratio,
    }


def show_wall(result: dict[str, Any]) -> None:
    """Verdict, reasons, worst joints and columns, for people."""
    from rich.table import Table

    paper = table_console(100)
    colour = "green" if result["verdict"] == "tight" else "bold red"
    frame = f"{result['north']} north, depth from {result['depth_reference']}"
    paper.print(f"[{colour}]{result['wall']}: {result['verdict']}[/] ({frame})")
    for finding in result["findings"]:
        paper.print(f"  {finding['kind']}: {finding['text']}", markup=False)
    table = Table(title=f"the {min(SHOWN, len(result['joints']))} most doubtful of {len(result['joints'])} joints")
    for name in ("joint", "state", "depth m", "thickness m", "thinnest at m", "P(too thin)", "apart cm", "towards deg"):
        table.add_column(name, justify="right")
    thin = {row["joint"]: -math.inf if row["thickness_m"] is None else row["thickness_m"] for row in result["joints"]}
    for row in sorted(result["joints"], key=lambda r: (-r["probability"], thin[r["joint"]]))[:SHOWN]:
        table.add_row(
            row["joint"],
            row["state"],
            f"{row['depth_m']:.2f}",
            number_text(row["thickness_m"], 3),
            f"{row['thinnest_at_m']:.2f}",
            f"{row['probability']:.2e}",
            number_text(row["moved_apart_cm"], 1),
            number_text(row["direction_deg"], 0),
        )
    paper.print(table)
    if result["margin"] is not None:
        m = result["margin"]
        paper.print(f"one column alone may be {m['shift_cm']:.1f} cm off at its toe, {m['deviation_deg']:.3f} deg")
    over = [row for row in result["columns"] if row["used_percent"] is not None and row["used_percent"] >= 100.0]
    paper.print(
        f"required {result['required_thickness_m']:g} m: "
        f"{result['gaps']} of {len(result['joints'])} joints are thinner or open, "
        f"{result['doubtful']} are so with a probability of more than {result['allowed_probability']:g}; "
        f"{len(over)} columns beyond their tolerance"
    )
    for row in result["closing"][-SHOWN:]:
        widest = row["largest_spacing"]
        spacing = "" if widest is None else f", widest {widest['spacing_m']:.3f} m ({widest['joint']})"
        paper.print(f"{row['day']}: {row['closed_percent']:.1f} % closed, {row['open_joints']} joints open{spacing}")
    paper.print(f"anything open or too thin: probability {result['probability_of_any']:.2g}")
    paper.print(f"worst joint {result['worst']['joint']} at {result['worst']['depth_m']:g} m")
    for row in result["extra_columns"]:
        extra = row["extra_column"]
        verdict = "closes" if extra["closes"] else "does not close"
        paper.print(
            f"a column at north {extra['north_m']:.2f} m, east {extra['east_m']:.2f} m "
            f"from {extra['from_m']:g} to {extra['to_m']:g} m {verdict} {row['joint']}"
        )


def number_text(value: float | None, digits: int) -> str:
    """A number of a table, a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"
