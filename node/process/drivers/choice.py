"""A source by its name on the command line: ``replay:FILE``, ``mpu6500:1``, ``mpu6500:1:0x69``, ``counter:FILE``."""

from __future__ import annotations

from pathlib import Path

from node.errors import ConfigurationError
from node.process.drivers.mpu6500 import ADDRESS, Mpu6500, open_bus
from node.process.drivers.quadrature import QuadratureFile
from node.process.drivers.replay import ReplayEncoder, ReplayImu
from node.process.drivers.source import EncoderSource, ImuSource

IMU_FORMS = "replay:FILE, mpu6500:BUS or mpu6500:BUS:ADDRESS"
COUNTER_FORMS = "replay:FILE or counter:FILE"
LARGEST_BUS = 255
ADDRESSES = (0x68, 0x69)


def imu_source(text: str) -> ImuSource:
    """Source of a text.

    Raises
    ------
    ConfigurationError
        When it names none.
    """
    kind, _, rest = text.partition(":")
    if kind == "replay" and rest:
        return ReplayImu(Path(rest))
    if kind == "mpu6500":
        bus, _, address = rest.partition(":")
        try:
            number, at = int(bus), int(address, 0) if address else ADDRESS
        except ValueError:
            number, at = -1, ADDRESS
        if 0 <= number <= LARGEST_BUS and at in ADDRESSES:
            return Mpu6500(lambda: open_bus(number), at)
    raise ConfigurationError(f"imu: expected {IMU_FORMS}, got {text!r}")


def encoder_source(text: str) -> EncoderSource:
    """Source of a text.

    Raises
    ------
    ConfigurationError
        When it names none.
    """
    kind, _, rest = text.partition(":")
    if kind == "replay" and rest:
        return ReplayEncoder(Path(rest))
    if kind == "counter" and rest:
        return QuadratureFile(Path(rest))
    raise ConfigurationError(f"counter: expected {COUNTER_FORMS}, got {text!r}")
