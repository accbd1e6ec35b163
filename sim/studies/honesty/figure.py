"""NEES and coverage over hops."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from sim.campaign.campaign_figures import honesty_figure


def draw_figures(result: dict[str, Any]) -> dict[str, Figure]:
    """One figure."""
    where = "" if result["world"] == "assumed" else f" in a {result['world']} world"
    title = f"Honesty of {result['hops']} nodes{where}, {result['runs']} strings"
    return {result["experiment"]: honesty_figure(result["traces"], title)}
