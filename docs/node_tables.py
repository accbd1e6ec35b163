"""Tables of ``firmware.md``: the node's record as a map, the events of its step, what a saved yaw is worth.

What a field means stands once, in the comment behind it in the code: ``# UNIT, meaning`` or ``# meaning``.
"""

from __future__ import annotations

import ast
import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from node.firmware.event_table import EVENT_TABLE
from node.kernels.arithmetic.formats import DEG
from node.kernels.record import filter_record, node_record, sensor_record
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import NODE
from node.kernels.string import encoder_step
from node.kernels.string.encoder_step import ENCODER

UNITS: Final = (
    *(
        "rad",
        "rad^2",
        "rad/s",
        "(rad/s)^2",
        "2^-32 turn",
        "unit vector",
        "s",
        "m/s^2",
        "(m/s^2)^2",
        "N m",
        "C",
        "rad/s/sqrt(Hz)",
    ),
    *("s/sqrt(s)", "rad/sqrt(s)", "counts", "counts^2", "cycles", "sigmas"),
)
MODULES: Final = (filter_record, sensor_record, node_record, encoder_step)
PERIODS: Final = {"5 minutes": 300.0, "1 hour": 3600.0, "8 hours": 28800.0, "1 day": 86400.0, "30 days": 2592000.0}
SIGMAS_DEG: Final = (0.01, 0.02, 0.05, 0.1)


def in_cell(text: str) -> str:
    """A text as a cell of a table may hold it, whose borders are bars."""
    return text.replace("|", "&#124;")


@functools.cache
def comments_of(source: str) -> dict[str, dict[str, str]]:
    """Comments behind the fields of every record type of a module: by name of the type and of the field."""
    lines, found = source.splitlines(), {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Call) and node.value.args:
            fields = [f for f in getattr(node.value.args[0], "elts", []) if isinstance(f, ast.Tuple)]
            found[ast.unparse(node.target)] = {
                ast.literal_eval(field.elts[0]): in_cell(lines[(field.end_lineno or 0) - 1].partition("#")[2].strip())
                for field in fields
            }
    return found


def described() -> list[tuple[np.dtype[Any], str, dict[str, str]]]:
    """Every record type of the node, its name and the comments behind its fields."""
    types = []
    for module in MODULES:
        comments = comments_of(Path(str(module.__file__)).read_text())
        types += [(getattr(module, name), f"{module.__name__}.{name}", texts) for name, texts in comments.items()]
    return types


def text_of(dtype: np.dtype[Any], field: str) -> tuple[str, str]:
    """Unit and meaning of a field.

    Raises
    ------
    ValueError
        When no comment with a meaning stands behind it; the message names the field.
    """
    for known, name, texts in described():
        if known is dtype or (known == dtype and field in texts):
            unit, comma, meaning = texts.get(field, "").partition(", ")
            if unit not in UNITS:
                unit, meaning = "", unit + comma + meaning
            if not meaning:
                raise ValueError(
                    f"{name}: expected a comment '# UNIT, meaning' behind {field!r}, got {texts.get(field)!r}"
                )
            return unit, meaning
    raise ValueError(f"{field!r}: expected its record type in {', '.join(m.__name__ for m in MODULES)}, got another")


def rows_of(dtype: np.dtype[Any], begin: int = 0, path: str = "") -> Iterator[tuple[str, ...]]:
    """Rows of the plain fields of a record at byte ``begin``: byte, path, type, unit, meaning."""
    for name in dtype.names or ():
        kind, offset = (dtype.fields or {})[name][:2]
        unit, meaning = text_of(dtype, name)
        base, shape = kind.subdtype or (kind, ())
        size = " × ".join(map(str, shape))
        if base.fields is not None:
            where = f"{path}{name}[{size}]." if shape else f"{path}{name}."
            yield str(begin + offset), f"`{where[:-1]}`", "record", unit, meaning
            yield from rows_of(base, begin + offset, where)
        else:
            yield str(begin + offset), f"`{path}{name}`", f"{base.str[1:]} {size}".strip(), unit, meaning


def record_parts() -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Head and rows of each sub-record of the node, then of what stands beside them."""
    own = []
    for name in NODE.names or ():
        kind, offset = (NODE.fields or {})[name][:2]
        unit, meaning = text_of(NODE, name)
        if kind.fields is None:
            base, shape = kind.subdtype or (kind, ())
            size = " × ".join(map(str, shape))
            own.append((str(offset), f"`{name}`", f"{base.str[1:]} {size}".strip(), unit, meaning))
        else:
            yield f"`{name}`: {meaning}, {kind.itemsize} bytes", list(rows_of(kind, offset))
    yield "Of the node itself", own


def encoder_rows() -> Iterator[tuple[str, ...]]:
    """Rows of the encoder node's record."""
    yield from rows_of(ENCODER)


def event_rows() -> Iterator[tuple[str, ...]]:
    """Rows of the events of the step: code, name, severity, arguments, meaning."""
    for code, line in EVENT_TABLE.items():
        arguments = ", ".join(f"`{name}`" for name, _ in line.arguments)
        yield str(int(code)), f"`{line.name}`", line.severity.name.lower(), arguments, line.meaning


def outage_rows() -> Iterator[tuple[str, str]]:
    """What a tube taken for still may have turned unseen, by the length of an outage."""
    walk = float(default_config()[0]["still_walk"]) / DEG
    for name, seconds in PERIODS.items():
        yield name, f"{walk * math.sqrt(seconds):.2g}"


def worth_rows() -> Iterator[tuple[str, str]]:
    """Length of the outage after which that is as large as the yaw's own sigma."""
    walk = float(default_config()[0]["still_walk"]) / DEG
    for sigma in SIGMAS_DEG:
        yield f"{sigma:g}", f"{(sigma / walk) ** 2 / 3600.0:.2g}"
