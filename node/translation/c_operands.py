"""What expressions of a kernel are made of, in C: numbers, names, fields of records, elements and parts of arrays."""

from __future__ import annotations

import ast
import builtins
from typing import Any, Protocol

import numpy as np

from node.kernels.arithmetic.quantity import Constant
from node.translation.c_value import (
    ATOM,
    COMPARED,
    PRODUCT,
    SUM,
    UNARY,
    CValue,
    c_word,
    element_of,
    number_value,
    several_values,
    truth_value,
)
from node.translation.kernel_source import UntranslatableKernelError, python_function
from node.translation.kinds_of_values import (
    INTEGER,
    TRUTH,
    ArrayOf,
    FunctionOf,
    RecordOf,
    Several,
    is_numeric,
    kind_of_dtype,
)


class CContext(Protocol):
    """What an expression needs of the file that it goes into."""

    def constant(self, name: str, number: int) -> str:
        """Name in C of a whole number of a module."""
        ...

    def table(self, name: str, numbers: tuple[int, ...]) -> str:
        """Name in C of a table of whole numbers of a module."""
        ...

    def struct_name(self, kind: RecordOf | Several) -> str:
        """Name in C of the struct of a record, or of several values."""
        ...

    def call(self, function: Any, given: list[CValue], place: str) -> CValue:
        """Call of a kernel with these arguments."""
        ...


class COperands:
    """Translates what the expressions of one function are made of: numbers, names, fields, elements, several values.

    Parameters
    ----------
    program : the file that is written
    names : what the module of the function knows
    place : where the function stands, for errors
    """

    def __init__(self, program: CContext, names: dict[str, Any], place: str) -> None:
        self._program, self._names, self._place = program, names, place
        self.variables: dict[str, CValue] = {}

    def refuse(self, node: ast.AST, why: str) -> UntranslatableKernelError:
        """The error of a piece of source that is not translated."""
        path, _, _ = self._place.rpartition(":")
        text = ast.unparse(node)[:80]
        return UntranslatableKernelError(f"{path}:{getattr(node, 'lineno', '?')}: {why}: {text}")

    def value(self, node: ast.expr) -> CValue:
        """C of an expression."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise self.refuse(node, f"expected what C has too, got {type(node).__name__}")
        found: CValue = method(node)
        return found

    def truth(self, node: ast.expr) -> CValue:
        """C of an expression that is asked for its truth."""
        found = self.value(node)
        if not is_numeric(found.kind):
            raise self.refuse(node, "expected a number or a truth")
        return found if found.kind == TRUTH else CValue(f"{found.within(SUM)} != 0", TRUTH, COMPARED)

    def _constant(self, node: ast.Constant) -> CValue:
        if isinstance(node.value, bool):
            return truth_value(node.value)
        if isinstance(node.value, int):
            return number_value(node.value)
        raise self.refuse(node, "expected a whole number, for chips count in integers")

    def _name(self, node: ast.Name) -> CValue:
        if node.id in self.variables:
            return self.variables[node.id]
        if node.id not in self._names and not hasattr(builtins, node.id):
            raise self.refuse(node, "expected a name that is known")
        return self._global(node, node.id, self._names.get(node.id, getattr(builtins, node.id, None)))

    def _global(self, node: ast.AST, name: str, found: Any) -> CValue:
        if isinstance(found, bool):
            return truth_value(found)
        if isinstance(found, Constant | int | np.integer):
            number = found.fixed if isinstance(found, Constant) else int(found)
            return CValue(self._program.constant(name, number), INTEGER, known=number)
        if isinstance(found, np.ndarray) and found.dtype.kind in "iu" and found.ndim == 1:
            return self._table(name, tuple(map(int, found)))
        if isinstance(found, tuple) and all(isinstance(number, int) for number in found):
            return self._table(name, tuple(map(int, found)))
        if callable(found):
            return CValue(name, FunctionOf(python_function(found)))
        raise self.refuse(node, f"expected integers, a table of them or a kernel, got {type(found).__name__}")

    def _table(self, name: str, numbers: tuple[int, ...]) -> CValue:
        parts = tuple(number_value(number) for number in numbers)
        return CValue(self._program.table(name, numbers), ArrayOf(INTEGER, (len(numbers),)), parts=parts)

    def _attribute(self, node: ast.Attribute) -> CValue:
        if isinstance(node.value, ast.Name) and node.value.id not in self.variables:
            whole = self._names.get(node.value.id)
            if whole is not None and hasattr(whole, node.attr):
                return self._global(node, f"{node.value.id}_{node.attr}", getattr(whole, node.attr))
        record = self.value(node.value)
        if not isinstance(record.kind, RecordOf) or node.attr not in (record.kind.dtype.names or ()):
            raise self.refuse(node, "expected a field of a record")
        fields = record.kind.dtype.fields
        assert fields is not None
        kind = kind_of_dtype(fields[node.attr][0])
        joined = "." if record.is_place else "->"
        code = f"{record.within(ATOM)}{joined}{c_word(node.attr)}"
        return CValue(code, kind, is_place=isinstance(kind, RecordOf))

    def _subscript(self, node: ast.Subscript) -> CValue:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            return self._length(node)
        found = self.value(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        for place, index in enumerate(indices):
            found = self._part(node, found, index, last=place == len(indices) - 1)
        return found

    def _length(self, node: ast.Subscript) -> CValue:
        assert isinstance(node.value, ast.Attribute)
        array, axis = self.value(node.value.value), self.value(node.slice).known
        if not isinstance(array.kind, ArrayOf) or axis is None:
            raise self.refuse(node, "expected the length of an array")
        length = array.kind.shape[axis]
        if length is not None:
            return number_value(length)
        if not array.length:
            raise self.refuse(node, "expected an array whose length is handed on")
        return CValue(array.length, INTEGER)

    def _part(self, node: ast.Subscript, found: CValue, index: ast.expr, *, last: bool) -> CValue:
        if isinstance(index, ast.Slice):
            if not last:
                raise self.refuse(node, "expected a slice of the last index, for others skip memory")
            return self._slice_of(node, found, index)
        at = self.value(index)
        if isinstance(found.kind, Several) and at.known is not None:
            return self.part_of(found, at.known)
        if isinstance(found.kind, Several) and found.parts is None and found.kind.is_flat:
            return CValue(f"{found.within(ATOM)}{found.kind.part(at.code)}", INTEGER)
        if not isinstance(found.kind, ArrayOf) or not is_numeric(at.kind):
            raise self.refuse(node, "expected an element of an array")
        if at.known is not None and at.known < 0:
            raise self.refuse(node, "expected a place that is counted from the first")
        return element_of(found, at.code)

    def _slice_of(self, node: ast.Subscript, found: CValue, index: ast.Slice) -> CValue:
        kind = found.kind
        if not isinstance(kind, ArrayOf) or index.step is not None:
            raise self.refuse(node, "expected a slice of an array, without a step")
        lower = self.value(index.lower) if index.lower else number_value(0)
        if index.upper is None and lower.known == 0:
            return found
        upper = self.value(index.upper) if index.upper else self._end_of(node, found)
        code = found.code if lower.known == 0 else f"&{found.within(ATOM)}[{lower.code}]"
        level = ATOM if lower.known == 0 else UNARY
        if upper.known is not None and lower.known is not None:
            return CValue(code, ArrayOf(kind.element, (upper.known - lower.known, *kind.shape[1:])), level)
        length = upper.code if lower.known == 0 else f"{upper.within(SUM)} - {lower.within(PRODUCT)}"
        return CValue(code, ArrayOf(kind.element, (None, *kind.shape[1:])), level, length=length)

    def _end_of(self, node: ast.Subscript, found: CValue) -> CValue:
        length = found.kind.shape[0] if isinstance(found.kind, ArrayOf) else None
        if length is None:
            raise self.refuse(node, "expected a slice with an end")
        return number_value(length)

    def part_of(self, several: CValue, at: int) -> CValue:
        """One of several values."""
        if several.parts is not None:
            return several.parts[at]
        assert isinstance(several.kind, Several)
        return CValue(f"{several.within(ATOM)}{several.kind.part(at)}", several.kind.kinds[at])

    def parts_of(self, several: CValue) -> list[CValue]:
        """All of several values."""
        assert isinstance(several.kind, Several)
        return [self.part_of(several, at) for at in range(len(several.kind.kinds))]

    def _tuple(self, node: ast.Tuple) -> CValue:
        parts: list[CValue] = []
        for element in node.elts:
            if isinstance(element, ast.Starred):
                parts.extend(self.parts_of(self.value(element.value)))
            else:
                parts.append(self.value(element))
        return several_values(tuple(parts))
