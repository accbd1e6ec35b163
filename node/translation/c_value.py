"""A piece of C: what stands for one value of a kernel, with its kind and how tightly it is bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from node.translation.kinds_of_values import INTEGER, TRUTH, ArrayOf, Kind, RecordOf, Several

# how tightly an operator binds, loosest last
ATOM, UNARY, PRODUCT, SUM, COMPARED, LOGICAL, CHOSEN = range(7)
INT32: Final = 1 << 31
RESERVED: Final = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "bool",
        "true",
        "false",
        "asm",
        "div",
        "abs",
        "labs",
        "index",
        "gamma",
        "y0",
        "y1",
        "yn",
        "j0",
        "j1",
        "jn",
        "least",
        "most",
        "magnitude",
    ]
)


@dataclass(frozen=True)
class CValue:
    """One value.

    Attributes
    ----------
    code : expression of C
    kind : what it is
    level : how tightly it is bound: an operator that binds tighter wants parentheses around it
    known : its number, where it is known as C is written
    parts : its values, where it is several that stand in the source
    length : expression of the first length of an array, where only the code that runs knows it
    is_place : it is a record itself and not its address
    """

    code: str
    kind: Kind
    level: int = ATOM
    known: Any = None
    parts: tuple[CValue, ...] | None = None
    length: str = ""
    is_place: bool = False

    def within(self, level: int) -> str:
        """Its code as an operand of what binds as tightly as ``level``."""
        return self.code if self.level <= level else f"({self.code})"

    @property
    def address(self) -> str:
        """Its code as an argument or a variable: the address of a record."""
        return f"&{self.within(ATOM)}" if self.is_place else self.code


def c_word(name: str) -> str:
    """A name that C leaves free."""
    return f"{name}_" if name in RESERVED else name


def literal_of(number: int) -> str:
    """A whole number as C reads it."""
    if -INT32 < number < INT32:
        return str(number)
    size = abs(number)
    text = hex(size).upper().replace("X", "x") if size & (size - 1) == 0 or size & (size + 1) == 0 else str(size)
    return f"INT64_C({text})" if number > 0 else f"(-INT64_C({text}))"


def number_value(number: int) -> CValue:
    """A whole number that stands in the source."""
    return CValue(literal_of(number), INTEGER, UNARY if -INT32 < number < 0 else ATOM, int(number))


def truth_value(truth: bool) -> CValue:
    """A truth that stands in the source."""
    return CValue("true" if truth else "false", TRUTH, known=truth)


def several_values(parts: tuple[CValue, ...]) -> CValue:
    """Several values that stand beside each other in the source."""
    kind = Several(tuple(part.kind if isinstance(part.kind, Several) else INTEGER for part in parts))
    inside = ", ".join(part.code for part in parts)
    inside = f"{{{inside}}}" if kind.is_flat else inside
    return CValue(f"(struct {kind.c_name}){{{inside}}}", kind, parts=parts)


def element_of(array: CValue, index: str) -> CValue:
    """One element of an array, or one row of it."""
    kind = array.kind
    assert isinstance(kind, ArrayOf)
    code = f"{array.within(ATOM)}[{index}]"
    if len(kind.shape) > 1:
        return CValue(code, ArrayOf(kind.element, kind.shape[1:]))
    return CValue(code, kind.element, is_place=isinstance(kind.element, RecordOf))
