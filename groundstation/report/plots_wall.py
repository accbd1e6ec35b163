"""Figure of a wall or a grid of columns: where a joint is too thin, by name, depth and direction.

Source: thesis chapter 1. Frame: north, east, down; m.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from groundstation.errors import SurveyError
from groundstation.report.plane_words import PlaneWords, name_axes
from groundstation.report.style import (
    GREY,
    INK,
    LIGHT,
    SERIES,
    WRONG,
    draw_covariance_ellipse,
    new_figure,
    plain_text,
    styled,
    tidy_ticks,
)
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import joint_thickness
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_joints import ExtraColumn, Joints, pair_covariance, worst_joint
from groundstation.survey.wall.wall_verdict import Judgement, true_runs
from groundstation.survey.well.ellipsoid import coverage_radius

Array = npt.NDArray[np.float64]
BAND = 0.95
GREYS, ALARMS = ("#F2F2F2", "#D0D0D0", "#A6A6A6"), ("#E69F00", WRONG)
SHADES = ("probability", "thickness")
MOST_CELLS = 240  # along the wall; a cell narrower than that is lost on paper
LINES = ("-", "--", ":", "-.")
UPRIGHT = PlaneWords()


def joint_name(columns: Columns, found: Joints, joint: int) -> str:
    """Names of the two columns of a joint, for a figure."""
    a, b = found.pairs[joint]
    return plain_text(f"{columns.names[a]}–{columns.names[b]}")


def band_of_thickness(columns: Columns, found: Joints, joint: int) -> tuple[Array, Array]:
    """Thickness (depths,) at both ends of the 95 % interval of the distance of the centres, along their line."""
    a, b = found.pairs[joint]
    apart = columns.centres[b] - columns.centres[a]
    size = found.distance[joint]
    unit = apart / np.maximum(size, 1e-9)[:, None]
    cov = pair_covariance(columns, found.pairs[joint : joint + 1])[0]
    std = np.sqrt(np.maximum(np.einsum("zi,zij,zj->z", unit, cov, unit), 0.0))
    wide = coverage_radius(BAND, 1) * std
    return size + wide, np.maximum(size - wide, 0.0)


def thinness_ranking(found: Joints) -> npt.NDArray[np.intp]:
    """Indices of joints, most probably too thin first; of equals the thinnest."""
    probability = np.where(np.isfinite(found.probability), found.probability, -1.0).max(axis=1)
    thin = np.where(np.isfinite(found.thickness), found.thickness, np.inf).min(axis=1)
    return np.lexsort((thin, -probability))


@styled
def wall_figure(
    columns: Columns,
    found: Joints,
    required: float,
    extra: ExtraColumn | None,
    title: str,
    *,
    shown: int = 3,
    allowed: float = 0.05,
    shade: Literal["probability", "thickness"] = "probability",
    words: PlaneWords = UPRIGHT,
) -> Figure:
    """Thickness of the worst joints over depth, all joints as a map, the wall in plan and its worst joint enlarged.

    Parameters
    ----------
    required : thickness of a joint, m
    extra : proposed column, drawn in plan
    shown : joints whose thickness is drawn, at most 4
    allowed : probability of a joint being too thin, beyond which it is marked
    shade : of the map
    words : names of the axes

    Raises
    ------
    SurveyError
        When no joint is known at any depth, or an option has no such value.
    """
    figure = new_figure(8.8, title)
    _draw(figure, columns, found, required, extra, shown=shown, allowed=allowed, shade=shade, words=words)
    return tidy_ticks(figure)


def _draw(
    figure: Figure,
    columns: Columns,
    found: Joints,
    required: float,
    extra: ExtraColumn | None,
    *,
    shown: int,
    allowed: float,
    shade: str,
    words: PlaneWords,
) -> None:
    """Fill the figure."""
    if shade not in SHADES or not 0.0 < allowed < 0.5 or not 1 <= shown <= len(LINES):
        raise SurveyError(
            f"plot: expected a shade of {', '.join(SHADES)}, allowed in 0..0.5 and shown of 1..{len(LINES)}, "
            f"got {shade!r}, {allowed} and {shown}"
        )
    if not np.any(np.isfinite(found.thickness)):
        raise SurveyError("plot: expected a joint whose two columns reach a common depth, got none")
    (over_depth, shades), (plan, zoom) = figure.subplots(2, 2, height_ratios=(1.15, 1.0))
    bad = np.max(np.where(np.isfinite(found.probability), found.probability, 0.0), axis=1) > allowed
    bad |= np.min(np.where(np.isfinite(found.thickness), found.thickness, np.inf), axis=1) < required
    ranking = thinness_ranking(found)
    drawable = np.isfinite(found.thickness[ranking]).any(axis=1)  # a joint that is missing all along has no line
    _thickness(over_depth, columns, found, required, [*ranking[drawable], *ranking[~drawable]][:shown], bad)
    over_depth.set_ylabel(words.depth)
    _map(shades, columns, found, required, allowed, shade)
    shades.set_ylabel(words.depth)
    _plan(plan, columns, found, bad, words)
    _zoom(zoom, columns, found, bad, extra)
    for axes in (plan, zoom):
        axes.set(xlabel=words.second, ylabel=words.first)


def _thickness(
    axes: Axes,
    columns: Columns,
    found: Joints,
    required: float,
    which: Sequence[np.intp],
    bad: npt.NDArray[np.bool_],
) -> None:
    """Draw the thickness over depth; the band of the worst joint only, since bands on bands cannot be read."""
    for rank, joint in enumerate(which):
        colour = (WRONG if rank == 0 else ALARMS[0]) if bad[joint] else (INK if rank == 0 else GREY)
        label = joint_name(columns, found, int(joint)) + _missing_words(columns, found, int(joint))
        axes.plot(found.thickness[joint], columns.depths, color=colour, ls=LINES[rank], lw=1.8 if rank == 0 else 1.3,
                  label=label)  # fmt: skip
        if rank == 0:
            a, b = found.pairs[joint]
            low, high = (
                joint_thickness(d, columns.radii[a], columns.radii[b])
                for d in band_of_thickness(columns, found, int(joint))
            )
            axes.fill_betweenx(
                columns.depths, low, high, color=colour, alpha=0.18, lw=0.0, label=f"its {100.0 * BAND:g} % band"
            )
    axes.axvline(required, color=INK, lw=1.0, ls=(0, (6, 2)), label=f"required, {required:g} m")
    axes.set(xlabel="Thickness of the joint (m)", title="Worst joints")
    axes.set_ylim(float(columns.depths[-1]), float(columns.depths[0]))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.19), ncols=2)


def _missing_words(columns: Columns, found: Joints, joint: int) -> str:
    """Words on where a joint is missing, which has no thickness to draw."""
    missing = np.flatnonzero(found.states[joint] == ColumnState.MISSING)
    return f", missing from {columns.depths[missing[0]]:g} m" if len(missing) else ""


def _map(axes: Axes, columns: Columns, found: Joints, required: float, allowed: float, shade: str) -> None:
    """Joints along the wall, depth down; steps of grey where all is well."""
    colours: tuple[str, ...] = (*GREYS, *ALARMS)
    bounds = [0.0, 1e-4 * allowed, 1e-2 * allowed, allowed, 0.5, 1.0]
    values, label = found.probability, f"Probability of less than {required:g} m (-)"
    if shade == "thickness":
        values, label = found.thickness, "Thickness of the joint (m)"
        thin = float(np.nanmin(values))
        bounds, colours = np.linspace(required, 2.0 * float(columns.radii.max()), 4).tolist(), GREYS[::-1]
        if required > 0.0:
            bounds, colours = [0.0, *bounds], (ALARMS[0], *colours)
        if thin < 0.0:  # there is a gap
            bounds, colours = [thin, *bounds], (WRONG, *colours)
    colormap = ListedColormap(list(colours))
    count, depths = len(found.pairs), columns.depths
    edge, cells = pooled_cells(values, np.nanmin if shade == "thickness" else np.nanmax)
    middles = 0.5 * (depths[1:] + depths[:-1])
    edges = np.concatenate([depths[:1], middles, depths[-1:]])
    picture = axes.pcolormesh(
        edge,
        edges,
        np.ma.masked_invalid(cells.T),
        cmap=colormap,
        norm=BoundaryNorm(bounds, len(colours)),
        rasterized=True,  # thousands of cells would make a vector file slow to open
    )
    missing, unsurveyed = (
        _marked(axes, found.states == state, edge, edges, state)
        for state in (ColumnState.MISSING, ColumnState.UNSURVEYED)
    )
    joint, depth = worst_joint(found)
    axes.plot(joint, depths[depth], "o", ms=8.0, mfc="none", mec=INK, mew=1.4, clip_on=False, gid="worst")
    axes.grid(visible=False)
    axes.set_ylim(float(depths[-1]), float(depths[0]))
    step = -(-count // 16)
    axes.set_xticks(range(0, count, step), [joint_name(columns, found, k) for k in range(0, count, step)], rotation=90)
    notes = [*(["crossed: missing"] if missing else []), *(["hatched: not surveyed"] if unsurveyed else [])]
    marks = ";\n".join(["ring: the worst", *notes])
    axes.set(title=f"All joints ({marks})")
    bar = axes.figure.colorbar(picture, ax=axes, location="bottom", spacing="uniform", label=label, aspect=30, pad=0.02)
    bar.ax.set_xticks(bounds, [f"{b:.2g}" for b in bounds])


def _marked(axes: Axes, flags: npt.NDArray[np.bool_], edge: Array, edges: Array, state: ColumnState) -> bool:
    """Draw marks over the cells (joints, depths) of a state that no grey shows; returns whether there are any."""
    look: dict[str, Any] = {"fc": "none", "ec": INK, "hatch": "////"}
    if state == ColumnState.MISSING:
        look = {"fc": WRONG, "ec": INK, "hatch": "xxxx"}
    step = -(-len(flags) // MOST_CELLS)
    for cell, k in enumerate(range(0, len(flags), step)):
        for first, last in true_runs(np.any(flags[k : k + step], axis=0)):
            size = float(edge[cell + 1] - edge[cell]), float(edges[last + 1] - edges[first])
            place = float(edge[cell]), float(edges[first])
            axes.add_patch(Rectangle(place, *size, lw=0.0, gid=state.name.lower(), **look))
    return bool(np.any(flags))


def pooled_cells(values: Array, worst_of: Callable[..., Any]) -> tuple[Array, Array]:
    """Edges along the wall and cells (at most ``MOST_CELLS``, depths): joints that share one show their worst."""
    count = len(values)
    step = -(-count // MOST_CELLS)
    edge = np.append(np.arange(0, count, step), count) - 0.5
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a cell of nothing but nan stays nan
        cells = [worst_of(values[k : k + step], axis=0) for k in range(0, count, step)]
    return edge, np.array(cells)


def _frame(axes: Axes, title: str) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(title, size="medium")  # that of a joint with its names is long


def _plan(axes: Axes, columns: Columns, found: Joints, bad: npt.NDArray[np.bool_], words: PlaneWords) -> None:
    """Whole wall at the depth of the worst joint; what is missing there is a dashed ring at its design."""
    _, depth = worst_joint(found)
    touched = set(found.pairs[bad].ravel().tolist())
    missing = False
    for k, centre in enumerate(columns.drawn_centres[:, depth]):
        place, radius = (float(centre[1]), float(centre[0])), float(columns.radii[k, depth])
        if columns.states[k, depth] == ColumnState.MISSING:
            missing = True
            axes.add_patch(Circle(place, radius, fc="none", ec=WRONG, lw=1.2, ls="--", gid="missing"))
        elif np.isfinite(columns.centres[k, depth, 0]):
            face = WRONG if k in touched else LIGHT
            axes.add_patch(Circle(place, radius, fc=face, ec=GREY, lw=0.5, alpha=0.6, gid="column"))
    axes.plot(columns.designs[:, 1], columns.designs[:, 0], ls="", marker="+", ms=3.0, mew=0.7, color=INK)
    middle, half = _window(columns, found)
    corner = (float(middle[1] - half), float(middle[0] - half))
    axes.add_patch(Rectangle(corner, 2.0 * half, 2.0 * half, fc="none", ec=INK, lw=0.8))
    axes.autoscale_view()
    note = " (dashed: missing)" if missing else (" (coloured: a joint not safe)" if touched else "")
    _frame(axes, f"{words.view} at {columns.depths[depth]:.1f} m{note}")


def _window(columns: Columns, found: Joints) -> tuple[Array, float]:
    """Middle and half width (m) of the surroundings of the worst joint."""
    joint, depth = worst_joint(found)
    pair = found.pairs[joint]
    first, second = columns.drawn_centres[pair, depth]
    apart = float(np.hypot(*(second - first)))
    return 0.5 * (first + second), 0.5 * apart + 1.45 * float(columns.radii[pair, depth].max())


def _zoom(axes: Axes, columns: Columns, found: Joints, bad: npt.NDArray[np.bool_], extra: ExtraColumn | None) -> None:
    """Columns around the worst joint: from head to toe, and as circles where it is worst."""
    joint, depth = worst_joint(found)
    a, b = (int(k) for k in found.pairs[joint])
    middle, half = _window(columns, found)
    colour = WRONG if bad[joint] else INK
    for k, way in enumerate(columns.centres):
        radius, known = float(columns.radii[k, depth]), np.isfinite(way[:, 0])
        if np.all(np.abs(columns.drawn_centres[k, depth] - middle) < half + radius):
            _column(axes, columns, k, depth, known)
    labels: list[Array] = []
    drawn = columns.drawn_centres[:, depth]
    first, second = drawn[a], drawn[b]
    along = (second - first) / max(float(np.hypot(*(second - first))), 1e-9)
    across = np.array([-along[1], along[0]])
    for k in (a, b, *(other for other in range(len(columns.names)) if other not in (a, b))):
        radius = float(columns.radii[k, depth])
        place = _label_place(drawn, k, 0.8 * radius * across)
        free = all(np.hypot(*(place - other)) > 0.6 * radius for other in labels)
        if free and np.all(np.abs(drawn[k] - middle) < half - 0.2 * radius):
            labels.append(place)
            weight = "bold" if k in (a, b) else "normal"
            axes.text(place[1], place[0], plain_text(columns.names[k]), ha="center", va="center", weight=weight)
    thick = float(found.thickness[joint, depth])
    if np.isfinite(thick):  # a gap lies along the line of the centres
        ends = 0.5 * (first + second) + 0.5 * abs(thick) * (across if thick > 0.0 else along) * np.array(
            [[-1.0], [1.0]]
        )
        look = "|-" if thick < 0.0 else "-"
        axes.plot(ends[:, 1], ends[:, 0], look, color=colour, lw=2.4, solid_capstyle="butt")
    radius = float(columns.radii[[a, b], depth].min())
    if extra is not None:
        axes.add_patch(Circle((extra.east, extra.north), radius, fc="none", ec=SERIES[1], ls="--", lw=1.5, gid="extra"))
    kind = f"gap of {-thick:.2f} m" if thick <= 0.0 else f"{thick:.2f} m thick"
    if found.states[joint, depth] == ColumnState.MISSING:
        kind = "column missing"
    _frame(axes, f"{joint_name(columns, found, joint)} at {columns.depths[depth]:.1f} m: {kind}")
    # automatic, so that the equal aspect may widen them
    axes.set_xlim(float(middle[1] - half), float(middle[1] + half), auto=True)
    axes.set_ylim(float(middle[0] - half), float(middle[0] + half), auto=True)
    axes.figure.legend(handles=_legend(colour, extra), loc="outside lower left", ncols=3)


def _label_place(drawn: Array, k: int, away: Array) -> Array:
    """Place of a column's name: ``away`` from its centre, or nearer where that is nearer to another one's."""
    for share in (1.0, 0.6, 0.35):
        place = drawn[k] + share * away
        apart = np.hypot(*(drawn - place).T)
        if not np.any(np.delete(apart, k) < 1.3 * apart[k]):
            break
    return np.asarray(place)


def _column(axes: Axes, columns: Columns, k: int, depth: int, known: npt.NDArray[np.bool_]) -> None:
    """One column of the enlarged plan; a dashed ring where it is missing."""
    way, radius = columns.centres[k], float(columns.radii[k, depth])
    axes.plot(columns.designs[k, 1], columns.designs[k, 0], "+", color=INK, ms=6.0)
    if np.any(known):
        axes.plot(way[known, 1], way[known, 0], "-", color=GREY, lw=1.0)
        axes.plot(*way[known][-1, ::-1], "v", color=INK, ms=4.0)
    north, east = columns.drawn_centres[k, depth]
    if not known[depth]:
        axes.add_patch(Circle((east, north), radius, fc="none", ec=WRONG, ls="--", lw=1.2, gid="missing"))
        return
    axes.add_patch(Circle((east, north), radius, fc=LIGHT, ec=GREY, lw=0.8, alpha=0.5, gid="column"))
    cov = columns.covs[k, depth, ::-1, ::-1]
    draw_covariance_ellipse(
        axes, np.array([east, north]), cov, coverage_radius(BAND, 2), fc="none", ec=SERIES[0], lw=1.0
    )


def _legend(colour: str, extra: ExtraColumn | None) -> list[Any]:
    handles: list[Any] = [
        Line2D([], [], ls="", marker="+", color=INK, label="head as designed"),
        Line2D([], [], color=GREY, marker="v", mfc=INK, mec=INK, label="hole to its toe"),
        Line2D([], [], color=SERIES[0], lw=1.0, label=f"{100.0 * BAND:g} % region of the centre"),
        Line2D([], [], color=colour, lw=2.4, label="worst joint"),
    ]
    if extra is not None:
        verdict = "closes the gap" if extra.closes else "does not close the gap alone"
        what = f"extra column, {extra.from_depth:.1f}–{extra.to_depth:.1f} m: {verdict}"
        handles.append(Line2D([], [], color=SERIES[1], ls="--", lw=1.5, label=what))
    return handles


def draw_wall(wall: Wall, judgement: Judgement) -> Figure:
    """Figure of a wall with its verdict, and the column that is proposed at its most doubtful joint."""
    joint, _ = worst_joint(judgement.joints)
    title = f"{wall.file.name}: {len(wall.pairs)} joints, {judgement.verdict.value}"
    extra = dict(judgement.extras).get(joint)
    words = name_axes(wall.built.frame)
    return wall_figure(wall.built.columns, judgement.joints, wall.file.thickness, extra, title, words=words)
