"""CStructs of the kernels as structs of C: the same bytes at the same places, with what each field is and counts."""

from __future__ import annotations

import ast
import importlib
import inspect
import io
import tokenize
from types import ModuleType
from typing import Any, Final

import numpy as np

from node.kernels.record import filter_record, integer_filter, integer_node, node_record, sensor_record
from node.kernels.record.integer_node import COPIED, OWN_FORMATS, G, in_integers
from node.translation.c_value import c_word
from node.translation.kernel_source import UntranslatableKernelError
from node.translation.kinds_of_values import NUMBERS

MODULES: Final[tuple[ModuleType, ...]] = (integer_filter, filter_record, sensor_record, node_record, integer_node)
PREFIX: Final = "borechain_"
FIXED: Final = "fixed_"  # of a record that the kernels write in integers themselves


class CStructs:
    """Structs of all records that a program names, each after those that it holds."""

    def __init__(self) -> None:
        self._known = _known_records()
        self._written: dict[np.dtype[Any], str] = {}
        self._texts: list[str] = []

    def name(self, dtype: np.dtype[Any]) -> str:
        """Name of a record's struct, which is written where it was not yet."""
        if dtype not in self._written:
            label, comments = self._known.get(dtype, ("", {}))
            if not label:
                raise UntranslatableKernelError(f"expected a record that a module of the kernels names, got {dtype}")
            name = f"{PREFIX}{label}"
            if name in self._written.values():
                raise UntranslatableKernelError(f"expected one record of the name {label}, got two")
            self._written[dtype] = name
            self._texts.append(self._struct(dtype, name, comments))
        return self._written[dtype]

    def text(self) -> str:
        """All structs so far."""
        return "\n".join(self._texts)

    def _struct(self, dtype: np.dtype[Any], name: str, comments: dict[str, str]) -> str:
        assert dtype.fields is not None
        rows, checks, at, holes = [], [], 0, 0
        for field in dtype.names or ():
            kind, offset = dtype.fields[field][:2]
            if offset > at:
                rows.append(f"    uint8_t unused_{holes}[{offset - at}];")
                holes += 1
            note = comments.get(field, "")
            rows.append(f"    {self._field(kind, c_word(field))};{f' /* {note} */' if note else ''}")
            checks.append(f"LIES_AT({name}, {c_word(field)}, {offset});")
            at = offset + kind.itemsize
        if dtype.itemsize > at:
            rows.append(f"    uint8_t unused_{holes}[{dtype.itemsize - at}];")
        checks.append(f"IS_LONG({name}, {dtype.itemsize});")
        return "\n".join([f"struct {name} {{", *rows, "};", *checks, ""])

    def _field(self, kind: np.dtype[Any], name: str) -> str:
        base, shape = kind.subdtype or (kind, ())
        inside = "".join(f"[{length}]" for length in shape)
        if base.fields is not None:
            return f"struct {self.name(base)} {name}{inside}"
        return f"{NUMBERS[base].c_name} {name}{inside}"


def _known_records() -> dict[np.dtype[Any], tuple[str, dict[str, str]]]:
    """Name and comments of every record of the kernels, by its form in integers."""
    found: dict[np.dtype[Any], tuple[str, dict[str, str]]] = {}
    floats: dict[str, dict[str, str]] = {}
    for module in MODULES:
        notes = {
            name: {field: note for field, note in fields.items() if note}
            for name, fields in _field_comments(module).items()
        }
        for name, given in vars(module).items():
            if not (name.isupper() and _is_record(given)):
                continue
            value = np.dtype(given, align=True)
            if value.fields is None:
                continue
            label, own = name.lower().removeprefix(FIXED), notes.get(name, {})
            if _all_integers(value):
                found.setdefault(value, (label, floats.get(label, {}) | own))
            elif label not in floats:  # the first module that has it is the one that makes it
                floats[label] = {
                    field: _with_format(label, field, value, own.get(field, "")) for field in value.names or ()
                }
                found.setdefault(in_integers(value), (label, floats[label]))
    return found


def _is_record(given: Any) -> bool:
    """Whether it is a dtype, or the list of fields of one."""
    return isinstance(given, np.dtype) or (isinstance(given, list) and all(isinstance(one, tuple) for one in given))


def _all_integers(dtype: np.dtype[Any]) -> bool:
    base = dtype.subdtype[0] if dtype.subdtype else dtype
    if base.fields is not None:
        return all(_all_integers(base.fields[name][0]) for name in base.names or ())
    return base.kind != "f"


def _with_format(group: str, field: str, dtype: np.dtype[Any], note: str) -> str:
    """The comment of a field with its format in integers."""
    assert dtype.fields is not None
    base = dtype.fields[field][0]
    base = base.subdtype[0] if base.subdtype else base
    if base.kind != "f":
        return note
    found = OWN_FORMATS.get(f"{group}.{field}", OWN_FORMATS.get(f"{group}s.{field}", OWN_FORMATS.get(field, COPIED)))
    formats = sorted({int(one) for one in np.unique(np.asarray(found))})
    if formats == [COPIED]:
        return note
    named = "/".join(f"Q{one % G}" for one in formats)
    if any(one >= G for one in formats):
        note = note.replace("m/s^2", "g")
    return f"{note}, {named}" if note else named


def _field_comments(module: ModuleType) -> dict[str, dict[str, str]]:
    """What stands behind each field of the dtypes of a module: name of the dtype -> field -> comment."""
    source = inspect.getsource(importlib.import_module(module.__name__))
    notes = {
        token.start[0]: token.string.lstrip("# ").replace("``", "")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    found: dict[str, dict[str, str]] = {}
    for statement in ast.parse(source).body:
        target = getattr(statement, "target", None)
        if not isinstance(statement, ast.AnnAssign) or not isinstance(target, ast.Name) or statement.value is None:
            continue
        for node in ast.walk(statement.value):
            if isinstance(node, ast.Tuple) and node.elts and isinstance(node.elts[0], ast.Constant):
                found.setdefault(target.id, {})[str(node.elts[0].value)] = notes.get(node.lineno, "")
    return found
