"""What is made once and never changed: base of the messages and of what the firmware is given each cycle.

A frozen dataclass assigns each of its fields by a call of Python; a struct of msgspec is made by one call in C, which
``benchmarks/codec.py`` holds to less than half the time.
"""

from __future__ import annotations

from typing import dataclass_transform

from msgspec import Struct, field
from msgspec.structs import replace

__all__ = ["Frozen", "field", "replace"]


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class Frozen(Struct, frozen=True):
    """Fields with their types, given in their order or by name; equal when all are, and never assigned again."""
