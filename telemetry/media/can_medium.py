"""CAN as a medium: one segment a joint; the hop link's frames byte for byte in ISO-TP, or cyclic messages as signals.

``can:CHANNEL`` names what a port is on, and settings may follow, each after a comma::

    can:can0                                       SocketCAN, CAN FD
    can:can0,frames=classic                        frames of 8 bytes
    can:can0,bitrate=125000                        node states are thinned out before such a bus is full
    can:can0,log=joint.blf                         every frame into joint-7-upper.blf or the like; .asc is text
    can:can0,profile=native                        cyclic messages as signals; both ends of the joint must agree
    can:PCAN_USBBUS1,interface=pcan,bitrate=500000,data_bitrate=2000000
    can:7800,interface=borechain_loopback          a hub of simulated segments on UDP port 7800, one for each joint
    can:7800/any,interface=borechain_loopback      one segment of it
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import can

from telemetry.errors import MediumError
from telemetry.media.can_log import CanLog, log_path
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_port import CanPort
from telemetry.media.can_profile import NAMES, TUNNEL_ALONE, open_profile
from telemetry.media.can_timing import CLASSIC_LARGEST, FD_LARGEST, BitRates
from telemetry.media.port import STEPPER, TubeEnd
from telemetry.media.send_queue import SEND_LIMIT
from telemetry.messages import Side, address_name

STEPPED_LIMIT = 4096  # frames: a step waits for all that it sends, so none may be dropped
SETTINGS = ("bitrate", "data_bitrate", "frames", "interface", "log", "profile")
FRAMES = {"fd": FD_LARGEST, "classic": CLASSIC_LARGEST}


@dataclass(frozen=True, slots=True)
class CanSettings:
    """Settings after ``can:``."""

    channel: str
    interface: str = "socketcan"
    frames: str = "fd"
    profile: str = TUNNEL_ALONE
    log: Path | None = None
    bitrates: dict[str, int] = field(default_factory=dict)

    @classmethod
    def parse(cls, where: str) -> CanSettings:
        """Settings of a text.

        Raises
        ------
        MediumError
            Naming the setting, what was expected and what was got.
        """
        channel, *settings = where.split(",")
        if not channel:
            raise MediumError("medium can: expected a channel, such as can:can0, got none")
        given: dict[str, Any] = {}
        bitrates: dict[str, int] = {}
        for setting in settings:
            name, _, value = setting.partition("=")
            if name in ("bitrate", "data_bitrate"):
                bitrates[name] = _positive(name, value)
            elif name == "log":
                given[name] = log_path(value)
            elif name in ("interface", "frames", "profile"):
                given[name] = value
            else:
                raise MediumError(f"medium can: expected one of {', '.join(SETTINGS)}, got {setting}")
        if given.get("profile", TUNNEL_ALONE) not in NAMES:
            raise MediumError(f"medium can: profile: expected {' or '.join(NAMES)}, got {given['profile']}")
        if given.get("frames", "fd") not in FRAMES:
            raise MediumError(f"medium can: frames: expected fd or classic, got {given['frames']}")
        return cls(channel, bitrates=bitrates, **given)

    @property
    def rates(self) -> BitRates:
        """Bit rates, if given; also allowed for an interface that was set up before, such as can0."""
        return BitRates(self.bitrates.get("bitrate", 0), self.bitrates.get("data_bitrate", 0))

    def open_bus(self, segment: str) -> can.BusABC:
        """The controller of one end; a simulated channel that names no segment has one for each joint."""
        is_hub = self.interface == INTERFACE and "/" not in self.channel
        channel = f"{self.channel}/{segment}" if is_hub else self.channel
        options: dict[str, Any] = {"fd": self.frames == "fd", "receive_own_messages": True, **self.bitrates}
        return can.Bus(channel, interface=self.interface, ignore_config=True, **options)


class CanMedium:
    """Ends of one process on CAN."""

    def __init__(self, settings: CanSettings) -> None:
        self._settings = settings
        self._ports: list[CanPort] = []

    def open_port(self, end: TubeEnd) -> CanPort:
        """Port of one end.

        Raises
        ------
        MediumError
            When the bus cannot be opened.
        """
        settings = self._settings
        limit = STEPPED_LIMIT if STEPPER in (end.address, end.neighbour) else SEND_LIMIT
        name = f"{settings.channel} ({end.side.name.lower()} end of {address_name(end.address)})"
        bus, profile = partial(settings.open_bus, segment_of(end)), open_profile(settings.profile)
        log = (
            None
            if settings.log is None
            else CanLog(settings.log, f"{address_name(end.address)}-{end.side.name.lower()}")
        )
        largest, is_stepped = FRAMES[settings.frames], limit == STEPPED_LIMIT
        port = CanPort(name, bus, end.address, largest, limit, profile, settings.rates, log, is_stepped=is_stepped)
        self._ports.append(port)
        return port

    def close(self) -> None:
        """Close every port."""
        for port in self._ports:
            port.close()


def segment_of(end: TubeEnd) -> str:
    """Name of the joint that an end belongs to, the same seen from both sides."""
    neighbour = "" if end.neighbour is None else address_name(end.neighbour)
    names = [address_name(end.address), neighbour]
    return f"{end.rig}/{'-'.join(names if end.side is Side.LOWER else reversed(names))}"


def check_settings(where: str) -> None:
    """Check settings, and open nothing.

    Raises
    ------
    MediumError
        Naming the setting that is wrong.
    """
    CanSettings.parse(where)


@contextmanager
def open_medium(where: str) -> Iterator[CanMedium]:
    """Medium of the settings ``where``.

    Raises
    ------
    MediumError
        When the settings are wrong.
    """
    register_loopback()
    medium = CanMedium(CanSettings.parse(where))
    try:
        yield medium
    finally:
        medium.close()


def _positive(name: str, value: str) -> int:
    if not value.isdecimal() or int(value) == 0:
        raise MediumError(f"medium can: {name}: expected bit/s, got {value or 'nothing'}")
    return int(value)
