"""What a room makes, told line by line: every figure of an answer, every stroke of a drawing, as it was approved.

Words must be the same; numbers may differ by rounding, as they do between processors. The files in `tests/data/whole`
were read beside the calculations of the tests that use them, and are written anew as CONTRIBUTING.md says.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

APPROVED = Path(__file__).parents[1] / "data" / "whole"
NUMBER = re.compile(r"(?<![\w.])[-+\N{MINUS SIGN}]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w.])")
RELATIVE, ABSOLUTE = 1e-6, 1e-11
FEW = 12  # numbers that are told one by one; of more their ends and three sums
FEWEST_ROWS = 3  # of a table
HASH = re.compile(r"\b[0-9a-f]{64}\b")
Makers = Mapping[str, Callable[[Path], Iterable[str]]]


def number(value: float) -> str:
    """A number with nine digits, and without the sign of a zero."""
    return f"{float(value) + 0.0:.9g}"


def numbers(values: Any) -> str:
    """Numbers of any shape in one line."""
    flat = np.ravel(np.asarray(values, float))
    if len(flat) <= FEW:
        return " ".join(map(number, flat)) or "none"
    known = np.isfinite(flat)
    place = np.arange(1, len(flat) + 1) / len(flat)
    sums = flat[known].sum(), (flat * place)[known].sum(), np.square(flat[known]).sum()
    ends = f"{number(flat[0])} .. {number(flat[-1])}"
    return f"{len(flat)} numbers, {int(known.sum())} of them known, {ends}; sums {' '.join(map(number, sums))}"


def leaves(value: Any, path: str = "") -> Iterator[str]:
    """Every leaf of tables, lists, arrays and records, with the way to it; of what is a hash that it is one."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping) and value:
        for name, one in value.items():
            yield from leaves(one, f"{path} > {name}" if path else str(name))
    elif is_table(value):
        yield from leaves({name: [row[name] for row in value] for name in value[0]}, f"{path}, {len(value)} rows")
    elif is_numbers(value):
        yield f"{path}: {numbers(value)}"
    elif isinstance(value, list | tuple) and value and all(isinstance(one, str | bool | None) for one in value):
        yield f"{path}: {HASH.sub('a hash', ' | '.join(map(str, value)))}"
    elif isinstance(value, list | tuple | np.ndarray) and len(value) > 0:
        for place, one in enumerate(value):
            yield from leaves(one, f"{path} > {place}")
    elif isinstance(value, float) and not isinstance(value, bool):
        yield f"{path}: {number(value)}"
    else:
        told = value.value if isinstance(value, Enum) else value
        yield f"{path}: {HASH.sub('a hash', str(told))}"


def is_table(value: Any) -> bool:
    """Whether a list holds rows of the same names, which are told column by column."""
    if not isinstance(value, list | tuple) or len(value) < FEWEST_ROWS:
        return False
    return all(isinstance(row, Mapping) and row and row.keys() == value[0].keys() for row in value)


def is_numbers(value: Any) -> bool:
    """Whether a list or an array, of any depth, holds numbers alone; some of a list may be missing."""
    if isinstance(value, np.ndarray):
        return value.size > 0 and value.dtype.kind in "fiu"
    if isinstance(value, list | tuple) and any(one is not None for one in value):
        kinds = float | int | np.floating | None
        plain = all(isinstance(one, kinds) and not isinstance(one, bool) for one in value)
        even = {len(one) if isinstance(one, list | tuple | np.ndarray) else 0 for one in value}
        return plain or (len(even) == 1 and 0 not in even and all(map(is_numbers, value)))
    return False


def drawing(figure: Any) -> Iterator[str]:
    """Everything that a figure draws, in the coordinates of its axes."""
    suptitle = getattr(figure, "_suptitle", None)
    if suptitle is not None:
        yield f"title: {suptitle.get_text()}"
    for place, axes in enumerate(figure.axes):
        for line in axes_lines(axes):
            yield f"axes {place}, {line}"
    for legend in figure.legends:
        yield f"legend: {' | '.join(text.get_text() for text in legend.get_texts())}"


def axes_lines(axes: Any) -> Iterator[str]:
    """What one pair of axes draws."""
    titles = [axes.get_title(loc) for loc in ("left", "center", "right")]
    yield f"words: {' | '.join((*titles, axes.get_xlabel(), axes.get_ylabel()))}"
    scales = f"{axes.get_xscale()} {axes.get_yscale()} {axes.get_aspect()}"
    yield f"scales: {scales}; x {numbers(axes.get_xlim())}; y {numbers(axes.get_ylim())}"
    for axis, letter in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        locator = axis.get_major_locator()
        if hasattr(locator, "locs"):
            words = " | ".join(label.get_text() for label in axis.get_ticklabels())
            yield f"ticks of {letter}: {numbers(locator.locs)}; {words}"
    for line in axes.lines:
        look = f"{line.get_color()} {line.get_linestyle()} {line.get_marker()} {line.get_linewidth():g}"
        x, y = (np.asarray(values, float) for values in line.get_data(orig=False))
        yield f"line {label_of(line)} {look}: x {numbers(x)}; y {numbers(y)}"
    for patch in axes.patches:
        outline = without_closing(patch.get_patch_transform().transform(patch.get_path().vertices))
        look = f"{colour(patch.get_facecolor())} {colour(patch.get_edgecolor())} {patch.get_linestyle()}"
        yield f"{type(patch).__name__} {patch.get_gid()} {look} {patch.get_hatch()}: {numbers(outline)}"
    for part in axes.collections:
        paths = np.concatenate([path.vertices for path in part.get_paths()] or [np.zeros((0, 2))])
        told = part.get_array()
        values = "none" if told is None else numbers(np.ma.filled(np.ma.asarray(told, float), math.nan))
        faces = part.get_facecolor()
        face = colour(faces[0]) if len(faces) else "none"
        places = np.asarray(np.ma.filled(part.get_offsets(), math.nan), float)
        yield (
            f"{type(part).__name__} {label_of(part)} {face}: at {numbers(places)}; of {numbers(paths)}; values {values}"
        )
    for text in axes.texts:
        yield f"text {text.get_text()} {text.get_fontweight()}: {numbers(text.get_position())}"
    if axes.get_legend() is not None:
        yield f"legend: {' | '.join(text.get_text() for text in axes.get_legend().get_texts())}"


def without_closing(outline: Any) -> Any:
    """Vertices (n, 2) without those at the end that stand at the first: rounding makes one or two of them."""
    while len(outline) > 1 and np.allclose(outline[-1], outline[0], rtol=0.0, atol=1e-9 * np.abs(outline).max()):
        outline = outline[:-1]
    return outline


def label_of(part: Any) -> str:
    """Label of a part of a drawing, empty of one without."""
    label = str(part.get_label())
    return "-" if label.startswith("_") else f"'{label}'"


def colour(value: Any) -> str:
    """A colour as it is written."""
    from matplotlib.colors import to_hex

    return str(to_hex(value, keep_alpha=True))


def compare(told: Iterable[str], approved: Iterable[str]) -> None:
    """Raise where a line, a word or a number beyond rounding is another than approved."""
    left, right = list(map(in_one_line, told)), list(approved)
    for place, (one, other) in enumerate(zip(left, right, strict=False), 1):
        assert is_same(one, other), f"line {place}:\ngot      {one}\napproved {other}"
    assert len(left) == len(right), f"got {len(left)} lines, approved {len(right)}: {(left + right)[len(right) :][:3]}"


def in_one_line(text: str) -> str:
    """A text whose ends of lines are words, and of whose hashes is told that they are: of what rounding reaches."""
    return HASH.sub("a hash", text.replace("\r", "\\r").replace("\n", "\\n"))


def is_same(one: str, other: str) -> bool:
    """Whether two lines differ by rounding at the most."""
    if one == other:
        return True
    if NUMBER.split(one) != NUMBER.split(other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    values = [[float(word.replace("\N{MINUS SIGN}", "-")) for word in pair] for pair in pairs]
    return all(math.isclose(*pair, rel_tol=RELATIVE, abs_tol=ABSOLUTE) for pair in values)


def check(name: str, told: Iterable[str]) -> None:
    """Raise where something is told otherwise than it was approved."""
    compare(told, (APPROVED / f"{name}.txt").read_text("utf-8").splitlines())


def write_anew(makers: Makers) -> None:
    """Write what is made as approved; the difference is read like code."""
    for name, make in makers.items():
        with tempfile.TemporaryDirectory() as folder:
            lines = list(map(in_one_line, make(Path(folder))))
        (APPROVED / f"{name}.txt").write_text("\n".join(lines) + "\n", "utf-8")
