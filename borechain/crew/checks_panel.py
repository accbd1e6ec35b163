"""What the tubes say about each other, on the crew's screen: what is wrong, of what the ± is made, the next stop."""

from __future__ import annotations

import textwrap
from typing import Any

from rich.text import Text

from borechain.crew.picture import Picture
from borechain.crew.screen_panels import PLAN_HEIGHT, QUIET, WIDTH, fit_line

View = dict[str, Any]
MOST_BLUNDERS = 1  # which has up to six lines; the others are among the alarms
FEWEST_PARTS = 2
LEAST_PERCENT = 0.5  # of the variance at the toe


def checks_panel(picture: Picture) -> Text:
    """Eleven lines: whether all fits, what is wrong, the next stop, of what the ± is made, what would not be found."""
    found = picture.answers.get("adjustment")
    if found is None:
        return Text("what the tubes say: not heard yet".ljust(WIDTH), QUIET)
    lines = [fit_line(found["said"].upper() if found["blunders"] else found["said"], fit_style(found))]
    for row in found["blunders"][:MOST_BLUNDERS]:
        lines += blunder_lines(row)
    if found["next_stop"] is not None:
        lines.append(fit_line(f"next stop: {found['next_stop']['words']}", ""))
    below = [fit_line(f"not in it: {found['left_out']}", QUIET)]
    if found["unfound"] and not found["blunders"]:
        below = [*wrapped_lines(found["unfound"][0]["words"], QUIET), *below]
    room = max(PLAN_HEIGHT - len(lines) - len(below), 1 + FEWEST_PARTS)
    return Text("\n").join([*lines, *part_lines(found, room), *below][:PLAN_HEIGHT])


def wrapped_lines(line: str, style: str) -> list[Text]:
    """A sentence in as many lines as it needs."""
    return [fit_line(part, style) for part in textwrap.wrap(line, WIDTH, subsequent_indent="  ")]


def fit_style(found: View) -> str:
    """How the first line looks: calm while nothing is wrong."""
    if any(row["is_doubt"] for row in found["blunders"]):
        return "bold white on magenta"
    return "bold white on red" if found["blunders"] else "bold"


def blunder_lines(row: View) -> list[Text]:
    """What is wrong, what else it may be, and what it costs and asks for."""
    style = "yellow" if row["is_doubt"] else "bold red"
    lines = wrapped_lines(row["best"], style)
    if row["second"] is not None:
        lines += wrapped_lines(f"or {row['second']}", QUIET)
    cost = "" if row["moved_cm"] is None else f"; toe {row['moved_cm']:.1f} cm off were it not put right"
    return [*lines, *wrapped_lines(f"do: {row['todo']}{cost}", "bold")]


def part_lines(found: View, room: int) -> list[Text]:
    """Of what the standard deviation at the toe is made, the worst first, in so many lines with their head."""
    if found["sigma_toe_cm"] is None:
        return []
    whose = "" if found["counts"] else ", beside stations fused one by one"
    head = (
        f"sigma {found['sigma_toe_cm']:.2f} cm at {found['toe_md_m']:.1f} m{whose}; ± of 95 % is twice that; made of cm"
    )
    parts = [row for row in found["parts"] if row["percent"] >= LEAST_PERCENT][: room - 1]
    rows = [fit_line(f"{row['sigma_cm']:7.2f} {row['percent']:4.0f} %  {row['words']}", "") for row in parts]
    return [fit_line(head, "bold"), *rows]
