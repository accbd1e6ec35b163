"""Faults as text: ``kill-node:3@600`` cuts the power of tube 3 at 600 s after the start, ``+20`` for 20 s.

``encoder`` and ``base`` in place of the number cut that of the encoder and of the ground station.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from sim.errors import ScenarioError
from telemetry.messages import BASE, ENCODER, address_name

DEFAULT_DOWN = 10.0  # s
PATTERN = re.compile(r"kill-node:(\d{1,3}|encoder|base)@(\d+(?:\.\d+)?)(?:\+(\d+(?:\.\d+)?))?")
OF_NAME = {address_name(address): address for address in (ENCODER, BASE)}


@dataclass(frozen=True, slots=True)
class KillNode:
    """SIGKILL of one process, and its restart."""

    address: int
    after: float  # s after the start of the rig
    down: float  # s

    def __str__(self) -> str:
        return f"kill-node:{address_name(self.address)}@{self.after:g}+{self.down:g}"


def parse_fault(text: str, tubes: int) -> KillNode:
    """Fault of a text.

    Raises
    ------
    ScenarioError
        When it is no fault, or its tube is not part of the string.
    """
    match = PATTERN.fullmatch(text)
    if match is None:
        raise ScenarioError(
            f"fault {text!r}: expected kill-node:TUBE@SECONDS or kill-node:TUBE@SECONDS+DOWN; "
            f"TUBE may be {' or '.join(OF_NAME)} too"
        )
    address = OF_NAME.get(match[1])
    if address is None:
        address = int(match[1])
        if not 1 <= address <= tubes:
            raise ScenarioError(f"fault {text!r}: expected a tube of 1..{tubes}, got {address}")
    return KillNode(address, float(match[2]), float(match[3] or DEFAULT_DOWN))
