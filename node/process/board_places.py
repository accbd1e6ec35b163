"""What a board has beside its sensors: CAN controllers, clock, disk, keys, compiled kernels.

Source for CAN: ``ip -json -details link show`` (iproute2), ``linkinfo.info_data``: state, bit rates, error counters.
"""

from __future__ import annotations

import datetime
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any, Final

from node.process.board_findings import BoardFinding, bad_finding, good_finding
from telemetry.errors import BorechainError
from telemetry.transport.key_ring import key_file, read_ring

BIT_RATE, DATA_BIT_RATE = 500_000, 2_000_000  # bit/s, of our units
ACTIVE: Final = "ERROR-ACTIVE"
MOST_ERRORS: Final = 95  # of a controller's counter; at 96 it warns
LEAST_FREE: Final = 200e6  # bytes: a year of surveys, and room to write anew
EARLIEST: Final = datetime.datetime(2025, 1, 1, tzinfo=datetime.UTC)  # of a clock that was set
TIME_LIMIT: Final = 10.0  # s, of a program
SOON: Final = datetime.timedelta(days=14)


def check_can(part: str, interface: str, *, is_fd: bool = True, limit: float = TIME_LIMIT) -> BoardFinding:
    """One CAN controller: up, active, with the bit rates of our units, few errors; ``limit`` (s) of the program."""
    try:
        done = subprocess.run(
            ["ip", "-json", "-details", "link", "show", interface],
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
        )
        rows: list[dict[str, Any]] = json.loads(done.stdout) if done.returncode == 0 else []
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        return bad_finding(part, f"{interface}: ip: {error}")
    if not rows:
        return bad_finding(
            part, f"{interface}: expected a CAN interface of this board, got none: is its overlay loaded?"
        )
    data = rows[0].get("linkinfo", {}).get("info_data", {})
    if rows[0].get("link_type") != "can":
        return bad_finding(part, f"{interface}: expected CAN, got {rows[0].get('link_type')}")
    wrong = _can_faults(rows[0], data, is_fd=is_fd)
    rate = data.get("bittiming", {}).get("bitrate")
    kind = "FD" if "FD" in data.get("ctrlmode", []) else "classic"
    return (
        bad_finding(part, f"{interface}: {wrong}")
        if wrong
        else good_finding(part, f"{interface}: {kind}, {rate} bit/s")
    )


def _can_faults(row: dict[str, Any], data: dict[str, Any], *, is_fd: bool) -> str:
    """The first of what is wrong with a CAN interface; empty where nothing is."""
    rate, data_rate = (data.get(name, {}).get("bitrate") for name in ("bittiming", "data_bittiming"))
    counters = data.get("berr_counter", {})
    has_fd = "FD" in data.get("ctrlmode", [])
    faults = (
        ("UP" not in row.get("flags", []), "it is down: systemctl enable --now borechain-can@..."),
        (
            data.get("state") != ACTIVE,
            f"expected state {ACTIVE}, got {data.get('state')}: look at its wires and its termination",
        ),
        (rate != BIT_RATE, f"expected {BIT_RATE} bit/s, got {rate}"),
        (is_fd and not has_fd, "expected CAN FD, got classic: load the overlay of an FD controller, or say --classic"),
        (is_fd and data_rate != DATA_BIT_RATE, f"expected {DATA_BIT_RATE} bit/s for data, got {data_rate}"),
        (
            max(counters.get("tx", 0), counters.get("rx", 0)) > MOST_ERRORS,
            f"expected at most {MOST_ERRORS} errors, got {counters}",
        ),
    )
    return next((text for is_wrong, text in faults if is_wrong), "")


def check_clock(now: datetime.datetime) -> BoardFinding:
    """Whether the clock was ever set: keys have dates; the string's own time needs none."""
    text = f"{now:%Y-%m-%d %H:%M} UTC"
    if now < EARLIEST:
        return bad_finding("clock", f"expected a clock that was set, got {text}")
    return good_finding("clock", text)


def check_disk(folder: Path) -> BoardFinding:
    """Whether the folder of the state takes a file, forced to the disk, and how much room is left."""
    probe = folder / ".board-check"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with probe.open("wb") as file:
            file.write(b"0" * 4096)
            file.flush()
            os.fsync(file.fileno())
        probe.unlink()
        free = shutil.disk_usage(folder).free
    except OSError as error:
        return bad_finding("disk", f"{folder}: {error.strerror}")
    text = f"{folder}: {free / 1e6:.0f} MB free"
    return (
        good_finding("disk", text)
        if free >= LEAST_FREE
        else bad_finding("disk", f"{text}, expected {LEAST_FREE / 1e6:.0f}")
    )


def check_keys(place: Path, address: int, now: datetime.datetime) -> BoardFinding:
    """Whether the keys can be read, are of this process, and until when they hold."""
    try:
        ring = read_ring(key_file(place, address), address, now)
    except BorechainError as error:
        return bad_finding("keys", str(error))
    newest = ring.generations[-1]
    if newest.retires_at is not None and newest.retires_at <= now + SOON:
        return bad_finding("keys", f"generation {newest.number} holds until {newest.retires_at:%Y-%m-%d %H:%M} UTC")
    if ring.warnings:
        return bad_finding("keys", ring.warnings[0])
    return good_finding("keys", f"rig {ring.rig}, generation {newest.number} of {newest.made_at:%Y-%m-%d}")


def check_kernels(folder: Path) -> BoardFinding:
    """Whether the step of a node was compiled on this board: it takes half a minute at a start else."""
    if any(folder.rglob("node_step.node_step-*.nbi")):
        return good_finding("kernels", f"compiled in {folder}")
    return bad_finding(
        "kernels", f"not compiled in {folder}: run node.kernels.step.precompile.warm_up once (docs/deploy.md)"
    )
