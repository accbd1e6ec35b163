"""What a named value may be: kind, unit, range and meaning, described once for messages, commands and keys."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

MAX_TEXT = 256  # characters
MAX_ARGUMENTS = 32
MAX_LIST = 16
MAX_IMUS = 16
MAX_STANDS = 16


class ValueKind(enum.Enum):
    """Type of a value; the text stands in the tables of the documentation."""

    NUMBER = "number"
    INTEGER = "integer"
    BOOLEAN = "boolean"
    TEXT = "text"
    BINARY = "bytes"
    VECTOR = "3 numbers"
    COVARIANCE = "3 x 3 covariance"
    IMUS = "list of mean and 3 x 3 covariance"
    SCALARS = "names with scalars"
    VALUES = "names with scalars or lists of numbers"
    NUMBERS = "list of numbers"
    INTEGERS = "list of integers"
    STANDS = "list of epoch, begin, end, depth"


@dataclass(frozen=True, slots=True)
class Quantity:
    """One named value.

    ``low`` and ``high`` bound a number, the members of a list, the length of bytes, or the magnitude of a vector
    (``high``). ``step`` is the smallest difference worth telling, in the unit; a medium with few bits rounds to it.
    Of variances it is a ratio, ``step_db``.
    """

    name: str
    kind: ValueKind
    meaning: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    step: float = 0.0
    step_db: float = 0.0

    @property
    def range_text(self) -> str:
        """The range as people read it; empty when there is no limit."""
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is ValueKind.VECTOR:
            return f"+-{self.high:g}"
        if math.isinf(self.low) and math.isinf(self.high):
            return ""
        return f"{bound_text(self.low)}..{bound_text(self.high)}"

    @property
    def step_text(self) -> str:
        """The resolution as people read it."""
        if self.step_db:
            return f"{self.step_db:g} dB"
        return f"{self.step:.1g}" if self.step else ""


POWERS_OF_TWO = {2**power: f"2^{power}" for power in range(20, 64)}


def bound_text(value: float) -> str:
    """One end of a range, large integers as powers of two."""
    if isinstance(value, int):
        return POWERS_OF_TWO.get(value) or (
            f"{POWERS_OF_TWO[value + 1]}-1" if value + 1 in POWERS_OF_TWO else str(value)
        )
    return {math.tau: "2 pi", -math.tau: "-2 pi", math.inf: "inf"}.get(value, f"{value:g}")


def check_number(q: Quantity, value: Any) -> float:
    """Finite float in the range.

    Raises
    ------
    ValueError
        Naming the value, what was expected and what was got; so do all the checks below.
    """
    if type(value) is float and q.low <= value <= q.high:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not q.low <= value <= q.high:
        raise ValueError(f"{q.name}: expected a number in [{q.low:g}, {q.high:g}], got {value!r:.40}")
    return float(value)


def check_integer(q: Quantity, value: Any) -> int:
    """Integer in the range."""
    if type(value) is int and q.low <= value <= q.high:
        return value
    if isinstance(value, bool) or not isinstance(value, int) or not q.low <= value <= q.high:
        raise ValueError(f"{q.name}: expected an integer in [{q.low}, {q.high}], got {value!r:.40}")
    return value


def check_boolean(q: Quantity, value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise ValueError(f"{q.name}: expected true or false, got {value!r:.40}")
    return value


def check_text(q: Quantity, value: Any) -> str:
    """Short string, one of the choices where there are any."""
    if not isinstance(value, str) or len(value) > MAX_TEXT:
        raise ValueError(f"{q.name}: expected at most {MAX_TEXT} characters, got {value!r:.40}")
    if q.choices and value not in q.choices:
        raise ValueError(f"{q.name}: expected {', '.join(q.choices)}, got {value!r:.40}")
    return value


def check_binary(q: Quantity, value: Any) -> bytes:
    """Bytes, as many as the range says."""
    if not isinstance(value, bytes) or not q.low <= len(value) <= q.high:
        raise ValueError(f"{q.name}: expected {q.low}..{q.high} bytes, got {value!r:.40}")
    return value


def check_numbers(q: Quantity, value: Any) -> tuple[float, ...]:
    """Finite numbers in the range, at most ``MAX_LIST`` of them."""
    if not isinstance(value, list | tuple) or len(value) > MAX_LIST:
        raise ValueError(f"{q.name}: expected at most {MAX_LIST} numbers, got {value!r:.40}")
    numbers = tuple(check_number(q, item) for item in value)
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{q.name}: expected finite numbers, got {value!r:.40}")
    return numbers


def check_integers(q: Quantity, value: Any) -> tuple[int, ...]:
    """One integer or more in the range."""
    if not isinstance(value, list | tuple) or not value:
        raise ValueError(f"{q.name}: expected one integer or more, got {value!r:.40}")
    return tuple(check_integer(q, item) for item in value)
