"""Persons who have a certificate of a rig: by name and role, each for itself, so that one can be shut out alone.

A person who was revoked and comes back, with another laptop, has the next number: the router knows a certificate by its
common name, and that of the one which was stolen is never let in again.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from borechain.pki.access import DRILLER, MEDIUM, OPERATOR, ROUTER
from telemetry.errors import KeyFileError

PERSON_ROLES = (OPERATOR, DRILLER)
NAME = re.compile(r"(?=.*[A-Za-z])[A-Za-z0-9_-]{1,64}")
TAKEN = re.compile(rf"{ROUTER}|{MEDIUM}|base|encoder|depth|ca|rig|access|tube-\d+")  # files of others
MOST = 200  # persons of a rig, those revoked among them


@dataclass(frozen=True, slots=True)
class Person:
    """Who has a certificate; ``number`` counts the times that this name was let in anew after it was revoked."""

    name: str
    role: str
    number: int = 1
    is_revoked: bool = False

    @property
    def common_name(self) -> str:
        """Common name of the certificate."""
        return self.name if self.number == 1 else f"{self.name}.{self.number}"


FIRST = (Person(OPERATOR, OPERATOR), Person(DRILLER, DRILLER))  # whose certificates a new rig has


def admitted_roles(persons: Iterable[Person]) -> dict[str, str]:
    """Role of each common name that the router lets in."""
    return {person.common_name: person.role for person in persons if not person.is_revoked}


def with_person(persons: tuple[Person, ...], name: str, role: str) -> tuple[Person, ...]:
    """All persons, and one more or one who comes back.

    Raises
    ------
    KeyFileError
        When name or role is invalid, the name has another role, or there are too many.
    """
    if not NAME.fullmatch(name) or TAKEN.fullmatch(name):
        raise KeyFileError(
            f"person: expected a name of 1 to 64 letters, digits, - and _ that no process has, got {name!r:.80}"
        )
    if role not in PERSON_ROLES:
        raise KeyFileError(f"person {name}: expected a role of {', '.join(PERSON_ROLES)}, got {role!r:.80}")
    before = {person.name: person for person in persons}
    known = before.get(name)
    if known is not None and not known.is_revoked and known.role != role:
        raise KeyFileError(f"person {name}: expected the role {known.role} that it has, got {role}; revoke it first")
    if known is None and len(persons) >= MOST:
        raise KeyFileError(f"person {name}: expected at most {MOST} persons, those revoked among them")
    if known is not None and known.is_revoked:
        before[name] = Person(name, role, known.number + 1)
    elif known is None:
        before[name] = Person(name, role)
    return tuple(before.values())


def without_person(persons: tuple[Person, ...], name: str) -> tuple[Person, ...]:
    """All persons, one of them revoked.

    Raises
    ------
    KeyFileError
        When no person of that name has a certificate.
    """
    names = sorted(person.name for person in persons if not person.is_revoked)
    if name not in names:
        raise KeyFileError(f"revoke: expected a tube's number or one of {', '.join(names) or 'none'}, got {name!r:.80}")
    return tuple(replace(person, is_revoked=True) if person.name == name else person for person in persons)


def person_lines(persons: Iterable[Person]) -> list[str]:
    """Rows of the persons in the rig's secret file."""
    lines = []
    for person in persons:
        lines += ["", "[[person]]", f'name = "{person.name}"', f'role = "{person.role}"', f"number = {person.number}"]
        lines += ["revoked = true"] if person.is_revoked else []
    return lines


def person_of(row: dict[str, Any]) -> Person:
    """A person of a row.

    Raises
    ------
    KeyError, TypeError, ValueError
        When it is none.
    """
    person = Person(str(row["name"]), str(row["role"]), int(row["number"]), bool(row.get("revoked", False)))
    if person.role not in PERSON_ROLES or not NAME.fullmatch(person.name) or person.number < 1:
        raise ValueError("person")
    return person
