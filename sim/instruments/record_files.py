"""Records of the synthetic instruments as files, in the formats of a real laboratory, with the truth beside."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from sim.instruments.instrument import Instrument

TRUTH = "truth.json"


def write_records(folder: Path, seed: int, instruments: Iterable[Instrument]) -> list[str]:
    """Write the records of every instrument and their truth; returns the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files: dict[str, bytes] = {}
    truth: dict[str, Any] = {}
    for instrument in instruments:
        records = instrument.records(seed)
        files |= records.files
        truth |= records.truth
    files[TRUTH] = (json.dumps(truth, indent=1) + "\n").encode()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [str(folder / name) for name in files]
