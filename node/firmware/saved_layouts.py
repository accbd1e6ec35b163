"""Layouts of saved states that earlier versions wrote, and what is carried over from one of them.

A firmware update must not make a tube forget what it has learnt: biases, mounts, yaw, trust, the twist. Each layout
names its fields in ``saved_layouts.json``; what a layout and the present one both know, by the same name, type and
shape, is carried over, and all else starts as on a new node. ``docs/make_layouts.py`` adds the present layout, which a
test asks for; a field whose meaning changes gets another name.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import Array

TABLE: Final = Path(__file__).with_name("saved_layouts.json")
LEAF: Final = re.compile(r"[<>|=][a-zA-Z]\d+")
NUMBER: Final = re.compile(r"\d+")
SHAPE: Final = re.compile(r"\[([\d, ]+)\]")


@dataclass(frozen=True, slots=True)
class CarriedState:
    """How much of a state of another layout was carried over.

    Attributes
    ----------
    layout : its name
    fields, fresh : that were carried over, and that start as on a new node
    """

    layout: str
    fields: int
    fresh: int


def dtype_description(dtype: np.dtype[Any]) -> str:
    """All that fixes the bytes of a record: names, places, types and shapes of its fields, and its size."""
    if dtype.subdtype is not None:
        base, shape = dtype.subdtype
        return f"{dtype_description(base)}{list(shape)}"
    if dtype.fields is None:
        return dtype.str
    fields = (
        f"{name}@{dtype.fields[name][1]}:{dtype_description(dtype.fields[name][0])}" for name in dtype.names or ()
    )
    return f"{{{','.join(fields)}}}{dtype.itemsize}"


def described_dtype(text: str) -> np.dtype[Any]:
    """The type of a description; the inverse of ``dtype_description``.

    Raises
    ------
    ValueError
        When it is none.
    """
    made, rest = _parse(text)
    if rest:
        raise ValueError(f"description of a record: expected its end, got {rest[:20]!r}")
    return made


@cache
def known_layouts() -> dict[str, np.dtype[Any]]:
    """Type of what is kept, for each layout by name."""
    return {name: described_dtype(text) for name, text in json.loads(TABLE.read_text()).items()}


def carry_over(source: Array, target: Array) -> tuple[int, int]:
    """Copy to one record of ``target`` what it shares with one of ``source``; numbers of fields carried and fresh."""
    old, new = dict(_leaves(source.dtype)), dict(_leaves(target.dtype))
    shared = [path for path, kind in new.items() if old.get(path) == kind]
    for path in shared:
        *above, last = path
        there, here = source, target
        for name in above:
            there, here = there[name], here[name]
        here[last] = there[last]
    return len(shared), len(new) - len(shared)


def _leaves(dtype: np.dtype[Any], above: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], str]]:
    """Path and description of every field that has no fields of its own."""
    if dtype.fields is None:
        return [(above, dtype_description(dtype))]
    found = []
    for name in dtype.names or ():
        found += _leaves(dtype.fields[name][0], (*above, name))
    return found


def _parse(text: str) -> tuple[np.dtype[Any], str]:
    """Type at the beginning of a description, and what follows it."""
    if text.startswith("{"):
        made, text = _parse_record(text[1:])
    else:
        leaf = LEAF.match(text)
        if leaf is None:
            raise ValueError(f"description of a record: expected a type, got {text[:20]!r}")
        made, text = np.dtype(leaf[0]), text[leaf.end() :]
    if shape := SHAPE.match(text):
        made, text = np.dtype((made, tuple(map(int, shape[1].split(","))))), text[shape.end() :]
    return made, text


def _parse_record(text: str) -> tuple[np.dtype[Any], str]:
    names, formats, offsets = [], [], []
    while not text.startswith("}"):
        name, _, text = text.partition("@")
        offset, _, text = text.partition(":")
        form, text = _parse(text)
        text = text.removeprefix(",")
        names.append(name)
        formats.append(form)
        offsets.append(int(offset))
    size = NUMBER.match(text, 1)
    if size is None:
        raise ValueError("description of a record: expected its size")
    made = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": int(size[0])})
    return made, text[size.end() :]
