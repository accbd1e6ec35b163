"""What came of a run: as its ground station answers, as the JSON object of the command, and for people."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.console_tables import table_console

if TYPE_CHECKING:
    from sim.world.world import World
    from telemetry.media.zenoh_bus import ZenohBus

NAMED = 5  # surveys named that are missing
ASKED = ("stations", "measurements", "column", "alarms", "recalibration", "wall")


def ask_surveys(bus: ZenohBus, rig_name: str) -> dict[str, Any]:
    """Stations, trajectory and measurements as any operator would get them."""
    return {path: get_json(bus, selector_of(rig_name, path)) for path in ASKED}


def selector_of(rig_name: str, path: str, parameters: Mapping[str, str] | None = None) -> str:
    """Selector of an answer of the ground station."""
    asked = ";".join(f"{name}={value}" for name, value in (parameters or {}).items())
    return f"borechain/{rig_name}/ground/{path}" + (f"?{asked}" if asked else "")


def get_json(bus: ZenohBus, selector: str) -> Any:
    """One reply of the ground station."""
    from sim.errors import RigError

    replies = bus.get(selector, timeout=10.0)
    if len(replies) != 1 or replies[0].error is not None:
        raise RigError(f"{selector}: expected one answer of the ground station, got {len(replies)}")
    return json.loads(replies[0].payload)


def result_of(answers: dict[str, Any], world: World) -> dict[str, Any]:
    """The JSON object of the command."""
    from sim.rig.calibration_report import calibration_result
    from sim.rig.report import figures_of_merit, missing_surveys, station_digest, station_table

    stations = station_table(answers["stations"]["stations"], world)
    measurements = answers["measurements"]["measurements"]
    result: dict[str, Any] = {
        "stations": stations,
        "figures": figures_of_merit(stations, measurements, world),
        "measurements": len(measurements),
        "column": {key: answers["column"][key] for key in ("worst", "projection", "dominant")},
        "missing": missing_surveys(measurements, world),
        "alarms": answers["alarms"]["active"],
        "rig_alarms": answers["alarms"]["rig"],
        "rig_s": round(world.end - world.begin, 3),
        "digest": station_digest(stations),
    }
    if "wall" in answers:
        result["wall"] = answers["wall"]["wall"]
    if world.rack is not None:
        result["calibration"] = calibration_result(answers["recalibration"], measurements, world)
    return result


def missing_surveys_line(missing: list[dict[str, Any]], measured: int, folder: Path) -> str:
    """Line about surveys that the stops of a run asked for and that were not taken."""
    named = ", ".join(f"tube {row['tube']} at {row['bit_md_m']:g} m of the bit" for row in missing[:NAMED])
    more = f" and {len(missing) - NAMED} more" if len(missing) > NAMED else ""
    return f"expected {measured + len(missing)} surveys, {len(missing)} are missing: {named}{more}; files in {folder}"


def show_result(result: dict[str, Any], folder: Path) -> None:
    """Station table beside the truth, and the figures, for people."""
    from rich.table import Table

    paper = table_console(100)
    table = Table(title="Stations: measured, below it the truth")
    for name in ("#", "MD m", "looks", "incl deg", "azi deg", "north m", "east m", "TVD m", "sigma N cm", "sigma E cm"):
        table.add_column(name, justify="right")
    for s in result["stations"]:
        t = s["truth"]
        lines = [
            f"{s[key]:.{digits}f}\n[dim]{t[key]:.{digits}f}[/dim]"
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
