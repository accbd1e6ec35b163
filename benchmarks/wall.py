"""A wall of thousands of columns: time and memory of the command that judges it.

Run it as ``borechain bench wall`` or by itself. Columns of 30 m with 16 stations each, surveyed by one instrument: some
joints are sure to be too thin, or none is and all are doubtful, so that the whole wall is drawn. Memory is the largest
resident size of the process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

COUNTS = (1100, 4400)
LEANS_DEG = {"some too thin": (0.0, 0.3), "all doubtful": (0.025, 0.05)}
EXPECTED = (0, 3)  # exit status of a wall that is tight, and of one that is not
SPACING = 0.75  # m


def write(folder: Path, count: int, leans_deg: tuple[float, float]) -> Path:
    """Files of a wall whose columns lean between two inclinations, each its own way."""
    random = np.random.default_rng(1)
    heads, stations = ["column,north_m,east_m"], ["column,md_m,inclination_deg,azimuth_deg"]
    for k in range(count):
        heads.append(f"K{k},0,{SPACING * k:.2f}")
        lean, towards = random.uniform(*leans_deg), random.uniform(0.0, 360.0)
        stations += [f"K{k},{md},{lean:.3f},{towards:.1f}" for md in range(0, 31, 2)]
    (folder / "heads.csv").write_text("\n".join(heads) + "\n")
    (folder / "stations.csv").write_text("\n".join(stations) + "\n")
    file = folder / "wall.toml"
    file.write_text(
        f'radius_m = 0.6\nthickness_m = 0.8\nspacing_m = {SPACING}\nhead_sigma_m = 0.02\nheads = "heads.csv"\n'
        'stations = "stations.csv"\n'
    )
    return file


def judged(file: Path) -> tuple[float, float]:
    """Seconds that ``borechain wall`` takes, and its memory (MB)."""
    begin = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-m", "borechain", "wall", str(file), "--json"], stdout=subprocess.DEVNULL
    ) as command:
        _, status, used = os.wait4(command.pid, 0)
        command.returncode = os.waitstatus_to_exitcode(status)
    if command.returncode not in EXPECTED:
        raise RuntimeError(f"borechain wall {file}: expected exit status 0 or 3, got {command.returncode}")
    return time.perf_counter() - begin, used.ru_maxrss / 1e3


def run() -> dict[str, Any]:
    """Seconds and memory (MB) of every wall."""
    ratios: dict[str, dict[str, float | None]] = {}
    for kind, leans_deg in LEANS_DEG.items():
        for count in COUNTS:
            with tempfile.TemporaryDirectory(prefix="wall-") as folder:
                took, memory_mb = judged(write(Path(folder), count, leans_deg))
            row = {"ours": took, "peer": None, "ratio": None, "memory_mb": memory_mb}
            ratios[f"{count} columns, {kind}: {memory_mb:.0f} MB"] = row
    return {"bench": "wall", "ratios": ratios}


if __name__ == "__main__":
    print(json.dumps(run(), indent=2))
