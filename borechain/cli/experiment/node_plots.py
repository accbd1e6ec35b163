"""Plots of the node's experiments, as figures 4.11-4.22 of the thesis show them."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def draw_modes(folder: Path, result: dict[str, Any]) -> None:
    """Yaw over time and the reach of every case, figures 4.11-4.22."""
    from groundstation.report.plots_node import Reach, YawPanel, reach_figure, yaw_figure
    from groundstation.report.style import save
    from sim.studies.node_modes import CASES
    from sim.studies.node_published import FORMS

    name, traces = result["experiment"], result["traces"]
    panels = []
    for case in CASES[name]:
        seen = traces[case.name]["t"] >= -130.0
        t, one = traces[case.name]["t"][seen], traces[case.name]["one"][seen]
        panels.append(YawPanel(case.name, t, one, {"all seeds": traces[case.name]["rms"][seen]}, case.yaw))
    save(yaw_figure(panels, f"Yaw error: {name}, {result['seeds']} seeds"), folder / f"{name}.svg")
    reaches: dict[str, list[Reach]] = {}
    figures = {(r["case"], r["quantity"]): r["ours"] for r in result["cases"]}
    for r in result["cases"]:
        if r["to_reach"] is not None:
            published = float(r["published"]) if isinstance(r["published"], float) else None
            simulated = [figures[key] for form in FORMS if (key := (f"{r['case']}, {form}", r["quantity"])) in figures]
            reach = Reach(r["case"], r["ours"], r["low"], r["high"], published, r["to_reach"], tuple(simulated))
            reaches.setdefault(r["quantity"].capitalize(), []).append(reach)
    save(reach_figure(reaches, f"Reach: {name}, {result['seeds']} seeds"), folder / f"{name}-reach.svg")


def draw_tuning(folder: Path, result: dict[str, Any]) -> None:
    """Error of the bias over time."""
    from groundstation.report.plots_node import bias_figure
    from groundstation.report.style import save
    from sim.studies.node_tuning import RESIDUAL_DPS

    series = {name: (trace["t"], trace["bias"]) for name, trace in result["traces"].items()}
    groups = {
        f"Factor {letter}": {name: both for name, both in series.items() if name.startswith(("A = B", letter))}
        for letter in "BA"
    }
    save(bias_figure(groups, abs(RESIDUAL_DPS), f"Tuning factors, {result['seeds']} seeds"), folder / "tuning.svg")


def draw_delay(folder: Path, result: dict[str, Any]) -> None:
    """Yaw error over the delay."""
    import numpy as np

    from groundstation.report.plots_node import delay_figure
    from groundstation.report.style import save
    from sim.studies.node_delay import DELAYS_MS, FORMS, STUDIED_DEG, TO_REACH_DEG

    panels: dict[str, dict[str, Any]] = {}
    for quantity, state in (("yaw, rotating", "Rotating"), ("yaw, at rest", "At rest")):
        for form in FORMS:
            found = [r["ours"] for r in result["cases"] if r["quantity"] == quantity and r["form"] == form]
            panels.setdefault(state, {})[form] = (np.array(DELAYS_MS), np.array(found))
    studied = np.array([[ms, deg] for (_, ms), deg in STUDIED_DEG.items()]).T
    title = f"Delay of the aiding, {result['seeds']} seeds"
    save(delay_figure(panels, (studied[0], studied[1]), TO_REACH_DEG, title), folder / "delay.svg")


def draw_outage(folder: Path, result: dict[str, Any]) -> None:
    """NEES over hops."""
    import numpy as np

    from groundstation.report.plots_node import consistency_figure
    from groundstation.report.style import save
    from sim.studies.node_outage import EVERY, HOPS, STATES

    panels: dict[tuple[str, str], dict[str, Any]] = {}
    for state in STATES:
        for r in result["cases"]:
            if r["state"] == state:
                key = (state, f"{r['outage_s']:g} s off" if r["outage_s"] else "no outage")
                values = np.array([r[f"hop_{k + 1}"] for k in range(HOPS)])
                panels.setdefault(key, {})[f"{100.0 * r['loss']:g} % lost a hop"] = values
    save(consistency_figure(panels, EVERY, f"NEES, {result['seeds']} seeds"), folder / "outage.svg")
