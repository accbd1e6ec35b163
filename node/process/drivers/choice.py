"""A source by its name on the command line, as ``timed:FILE``, ``iio:icm42688``, ``mpu6500:1``, ``counter:FILE``."""

from __future__ import annotations

import re
from pathlib import Path

from node.errors import NodeConfigurationError
from node.process.drivers.gpio_encoder import GpioEncoder
from node.process.drivers.gpio_lines import ChipLines
from node.process.drivers.iio_imu import IioImu
from node.process.drivers.mpu_chips import CHIPS
from node.process.drivers.mpu_imu import ADDRESS, MpuImu, open_bus
from node.process.drivers.quadrature import QuadratureFile, counter_file
from node.process.drivers.replay_drivers import ReplayEncoder, ReplayImu
from node.process.drivers.source import EncoderSource, ImuSource
from node.process.drivers.timed import TimedEncoder, TimedImu
from node.process.drivers.vn100 import Vn100
from telemetry.errors import LoggerError
from telemetry.records.record_reading import RecordReading, read_told

IMU_FORMS = "replay:FILE, timed:FILE, iio:NAME, vn100:DEVICE, CHIP:BUS or CHIP:BUS:ADDRESS with a chip of " + ", ".join(
    CHIPS
)
COUNTER_FORMS = "replay:FILE, timed:FILE, counter:/dev/counterN, counter:FILE or gpio:CHIP:A,B or gpio:CHIP:A,B,INDEX"
LINES = re.compile(r"((?:/dev/)?(?:gpio)?chip\d+):(\d{1,3},\d{1,3}(?:,\d{1,3})?)")
LARGEST_BUS = 255
ADDRESSES = (0x68, 0x69)


def imu_source(text: str) -> ImuSource:
    """Source named by an option.

    Raises
    ------
    ConfigurationError
        When the name is unknown or its recording does not exist.
    """
    kind, _, rest = text.partition(":")
    if kind == "replay" and rest:
        return ReplayImu(*told_recording("imu", rest))
    if kind == "timed" and rest:
        return TimedImu(*told_recording("imu", rest))
    if kind == "iio" and rest:
        return IioImu(rest)
    if kind == "vn100" and rest:
        return Vn100(Path(rest))
    if (chip := CHIPS.get(kind)) is not None:
        bus, _, address = rest.partition(":")
        try:
            number, at = int(bus), int(address, 0) if address else ADDRESS
        except ValueError:
            number, at = -1, ADDRESS
        if 0 <= number <= LARGEST_BUS and at in ADDRESSES:
            return MpuImu(lambda: open_bus(number), at, chip=chip)
    raise NodeConfigurationError(f"imu: expected {IMU_FORMS}, got {text!r}")


def encoder_source(text: str) -> EncoderSource:
    """Source named by an option.

    Raises
    ------
    ConfigurationError
        When the name is unknown or its recording does not exist.
    """
    kind, _, rest = text.partition(":")
    if kind == "replay" and rest:
        return ReplayEncoder(recording_path("counter", rest))
    if kind == "timed" and rest:
        return TimedEncoder(recording_path("counter", rest))
    if kind == "counter" and rest:
        return QuadratureFile(counter_file(rest))
    if kind == "gpio" and (found := LINES.fullmatch(rest)):
        chip = Path("/dev") / found[1].replace("/dev/", "").replace("gpiochip", "chip").replace("chip", "gpiochip")
        lines = [int(number) for number in found[2].split(",")]
        if len(set(lines)) == len(lines):
            return GpioEncoder(lambda: ChipLines(chip, lines), lines)
    raise NodeConfigurationError(f"counter: expected {COUNTER_FORMS}, got {text!r}")


def told_recording(option: str, text: str) -> tuple[Path, RecordReading]:
    """File of a recording and what is told of it.

    Raises
    ------
    ConfigurationError
        When there is none of that name, or what is told cannot be read.
    """
    try:
        path, reading = read_told(text)
    except LoggerError as error:
        raise NodeConfigurationError(f"{option}: {error}") from error
    return recording_path(option, str(path)), reading


def recording_path(option: str, name: str) -> Path:
    """File of a recording.

    Raises
    ------
    ConfigurationError
        When there is none of that name.
    """
    if not Path(name).is_file():
        raise NodeConfigurationError(f"{option}: expected a recording, got {name}, which is not a file")
    return Path(name)
