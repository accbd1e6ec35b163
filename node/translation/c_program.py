"""The C of a set of kernels: every function once for each kind of its arguments, in an order that declares itself."""

from __future__ import annotations

import ast
import textwrap
from typing import Any, NamedTuple

from node.translation.c_lines import LINE, break_line, fill_rows
from node.translation.c_statements import CStatements
from node.translation.c_structs import CStructs
from node.translation.c_value import CValue, c_word, literal_of
from node.translation.kernel_source import KernelSource, UntranslatableKernelError, integer_source
from node.translation.kinds_of_values import (
    INTEGER,
    NOTHING,
    ArrayOf,
    FunctionOf,
    Kind,
    RecordOf,
    Several,
    declare_variable,
    is_numeric,
)


class Translated(NamedTuple):
    """One function in C: how it is called, and what it returns."""

    name: str
    returned: Kind


class CProgram:
    """Collects what the kernels that are asked for are made of.

    Parameters
    ----------
    records : names of the records
    """

    def __init__(self, records: CStructs) -> None:
        self._records = records
        self._functions: dict[tuple[Any, ...], Translated] = {}
        self._names: dict[str, int] = {}
        self._constants: dict[str, tuple[str, int]] = {}
        self._tables: dict[str, tuple[str, tuple[int, ...]]] = {}
        self._several: dict[Several, str] = {}
        self._open: list[str] = []
        self.texts: list[str] = []
        self.returned: dict[str, Kind] = {}

    def constant(self, name: str, number: int) -> str:
        """Name in C of a whole number of a module; two modules may mean different ones by a name."""
        wanted = name.lstrip("_").upper()
        for k in range(1, 100):
            found = wanted if k == 1 else f"{wanted}_{k}"
            if self._constants.setdefault(found, (literal_of(number), number))[1] == number:
                return found
        raise UntranslatableKernelError(f"{name}: expected fewer than 100 constants of one name")

    def table(self, name: str, numbers: tuple[int, ...]) -> str:
        """Name in C of a table of whole numbers."""
        wanted = f"{name.lstrip('_').lower()}_table"
        for k in range(1, 100):
            found = wanted if k == 1 else f"{wanted}_{k}"
            if self._tables.setdefault(found, (_narrowest(numbers), numbers))[1] == numbers:
                return found
        raise UntranslatableKernelError(f"{name}: expected fewer than 100 tables of one name")

    def struct_name(self, kind: RecordOf | Several) -> str:
        """Name of the struct of a record, or of several values, which is written where it was not yet."""
        if isinstance(kind, RecordOf):
            return self._records.name(kind.dtype)
        if kind not in self._several:
            parts = (
                [f"int64_t at[{len(kind.kinds)}]"]
                if kind.is_flat
                else [declare_variable(part, f"part_{k}", self.struct_name) for k, part in enumerate(kind.kinds)]
            )
            inside = "".join(f"    {part};\n" for part in parts)
            self._several[kind] = f"struct {kind.c_name} {{\n{inside}}};"
        return kind.c_name

    def call(self, function: Any, given: list[CValue], place: str) -> CValue:
        """Call of a kernel with these arguments, which is translated where it was not yet."""
        source = integer_source(function)
        if len(given) != len(source.arguments):
            raise UntranslatableKernelError(
                f"{place}: expected {len(source.arguments)} arguments of {source.name}, got {len(given)}"
            )
        kinds = tuple(_handed_kind(source, name, value) for name, value in zip(source.arguments, given, strict=True))
        found = self._function(function, source, kinds)
        handed: list[str] = []
        for value, kind in zip(given, kinds, strict=True):
            if _is_handed(kind):
                handed.append(value.address)
            if isinstance(kind, ArrayOf) and kind.counted:
                handed.append(value.length)
        return CValue(f"{found.name}({', '.join(handed)})", found.returned)

    def _function(self, function: Any, source: KernelSource, kinds: tuple[Kind, ...]) -> Translated:
        key = (function, *kinds)
        if key not in self._functions:
            if source.place in self._open:
                raise UntranslatableKernelError(
                    f"{source.place}: expected no function that calls itself: {source.name}"
                )
            self._open.append(source.place)
            self._functions[key] = self.write(source, kinds, self._free_name(source.name))
            self._open.pop()
        return self._functions[key]

    def _free_name(self, name: str) -> str:
        count = self._names[name] = self._names.get(name, 0) + 1
        return name if count == 1 else f"{name}_{count}"

    def write(self, source: KernelSource, kinds: tuple[Kind, ...], name: str, static: str = "static ") -> Translated:
        """Write one function for arguments of these kinds under this name."""
        given = {
            argument: _argument_value(argument, kind) for argument, kind in zip(source.arguments, kinds, strict=True)
        }
        body = CStatements(self, source, given)
        lines = body.translate()
        returned = body.returned or NOTHING
        head = f"{static}{declare_variable(returned, name, self.struct_name)}({self._arguments(given)})"
        self.texts.append("\n".join([_note(source), break_line(head) + "\n{", *map(break_line, lines), "}\n"]))
        self.returned[name] = returned
        return Translated(name, returned)

    def _arguments(self, given: dict[str, CValue]) -> str:
        declared: list[str] = []
        for name, value in given.items():
            if not _is_handed(value.kind):
                continue
            declared.append(declare_variable(value.kind, c_word(name), self.struct_name))
            if isinstance(value.kind, ArrayOf) and value.kind.counted:
                declared.append(f"int64_t {name}_length")
        return ", ".join(declared) or "void"

    def constants_text(self) -> str:
        """Constants and tables that the functions use, and what functions return together."""
        parts = [f"#define {name} {text}" for name, (text, _) in sorted(self._constants.items())]
        parts.extend(self._several.values())
        for name, (kind, numbers) in sorted(self._tables.items()):
            rows = fill_rows([literal_of(number) for number in numbers])
            parts.append(f"static const {kind} {name}[{len(numbers)}] = {{\n{rows}\n}};")
        return "\n".join(parts)


def _narrowest(numbers: tuple[int, ...]) -> str:
    for bits in (8, 16, 32, 64):
        if all(-(1 << (bits - 1)) <= number < 1 << (bits - 1) for number in numbers):
            return f"int{bits}_t"
    raise UntranslatableKernelError(f"expected numbers of 64 bits, got up to {max(numbers)}")


def _handed_kind(source: KernelSource, name: str, value: CValue) -> Kind:
    """Kind of an argument, ``NOTHING`` of one that is not used; an array has a length only where that is asked for."""
    kind = value.kind
    if not _uses(source, name):
        return NOTHING
    if is_numeric(kind):
        return INTEGER if kind.c_name != "bool" else kind  # type: ignore[union-attr]
    if not isinstance(kind, ArrayOf):
        return kind
    if not _asks_length(source, name):
        return ArrayOf(kind.element, (None, *kind.shape[1:]))
    return ArrayOf(kind.element, kind.shape, counted=kind.shape[0] is None)


def _is_handed(kind: Kind) -> bool:
    """Whether an argument is one in C too."""
    return not isinstance(kind, FunctionOf) and kind != NOTHING


def _uses(source: KernelSource, name: str) -> bool:
    return any(
        isinstance(node, ast.Name) and node.id == name for statement in source.body for node in ast.walk(statement)
    )


def _asks_length(source: KernelSource, name: str) -> bool:
    nodes = [node for statement in source.body for node in ast.walk(statement)]
    indexed = {id(node.value) for node in nodes if isinstance(node, ast.Subscript)}
    sliced = {
        id(node.value)
        for node in nodes
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Slice) and node.slice.upper is None
    }
    return any(
        isinstance(node, ast.Name) and node.id == name and (id(node) not in indexed or id(node) in sliced)
        for node in nodes
    )


def _argument_value(name: str, kind: Kind) -> CValue:
    if isinstance(kind, FunctionOf):
        return CValue(name, kind)
    counted = isinstance(kind, ArrayOf) and kind.counted
    return CValue(c_word(name), kind, length=f"{name}_length" if counted else "")


def _note(source: KernelSource) -> str:
    text = f"{source.summary} ({source.place})" if source.summary else source.place
    return "\n * ".join(textwrap.wrap(text.replace("``", ""), LINE - 3, initial_indent="/* ")) + " */"
