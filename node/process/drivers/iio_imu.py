"""An IMU by the kernel's own driver, through Linux' industrial I/O: dozens of chips, one driver here.

Channels, scales and clock are set in sysfs; frames come from the character device with the stamps of the hardware's
interrupt. What is read in a cycle stands for the motion between the stamps, so the sample says how late it is and what
the eighths of the cycle turned. Source: Linux, Documentation/ABI/testing/sysfs-bus-iio and driver-api/iio/buffers.
"""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from node.errors import SensorError
from node.kernels.sensors.correction import USUAL
from node.process.drivers.fifo_window import parts_of
from node.process.drivers.source import ImuSample
from node.process.drivers.waiting_bytes import read_waiting

Array = npt.NDArray[np.float64]
SYSFS, DEVICES = Path("/sys/bus/iio/devices"), Path("/dev")
WANTED: Final = tuple(f"in_{kind}_{axis}" for kind in ("anglvel", "accel") for axis in "xyz")
STAMP, WARMTH = "in_timestamp", "in_temp"
TYPE: Final = re.compile(r"([bl]e):([su])(\d+)/(\d+)(?:X\d+)?>>(\d+)")
LENGTH: Final = 2048  # frames of the kernel's buffer
LOST: Final = 2.5  # usual steps of the stamps, from which on frames are missing
SHORTEST: Final = 0.5  # of the frames of a cycle
USUAL_RATE: Final = 100.0  # Hz, of a device that does not say its own
MILLI: Final = 1e-3  # temperatures are in thousandths of a degree


@dataclass(frozen=True, slots=True)
class Channel:
    """One element of a frame: name, place in bytes, type for numpy, shift, bits, SI of one and what is added first."""

    name: str
    at: int
    kind: str
    shift: int
    bits: int
    scale: float
    offset: float

    def take(self, frames: npt.NDArray[np.uint8]) -> Array:
        """Values (n,) of frames (n, size), SI; ns of a stamp."""
        size = np.dtype(self.kind).itemsize
        raw = np.ascontiguousarray(frames[:, self.at : self.at + size]).view(self.kind)[:, 0]
        return (self._whole(raw).astype(np.float64) + self.offset) * self.scale

    def is_at_range(self, frames: npt.NDArray[np.uint8]) -> bool:
        """Whether one of the values is the largest or smallest that its bits hold."""
        size = np.dtype(self.kind).itemsize
        raw = self._whole(np.ascontiguousarray(frames[:, self.at : self.at + size]).view(self.kind)[:, 0])
        top = 1 << (self.bits - 1)
        return bool(np.any(raw >= top - 1) or np.any(raw <= -top))

    def _whole(self, raw: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Value of the bits that count, with their sign."""
        value = raw.astype(np.int64) >> self.shift
        spare = 64 - self.bits
        if self.kind[1] == "u":
            return value & ((1 << self.bits) - 1) if spare else value
        return (value << spare) >> spare


class IioImu:
    """One device of the kernel by its name, such as ``icm42688`` or ``mpu6050``.

    Parameters
    ----------
    name : what its file ``name`` says, or ``iio:deviceN``
    sysfs, devices : folders of the devices and of their character devices
    """

    def __init__(self, name: str, sysfs: Path = SYSFS, devices: Path = DEVICES) -> None:
        self._name, self._sysfs, self._devices = name, sysfs, devices
        self._channels: dict[str, Channel] = {}
        self._size = 0
        self._file = -1
        self._rest = b""
        self._newest = np.nan  # s, stamp of the last frame that was read
        self._period = 1.0 / USUAL_RATE
        self.counted_rate = self.jitter = np.nan  # Hz and s, of the stamps of the last whole cycle

    @property
    def sample_rate(self) -> float:
        """Rate of the frames as it is set, Hz."""
        return 1.0 / self._period

    @property
    def description(self) -> str:
        """What it is."""
        return f"{self._name} by the kernel's driver, {self.sample_rate:.1f} Hz"

    def start(self) -> None:
        """Find the device, set its channels and its clock, and begin to capture."""
        self.close()
        folder = self._found()
        self._write(folder / "buffer" / "enable", "0")
        with contextlib.suppress(SensorError):  # of a kernel that stamps in another clock alone
            self._write(folder / "current_timestamp_clock", "monotonic")
        self._channels, self._size = self._set_up(folder)
        rate = next((path for path in sorted(folder.glob("*sampling_frequency"))), None)
        self._period = 1.0 / (float(_text(rate)) if rate is not None else USUAL_RATE)
        with contextlib.suppress(SensorError):
            self._write(folder / "buffer" / "length", str(LENGTH))
        self._write(folder / "buffer" / "enable", "1")
        try:
            self._file = os.open(self._devices / folder.name, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise SensorError(f"iio: {self._devices / folder.name}: {error.strerror}") from error
        self._rest, self._newest = b"", np.nan

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean of the frames since the last read, which must be about those of a cycle from ``begin`` to ``end``."""
        frames = self._drained()
        stamps = self._channels[STAMP].take(frames) * 1e-9 if len(frames) else np.zeros(0)
        before, expected = self._newest, (end - begin) / self._period
        fresh = bool(np.isnan(before))
        if len(frames):
            self._newest = float(stamps[-1])
            steps = np.diff(stamps) if fresh else np.diff(stamps, prepend=before)
            if steps.size and not np.all((steps > 0.0) & (steps < LOST * self._period)):
                raise SensorError(
                    f"iio: {self._name}: frames are missing, {1e3 * float(steps.max()):.0f} ms between two of "
                    f"{1e3 * self._period:.1f} ms: readings of this cycle are lost"
                )
        if len(frames) < 1 or (not fresh and len(frames) < SHORTEST * expected):
            raise SensorError(f"iio: {self._name}: expected about {expected:.0f} frames, got {len(frames)}")
        return self._sample(frames, steps, begin, end, whole=not fresh)

    def close(self) -> None:
        """Release the device."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _sample(
        self, frames: npt.NDArray[np.uint8], steps: Array, begin: float, end: float, *, whole: bool
    ) -> ImuSample:
        values = np.array([self._channels[name].take(frames) for name in WANTED])
        weights = steps / steps.sum() if whole else np.full(len(frames), 1.0 / len(frames))
        wx, wy, wz, fx, fy, fz = (values @ weights).tolist()
        at_range = [self._channels[name].is_at_range(frames) for name in WANTED]
        saturated = int(any(at_range[:3])) | 2 * int(any(at_range[3:]))
        warmth = float(USUAL)
        if WARMTH in self._channels:
            warmth = MILLI * float(self._channels[WARMTH].take(frames).mean())
        sample = ImuSample((wx, wy, wz), (fx, fy, fz), warmth, saturated, late=end - self._newest)
        if not whole:
            return sample
        self.counted_rate, self.jitter = float(1.0 / steps.mean()), float(steps.std())
        window = (self._newest - float(steps.sum()), self._newest)
        return replace(sample, parts=parts_of(values[2], window, begin, end))

    def _drained(self) -> npt.NDArray[np.uint8]:
        """Frames (n, size) that the kernel holds."""
        if self._file < 0:
            raise SensorError(f"iio: {self._name}: not started")
        try:
            data = self._rest + read_waiting(self._file)
        except OSError as error:
            raise SensorError(f"iio: {self._name}: {error.strerror}: the device is gone") from error
        count = len(data) // self._size
        self._rest = data[count * self._size :]
        return np.frombuffer(data[: count * self._size], dtype=np.uint8).reshape(count, self._size)

    def _found(self) -> Path:
        """Folder of the device in sysfs."""
        names = {path: _text(path / "name") for path in sorted(self._sysfs.glob("iio:device*"))}
        for path, name in names.items():
            if self._name in (name, path.name):
                return path
        there = ", ".join(f"{name} ({path.name})" for path, name in names.items()) or "none"
        raise SensorError(f"iio: expected a device {self._name}, got {there}")

    def _set_up(self, folder: Path) -> tuple[dict[str, Channel], int]:
        """Channels of a frame in their order, and its size in bytes."""
        elements = folder / "scan_elements"
        for name in (*WANTED, STAMP):
            if not (elements / f"{name}_en").exists():
                raise SensorError(
                    f"iio: {self._name}: expected a device with gyroscope, accelerometer and stamps, it has no {name}"
                )
        wanted = (*WANTED, STAMP, *([WARMTH] if (elements / f"{WARMTH}_en").exists() else []))
        for path in sorted(elements.glob("*_en")):
            self._write(path, "1" if path.name.removesuffix("_en") in wanted else "0")
        order = sorted(wanted, key=lambda name: int(_text(elements / f"{name}_index")))
        channels: dict[str, Channel] = {}
        at = 0
        for name in order:
            found = TYPE.fullmatch(_text(elements / f"{name}_type"))
            if found is None:
                raise SensorError(f"iio: {self._name}: {name}_type: expected one as be:s16/16>>0")
            size = int(found[4]) // 8
            at = -(-at // size) * size  # elements lie at multiples of their size
            kind = f"{'>' if found[1] == 'be' else '<'}{'i' if found[2] == 's' else 'u'}{size}"
            scale, offset = (1.0, 0.0) if name == STAMP else (self._number(folder, name, "scale", 1.0), 0.0)
            if name != STAMP:
                offset = self._number(folder, name, "offset", 0.0)
            channels[name] = Channel(name, at, kind, int(found[5]), int(found[3]), scale, offset)
            at += size
        largest = max(np.dtype(channel.kind).itemsize for channel in channels.values())
        return channels, -(-at // largest) * largest

    def _number(self, folder: Path, name: str, what: str, usual: float) -> float:
        """Attribute of a channel, of its kind where it has none of its own."""
        for stem in (name, name.rpartition("_")[0]):
            if (path := folder / f"{stem}_{what}").exists():
                try:
                    return float(_text(path))
                except ValueError as error:
                    raise SensorError(f"iio: {self._name}: {path.name}: expected a number") from error
        return usual

    def _write(self, path: Path, text: str) -> None:
        try:
            path.write_text(text)
        except OSError as error:
            raise SensorError(f"iio: {self._name}: {path.name}: {error.strerror}") from error


def _text(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError as error:
        raise SensorError(f"iio: {path}: {error.strerror}") from error
