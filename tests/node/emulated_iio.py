"""A device of the kernel's industrial I/O in a folder: its tree of attributes, and a pipe for its character device."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np

RATE_LSB, FORCE_LSB = 0.001064724, 0.004788403  # rad/s and m/s^2, of 2000 deg/s and 16 g
ORDER = ("in_accel_x", "in_accel_y", "in_accel_z", "in_temp", "in_anglvel_x", "in_anglvel_y", "in_anglvel_z")


class EmulatedDevice:
    """An MPU-6050 as the kernel shows it: big-endian words, a temperature among them, stamps of 64 bits."""

    def __init__(self, folder: Path, name: str = "mpu6050", rate: float = 100.0) -> None:
        self.sysfs, self.devices = folder / "iio", folder / "dev"
        self.folder = self.sysfs / "iio:device0"
        elements = self.folder / "scan_elements"
        for path in (elements, self.folder / "buffer", self.devices):
            path.mkdir(parents=True, exist_ok=True)
        self.attributes = {
            "name": name,
            "sampling_frequency": f"{rate:g}",
            "current_timestamp_clock": "realtime",
            "in_anglvel_scale": repr(RATE_LSB),
            "in_accel_scale": repr(FORCE_LSB),
            "in_temp_scale": "2.941176",
            "in_temp_offset": "12420",
            "buffer/enable": "0",
            "buffer/length": "2",
            "scan_elements/in_timestamp_en": "0",
            "scan_elements/in_timestamp_index": "7",
            "scan_elements/in_timestamp_type": "le:s64/64>>0",
            "scan_elements/in_magn_x_en": "1",
        }
        for k, channel in enumerate(ORDER):
            self.attributes[f"scan_elements/{channel}_en"] = "0"
            self.attributes[f"scan_elements/{channel}_index"] = str(k)
            self.attributes[f"scan_elements/{channel}_type"] = "be:s16/16>>0"
        for path, text in self.attributes.items():
            (self.folder / path).write_text(text + "\n")
        os.mkfifo(self.devices / "iio:device0")
        self.pipe = os.open(self.devices / "iio:device0", os.O_RDWR | os.O_NONBLOCK)

    def attribute(self, path: str) -> str:
        """What was written to a file of the tree."""
        return (self.folder / path).read_text().strip()

    def live(self, stamps: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Capture samples (n,) s, (n, 3) rad/s, (n, 3) m/s^2; returns what they are in counts, SI (n, 6)."""
        counts = np.hstack([np.round(forces / FORCE_LSB), np.round(rates / RATE_LSB)]).clip(-32768, 32767).astype(int)
        for stamp, row in zip(stamps, counts, strict=True):
            words = (*row[:3], -3600, *row[3:])
            os.write(self.pipe, struct.pack(">7h", *words) + b"\0\0" + struct.pack("<q", round(stamp * 1e9)))
        return np.hstack([counts[:, 3:] * RATE_LSB, counts[:, :3] * FORCE_LSB])

    def unplug(self) -> None:
        """Take the device away: its folder and its character device are gone."""
        for path in sorted(self.sysfs.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        (self.devices / "iio:device0").unlink()
        os.close(self.pipe)
