"""A message that is on the disk, with what is known of where it was sent from. No I/O."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from telemetry.messages import Kept

M = TypeVar("M", bound=Kept)


@dataclass(frozen=True, slots=True)
class Stored(Generic[M]):
    """A message, the depth (m) it was measured at and the length (m) of string below its tube, as far as known."""

    message: M
    md: float | None
    below: float | None = None
