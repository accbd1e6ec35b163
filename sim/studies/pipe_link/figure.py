"""Attenuation of the modes over frequency, and of TE11 over carbon and temperature."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from groundstation.report.plots_radio import pipe_figure
from sim.studies.pipe_link.run import ATTENUATIONS_DB, FREQUENCIES, RADIUS, RHO


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """The one figure."""
    del result
    printed = {name: (FREQUENCIES[1] * 1e-9, db) for name, db in ATTENUATIONS_DB.items()}
    title = "Attenuation inside a pipe of 3 cm radius"
    return {"pipe-link": pipe_figure(RADIUS, RHO, FREQUENCIES[1], title, printed)}
