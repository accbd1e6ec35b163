"""How every figure looks, and how it becomes a file.

Figures are 188 mm wide: they fit an A4 page as they are. Grey is normal; the one strong colour (``WRONG``) marks what
is out of tolerance and nothing else. Series have the colours of Okabe and Ito, which the colour-blind distinguish, and
a marker each. Figures are built without pyplot and hold no date: the same numbers give the same bytes.
"""

from __future__ import annotations

import io
import os
import secrets
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Polygon
from matplotlib.ticker import AutoLocator, FuncFormatter, MaxNLocator, NullFormatter

from groundstation.errors import SurveyError
from groundstation.survey.well.ellipsoid import ellipse_outline

Array = npt.NDArray[np.float64]
WIDTH = 7.4  # in, of every figure
WRONG = "#D55E00"
INK, GREY, LIGHT = "#333333", "#888888", "#DDDDDD"
SERIES = ("#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v")  # as many as have no common factor with the colours
STYLE: Any = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.edgecolor": GREY,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "legend.frameon": False,
    "figure.titlesize": 10.0,
    "figure.dpi": 100.0,
    "savefig.dpi": 200.0,
    "svg.hashsalt": "borechain",
    "pdf.fonttype": 42,
}
METADATA: dict[str, dict[str, Any]] = {
    ".pdf": {"CreationDate": None},
    ".png": {"Software": None},
    ".svg": {"Date": None},
}
NICE = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
LOGARITHMIC = 30.0  # ratio of the largest value to the smallest beyond which a linear axis hides the small ones
MOST_ELLIPSES = 60
styled = matplotlib.rc_context(STYLE)


class FigureDrawnOnce(Figure):
    """A figure that is drawn once when it is saved.

    matplotlib draws one with a layout engine before, without output, and then without the engine: the engine alone
    does the same, in three quarters of the time.
    """

    def draw(self, renderer: RendererBase) -> None:
        """Draw it, or only lay it out where it is drawn for the sake of that."""
        engine = self.get_layout_engine()
        if self.axes and isinstance(engine, ConstrainedLayoutEngine) and self.canvas.is_saving():
            engine.execute(self)
        else:
            super().draw(renderer)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure by the suffix of the file: all of it or, when anything fails, the old file stays.

    Raises
    ------
    SurveyError
        Names the suffixes, or what kept the file from being written.
    """
    kind = path.suffix.lower()
    if kind not in METADATA:
        raise SurveyError(f"{path}: expected one of {', '.join(sorted(METADATA))}, got {path.suffix!r}")
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        with matplotlib.rc_context(STYLE), part.open("wb") as file:
            figure.savefig(file, format=kind[1:], metadata=METADATA[kind])
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise SurveyError(f"{path}: {error.strerror or error}; expected a folder that can be written to") from error
    finally:
        part.unlink(missing_ok=True)


def svg_of(figure: Figure) -> str:
    """Text of a figure, for a document."""
    text = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(text, format="svg", metadata=METADATA[".svg"])
    return text.getvalue().decode()


def new_figure(height: float, title: str) -> Figure:
    """Empty figure, ``height`` in inches; the title stands in it as it is."""
    figure = FigureDrawnOnce(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06))
    figure.suptitle(plain_text(title), x=0.01, ha="left", weight="bold")
    return figure


def plain_text(name: str) -> str:
    """A name as it stands, for a figure: between two dollar signs matplotlib would read a formula."""
    return name.replace("$", r"\$")


def tick_text(value: float) -> str:
    """A tick's number: as it is up to a million, as a power of ten beyond."""
    if value >= 1e6:
        return f"$10^{{{np.log10(value):.3g}}}$"
    return str(np.format_float_positional(value, 6, fractional=False, trim="-"))


def tidy_ticks(figure: Figure) -> Figure:
    """Ticks at 1, 2 and 5 and their decades, written as plain numbers."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
        elif axis.get_scale() == "log":
            axis.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value)))
            axis.set_minor_formatter(NullFormatter())
    return figure


def in_unit(span: float) -> tuple[float, str]:
    """Scale and name of the unit for lengths up to ``span`` (m)."""
    return (1.0, "m") if span >= 5.0 else (100.0, "cm") if span >= 0.01 else (1000.0, "mm")


def log_if_needed(axes: Axes, values: Iterable[Array]) -> None:
    """Make the value axis logarithmic where a linear one would hide the small values."""
    every = np.concatenate([np.ravel(v) for v in values])
    positive = every[np.isfinite(every) & (every > 0.0)]
    if len(positive) and positive.max() > LOGARITHMIC * positive.min():
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0.0)


def above_zero(values: Array) -> Array:
    """Return the values with NaN for those of zero or below, which a logarithmic axis cannot show."""
    return np.where(values > 0.0, values, np.nan)


def draw_covariance_ellipse(axes: Axes, centre: Sequence[float] | Array, cov: Array, sigma: float, **look: Any) -> bool:
    """Draw the ellipse of a covariance (2, 2) around ``centre``, in the order of the axes; False when it has none."""
    if not float(np.trace(cov)) > 0.0:
        return False
    axes.add_patch(Polygon(np.asarray(centre) + ellipse_outline(cov, sigma), closed=True, gid="ellipse", **look))
    return True
