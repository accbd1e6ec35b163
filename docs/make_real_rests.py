"""Calibrate the real sensors of ``tests/data/records`` from their rests: ``python docs/make_real_rests.py``, 15 s.

Writes ``results/rests.csv``: how wrong each reads gravity and turns, before and after, and where a fit did not look;
and the pictures of ``first-sensor.md``, by its own commands.
"""

from __future__ import annotations

import csv
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

from groundstation.report.calibrations.calibration_answer import answer_calibration  # noqa: E402
from groundstation.report.calibrations.calibration_request import RecordWords, RestsRequest  # noqa: E402

RECORDS = DOCS.parent / "tests" / "data" / "records"
SENSORS = {"mpu9150-imu0": "MPU-9150, first", "mpu9150-imu1": "MPU-9150, second"}
WORDS = RecordWords(gyro=f"{2000 / 32768} deg/s", accel=f"{9.81 / 2048} m/s2")
GRAVITY, RATE, DAY = 9.81, 100.0, "2026-11-27"


def row_of(name: str) -> dict[str, str | int]:
    """One line of the table, of the sensor whose record has this name."""
    request = RestsRequest(RECORDS / f"{name}-100hz.npy", gravity=GRAVITY, rate=RATE, words=WORDS)
    found: dict[str, Any] = answer_calibration(request, DAY).result
    turned = found["gyroscope"]
    return {
        "sensor": SENSORS[name],
        "rests": len(found["rests"]),
        "before_mps2": f"{found['before_rms']:.4f}",
        "after_mps2": f"{found['residual_rms']:.5f}",
        "not_used_mps2": f"{found['left_out_rms']:.5f}",
        "turns": turned["turns"],
        "turns_before_deg": f"{turned['uncalibrated_rms_deg']:.3f}",
        "turns_not_used_deg": f"{turned['left_out_rms_deg']:.4f}",
    }


def draw_pictures() -> None:
    """Run the commands of the page that draw, and keep what they drew."""
    page = (DOCS / "first-sensor.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for line in re.findall(r"^    borechain (calibrate .* --plot .*)$", page, re.MULTILINE):
            words = [str(DOCS.parent / word) if word.startswith("tests/") else word for word in shlex.split(line)]
            subprocess.run([sys.executable, "-m", "borechain", *words], cwd=folder, check=True, capture_output=True)
            (drawn := Path(folder, words[-1])).replace(DOCS / f"first-sensor-{drawn.name}")


if __name__ == "__main__":
    rows = [row_of(name) for name in SENSORS]
    with (DOCS / "results" / "rests.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    draw_pictures()
