"""Where C is to declare each variable of a kernel: in the innermost block that all its uses share."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

Block: TypeAlias = tuple[tuple[int, str], ...]  # statements and their parts, from the function inwards


class NameUse(NamedTuple):
    """One use of a name: the block, the statement of it, and whether that plainly stores."""

    block: Block
    statement: ast.stmt
    stores: bool


class Declarations(NamedTuple):
    """What is declared where.

    Attributes
    ----------
    at_store : statement (by id) -> names that it declares as it stores them
    ahead : block -> names that are declared as it begins
    """

    at_store: dict[int, set[str]]
    ahead: dict[Block, list[str]]


def declare_places(body: list[ast.stmt], arguments: tuple[str, ...]) -> Declarations:
    """Where each variable of a function with this ``body`` is declared, but for its arguments and counters of loops."""
    uses: dict[str, list[NameUse]] = {}
    for name, use in _uses_of(body, (), frozenset(arguments)):
        uses.setdefault(name, []).append(use)
    found = Declarations({}, {})
    for name, all_uses in uses.items():
        shared = all_uses[0].block
        for use in all_uses:
            shared = _common(shared, use.block)
        first = all_uses[0]
        if first.stores and first.block == shared:
            found.at_store.setdefault(id(first.statement), set()).add(name)
        else:
            found.ahead.setdefault(shared, []).append(name)
    return found


def _common(one: Block, other: Block) -> Block:
    count = 0
    while count < min(len(one), len(other)) and one[count] == other[count]:
        count += 1
    return one[:count]


def _uses_of(body: list[ast.stmt], block: Block, given: frozenset[str]) -> Iterator[tuple[str, NameUse]]:
    for number, statement in enumerate(body):
        if isinstance(statement, ast.For):
            yield from _names_in(statement.iter, block, statement, given)
            counters = frozenset({statement.target.id} if isinstance(statement.target, ast.Name) else ())
            yield from _uses_of(statement.body, (*block, (number, "body")), given | counters)
        elif isinstance(statement, ast.If | ast.While):
            yield from _names_in(statement.test, block, statement, given)
            yield from _uses_of(statement.body, (*block, (number, "body")), given)
            yield from _uses_of(statement.orelse, (*block, (number, "orelse")), given)
        else:
            yield from _names_in_order(statement, block, given)


def _names_in_order(statement: ast.stmt, block: Block, given: frozenset[str]) -> Iterator[tuple[str, NameUse]]:
    """What a statement reads comes before what it stores."""
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        if statement.value is not None:
            yield from _names_in(statement.value, block, statement, given)
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for target in targets:
            yield from _names_in(target, block, statement, given, stores=True)
    else:
        yield from _names_in(statement, block, statement, given)


def _names_in(
    node: ast.AST, block: Block, statement: ast.stmt, given: frozenset[str], *, stores: bool = False
) -> Iterator[tuple[str, NameUse]]:
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name) and inner.id not in given:
            yield inner.id, NameUse(block, statement, stores and isinstance(inner.ctx, ast.Store))


def stored_names(body: list[ast.stmt]) -> set[str]:
    """Names that a function stores itself, its counters of loops among them."""
    return {
        node.id
        for statement in body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
