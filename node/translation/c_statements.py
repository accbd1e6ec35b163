"""CStatements of a kernel in C."""

from __future__ import annotations

import ast
import re

from node.translation.c_expressions import FOLDED, CExpressions
from node.translation.c_operands import CContext
from node.translation.c_value import SUM, CValue, c_word, several_values
from node.translation.kernel_source import KernelSource, UntranslatableKernelError
from node.translation.kinds_of_values import (
    INTEGER,
    NOTHING,
    TRUTH,
    ArrayOf,
    FunctionOf,
    Kind,
    Plain,
    RecordOf,
    Several,
    declare_variable,
    is_numeric,
    unite_kinds,
)
from node.translation.variable_places import Block, declare_places, stored_names

STEP = "    "


class CStatements:
    """Translates the body of one function, twice: what a variable is may show only after its first use.

    Parameters
    ----------
    program : the file that is written
    source : the function
    given : value of each argument, as the body names it
    """

    def __init__(self, program: CContext, source: KernelSource, given: dict[str, CValue]) -> None:
        self._program, self._source, self._given = program, source, given
        self._expressions = CExpressions(program, source.names, source.place)
        stored = stored_names(source.body)
        self._places = declare_places(source.body, tuple(given))
        self._own = stored - set(given)
        self._kinds: dict[str, Kind] = {}
        self._lines: list[str] = []
        self._temporaries = 0
        self.returned: Kind | None = None

    def translate(self) -> list[str]:
        """Lines of the body, indented once."""
        for _ in range(2):
            self._lines, self._temporaries = [], 0
            self._expressions.variables = dict(self._given) | {
                name: self._variable(name) for name in self._kinds if name in self._own
            }
            self._block(self._source.body, (), 1)
        return [line for line in self._lines if not self._is_idle(line)]

    def _is_idle(self, line: str) -> bool:
        """Whether a line declares what nothing reads: the form of a constant, which integers do not ask for."""
        declared = re.match(r" *int64_t (\w+) = [^(]*;$", line)
        if declared is None or declared[1] not in map(c_word, self._own):
            return False
        return sum(len(re.findall(rf"\b{declared[1]}\b", other)) for other in self._lines) == 1

    def _variable(self, name: str) -> CValue:
        kind = self._kinds[name]
        return CValue(c_word(name), kind, length=f"{name}_length" if _is_counted(kind) else "")

    def _emit(self, depth: int, line: str) -> None:
        self._lines.append(f"{STEP * depth}{line}")

    def _block(self, body: list[ast.stmt], block: Block, depth: int) -> None:
        for name in self._places.ahead.get(block, ()):
            if name in self._own and name in self._kinds:
                self._emit(depth, f"{self._declared(name)} = {_nothing_yet(self._kinds[name])};")
        for number, statement in enumerate(body):
            self._statement(statement, (*block, (number, "body")), depth)

    def _declared(self, name: str) -> str:
        return declare_variable(self._kinds[name], c_word(name), self._program.struct_name)

    def _statement(self, statement: ast.stmt, inner: Block, depth: int) -> None:
        method = getattr(self, f"_{type(statement).__name__.lower()}", None)
        if method is None:
            raise self._expressions.refuse(statement, f"expected what C has too, got {type(statement).__name__}")
        method(statement, inner, depth)

    def _pass(self, _: ast.Pass, __: Block, ___: int) -> None:
        return

    def _break(self, _: ast.Break, __: Block, depth: int) -> None:
        self._emit(depth, "break;")

    def _continue(self, _: ast.Continue, __: Block, depth: int) -> None:
        self._emit(depth, "continue;")

    def _return(self, statement: ast.Return, _: Block, depth: int) -> None:
        if statement.value is None:
            self._emit(depth, "return;")
            return
        found = self._expressions.value(statement.value)
        if not (is_numeric(found.kind) or isinstance(found.kind, Several)):
            raise self._expressions.refuse(statement, "expected numbers to return")
        kind = INTEGER if is_numeric(found.kind) and found.kind != TRUTH else found.kind
        self.returned = kind if self.returned is None else unite_kinds(self.returned, kind)
        self._emit(depth, f"return {found.code};")

    def _expr(self, statement: ast.Expr, _: Block, depth: int) -> None:
        found = self._expressions.value(statement.value)
        self._emit(depth, f"{found.code};" if found.kind == NOTHING else f"(void){found.code};")

    def _if(self, statement: ast.If, inner: Block, depth: int, word: str = "if") -> None:
        truth = self._expressions.truth(statement.test)
        self._emit(depth, f"{word} ({truth.code}) {{")
        self._block(statement.body, inner, depth + 1)
        block: Block = (*inner[:-1], (inner[-1][0], "orelse"))
        if not statement.orelse:
            self._emit(depth, "}")
        elif len(statement.orelse) == 1 and isinstance(statement.orelse[0], ast.If) and not self._needs(block):
            self._if(statement.orelse[0], (*block, (0, "body")), depth, "} else if")
        else:
            self._emit(depth, "} else {")
            self._block(statement.orelse, block, depth + 1)
            self._emit(depth, "}")

    def _needs(self, block: Block) -> bool:
        return block in self._places.ahead

    def _while(self, statement: ast.While, inner: Block, depth: int) -> None:
        if statement.orelse:
            raise self._expressions.refuse(statement, "expected a loop without else")
        self._emit(depth, f"while ({self._expressions.truth(statement.test).code}) {{")
        self._block(statement.body, inner, depth + 1)
        self._emit(depth, "}")

    def _for(self, statement: ast.For, inner: Block, depth: int) -> None:
        if not isinstance(statement.target, ast.Name) or statement.orelse:
            raise self._expressions.refuse(statement, "expected a loop over one name")
        name, before = statement.target.id, dict(self._expressions.variables)
        if isinstance(statement.iter, ast.Tuple):
            self._over_tuple(statement, statement.iter, depth)
        else:
            self._over_range(statement, depth)
        self._block(statement.body, inner, depth + 1)
        self._emit(depth, "}")
        self._expressions.variables.pop(name)
        if name in before:
            self._expressions.variables[name] = before[name]

    def _over_tuple(self, statement: ast.For, several: ast.Tuple, depth: int) -> None:
        assert isinstance(statement.target, ast.Name)
        name, count = c_word(statement.target.id), len(several.elts)
        parts = [self._expressions.value(one) for one in several.elts]
        # C wants constants in what is kept between calls; an element of a table is none
        storage = "static " if all(part.known is not None and "[" not in part.code for part in parts) else ""
        numbers = ", ".join(part.code for part in parts)
        self._emit(depth, f"{storage}const int64_t {name}_of[{count}] = {{{numbers}}};")
        self._emit(depth, f"for (int64_t {name}_at = 0; {name}_at < {count}; {name}_at++) {{")
        self._emit(depth + 1, f"const int64_t {name} = {name}_of[{name}_at];")
        self._expressions.variables[statement.target.id] = CValue(name, INTEGER)

    def _over_range(self, statement: ast.For, depth: int) -> None:
        call, name = statement.iter, getattr(statement.target, "id", "")
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            raise self._expressions.refuse(statement, "expected a loop over a range")
        bounds = [self._expressions.value(one) for one in call.args]
        first = bounds[0].code if len(bounds) > 1 else "0"
        step = bounds[2].known if len(bounds) > 2 else 1
        if step not in (1, -1):
            raise self._expressions.refuse(statement, "expected a step of 1 or -1")
        end, counter, sign = bounds[min(len(bounds) - 1, 1)], c_word(name), "<" if step == 1 else ">"
        start, until = f"int64_t {counter} = {first}", end.within(SUM)
        if end.known is None:
            start, until = f"{start}, {name}_end = {end.code}", f"{name}_end"
        self._emit(depth, f"for ({start}; {counter} {sign} {until}; {counter}{'++' if step == 1 else '--'}) {{")
        self._expressions.variables[name] = CValue(counter, INTEGER)

    def _annassign(self, statement: ast.AnnAssign, _: Block, depth: int) -> None:
        if statement.value is not None:
            self._store(statement, statement.target, self._expressions.value(statement.value), depth)

    def _augassign(self, statement: ast.AugAssign, _: Block, depth: int) -> None:
        read = ast.copy_location(_read(statement.target), statement)
        added = ast.copy_location(ast.BinOp(read, statement.op, statement.value), statement)
        sign = {ast.Add: "+=", ast.Sub: "-=", ast.BitOr: "|=", ast.BitAnd: "&=", ast.BitXor: "^=", ast.Mult: "*="}
        found = self._expressions.value(added)
        place, value = self._expressions.value(read), self._expressions.value(statement.value)
        if type(statement.op) in sign and type(statement.op) in FOLDED and place.kind == INTEGER:
            self._emit(depth, f"{place.code} {sign[type(statement.op)]} {value.code};")
        else:
            self._store(statement, statement.target, found, depth)

    def _assign(self, statement: ast.Assign, _: Block, depth: int) -> None:
        found = self._expressions.value(statement.value)
        if len(statement.targets) > 1:
            for target in reversed(statement.targets):
                self._store(statement, target, found, depth)
            return
        (target,) = statement.targets
        if isinstance(target, ast.Tuple):
            self._unpack(statement, target, found, depth)
        else:
            self._store(statement, target, found, depth)

    def _unpack(self, statement: ast.Assign, target: ast.Tuple, found: CValue, depth: int) -> None:
        if found.parts is None:
            found = self._held(found, depth)
        parts = self._expressions.parts_of(found)
        if len(parts) != len(target.elts):
            raise self._expressions.refuse(statement, f"expected {len(target.elts)} values, got {len(parts)}")
        if found.parts is not None and _is_circular(statement):
            parts = [part if part.known is not None else self._held(part, depth) for part in parts]
        for one, part in zip(target.elts, parts, strict=True):
            self._store(statement, one, part, depth)

    def _held(self, found: CValue, depth: int) -> CValue:
        """A value that is computed now and used later."""
        name = f"held_{self._temporaries}"
        self._temporaries += 1
        kind = INTEGER if is_numeric(found.kind) else found.kind
        self._emit(depth, f"const {declare_variable(kind, name, self._program.struct_name)} = {found.code};")
        return CValue(name, kind)

    def _store(self, statement: ast.stmt, target: ast.expr, found: CValue, depth: int) -> None:
        if isinstance(target, ast.Name):
            self._store_variable(statement, target.id, found, depth)
            return
        place = self._expressions.value(target)
        if not (isinstance(place.kind, Plain) and is_numeric(found.kind)):
            raise self._expressions.refuse(statement, "expected a number to store")
        narrow = place.kind not in (INTEGER, TRUTH) and found.kind != place.kind
        self._emit(depth, f"{place.code} = {f'({place.kind.c_name}){found.within(0)}' if narrow else found.code};")

    def _store_variable(self, statement: ast.stmt, name: str, found: CValue, depth: int) -> None:
        kind = _kept_kind(found)
        if isinstance(kind, FunctionOf):
            raise self._expressions.refuse(statement, "expected a value")
        try:
            self._kinds[name] = unite_kinds(self._kinds.get(name), kind)
        except UntranslatableKernelError as error:
            raise self._expressions.refuse(statement, str(error)) from None
        if found.parts is not None and not isinstance(found.kind, ArrayOf):
            found = several_values(found.parts)
        self._expressions.variables[name] = self._variable(name)
        begins = name in self._places.at_store.get(id(statement), ())
        if begins and _is_counted(self._kinds[name]):
            self._emit(depth, f"const int64_t {name}_length = {found.length};")
        code = f"{found.within(SUM)} != 0" if self._kinds[name] == TRUTH != found.kind else found.address
        self._emit(depth, f"{self._declared(name) if begins else c_word(name)} = {code};")


def _is_counted(kind: Kind) -> bool:
    return isinstance(kind, ArrayOf) and kind.counted


def _kept_kind(found: CValue) -> Kind:
    if is_numeric(found.kind):
        return TRUTH if found.kind == TRUTH else INTEGER
    if isinstance(found.kind, ArrayOf) and found.length:
        return ArrayOf(found.kind.element, found.kind.shape, counted=True)
    return found.kind


def _nothing_yet(kind: Kind) -> str:
    if isinstance(kind, Several):
        return "{0}"
    if isinstance(kind, ArrayOf | RecordOf):
        return "0"
    return "false" if kind == TRUTH else "0"


def _read(target: ast.expr) -> ast.expr:
    """The expression that reads what a statement stores to."""
    made = ast.parse(ast.unparse(target), mode="eval").body
    for node in ast.walk(made):
        ast.copy_location(node, target)
    return made


def _is_circular(statement: ast.Assign) -> bool:
    """Whether what is stored first is read for what is stored later."""
    target, value = statement.targets[0], statement.value
    if not isinstance(target, ast.Tuple) or not isinstance(value, ast.Tuple):
        return True
    stored: set[str] = set()
    for one, read in zip(target.elts, value.elts, strict=True):
        if any(ast.unparse(node) in stored for node in ast.walk(read) if isinstance(node, ast.expr)):
            return True
        stored.add(ast.unparse(one))
        if not isinstance(one, ast.Name):
            stored.add(ast.unparse(one).partition("[")[0])
    return False
