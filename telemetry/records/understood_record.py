"""What was understood of a record, in one line and as an object."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from telemetry.records.imu_record import ImuRecord
from telemetry.records.sensor_columns import TIME

SHOWN: Final = 3  # of a list
NO_FAULT: Final = "no gap, no fault"


def understood_line(record: ImuRecord) -> str:
    """Columns, units, rate, scale, stamps and faults of a record, in a line."""
    parts = [f"{len(record.lines)} rows", *_stamps(record)]
    for quantity, one in record.placed.items():
        if quantity != TIME:
            parts.append(f"{quantity} {','.join(one.names)} in {one.unit}")
    if record.temperature is not None:
        parts[-1] += f", {record.temperature.min():.1f} to {record.temperature.max():.1f}"
    if record.ignored:
        parts.append(f"not used: {','.join(record.ignored)}")
    return f"{record.name}: " + "; ".join([*parts, *fault_phrases(record)])


def fault_phrases(record: ImuRecord) -> list[str]:
    """What is wrong with the rows of a record, each with its first lines; none is said to be none."""
    found, stamps, lines = [], record.stamps, record.lines
    if stamps is not None:
        found += [f"gap of {length:.3g} s before line {lines[k]}" for k, length in stamps.gaps[:SHOWN]]
        if len(stamps.gaps) > SHOWN:
            found.append(f"{len(stamps.gaps) - SHOWN} gaps more, {sum(g for _, g in stamps.gaps):.4g} s in all")
        found += [f"the clock was set by {step:.4g} s before line {lines[k]}" for k, step in stamps.jumps[:SHOWN]]
        if stamps.wraps:
            found.append(f"the counter of the stamps began anew {stamps.wraps} times")
        if stamps.strays:
            found.append(f"{len(stamps.strays)} stray stamps, the first in line {lines[stamps.strays[0]]}")
        if stamps.repeats:
            found.append(f"{stamps.repeats} stamps stand twice")
    if record.repeated:
        found.append(f"{record.repeated} readings stand twice: the sensor was polled faster than it samples")
    if record.lost:
        found.append(f"{len(record.lost)} rows without numbers, the first in line {record.lost[0]}")
    for bit, sensor in ((1, "gyroscope"), (2, "accelerometer")):
        at = np.flatnonzero(record.saturated & bit)
        if at.size:
            found.append(f"{sensor} at its range in {at.size} rows, the first in line {lines[at[0]]}")
    return found or [NO_FAULT]


def understood_object(record: ImuRecord) -> dict[str, Any]:
    """The same for JSON."""
    stamps = record.stamps
    return {
        "rows": len(record.lines),
        "rate_hz": 1.0 / stamps.period if stamps is not None else None,
        "duration_s": float(stamps.times[-1] - stamps.times[0]) if stamps is not None else None,
        "columns": {
            quantity: {"names": list(one.names), "unit": one.unit, "si_of_one": one.scale}
            for quantity, one in record.placed.items()
        },
        "not_used": list(record.ignored),
        "bursts_s": list(stamps.bursts) if stamps is not None and stamps.bursts is not None else None,
        "gaps": [{"line": int(record.lines[k]), "length_s": length} for k, length in (stamps.gaps if stamps else ())],
        "faults": [] if (found := fault_phrases(record)) == [NO_FAULT] else found,
        "record_sha256": record.sha256,
    }


def _stamps(record: ImuRecord) -> list[str]:
    stamps = record.stamps
    if stamps is None:
        return ["no times and no rate"]
    rate = f"{1.0 / stamps.period:.4g} Hz" if stamps.period > 0.0 else "no rate, for its clock stands"
    length = f"{stamps.times[-1] - stamps.times[0]:.1f} s at {rate}"
    if TIME not in record.placed:
        return [f"{length} as told"]
    one = record.placed[TIME]
    arrived = ""
    if stamps.bursts is not None:
        median, largest = stamps.bursts
        arrived = f", in bursts, late by {1e3 * median:.0f} ms at the median and {1e3 * largest:.0f} ms at most"
    return [f"{length} by {one.names[0]} in {one.unit}{arrived}"]
