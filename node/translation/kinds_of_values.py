"""What a value of a kernel is in C: integers, truths, records, arrays of them, several together, functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np

from node.translation.kernel_source import UntranslatableKernelError


@dataclass(frozen=True)
class Plain:
    """A number of one C type."""

    c_name: str


@dataclass(frozen=True)
class RecordOf:
    """A record, handed on by its address."""

    dtype: np.dtype[Any]


@dataclass(frozen=True)
class ArrayOf:
    """An array of numbers or records, handed on by its address.

    Attributes
    ----------
    shape : lengths; None: the first is not known before the code runs, or nothing asks for it
    counted : its length is handed on beside it
    """

    element: Plain | RecordOf
    shape: tuple[int | None, ...]
    counted: bool = False


@dataclass(frozen=True)
class Several:
    """Several values together, as a kernel returns them: integers, or several again."""

    kinds: tuple[Plain | Several, ...]

    @property
    def is_flat(self) -> bool:
        """Whether they are integers alone."""
        return all(isinstance(kind, Plain) for kind in self.kinds)

    @property
    def c_name(self) -> str:
        """Name of its struct: how many integers, or how many in each part."""
        if self.is_flat:
            return f"integers_{len(self.kinds)}"
        sizes = [len(kind.kinds) if isinstance(kind, Several) else 1 for kind in self.kinds]
        return "several_" + "_".join(map(str, sizes))

    def part(self, at: int | str) -> str:
        """How C names one of them."""
        return f".at[{at}]" if self.is_flat else f".part_{at}"


@dataclass(frozen=True)
class FunctionOf:
    """A function, known where C is written."""

    function: Callable[..., Any]


Kind: TypeAlias = Plain | RecordOf | ArrayOf | Several | FunctionOf
INTEGER: Final = Plain("int64_t")
TRUTH: Final = Plain("bool")
NOTHING: Final = Plain("void")
NUMBERS: Final = {
    np.dtype("i8"): INTEGER,
    np.dtype("u4"): Plain("uint32_t"),
    np.dtype("u1"): Plain("uint8_t"),
    np.dtype("i4"): Plain("int32_t"),
    np.dtype("i2"): Plain("int16_t"),
}


def kind_of_dtype(dtype: np.dtype[Any]) -> Kind:
    """Kind of what a field of this dtype holds.

    Raises
    ------
    UntranslatableKernelError
        When it holds floats or anything else that is no integer.
    """
    if dtype.subdtype is not None:
        element = kind_of_dtype(dtype.subdtype[0])
        assert isinstance(element, Plain | RecordOf)
        return ArrayOf(element, dtype.subdtype[1])
    if dtype.fields is not None:
        return RecordOf(dtype)
    found = NUMBERS.get(dtype)
    if found is None:
        raise UntranslatableKernelError(f"expected a field of integers, got {dtype}")
    return found


def is_numeric(kind: Kind) -> bool:
    """Whether it is one integer or truth."""
    return isinstance(kind, Plain) and kind != NOTHING


def unite_kinds(one: Kind | None, other: Kind) -> Kind:
    """Kind of a variable that is given both.

    Raises
    ------
    UntranslatableKernelError
        When there is none.
    """
    if one is None or one == other:
        return other
    if is_numeric(one) and is_numeric(other):
        return INTEGER
    if isinstance(one, ArrayOf) and isinstance(other, ArrayOf) and one.shape[1:] == other.shape[1:]:
        return one
    raise UntranslatableKernelError(f"expected one kind for a variable, got {one} and {other}")


def declare_variable(kind: Kind, name: str, struct_name: Callable[[RecordOf | Several], str]) -> str:
    """How C declares a variable ``name``; ``struct_name`` gives the name of a struct, and sees to it that it is one."""
    if isinstance(kind, Plain):
        return f"{kind.c_name} {name}"
    if isinstance(kind, Several):
        return f"struct {struct_name(kind)} {name}"
    if isinstance(kind, RecordOf):
        return f"struct {struct_name(kind)} *{name}"
    assert isinstance(kind, ArrayOf)
    held = declare_variable(kind.element, "", struct_name).replace(" *", "").strip()
    inner = "".join(f"[{length}]" for length in kind.shape[1:])
    return f"{held} (*{name}){inner}" if inner else f"{held} *{name}"
