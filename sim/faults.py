"""Faults as text: ``kill-node:3@600`` cuts the power of tube 3 at 600 s after the start, ``+20`` for 20 s."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sim.errors import ScenarioError

DEFAULT_DOWN = 10.0  # s
PATTERN = re.compile(r"kill-node:(\d{1,3})@(\d+(?:\.\d+)?)(?:\+(\d+(?:\.\d+)?))?")


@dataclass(frozen=True, slots=True)
class KillNode:
    """SIGKILL of one node's process, and its restart."""

    tube: int
    after: float  # s after the start of the rig
    down: float  # s

    def __str__(self) -> str:
        return f"kill-node:{self.tube}@{self.after:g}+{self.down:g}"


def parse_fault(text: str, tubes: int) -> KillNode:
    """Fault of a text.

    Raises
    ------
    ScenarioError
        When it is no fault, or its tube is not part of the string.
    """
    match = PATTERN.fullmatch(text)
    if match is None:
        raise ScenarioError(f"fault {text!r}: expected kill-node:TUBE@SECONDS or kill-node:TUBE@SECONDS+DOWN")
    tube = int(match[1])
    if not 1 <= tube <= tubes:
        raise ScenarioError(f"fault {text!r}: expected a tube of 1..{tubes}, got {tube}")
    return KillNode(tube, float(match[2]), float(match[3] or DEFAULT_DOWN))
