"""Writes ``payloads.json``: payloads that every later codec must read, and write again bit for bit.

Recorded at schema version 2. Run it from the root of a checkout whose codec is trusted, with the database of a run:
``python tests/telemetry/golden/make_payloads.py out/run/state/ground/ground.sqlite``.
"""

import json
import math
import sqlite3
import sys
from pathlib import Path
from typing import Any

from telemetry.messages import (
    BASE,
    HOPS_UNKNOWN,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    Event,
    Hello,
    ImuMean,
    NodeFlag,
    NodeMode,
    NodeState,
    Receipt,
    Reply,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
    UploadPhase,
)
from telemetry.presentation.msgpack_codec import encode_message

FILE = Path(__file__).with_name("payloads.json")
EACH = 3  # recorded messages of one kind
COV = ((1e-6, 2e-7, -1e-7), (2e-7, 3e-6, 0.0), (-1e-7, 0.0, 4e-6))
MADE: tuple[Any, ...] = (
    Aiding(1.25, 1e-8, 2e-6, -0.5, 0.1, 1234.5, 77, 3),
    Aiding(0, 1e-8, 0, 0, 0, 1234, 2**33 + 1, 0),
    Aiding(math.tau, 1e-8, 2e-6, -0.5, 0.1, 1234.5, 77, 3, torque=850.0, torsion_var=1e-7, under_torque=True),
    Hello(BASE, 12, HOPS_UNKNOWN, NodeMode.BOOT, 1.0),
    Hello(250, 2**32 - 1, 250, NodeMode.FAULT, 0),
    TimeRequest(1000.125),
    TimeReply(1000.125, 2000.5, 2000.5, 990.25, 1.00001, 1e-9),
    NodeState(
        3, 1000.5, 2, NodeMode.TRACKING, 1.5, 1e-6, 2e-6, (1e-3, -2e-3, 3e-3), 1e-4, -1e-4, 1e-7, math.inf, 1e-9,
        NodeFlag.RESTORED | NodeFlag.AIDING_OLD, 70, 1,
    ),
    NodeState(
        3, 1000, 2, NodeMode.STILL, 1, 0, 0, (0, 0, 0), 0, 0, 0, 0.25, 0, NodeFlag.NONE, 2**53, 0, 7, bytes(range(8)),
        (1e-3, -2e-3, 1e-5),
    ),
    SurveyMeasurement(
        2, 9, 1000.5, 1, tuple(ImuMean((0.1 * k, -0.2, -9.8), COV) for k in range(16)), 1.0, 1e-6, 2e-6, 32, 18.5,
        NodeFlag.CLOCK_UNSYNCHRONISED,
    ),
    Receipt(3, 2**53),
    Command(7, (5 << 20) + 1, "static_record", {"seconds": 60.0}),
    Command(7, 1, "take_survey"),
    Command(7, 2, "align", {"method": "circle", "turns": 2, "again": True, "none": None}),
    Reply(7, (5 << 20) + 1, True, "recording 60.0 s"),
    Reply(7, 2, False, "a sensor is faulty"),
    Reply(7, 3, True, ""),
    Event(0, 1, 1000.5, Severity.WARNING, "overrun", {"missed": 3, "share": 0.5, "text": "x", "nothing": None}),
    BlockSegment(1, 5, 3, bytes(range(32)), 5, 2, bytes(range(192)), bytes(range(32, 64))),
    BlockStatus(1, 5, bytes(range(32)), UploadPhase.WAITING, 0b10111, 2, bytes(range(1, 33)), "waits"),
    StaticRecord(1, 6, 5, 1000.5, 1060.5, 114, (1e-3, 2e-3, 3e-3), COV, (0.1, 0.2, -9.8), COV, 31.5, False),
)  # fmt: skip


def recorded(database: Path) -> list[str]:
    """Some stored payloads of each kind, hex."""
    rows = sqlite3.connect(database).execute("SELECT kind, payload FROM messages ORDER BY id").fetchall()
    kinds = sorted({kind for kind, _ in rows})
    return [payload.hex() for kind in kinds for payload in [p for k, p in rows if k == kind][:EACH]]


if __name__ == "__main__":
    payloads = {"made": [encode_message(message).hex() for message in MADE], "recorded": recorded(Path(sys.argv[1]))}
    FILE.write_text(json.dumps(payloads, indent=1) + "\n")
