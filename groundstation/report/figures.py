"""Figures without a display: the same numbers give the same bytes. Text is drawn as paths, so no font is needed."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure

WIDTH = 6.7  # in, the text width of an A4 page
FORMATS = ("svg", "png", "pdf")
INK, QUIET, GRID = "#1c2733", "#5d6b79", "#d9dee3"
COLOURS = ("#0b6e99", "#c4501b", "#4a7c2c")  # of the three axes; apart in lightness too
MARKERS = ("o", "s", "^")
BEFORE, AFTER, LIMIT = "#9aa5b1", "#0b6e99", "#b3261e"
STYLE: Any = {
    "svg.fonttype": "path",
    "svg.hashsalt": "borechain",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.titlepad": 5.0,
    "axes.labelsize": 8.0,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "savefig.facecolor": "white",
}
METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}


@dataclass(frozen=True, slots=True)
class Panel:
    """One figure: caption, height (in) at the width `WIDTH`, and the function that draws it."""

    caption: str
    height: float
    draw: Callable[[Figure | SubFigure], None]


def render(panels: Sequence[Panel], suffix: str) -> bytes:
    """Bytes of one figure with the panels below each other; ``suffix`` one of `FORMATS`."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, sum(panel.height for panel in panels)), layout="constrained")
        FigureCanvasAgg(figure)
        parts: Any = figure.subfigures(len(panels), 1, squeeze=False, height_ratios=[p.height for p in panels])
        for panel, part in zip(panels, parts[:, 0], strict=True):
            if len(panels) > 1:
                part.suptitle(panel.caption, x=0.01, ha="left", fontsize=9.5, fontweight="bold")
            panel.draw(part)
        buffer = io.BytesIO()
        figure.savefig(buffer, format=suffix, dpi=150, metadata=METADATA[suffix])
    return buffer.getvalue()


def row_of(figure: Figure | SubFigure, count: int, **options: Any) -> list[Axes]:
    """``count`` axes beside each other."""
    return list(figure.subplots(1, count, squeeze=False, **options)[0])
