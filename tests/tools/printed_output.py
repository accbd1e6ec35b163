"""What a command prints, as lines and cells, and an answer about a wall to print."""

from __future__ import annotations

import contextlib
import io
import re
from typing import Any

from click.testing import CliRunner, Result

from borechain.cli.survey.wall_command import SHOWN
from telemetry.media.zenoh_bus import QueryReply


def run_command(command: Any, *words: str) -> Result:
    """Run a command in this process."""
    return CliRunner().invoke(command, list(words))


def query_reply(key: str, payload: bytes = b"", error: str | None = None) -> QueryReply:
    """What came back from a key."""
    return QueryReply(key=key, payload=payload, error=error)


def printed(show: Any, *given: Any) -> list[str]:
    """Lines that a command prints."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        show(*given)
    return told.getvalue().splitlines()


def cells(line: str) -> list[str]:
    """Cells of a row of a printed table."""
    return [cell.strip() for cell in re.split("[│┃|]", line) if cell.strip()]


def wall_result(**change: Any) -> dict[str, Any]:
    """The answer about a wall of three joints and four columns, two of which are beyond their tolerance."""
    joints = [
        {"joint": name, "state": "open", "depth_m": 5.0, "thickness_m": thickness, "thinnest_at_m": 4.0,
         "probability": chance, "moved_apart_cm": 1.0, "direction_deg": 90.0, "tight_from_m": 0.0, "tight_to_m": 9.0}
        for name, thickness, chance in (("A-B", 0.3, 1e-4), ("B-C", 0.2, 0.3), ("C-D", None, 0.3), ("D-E", 0.1, 0.02))
    ]  # fmt: skip
    columns = [{"used_percent": used} for used in (99.9, 100.0, 140.0, None)]
    closing = [
        {"day": f"2026-05-{k:02}", "closed_percent": 5.0 * k, "open_joints": 20 - k, "largest_spacing": None}
        for k in range(1, SHOWN + 4)
    ]
    whole = {
        "verdict": "not tight", "wall": "W", "north": "grid", "stations_north": "grid", "depth_reference": "heads",
        "joints": joints, "findings": [], "warnings": [], "margin": None, "columns": columns, "closing": closing,
        "required_thickness_m": 0.25, "gaps": 2, "doubtful": 3, "allowed_probability": 0.01,
        "probability_of_any": 0.5, "worst": {"joint": "C-D", "depth_m": 5.0}, "extra_columns": [],
    }  # fmt: skip
    return whole | change
