"""``borechain wall``: the joints of a wall or grid, and whether there is a gap."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import plain_faults
from borechain.cli.files import PLOT_FORMATS, check_suffix
from borechain.cli.options import json_option
from borechain.cli.tables import console
from telemetry.runtime.command_line import check_installed

if TYPE_CHECKING:
    from groundstation.survey.wall import ExtraColumn, Joints
    from groundstation.survey.wall_file import Wall

SHOWN = 10
LIKELY = 0.01  # probability from which a joint is counted as doubtful


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--plot", type=click.Path(path_type=Path, dir_okay=False), help="Thickness over depth as .svg, .png or .pdf."
)
@json_option
@plain_faults
def wall(file: Path, plot: Path | None, as_json: bool) -> None:
    """Judge every joint of the wall or grid in FILE: thickness, probability of a gap, where to add a column.

    \b
    Example:
      borechain wall scenarios/walls/wall-40.toml --plot wall.svg
    """
    from groundstation.survey.wall import extra_column, joints, worst
    from groundstation.survey.wall_file import read_wall

    check_suffix("--plot", plot, *PLOT_FORMATS)
    check_installed("scipy", *(["matplotlib"] if plot is not None else []))
    found = read_wall(file)
    judged = joints(found.columns, found.pairs, found.file.radius, found.file.thickness)
    joint, depth = worst(judged)
    extra = extra_column(found.columns, judged, joint, found.file.radius, found.file.thickness)
    result = result_of(found, judged, joint, depth, extra)
    if plot is not None:
        from groundstation.report.plots_wall import wall_figure
        from groundstation.report.style import save

        title = f"{found.file.name}: {len(judged.pairs)} joints"
        save(wall_figure(found.columns, judged, found.file.radius, found.file.thickness, extra, title), plot)
    if as_json:
        click.echo(json.dumps(result))
    else:
        show(result)


def result_of(found: Wall, judged: Joints, joint: int, depth: int, extra: ExtraColumn | None) -> dict[str, Any]:
    """The JSON object of the command."""
    import numpy as np

    from groundstation.survey.wall import worst_depths

    thin = np.where(np.isfinite(judged.thickness), judged.thickness, np.inf)
    doubtful_at = worst_depths(judged)
    thinnest = np.argmin(thin, axis=1)
    rows = [joint_row(found, judged, j, int(doubtful_at[j]), int(thinnest[j])) for j in range(len(judged.pairs))]
    proposal = None
    if extra is not None:
        proposal = {
            "north_m": extra.north,
            "east_m": extra.east,
            "from_m": extra.from_depth,
            "to_m": extra.to_depth,
            "closes": extra.closes,
        }
    worst = joint_row(found, judged, joint, depth, int(thinnest[joint])) | {"extra_column": proposal}
    return {
        "wall": found.file.name,
        "columns": [column_row(found, k) for k in range(len(found.columns.names))],
        "required_thickness_m": found.file.thickness,
        "margin": allowance(found),
        "joints": rows,
        "gaps": sum(row["thickness_m"] < found.file.thickness for row in rows),
        "doubtful": sum(row["probability"] >= LIKELY for row in rows),
        "worst": worst,
    }


def allowance(found: Wall) -> dict[str, float] | None:
    """How far one column alone may shift along the wall at its toe; None for a wall without a spacing."""
    from groundstation.survey.wall import margin

    if found.file.spacing is None:
        return None
    length = found.file.length or float(found.columns.depths[-1])
    shift, angle = margin(found.file.radius, found.file.thickness, found.file.spacing, length)
    return {"shift_cm": 100.0 * shift, "deviation_deg": math.degrees(angle)}


def joint_row(found: Wall, judged: Joints, joint: int, depth: int, thinnest: int) -> dict[str, Any]:
    """One joint at the depth where it is most probably too thin."""
    a, b = judged.pairs[joint]
    names = found.columns.names
    north, east = judged.offset[joint, depth]
    return {
        "joint": f"{names[a]}-{names[b]}",
        "depth_m": float(found.columns.depths[depth]),
        "distance_m": float(judged.distance[joint, depth]),
        "thickness_m": float(judged.thickness[joint, thinnest]),
        "thinnest_at_m": float(found.columns.depths[thinnest]),
        "probability": float(judged.probability[joint, depth]),
        "moved_apart_cm": 100.0 * math.hypot(north, east),
        "direction_deg": math.degrees(math.atan2(east, north)) % 360.0,
    }


def column_row(found: Wall, k: int) -> dict[str, Any]:
    """Deviation of one column at its toe."""
    north, east, tvd = found.toes[k].tolist()
    size = math.hypot(north, east)
    limit = found.file.design(found.columns.names[k], (0.0, 0.0), tvd).tolerance.at(tvd)
    return {
        "column": found.columns.names[k],
        "md_m": float(found.toe_mds[k]),
        "deviation_cm": 100.0 * size,
        "deviation_percent": 100.0 * size / tvd,
        "direction_deg": math.degrees(math.atan2(east, north)) % 360.0,
        "sigma_cm": 100.0 * math.sqrt(0.5 * float(found.toe_covs[k, 0, 0] + found.toe_covs[k, 1, 1])),
        "used_percent": 100.0 * size / limit,
    }


def show(result: dict[str, Any]) -> None:
    """Worst joints and columns, for people."""
    from rich.table import Table

    paper = console(100)
    table = Table(title=f"{result['wall']}: the {SHOWN} most doubtful of {len(result['joints'])} joints")
    for name in ("joint", "depth m", "thickness m", "thinnest at m", "P(too thin)", "apart cm", "towards deg"):
        table.add_column(name, justify="right")
    for row in sorted(result["joints"], key=lambda r: (-r["probability"], r["thickness_m"]))[:SHOWN]:
        table.add_row(
            row["joint"],
            f"{row['depth_m']:.2f}",
            f"{row['thickness_m']:.3f}",
            f"{row['thinnest_at_m']:.2f}",
            f"{row['probability']:.2e}",
            f"{row['moved_apart_cm']:.1f}",
            f"{row['direction_deg']:.0f}",
        )
    paper.print(table)
    if result["margin"] is not None:
        m = result["margin"]
        paper.print(f"one column alone may be {m['shift_cm']:.1f} cm off at its toe, {m['deviation_deg']:.3f} deg")
    over = [row for row in result["columns"] if row["used_percent"] >= 100.0]
    paper.print(
        f"required {result['required_thickness_m']:g} m: "
        f"{result['gaps']} of {len(result['joints'])} joints are thinner, "
        f"{result['doubtful']} are with a probability of {LIKELY:g} or more; "
        f"{len(over)} columns beyond their tolerance"
    )
    worst, extra = result["worst"], result["worst"]["extra_column"]
    paper.print(f"worst joint {worst['joint']} at {worst['depth_m']:g} m")
    if extra is not None:
        verdict = "closes it" if extra["closes"] else "does not close it alone"
        paper.print(
            f"a column at north {extra['north_m']:.2f} m, east {extra['east_m']:.2f} m "
            f"from {extra['from_m']:g} to {extra['to_m']:g} m {verdict}"
        )
