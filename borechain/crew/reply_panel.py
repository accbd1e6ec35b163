"""What a tube answered to an order that was typed here, such as the check of its board; what is wrong stands first."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

from rich.text import Text

from borechain.crew.screen_panels import PLAN_HEIGHT, QUIET, WIDTH, fit_line

PARTS_WRONG = "wrong"  # value of a reply that names others


def reply_panel(order: str, values: Mapping[str, Any]) -> Text:
    """At most eleven lines: the order, each value that the reply calls wrong on its own, then all others together."""
    wrong = [name for name in str(values.get(PARTS_WRONG, "")).split(", ") if name in values]
    lines = [fit_line(f"{order}    [esc] back", "bold")]
    for name in wrong:
        lines += _wrapped(f"{name}: {_said(values[name])}", "bold red")
    rest = [f"{name}: {_said(value)}" for name, value in values.items() if name not in (*wrong, PARTS_WRONG)]
    lines += _wrapped("; ".join(rest), "")
    if len(lines) > PLAN_HEIGHT:
        lines = [*lines[: PLAN_HEIGHT - 1], fit_line(f"and {len(lines) - PLAN_HEIGHT + 1} lines more", QUIET)]
    return Text("\n").join(lines)


def _wrapped(line: str, style: str) -> list[Text]:
    return [fit_line(part, style) for part in textwrap.wrap(line, WIDTH, subsequent_indent="  ")]


def _said(value: Any) -> str:
    """A value as people read it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
