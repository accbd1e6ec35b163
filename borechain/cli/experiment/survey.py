"""Experiments of survey mathematics: regions of uncertainty, weights of readings, coverage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from borechain.cli.experiment.output import bar, keep, out_option, tell
from borechain.cli.faults import plain_faults
from borechain.cli.options import json_option
from borechain.cli.tables import CASE_COLUMNS, show_table, write_table

REGION_COLUMNS = (*CASE_COLUMNS, ("ratio", "ratio"))
SWEEP_COLUMNS = tuple(
    (name, name) for name in ("changed", "value_deg", "scheme", "station", "north_cm", "east_cm", "tvd_cm")
)
FILTERED_COLUMNS = (
    ("instrument", "instrument"),
    ("station", "station"),
    ("unfiltered_cm", "gyro, cm"),
    ("filtered_cm", "0.25 deg azimuth, cm"),
)
MAGNETIC_COLUMNS = (("station", "station"), ("magnetic_deg", "magnetic, deg"), ("filtered_deg", "filtered, deg"))
COVERAGE_COLUMNS = (
    ("case", "case"),
    ("published", "claimed, %"),
    ("ours", "inside, %"),
    ("half_interval", "+- (95 %)"),
    ("unit", "unit"),
)


@click.command("region-of-uncertainty")
@out_option
@json_option
@plain_faults
def regions(out: Path | None, as_json: bool) -> None:
    """Regions of uncertainty of wellbore 1 for five instruments, the printed tables beside ours.

    \b
    Example:
      borechain experiment region-of-uncertainty --out docs/results
    """
    from sim.studies.regions import run

    result = run()
    keep(out, result, REGION_COLUMNS, draw_regions)
    tell(result, REGION_COLUMNS, "Region of uncertainty of wellbore 1", as_json=as_json)
    if not as_json:
        show_table("Lateral error: gyro against a held azimuth", result["filtered"], FILTERED_COLUMNS)
        show_table("Azimuth error of a magnetic survey", result["magnetic"], MAGNETIC_COLUMNS)


def draw_regions(folder: Path, result: dict[str, Any]) -> None:
    """Figures 4.5-4.7."""
    import numpy as np

    from groundstation.report.plots_study import azimuth_error_figure, uncertainty_figure
    from groundstation.report.style import save
    from sim.studies.published import wellbore_1

    md = wellbore_1().md
    tables = {}
    for name in dict.fromkeys(row["instrument"] for row in result["cases"]):
        ours, printed = (np.zeros((len(md), 3)) for _ in range(2))
        for row in result["cases"]:
            if row["instrument"] == name:
                axis = ("north", "east", "tvd").index(row["axis"])
                ours[row["station"], axis], printed[row["station"], axis] = row["ours"], row["published"]
        tables[name] = (md[1:], ours[1:], printed[1:])
    save(uncertainty_figure(tables, level="1 or 2 sigma, as printed"), folder / "region-of-uncertainty.svg")
    held = {}
    for name in dict.fromkeys(row["instrument"] for row in result["filtered"]):
        rows = [row for row in result["filtered"] if row["instrument"] == name]
        raw, kept = (np.array([row[key] for row in rows]) for key in ("unfiltered_cm", "filtered_cm"))
        held[name] = (md[1:], raw, kept)
    title = "Lateral error: gyro against an azimuth held to 0.25 deg"
    save(azimuth_error_figure(held, 0.25, title), folder / "filtered.svg")


@click.command()
@out_option
@json_option
@plain_faults
def weighting(out: Path | None, as_json: bool) -> None:
    """Weights of the readings of one station when the hole moves, the published reductions beside ours.

    \b
    Example:
      borechain experiment weighting --out docs/results
    """
    from sim.studies.weighting import run

    result = run()
    keep(out, result, CASE_COLUMNS, draw_weighting)
    tell(result, CASE_COLUMNS, "Remaining error at the fourth stop", as_json=as_json)


def draw_weighting(folder: Path, result: dict[str, Any]) -> None:
    """Figures 4.28-4.37: what remains at station 2, and the table of all sweeps."""
    import numpy as np

    from groundstation.report.plots_study import weighting_figure
    from groundstation.report.style import save

    sweeps = result["sweeps"]
    write_table(folder / "weighting-sweeps.csv", sweeps, SWEEP_COLUMNS)
    for angle in ("inclination", "azimuth"):
        rows = [row for row in sweeps if row["changed"] == angle and row["station"] == 2]
        changes = np.array(sorted({row["value_deg"] for row in rows}))
        errors = {
            scheme: np.array([np.hypot(r["north_cm"], r["east_cm"]) for r in rows if r["scheme"] == scheme])
            for scheme in dict.fromkeys(row["scheme"] for row in rows)
        }
        start = changes - (1.0 if angle == "inclination" else 120.0)
        figure = weighting_figure(start, errors, angle, f"Error left at station 2 when its {angle} changed")
        save(figure, folder / f"weighting-{angle}.svg")


@click.command()
@click.option("--wells", type=click.IntRange(100, 1_000_000), default=2000, show_default=True)
@click.option(
    "--strings", type=click.IntRange(2, 10_000), default=100, show_default=True, help="Whose filters are run."
)
@out_option
@json_option
@plain_faults
def coverage(wells: int, strings: int, out: Path | None, as_json: bool) -> None:
    """How often the claimed ellipse holds the true position, over wells drilled with the rig's own numbers.

    \b
    Example:
      borechain experiment coverage --wells 2000
    """
    from sim.studies.coverage import WELLS_A_JOB, run

    with bar(strings + -(-wells // WELLS_A_JOB), quiet=as_json, what="strings, then wells") as step:
        result = run(wells, strings, step)
    keep(out, result, COVERAGE_COLUMNS, draw_coverage)
    tell(result, COVERAGE_COLUMNS, f"Coverage over {result['wells']} wells", as_json=as_json)


def draw_coverage(folder: Path, result: dict[str, Any]) -> None:
    """Claimed confidence against the share inside."""
    import numpy as np

    from groundstation.report.plots_study import coverage_figure
    from groundstation.report.style import save

    toe = [row for row in result["cases"] if row["case"].startswith("plan ellipse, toe")]
    claimed, inside = (np.array([row[key] for row in toe]) / 100.0 for key in ("published", "ours"))
    title = f"Toes inside the claimed ellipse, {result['wells']} wells"
    save(coverage_figure(claimed, {"plan ellipse at the toe": inside}, result["wells"], title), folder / "coverage.svg")
