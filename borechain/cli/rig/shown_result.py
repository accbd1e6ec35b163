"""What came of a run, for people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from borechain.cli.console_tables import table_console


def show_result(result: dict[str, Any], folder: Path) -> None:
    """Station table beside the truth, and the figures, for people."""
    from rich.table import Table
    from rich.text import Text

    paper = table_console(100)
    table = Table(title="Stations: measured, below it the truth")
    for name in ("#", "MD m", "looks", "incl deg", "azi deg", "north m", "east m", "TVD m", "sigma N cm", "sigma E cm"):
        table.add_column(name, justify="right")
    for s in result["stations"]:
        t = s["truth"]
        lines = [
            Text.assemble(f"{s[key]:.{digits}f}\n", (f"{t[key]:.{digits}f}", "dim"))
            for key, digits in (("inclination_deg", 3), ("azimuth_deg", 2), ("north_m", 4), ("east_m", 4), ("tvd_m", 4))
        ]
        sigmas = [f"{100.0 * s[key]:.3f}" for key in ("sigma_north_m", "sigma_east_m")]
        table.add_row(str(s["station"]), f"{s['md_m']:.2f}", str(s["measurements"]), *lines, *sigmas)
    paper.print(table)
    for name, value in result["figures"].items():
        values = value if isinstance(value, list) else [value]
        shown = " ".join("-" if v is None else f"{v:.4f}" for v in values)
        paper.print(f"{name:22} {shown}")
    show_column(result)
    for alarm in result["rig_alarms"]:
        click.echo(f"alarm  {alarm['code']:15} {alarm['subject']}: {alarm['detail']}")
    if "calibration" in result:
        show_calibration(result["calibration"])
    processes = "one process" if result["processes"] == 1 else f"{result['processes']} processes"
    paper.print(
        f"{len(result['stations'])} stations, {result['measurements']} measurements, {processes}, "
        f"{result['rig_s']:.0f} s of rig time in {result['wall_s']:.1f} s"
    )
    paper.print(f"digest {result['digest']}\nfiles  {folder}", soft_wrap=True)


def show_column(result: dict[str, Any]) -> None:
    """Where the column is against its design, in a line each."""
    for name in ("worst", "projection"):
        d = result["column"][name]
        if d is not None:
            click.echo(
                f"column {name:15} {d['deviation_cm']:.1f} ± {d['sigma_cm']:.2f} cm "
                f"towards {d['direction_deg']:.0f} deg at {d['md_m']:.1f} m, {d['used_percent']:.0f} % of the tolerance"
            )
    if (ahead := result["column"]["ahead"]) is not None:
        within, spread = ahead["within_percent"], ahead["half_width_cm"]
        click.echo(f"column {'ends':15} ± {spread:.1f} cm (95 %), within its limit with {within:.0f} %")
    for alarm in result["alarms"]:
        click.echo(f"alarm  {alarm['kind']:15} {alarm['level_percent']} % of the tolerance at {alarm['md_m']:.1f} m")


def show_calibration(calibration: dict[str, Any]) -> None:
    """What the calibration in the field was good for, and the block of each tube."""
    errors = calibration["inclination_rms_deg"]
    shown = ", ".join(f"{name} {'-' if value is None else f'{value:.4f}'}" for name, value in errors.items())
    click.echo(f"calibration, inclination_rms_deg: {shown}")
    for t in calibration["tubes"]:
        cut = f", after its power cut {t['hash_after_restart'][:8]}" if t["restarted"] else ""
        click.echo(f"tube {t['tube']:<3} block {t['hash_before'][:8]} -> {t['hash'][:8]} version {t['version']}{cut}")
