"""Records of synthetic instruments as files, in the formats of a real laboratory, with the truth beside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_files import FULL_HEADER
from sim.instruments.mwd_jig import DIP, FIELD, BenchRecord, Heating, Tool, draw_tool, make_design, measure
from sim.instruments.static_records import StaticNoise, static_record
from sim.studies.allan.run import BIAS_INSTABILITY, RANDOM_WALK, RATE
from sim.studies.mwd.run import CONTROL, control_design

STATIC_DURATION = 1800.0  # s
UNITS = "Tilt and tool face in deg, temperature in C, accelerometers A B C and magnetometers X Y Z in volts"


def write_records(folder: Path, seed: int) -> list[str]:
    """Write the records of one tool and one gyroscope; returns the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    tool = draw_tool(seed)
    designs = {
        "mwd-room": (
            make_design(Heating.ROOM, seed),
            seed,
            "one temperature, 7 tilts, 12 tool faces each: 12 parameters",
        ),
        "mwd-oven": (make_design(Heating.SHUFFLED, seed), seed, "heated anew at each of 7 tilts, 24 tool faces each"),
        "mwd-control": (control_design(), seed + CONTROL, "12 tool faces at one attitude: quality control"),
    }
    for name, (design, draw, words) in designs.items():
        lines = [f"# Synthetic MWD tool {seed}, {words}. {UNITS}.", *mwd_lines(measure(tool, design, draw))]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    noise = tuple(StaticNoise(white=n, flicker=f) for n, f in zip(RANDOM_WALK, BIAS_INSTABILITY, strict=True))
    np.save(folder / "static.npy", static_record(noise, round(STATIC_DURATION * RATE), RATE, seed).astype(np.float32))
    (folder / "truth.json").write_text(json.dumps(truth(tool), indent=1) + "\n")
    return [str(folder / name) for name in (*(f"{name}.csv" for name in designs), "static.npy", "truth.json")]


def mwd_lines(record: BenchRecord) -> list[str]:
    """Header and rows of a record, volts to the microvolt."""
    angles = np.degrees(record.design.tilt), np.degrees(record.design.tool_face) % 360.0
    columns = np.column_stack([*angles, record.temperature, record.gravity_volts, record.field_volts])
    return [FULL_HEADER, *(",".join([*_cells(row[:3], 3), *_cells(row[3:], 6)]) for row in columns)]


def truth(tool: Tool) -> dict[str, object]:
    """What the calibration is to find, by name."""
    return {
        "accelerometers": tool.accelerometers.coefficients(),
        "magnetometers": tool.magnetometers.coefficients(),
        "field_ut": FIELD,
        "dip_deg": float(np.degrees(DIP)),
        "gyroscope": {"random_walk_dps_rthz": RANDOM_WALK, "bias_instability_dps": BIAS_INSTABILITY, "rate_hz": RATE},
    }


def _cells(values: npt.NDArray[np.float64], digits: int) -> list[str]:
    return [f"{value:.{digits}f}" for value in values]
