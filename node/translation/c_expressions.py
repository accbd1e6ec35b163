"""Expressions of a kernel in C, each with the meaning that numba gives it for integers."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable
from typing import Final

from node.translation.c_operands import COperands
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
    number_value,
)
from node.translation.kinds_of_values import INTEGER, TRUTH, FunctionOf, Kind, Plain, Several, is_numeric

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


class CExpressions(COperands):
    """Translates the expressions of one function: what is done with its operands."""

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
