"""Figures of all that the nodes of ``node_lives`` told and knew: event by event, field by field, word by word."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from node_lives import LIVES, Life
from recorded_calls import leaves

from node.kernels.record.node_record import NODE
from telemetry.messages import Event

FIGURES = Path(__file__).parents[1] / "data" / "seeded_nodes.json"
KERNELS = "float64", "fixed"


def weighed(values: Any) -> list[float]:
    """Sum of many by weights that differ, and the sum of their sizes; what is not finite counts as 17."""
    flat = np.asarray(values, dtype=np.float64).ravel()
    flat = np.where(np.isfinite(flat), flat, 17.0)
    sums = np.sum(flat * np.cos(0.7 * np.arange(1.0, len(flat) + 1.0))), np.sum(np.abs(flat))
    return [float(f"{one:.10g}") for one in sums]


def numbers_in(value: Any) -> Iterator[float]:
    """Every number of a field, in order; words by their letters."""
    if isinstance(value, msgspec.Struct):
        yield from (number for name in value.__struct_fields__ for number in numbers_in(getattr(value, name)))
    elif isinstance(value, list | tuple | bytes):
        yield from (number for part in value for number in numbers_in(part))
    elif isinstance(value, str):
        yield from value.encode()
    elif isinstance(value, dict):
        yield from (number for pair in value.items() for number in numbers_in(pair))
    else:
        yield 0.0 if value is None else float(value)


def figures_of(name: str, kernel: str) -> dict[str, Any]:
    """What a life told, event by event and field by field, and what its record held, word by word."""
    life = Life(name, kernel).live()
    events = [
        [cycle, one.code, one.severity.name.lower(), dict(one.arguments)]
        for cycle, one in life.told
        if isinstance(one, Event)
    ]
    fields: dict[str, list[float]] = {}
    for cycle, one in life.told:
        for field in one.__struct_fields__:
            if not isinstance(one, Event) or field != "arguments":
                fields.setdefault(f"{type(one).__name__}.{field}", []).extend(numbers_in(getattr(one, field)))
        fields.setdefault(f"cycles of {type(one).__name__}", []).append(cycle)
    found = {"events": events, "told": {field: weighed(numbers) for field, numbers in fields.items()}}
    return found | {"record": record_of(life.kept)} if kernel == "float64" else found


def record_of(kept: list[np.ndarray]) -> dict[str, list[float]]:
    """Figures of every field of a record that was kept again and again, but of those that held nothing but zeros."""
    raw = np.concatenate(kept).view(np.uint8).reshape(len(kept), -1)
    fields: dict[str, list[np.ndarray]] = {}
    for path, kind, at, size in fields_of_node():
        fields.setdefault(path, []).append(raw[:, at : at + size].copy().view(kind))
    return {path: sums for path, values in fields.items() if (sums := weighed(np.hstack(values)))[1]}


def fields_of_node() -> Iterator[tuple[str, Any, int, int]]:
    """Path without indices, kind, place and size of every word of a node's record."""
    for path, at, size in leaves(NODE):
        kind: Any = NODE
        for part in path[1:].split("."):
            inner = kind.fields[part.partition("[")[0]][0]
            kind = inner.subdtype[0] if inner.subdtype else inner
        bare = ".".join(part.partition("[")[0] for part in path[1:].split("."))
        yield bare, kind, at, size


def everything() -> dict[str, Any]:
    """Figures of all lives."""
    return {f"{name}, {kernel}": figures_of(name, kernel) for name in LIVES for kernel in KERNELS}


if __name__ == "__main__":
    lines = (f" {json.dumps(name)}: {json.dumps(found)}" for name, found in everything().items())
    FIGURES.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
