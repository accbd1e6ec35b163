"""CExpressions of a kernel in C, each with the meaning that numba gives it for integers."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable
from typing import Any, Final, Protocol

import numpy as np

from node.kernels.arithmetic.quantity import Constant
from node.translation.c_value import (
    ATOM,
    CHOSEN,
    COMPARED,
    INT32,
    LOGICAL,
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
    Kind,
    Plain,
    RecordOf,
    Several,
    is_numeric,
    kind_of_dtype,
)

SIGNS: Final[dict[type[ast.operator], tuple[str, int]]] = {
    ast.Add: ("+", SUM),
    ast.Sub: ("-", SUM),
    ast.Mult: ("*", PRODUCT),
    ast.BitAnd: ("&", ATOM),
    ast.BitOr: ("|", ATOM),
    ast.BitXor: ("^", ATOM),
}
FOLDED: Final[dict[type[ast.operator], Callable[[int, int], int]]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.BitAnd: lambda a, b: a & b,
    ast.BitOr: lambda a, b: a | b,
    ast.BitXor: lambda a, b: a ^ b,
    ast.LShift: lambda a, b: a << b,
    ast.RShift: lambda a, b: a >> b,
    ast.FloorDiv: lambda a, b: a // b,
    ast.Mod: lambda a, b: a % b,
    ast.Pow: lambda a, b: int(a**b),
}
COMPARISONS: Final[dict[type[ast.cmpop], str]] = {
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}
HELPERS: Final = {"min": "least", "max": "most"}


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


class CExpressions:
    """Translates the expressions of one function.

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

    def _binop(self, node: ast.BinOp) -> CValue:
        left, right, operator = self.value(node.left), self.value(node.right), type(node.op)
        if not (is_numeric(left.kind) and is_numeric(right.kind)) or operator not in FOLDED:
            raise self.refuse(node, "expected integers and an operator of theirs")
        self._refuse_unsigned(node, left.kind, right.kind)
        if left.known is not None and right.known is not None:
            return self._folded(left, right, operator)
        if operator in SIGNS:
            return self._signed(left, right, operator)
        return self._called(node, left, right, operator)

    def _refuse_unsigned(self, node: ast.BinOp, *kinds: Kind) -> None:
        """Numba makes an unsigned number of two: only what comes out the same for a signed one is translated."""
        unsigned = all(isinstance(kind, Plain) and kind.c_name.startswith("u") for kind in kinds)
        if unsigned and not isinstance(node.op, ast.BitAnd | ast.BitOr | ast.BitXor):
            raise self.refuse(node, "expected int() around one of two unsigned numbers")

    def _folded(self, left: CValue, right: CValue, operator: type[ast.operator]) -> CValue:
        number = FOLDED[operator](left.known, right.known)
        small = all(abs(one) < INT32 for one in (number, left.known, right.known))
        if operator not in (ast.Add, ast.Sub, ast.Mult) or not small:
            return number_value(number)
        found = self._signed(left, right, operator)
        return CValue(found.code, INTEGER, found.level, number)

    def _signed(self, left: CValue, right: CValue, operator: type[ast.operator]) -> CValue:
        sign, level = SIGNS[operator]
        if level == ATOM:
            kind = TRUTH if left.kind == right.kind == TRUTH else INTEGER
            return CValue(f"{_wide(left, ATOM)} {sign} {_wide(right, ATOM)}", kind, COMPARED)
        tighter = level if operator is not ast.Sub else PRODUCT
        return CValue(f"{_wide(left, level)} {sign} {_wide(right, tighter)}", INTEGER, level)

    def _called(self, node: ast.BinOp, left: CValue, right: CValue, operator: type[ast.operator]) -> CValue:
        if operator is ast.LShift:
            return CValue(f"shift_left({left.code}, {right.code})", INTEGER)
        if operator is ast.RShift:
            return CValue(f"shift_right({left.code}, {right.code})", INTEGER)
        if operator is ast.Pow:
            raise self.refuse(node, "expected a power that is known")
        divisor = right.known
        if divisor is not None and divisor > 0 and divisor & (divisor - 1) == 0:
            if operator is ast.Mod:
                return CValue(f"{_wide(left, ATOM)} & ({right.code} - 1)", INTEGER, COMPARED)
            return CValue(f"shift_right({left.code}, {divisor.bit_length() - 1})", INTEGER)
        name = "floor_divide" if operator is ast.FloorDiv else "floor_modulo"
        return CValue(f"{name}({left.code}, {right.code})", INTEGER)

    def _unaryop(self, node: ast.UnaryOp) -> CValue:
        if isinstance(node.op, ast.Not):
            found = self.truth(node.operand)
            return CValue(f"!{found.within(ATOM)}", TRUTH, UNARY)
        found = self.value(node.operand)
        if not is_numeric(found.kind):
            raise self.refuse(node, "expected an integer")
        if found.known is not None and isinstance(node.op, ast.USub) and found.code.lstrip("-").isdigit():
            return number_value(-found.known)
        sign = {ast.USub: "-", ast.Invert: "~", ast.UAdd: "+"}[type(node.op)]
        known = None if found.known is None else -found.known if sign == "-" else ~found.known
        return CValue(f"{sign}{_wide(found, ATOM)}", INTEGER, UNARY, known)

    def _boolop(self, node: ast.BoolOp) -> CValue:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return CValue(sign.join(self.truth(one).within(COMPARED) for one in node.values), TRUTH, LOGICAL)

    def _compare(self, node: ast.Compare) -> CValue:
        values = [self.value(one) for one in (node.left, *node.comparators)]
        if isinstance(node.ops[0], ast.In | ast.NotIn):
            return self._among(node, values)
        if any(not is_numeric(one.kind) for one in values):
            raise self.refuse(node, "expected numbers to compare")
        signs = [COMPARISONS[type(operator)] for operator in node.ops]
        if len(signs) == 2 and "(" in values[1].code:
            return self._between(node, values, signs)
        pairs = [
            f"{one.within(SUM)} {sign} {other.within(SUM)}"
            for one, sign, other in zip(values, signs, values[1:], strict=False)
        ]
        return CValue(" && ".join(pairs), TRUTH, COMPARED if len(pairs) == 1 else LOGICAL)

    def _between(self, node: ast.Compare, values: list[CValue], signs: list[str]) -> CValue:
        """A number that takes a call is computed once."""
        if signs[0] not in ("<", "<=") or signs[1] not in ("<", "<="):
            raise self.refuse(node, "expected a number between two")
        ends = {"<": "beyond", "<=": "from"}[signs[0]], {"<": "below", "<=": "upto"}[signs[1]]
        inside = ", ".join(one.code for one in values)
        return CValue(f"is_{ends[0]}_{ends[1]}({inside})", TRUTH)

    def _among(self, node: ast.Compare, values: list[CValue]) -> CValue:
        one, several = values
        if several.parts is None or not is_numeric(one.kind):
            raise self.refuse(node, "expected a number among several that stand in the source")
        joined = " || ".join(f"{one.within(SUM)} == {part.within(SUM)}" for part in several.parts)
        return (
            CValue(joined, TRUTH, LOGICAL) if isinstance(node.ops[0], ast.In) else CValue(f"!({joined})", TRUTH, UNARY)
        )

    def _ifexp(self, node: ast.IfExp) -> CValue:
        asked, one, other = self.truth(node.test), self.value(node.body), self.value(node.orelse)
        if isinstance(one.kind, Several) and one.kind == other.kind:
            kind: Kind = one.kind
        elif is_numeric(one.kind) and is_numeric(other.kind):
            kind = one.kind if one.kind == other.kind == TRUTH else INTEGER
        else:
            raise self.refuse(node, "expected two of one kind")
        return CValue(f"{asked.within(COMPARED)} ? {one.within(LOGICAL)} : {other.within(CHOSEN)}", kind, CHOSEN)

    def _call(self, node: ast.Call) -> CValue:
        if node.keywords:
            raise self.refuse(node, "expected arguments by their place")
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in self.variables and name not in self._names and hasattr(builtins, name):
            return self._builtin(node, name)
        function = self.value(node.func)
        if not isinstance(function.kind, FunctionOf):
            raise self.refuse(node, "expected a kernel to call")
        return self._program.call(function.kind.function, self._arguments(node), self._place)

    def _arguments(self, node: ast.Call) -> list[CValue]:
        given: list[CValue] = []
        for argument in node.args:
            if isinstance(argument, ast.Starred):
                given.extend(self.parts_of(self.value(argument.value)))
            else:
                given.append(self.value(argument))
        return given

    def _builtin(self, node: ast.Call, name: str) -> CValue:
        given = self._arguments(node)
        if not given or any(not is_numeric(one.kind) for one in given):
            raise self.refuse(node, "expected integers")
        if name == "int":
            return CValue(given[0].code, INTEGER, given[0].level, given[0].known)
        if name == "bool":
            return self.truth(node.args[0])
        if name == "abs":
            return CValue(f"magnitude({given[0].code})", INTEGER)
        if name not in HELPERS or len(given) < 2:
            raise self.refuse(node, "expected int, bool, abs, min or max")
        code = given[0].code
        for one in given[1:]:
            code = f"{HELPERS[name]}({code}, {one.code})"
        return CValue(code, INTEGER)


def _wide(value: CValue, level: int) -> str:
    """An operand in 64 bits: a product of narrow ones would be made in 32."""
    if value.kind == INTEGER or value.known is not None:
        return value.within(level)
    return f"(int64_t){value.within(ATOM)}" if value.kind != TRUTH else value.within(level)
