"""The setup on the crew's screen: whether the rig is ready to drill, and what is known of it, the dearest first."""

from __future__ import annotations

import datetime
from typing import Any

from rich.text import Text

from borechain.crew.picture import Picture
from borechain.crew.screen_panels import PLAN_HEIGHT, QUIET, fit_line

View = dict[str, Any]
HEAD_LINES = 4
WRONG = ("not checked", "contradicted")
HOUR_MIN = 90.0  # min, from which on an age is told in hours
LEAST_CM = 0.05  # at the toe, below which nothing is lost by what was not told


def setup_panel(picture: Picture, now_utc: datetime.datetime) -> Text:
    """Eleven lines: ready or not, what costs most, what to do next, and the items, what is missing first."""
    found = picture.answers.get("setup")
    if found is None:
        return Text("setup: not heard yet".ljust(80), QUIET)
    told = "READY TO DRILL: north and every joint are told"
    ready = told if found["ready"] else f"NOT READY TO DRILL, {found['hold']}"
    lines = [fit_line(ready, "bold" if found["ready"] else "bold white on magenta")]
    lines += [fit_line(f"costs most at the toe: {found['costs_most']}", "bold")]
    lines += [fit_line(f"next: {found['todo']}", "bold")]
    lines += [fit_line(f"{'item':15} {'toe cm':>6} {'value':>15} {'sigma':>9} {'unit':6} {'age':>6} source", "bold")]
    lines += [setup_line(row, now_utc) for row in found["items"][: PLAN_HEIGHT - HEAD_LINES]]
    return Text("\n").join(lines)


def setup_line(row: View, now_utc: datetime.datetime) -> Text:
    """One item."""
    value = " to ".join(f"{number:.4g}" for number in row["value"]) or ("of its node" if row["told"] else "any")
    age = age_text(row["utc"], now_utc)
    line = f"{row['item']:15} {row['toe_cm']:6.1f} {value:>15} {row['sigma']:9.3g} {row['unit']:6} {age:>6}"
    style = "yellow" if not row["told"] and row["toe_cm"] >= LEAST_CM else QUIET
    if row["missing"] or row["check"].startswith(WRONG):
        style = "bold red"
    return fit_line(f"{line} {row['source']}{' ' * bool(row['check'])}{row['check']}", style)


def age_text(utc: str, now_utc: datetime.datetime) -> str:
    """Age of what was told at a time of day; a dash where no order told it."""
    if not utc:
        return "-"
    minutes = max((now_utc - datetime.datetime.fromisoformat(utc)).total_seconds(), 0.0) / 60.0
    return f"{minutes:.0f} min" if minutes < HOUR_MIN else f"{minutes / 60.0:.0f} h"


def parse_order(line: str) -> tuple[str, dict[str, str]]:
    """Name and parameters of an order as it is typed: ``joint tube=3 angle_deg=12.5 sigma_deg=0.05``.

    Raises
    ------
    ValueError
        Naming the word that is no parameter.
    """
    name, *words = line.split() or [""]
    if not name:
        raise ValueError("expected the name of an order, such as north action=tell angle_deg=12 sigma_deg=0.3")
    parameters = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals or not key:
            raise ValueError(f"{name}: expected parameters as name=value, got {word:.40}")
        parameters[key] = value
    return name, parameters
