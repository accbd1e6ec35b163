"""Experiments of the node's filter: update modes, single updates, strings of nodes, tuning, delay, outages."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from borechain.faults import plain_faults
from borechain.tables import Columns, show_table, write_table

Run = Callable[[int, Callable[[], None]], dict[str, Any]]
COLUMNS: Columns = tuple(
    (name, name) for name in ("case", "quantity", "published", "ours", "low", "high", "unit", "to_reach", "reached")
)
SHOWN_COLUMNS: Columns = (
    ("case", "case"),
    ("quantity", "rms, deg, of"),
    ("published", "published"),
    ("ours", "ours"),
    ("interval", "95 %"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
)
TUNING_COLUMNS: Columns = (
    ("case", "case"),
    ("published", "published"),
    ("ours", "bias converged"),
    ("unit", "unit"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
    ("left_dps", "error left, deg/s"),
    ("scatter_dps", "scatter, deg/s"),
    ("yaw_rms_deg", "yaw rms at rest, deg"),
)
OUTAGE_COLUMNS: Columns = (
    ("case", "case"),
    *((f"hop_{k}", f"hop {k}") for k in range(1, 6)),
    ("published", "published"),
    ("ours", "ours"),
    ("unit", "unit"),
    ("to_reach", "to_reach"),
    ("reached", "reached"),
)
seeds_option = click.option("--seeds", type=click.IntRange(2, 10_000), default=40, show_default=True)
out_option = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for the table and plots."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else on stdout.")


def options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that all of these have."""
    return seeds_option(out_option(json_option(plain_faults(command))))


@click.command("update-modes")
@options
def update_modes(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw and azimuth at rest under continuous aiding and under 20 s on and 5 to 60 s off.

    \b
    Example:
      borechain experiment update-modes --seeds 200 --out docs/results
    """
    modes("update-modes", seeds, out, as_json=as_json)


@click.command("single-updates")
@options
def single_updates(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw and azimuth at rest under single updates from one a second to one a minute.

    \b
    Example:
      borechain experiment single-updates --seeds 200 --out docs/results
    """
    modes("single-updates", seeds, out, as_json=as_json)


@click.command("two-nodes")
@options
def two_nodes(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw and azimuth at rest of two nodes, the second aided through the first.

    \b
    Example:
      borechain experiment two-nodes --seeds 200 --out docs/results
    """
    modes("two-nodes", seeds, out, as_json=as_json)


@click.command("fifty-nodes")
@options
def fifty_nodes(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw of the last of fifty nodes: clocks off by 5 ms a joint, 30 % lost, 20 s on and 30 s off.

    \b
    Example:
      borechain experiment fifty-nodes --seeds 40 --out docs/results
    """
    modes("fifty-nodes", seeds, out, as_json=as_json)


def modes(name: str, seeds: int, out: Path | None, *, as_json: bool) -> None:
    """Run one of the experiments that differ in their cases alone."""
    from sim.experiments.node_modes import batches, run

    result = conduct(lambda n, step: run(name, n, step), seeds, batches(name), as_json=as_json)
    keep(out, result, COLUMNS, draw_modes)
    tell(result, SHOWN_COLUMNS, f"{name}, {seeds} seeds", as_json=as_json)


@click.command()
@options
def tuning(seeds: int, out: Path | None, as_json: bool) -> None:
    """Time from the stop until the bias is found, over the tuning factors A and B.

    \b
    Example:
      borechain experiment tuning --seeds 200 --out docs/results
    """
    from sim.experiments.node_tuning import FACTORS, run

    result = conduct(run, seeds, len(FACTORS), as_json=as_json)
    keep(out, result, TUNING_COLUMNS, draw_tuning)
    tell(result, TUNING_COLUMNS, f"Tuning, {seeds} seeds", as_json=as_json)


@click.command()
@options
def delay(seeds: int, out: Path | None, as_json: bool) -> None:
    """Yaw error over the delay of the aiding, with its time of validity and with that of its arrival.

    \b
    Example:
      borechain experiment delay --seeds 200 --out docs/results
    """
    from sim.experiments.node_delay import DELAYS_MS, FORMS, run

    result = conduct(run, seeds, len(DELAYS_MS) * len(FORMS), as_json=as_json)
    keep(out, result, COLUMNS, draw_delay)
    tell(result, SHOWN_COLUMNS, f"Delay, {seeds} seeds", as_json=as_json)


@click.command()
@options
def outage(seeds: int, out: Path | None, as_json: bool) -> None:
    """Consistency (NEES) of a string of five over the length of outages and the loss of every hop.

    \b
    Example:
      borechain experiment outage --seeds 200 --out docs/results
    """
    from sim.experiments.node_outage import OUTSIDE, USUAL, batches, run

    result = conduct(run, seeds, batches(), as_json=as_json)
    keep(out, result, OUTAGE_COLUMNS, draw_outage)
    tell(result, OUTAGE_COLUMNS, f"NEES of five hops, {seeds} seeds", as_json=as_json)
    if not as_json:
        low, high = USUAL
        click.echo(f"{result['outside']:.0%} of the cells outside {low:g}..{high:g}, allowed {OUTSIDE:.0%}")
        errors = result["standard_errors"]
        click.echo(f"standard error of a cell {errors['epochs']:.2f}, with joints {errors['joints']:.2f}")


COMMANDS = (update_modes, single_updates, two_nodes, fifty_nodes, tuning, delay, outage)


def conduct(run: Run, seeds: int, batches: int, *, as_json: bool) -> dict[str, Any]:
    """Run an experiment under a progress bar."""
    with bar(seeds * batches, quiet=as_json) as step:
        return run(seeds, step)


@contextmanager
def bar(total: int, *, quiet: bool) -> Iterator[Callable[[], None]]:
    """Bar on stderr; yields the function that moves it on by one."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=quiet) as shown:
        task = shown.add_task("runs", total=total)
        yield lambda: shown.advance(task)


def keep(
    folder: Path | None, result: dict[str, Any], columns: Columns, draw: Callable[[Path, dict[str, Any]], None]
) -> None:
    """Keep table and plots under the experiment's name."""
    if folder is not None:
        write_table(folder / f"{result['experiment']}.csv", result["cases"], columns)
        draw(folder, result)


def tell(result: dict[str, Any], columns: Columns, title: str, *, as_json: bool) -> None:
    """Print the result: JSON for scripts, the table for people."""
    if as_json:
        click.echo(json.dumps({key: value for key, value in result.items() if key != "traces"}))
    else:
        intervals = [{"interval": f"{r['low']:.3g}-{r['high']:.3g}"} if "low" in r else {} for r in result["cases"]]
        show_table(title, [r | i for r, i in zip(result["cases"], intervals, strict=True)], columns)


def draw_modes(folder: Path, result: dict[str, Any]) -> None:
    """Yaw over time and the reach of every case, figures 4.11-4.22."""
    from groundstation.report.plots_node import Reach, YawPanel, reach_figure, yaw_figure
    from groundstation.report.style import save
    from sim.experiments.node_modes import CASES
    from sim.experiments.node_published import FORMS

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
    from sim.experiments.node_tuning import RESIDUAL_DPS

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
    from sim.experiments.node_delay import DELAYS_MS, FORMS, STUDIED_DEG, TO_REACH_DEG

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
    from sim.experiments.node_outage import EVERY, HOPS, STATES

    panels: dict[tuple[str, str], dict[str, Any]] = {}
    for state in STATES:
        for r in result["cases"]:
            if r["state"] == state:
                key = (state, f"{r['outage_s']:g} s off" if r["outage_s"] else "no outage")
                values = np.array([r[f"hop_{k + 1}"] for k in range(HOPS)])
                panels.setdefault(key, {})[f"{100.0 * r['loss']:g} % lost a hop"] = values
    save(consistency_figure(panels, EVERY, f"NEES, {result['seeds']} seeds"), folder / "outage.svg")
