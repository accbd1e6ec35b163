"""Figures of several panels, for reports: in the style of all figures, as bytes."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure

from groundstation.report.figure_words import translate_figure
from groundstation.report.style import GREY, METADATA, SERIES, STYLE, WRONG, FigureDrawnOnce
from groundstation.report.word_tables import ENGLISH

WIDTH = 6.7  # in, the text width of an A4 page
FORMATS = tuple(suffix.removeprefix(".") for suffix in METADATA)
COLOURS = SERIES[:3]  # of the three axes
BEFORE, AFTER, LIMIT = GREY, SERIES[0], WRONG


@dataclass(frozen=True, slots=True)
class Panel:
    """One figure: caption, height (in) at the width `WIDTH`, and the function that draws it."""

    caption: str
    height: float
    draw: Callable[[Figure | SubFigure], None]


def render_panels(panels: Sequence[Panel], suffix: str, language: str = ENGLISH) -> bytes:
    """Bytes of one figure with the panels below each other; ``suffix`` one of `FORMATS`; errors as ``word_table``."""
    with mpl.rc_context(STYLE):
        figure = FigureDrawnOnce(figsize=(WIDTH, sum(panel.height for panel in panels)), layout="constrained")
        FigureCanvasAgg(figure)
        parts: Any = figure.subfigures(len(panels), 1, squeeze=False, height_ratios=[p.height for p in panels])
        for panel, part in zip(panels, parts[:, 0], strict=True):
            if len(panels) > 1:
                part.suptitle(panel.caption, x=0.01, ha="left", fontsize=9.5, fontweight="bold")
            panel.draw(part)
        translate_figure(figure, language)
        buffer = io.BytesIO()
        figure.savefig(buffer, format=suffix, dpi=150, metadata=METADATA[f".{suffix}"])
    return buffer.getvalue()


def row_of(figure: Figure | SubFigure, count: int, **options: Any) -> list[Axes]:
    """``count`` axes beside each other."""
    return list(figure.subplots(1, count, squeeze=False, **options)[0])
