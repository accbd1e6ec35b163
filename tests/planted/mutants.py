"""Mutants of pure modules: one operator, number or condition of a source changed, every one that there can be.

The changes are those that mutation tools make (comparison and its bound, arithmetic, logic, signs, numbers, loops).
They are made by position in the text, so that what is not changed stays as it was.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from defect_lists import Defect

AREAS = {
    "survey": ("groundstation/survey",),
    "presentation": ("telemetry/presentation",),
    "transport": ("telemetry/transport",),
    "verdict": (
        "groundstation/service/alarms/verdict.py",
        "groundstation/service/alarms/verdict_doubts.py",
        "groundstation/service/alarms/spread_text.py",
    ),
    "seals": (
        "telemetry/application/seals.py",
        "telemetry/application/end_seal.py",
        "telemetry/application/measurement_seal.py",
        "telemetry/application/depth_seal.py",
    ),
}
# what a rig is trusted for; of these defects of whole statements are drawn as well
TRUSTED = {
    "service": tuple(
        f"groundstation/{room}"
        for room in ("service/alarms", "service/orders", "service/process", "service/string", "gateway/lease.py")
    ),
    "store": ("groundstation/service/disk",),
    "link": (
        "telemetry/transport/hop.py",
        "telemetry/transport/upload.py",
        *(
            f"telemetry/application/{name}.py"
            for name in ("delivery_rules", "end_to_end", "endpoint", "endpoint_state", "outbox", "place", "series")
        ),
        "telemetry/runtime/inbox.py",
        "telemetry/runtime/marked_frames.py",
    ),
    "keys": (
        *(f"borechain/pki/{name}.py" for name in ("access", "certificates", "persons", "private_files", "rig_keys")),
        *(
            f"telemetry/transport/{name}.py"
            for name in ("authentication", "certificate_dates", "joint_seal", "key_ring", "seal")
        ),
        *(f"telemetry/application/{name}.py" for name in ("depth_seal", "end_seal", "measurement_seal", "seals")),
        *(f"groundstation/gateway/page/{name}.py" for name in ("passwords", "request_guard", "sessions")),
    ),
}
COMPILED = "kernels"  # folders of these are compiled anew for each change, and their defects are switched instead
COMPARISONS = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "in": "not in",
    "not in": "in",
    "is": "is not",
    "is not": "is",
}
ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "**": "*", "//": "/", "%": "*", "&": "|", "|": "&", "@": "+"}
SYMBOLS: dict[type[ast.AST], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.In: "in",
    ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not", ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/",
    ast.Pow: "**", ast.FloorDiv: "//", ast.Mod: "%", ast.BitAnd: "&", ast.BitOr: "|", ast.MatMult: "@",
}  # fmt: skip


@dataclass(frozen=True)
class Mutant(Defect):
    """A defect that stands at a position, and so is planted as a whole text."""

    text: str = ""

    def planted_text(self, root: Path) -> str:
        """Text of its file."""
        del root
        return self.text


@dataclass(frozen=True, slots=True)
class Change:
    """Bytes of a source from ``begin`` to ``end`` and what stands there instead."""

    begin: int
    end: int
    new: str


class Changes(ast.NodeVisitor):
    """Every change of a source; annotations, texts and what types alone need are left as they are."""

    def __init__(self, source: bytes) -> None:
        self.found: list[Change] = []
        self._source = source
        self._lines = [0]
        for line in source.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))
        self.visit(ast.parse(source))

    def visit_Compare(self, node: ast.Compare) -> None:
        """Another comparison."""
        sides = [node.left, *node.comparators]
        for k, op in enumerate(node.ops):
            self._swap(sides[k], sides[k + 1], SYMBOLS[type(op)], COMPARISONS[SYMBOLS[type(op)]])
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        """Another operation."""
        symbol = SYMBOLS.get(type(node.op), "")
        if symbol in ARITHMETIC:
            self._swap(node.left, node.right, symbol, ARITHMETIC[symbol])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        """The other of and and or."""
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for one, other in zip(node.values, node.values[1:], strict=False):
            self._swap(one, other, old, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        """Without a sign or a not."""
        if isinstance(node.op, ast.USub | ast.Not):
            sign = "-" if isinstance(node.op, ast.USub) else "not "
            self.found.append(Change(self._at(node), self._at(node) + len(sign), ""))
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        """Another number."""
        if isinstance(node.value, bool):
            self._replace(node, str(not node.value))
        elif isinstance(node.value, int):
            self._replace(node, str(node.value + 1))
        elif isinstance(node.value, float):
            self._replace(node, repr(node.value * 1.5 if node.value else 1.0))

    def visit_Break(self, node: ast.Break) -> None:
        """Go on."""
        self._replace(node, "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        """Stop."""
        self._replace(node, "break")

    def visit_If(self, node: ast.If) -> None:
        """What types alone need is no part of it."""
        if not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        """The value alone."""
        if node.value is not None:
            self.visit(node.value)

    def visit_arg(self, node: ast.arg) -> None:
        """No annotation."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """Defaults and body, no annotation of what it returns and no decorator."""
        for part in (*node.args.defaults, *node.body):
            self.visit(part)
        for default in node.args.kw_defaults:
            if default is not None:
                self.visit(default)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        """Its body, no decorator."""
        for part in node.body:
            self.visit(part)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """What is told in words is judged by who reads it."""

    def _swap(self, left: ast.expr, right: ast.expr, old: str, new: str) -> None:
        begin, end = self._end(left), self._at(right)
        between = self._source[begin:end].decode()
        place = between.find(old)
        if place >= 0:
            at = begin + len(between[:place].encode())
            self.found.append(Change(at, at + len(old), new))

    def _replace(self, node: ast.AST, new: str) -> None:
        self.found.append(Change(self._at(node), self._end(node), new))

    def _at(self, node: ast.AST) -> int:
        return self._lines[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]

    def _end(self, node: ast.AST) -> int:
        return self._lines[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]


class WiderChanges(Changes):
    """Those of whole statements as well: a call or a refusal that is left out, branches or arguments exchanged."""

    def visit_Expr(self, node: ast.Expr) -> None:
        """A call that is left out."""
        if isinstance(node.value, ast.Call):
            self._replace(node, "pass")
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        """A refusal that is left out."""
        self._replace(node, "pass")

    def visit_IfExp(self, node: ast.IfExp) -> None:
        """The other branch."""
        self._exchange(node.body, node.orelse)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        """The first two arguments exchanged."""
        if len(node.args) > 1 and not any(isinstance(one, ast.Starred) for one in node.args[:2]):
            self._exchange(*node.args[:2])
        self.generic_visit(node)

    def _exchange(self, one: ast.expr, other: ast.expr) -> None:
        begin, end = self._at(one), self._end(other)
        texts = [self._source[self._at(part) : self._end(part)].decode() for part in (other, one)]
        between = self._source[self._end(one) : self._at(other)].decode()
        self.found.append(Change(begin, end, between.join(texts)))


def changes_of(file: Path, kinds: type[Changes] = Changes) -> list[Change]:
    """Every change of one file, in the order of its text."""
    return sorted(set(kinds(file.read_bytes()).found), key=lambda c: (c.begin, c.end, c.new))


def mutant_of(root: Path, area: str, file: Path, change: Change) -> Mutant:
    """The mutant of a change, whose name is its line."""
    source, name = file.read_bytes(), file.relative_to(root).as_posix()
    text = source[: change.begin] + change.new.encode() + source[change.end :]
    line = source[: change.begin].count(b"\n")
    told = text.split(b"\n")[line].decode().strip()
    old = source[change.begin : change.end].decode()
    shown = f"{name}:{line + 1}: {old or 'nothing'} -> {change.new or 'nothing'}: {told} [{change.begin}]"
    return Mutant(shown, area, 8, name, old, change.new, text=text.decode())


def drawn_mutants(root: Path, size: int, seed: int) -> list[Mutant]:
    """So many mutants: a half of the survey's, which has nine in ten of all, and as many of each of the other areas."""
    drawn, draw = [], random.Random(seed)
    for area in AREAS:
        found = [(file, change) for file in files_of(root, area) for change in changes_of(file)]
        share = size // 2 if area == "survey" else size // (2 * (len(AREAS) - 1))
        drawn += [mutant_of(root, area, *one) for one in draw.sample(found, min(share, len(found)))]
    return sorted(drawn, key=lambda m: m.name)


def drawn_of_trusted(root: Path, size: int, seed: int) -> list[Mutant]:
    """So many mutants, as many of each area of what a rig is trusted for."""
    drawn, draw = [], random.Random(seed)
    for area in TRUSTED:
        found = [(file, change) for file in files_of(root, area) for change in changes_of(file, WiderChanges)]
        drawn += [mutant_of(root, area, *one) for one in draw.sample(found, size // len(TRUSTED))]
    return sorted(drawn, key=lambda m: m.name)


def drawn_below(root: Path, places: Sequence[str], size: int, seed: int) -> list[Mutant]:
    """So many mutants of files and folders, each place alike; a statement that is left out is drawn as well."""
    drawn, draw = [], random.Random(seed)
    rooms = [[(f, c) for f in _sources_of(root, (place,)) for c in changes_of(f, WiderChanges)] for place in places]
    for _ in range(size):
        place = draw.choice([k for k, left in enumerate(rooms) if left])
        file, change = rooms[place].pop(draw.randrange(len(rooms[place])))
        drawn.append(mutant_of(root, places[place], file, change))
    return sorted(drawn, key=lambda m: m.name)


def files_of(root: Path, area: str) -> Sequence[Path]:
    """Sources of an area."""
    return _sources_of(root, (AREAS | TRUSTED)[area])


def _sources_of(root: Path, places: Sequence[str]) -> Sequence[Path]:
    files: list[Path] = []
    for place in places:
        path = root / place
        files += sorted(path.rglob("*.py")) if path.is_dir() else [path]
    return [file for file in files if COMPILED not in file.parts]
