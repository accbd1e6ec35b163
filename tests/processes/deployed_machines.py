"""Machines that docs/deploy.md is followed on: a folder each, in which its commands run word for word.

What a machine of the tests lacks is stood in for: other users and packages, systemd (a unit's own command is started as
it stands in the unit), CAN interfaces (a hub on loopback), and a sensor and an encoder, which are emulated.
"""

from __future__ import annotations

import configparser
import contextlib
import json
import os
import re
import select
import shlex
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from emulated_encoders import EmulatedCounter
from emulated_vn100 import Line, line_of
from forked_commands import Command as Forked
from rigs import started

ROOMS = (
    "/etc/udev/rules.d",
    "/etc/systemd/system",
    "/etc/borechain",
    "/opt/borechain",
    "/usr/local/bin",
    "/var/lib/borechain",
)
STAND_INS = {
    "sudo": 'while [ "${1#-}" != "$1" ]; do shift 2; done; exec "$@"',  # -u NAME, -g NAME
    "useradd": 'while [ "$1" != --home-dir ]; do shift; done; mkdir -p "$2"',
    "install": 'for word; do shift; case "$word" in -o) skip=1 ;; *) [ -n "$skip" ] || set -- "$@" "$word"; skip= ;; '
    'esac; done; exec /usr/bin/install "$@"',
    "python3": 'mkdir -p "$3/bin"; ln -s "$STAND/python" "$3/bin/python"; ln -s "$STAND/pip" "$3/bin/pip"; '
    'ln -s "$STAND/borechain" "$3/bin/borechain"',
    "python": f'exec {shlex.quote(sys.executable)} "$@"',
    "pip": 'case "$2" in borechain\\[board\\]|borechain\\[ground\\]) ;; *) exit 1 ;; esac',
    "borechain": f'exec {shlex.quote(sys.executable)} -m borechain "$@"',
    "systemctl": 'shift 2; for unit; do echo "$unit" >> "$UNITS"; done',
    "udevadm": 'ls "${UNITS%/units}"/etc/udev/rules.d/*.rules > /dev/null',
    "journalctl": '[ "$1" = -u ] && grep -qx "$2" "$UNITS"',
}
CAN_LINK = {
    "flags": ["NOARP", "UP", "LOWER_UP", "ECHO"],
    "link_type": "can",
    "linkinfo": {
        "info_data": {
            "ctrlmode": ["FD"],
            "state": "ERROR-ACTIVE",
            "berr_counter": {"tx": 0, "rx": 0},
            "bittiming": {"bitrate": 500000},
            "data_bittiming": {"bitrate": 2000000},
        }
    },
}


@dataclass
class Machine:
    """One machine: where its root is, its stand-ins, and the units that it runs.

    ``translate`` puts what is emulated in place of hardware and addresses, in commands and configuration files.
    """

    root: Path
    stand_ins: Path
    translate: Callable[[str], str]
    running: dict[str, Forked] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for room in ("/etc/udev/rules.d", "/etc/systemd/system", "/opt", "/usr/local/bin", "/var/lib"):
            (self.root / room[1:]).mkdir(parents=True)

    def place(self, text: str) -> str:
        """A text of the page with the rooms of this machine."""
        for room in ROOMS:
            text = re.sub(rf"(?<![\w./]){room}(?![\w-])", str(self.root) + room, text)
        return self.translate(text)

    def shell(self, command: str, work: Path) -> None:
        """Run a command of the page as it stands."""
        environment = os.environ | {
            "PATH": f"{self.stand_ins}:{os.environ['PATH']}",
            "STAND": str(self.stand_ins),
            "UNITS": str(self.root / "units"),
        }
        done = subprocess.run(
            ["/bin/sh", "-c", self.place(command)],
            cwd=work, env=environment, capture_output=True, text=True, check=False, timeout=120,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}\n{done.stderr}"

    def configure(self, name: str, text: str) -> None:
        """Write a configuration file of the page."""
        (self.root / "etc" / "borechain" / name).write_text(self.place(text))

    def start_units(self) -> None:
        """Start what was enabled and does not run yet, as its unit says."""
        units = self.root / "units"
        for name in dict.fromkeys(units.read_text().split() if units.exists() else []):
            file, at, instance = name.partition("@")
            unit = self.root / "etc" / "systemd" / "system" / f"{file}{at}.service"
            parser = configparser.ConfigParser(interpolation=None, strict=False)
            parser.optionxform = str  # type: ignore[assignment, method-assign]
            parser.read_string(unit.read_text())
            program, *words = shlex.split(self.place(parser["Service"]["ExecStart"].replace("%i", instance)))
            if name not in self.running and program.endswith("/opt/borechain/bin/borechain"):
                assert Path(program).resolve().is_file()
                self.running[name] = started(*words)

    def end(self) -> None:
        for process in self.running.values():
            process.kill()
            process.communicate()


def make_stand_ins(folder: Path) -> Path:
    """Programs that stand in for those of a machine."""
    folder.mkdir()
    link = json.dumps([CAN_LINK])
    for name, body in (STAND_INS | {"ip": f"cat <<'END'\n{link}\nEND"}).items():
        (folder / name).write_text(f"#!/bin/sh\n{body}\n")
        (folder / name).chmod(0o755)
    return folder


def blocks_of(section: str) -> Iterator[tuple[str, str]]:
    """Indented blocks of a section, each with the line of text before it; a program goes on behind an empty line."""
    before, block = "", ""
    for line in [*section.splitlines(), "end"]:
        if line.startswith("    "):
            block += line[4:] + "\n"
        elif line or not block.startswith("from "):
            if block:
                yield before, block
            before, block = line or before, ""
        else:
            block += "\n"


def commands_of(section: str) -> Iterator[tuple[str, str]]:
    """Commands and configuration files of a section of the page: ``("shell", command)``, ``("node.toml", text)``."""
    for before, block in blocks_of(section):
        named = re.search(r"`/etc/borechain/([a-z]+\.toml)`", before)
        if named and re.match(r"[a-z-]+ = ", block):
            yield named[1], block
        elif block.startswith("from "):
            yield "python", block
        else:
            for line in block.splitlines():
                yield "shell", line.partition("  #")[0].strip()


class LivingSensor:
    """A VN-100 at rest that goes on writing its lines, a hundred a second, until it is told to stop.

    Its bias, of more than 0.5 deg/s, is learnt in five seconds where the head rests.
    """

    def __init__(self, force: tuple[float, float, float]) -> None:
        self.line, self._force = Line(), np.array(force)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def _live(self) -> None:
        random, begin, count = np.random.default_rng(6), time.monotonic(), 0
        while not self._stop.is_set():
            asked, _, _ = select.select([self.line.end], [], [], 0.05)
            with contextlib.suppress(OSError):
                if asked:  # the driver's settings
                    os.read(self.line.end, 4096)
                due = round(100.0 * (time.monotonic() - begin)) - count
                count += due
                rates = np.radians([0.1, -1.2, 0.08]) + 4e-4 * random.standard_normal((due, 3))
                forces = self._force + 0.01 * random.standard_normal((due, 3))
                self.line.send(b"".join(map(line_of, rates, forces)))

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()
        self.line.cut()


@contextlib.contextmanager
def living_sensor(force: tuple[float, float, float]) -> Iterator[LivingSensor]:
    """A sensor that lives as long as it is needed."""
    sensor = LivingSensor(force)
    try:
        yield sensor
    finally:
        sensor.stop()


def turned_by_hand(counter: EmulatedCounter) -> Callable[[], bool]:
    """What stands for Enter: the head is turned by 90 deg, forward, before it."""
    looks: list[Any] = []

    def is_turning() -> bool:
        looks.append(None)
        counter.turn_to(1024)
        return len(looks) < 2

    return is_turning
