"""What was told once of an item that no reading shows, and the independent second reading that checks it. No I/O.

A slip in telling north or the stick-up turns or moves all surveys alike, so nothing in the hole speaks against it. Only
a second reading of the same thing does, taken by another person or by other means. Until there is one nothing rests on
the item, and where the two are apart by more than both may err, one of them is wrong and it is not known which.

Nothing counts as better known than what checks it: a bearing of 0.1 deg that was checked within 1 deg has 1 deg.
"""

from __future__ import annotations

import math
from typing import Final

from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.told_value import SetupKind, ToldValue, shown_value

CHECKED: Final = (SetupKind.NORTH, SetupKind.STICK_UP)  # in no reading
APART: Final = 3.5  # standard deviations of their difference: one honest pair in 2000 is further apart
STICK_UP_STD: Final = 0.1  # m, of one that was not told: one that is told no better needs no check
WHAT_CHECKS: Final = {
    SetupKind.NORTH: "a second bearing",
    SetupKind.STICK_UP: "the bit at the collar's edge",
}


def counted_std(book: SetupBook, told: ToldValue) -> float:
    """Standard deviation (SI) that a told value counts with."""
    check = book.check_of(told.kind) if told.kind in CHECKED else None
    return told.sigma if check is None else max(told.sigma, check.sigma)


def is_unchecked(book: SetupBook, kind: SetupKind) -> bool:
    """Whether an item was told, more rests on it than on one that was not told, and nothing has checked it."""
    told = book.standing(kind) if kind in CHECKED else None
    if told is None or book.check_of(kind) is not None:
        return False
    return kind is not SetupKind.STICK_UP or told.sigma < STICK_UP_STD


def unchecked_kinds(book: SetupBook) -> list[SetupKind]:
    """Items that were told once, that no reading shows, and that nothing has checked."""
    return [kind for kind in CHECKED if is_unchecked(book, kind)]


def least_slip(told: ToldValue, check: ToldValue) -> float:
    """Smallest slip (SI) in telling an item that its check shows."""
    return APART * math.hypot(told.sigma, check.sigma)


def slip_between(told: ToldValue, check: ToldValue) -> float:
    """By how much (SI) a check is off what was told; of angles the shorter way round."""
    off = abs(check.values[0] - told.values[0])
    return abs(math.remainder(off, math.tau)) if told.kind is SetupKind.NORTH else off


def contradicted_kinds(book: SetupBook) -> list[SetupKind]:
    """Items whose check is further off than the two may err."""
    return [kind for kind in CHECKED if say_contradiction(book, kind)]


def say_contradiction(book: SetupBook, kind: SetupKind) -> str:
    """That a check contradicts what was told, or nothing."""
    told, check = book.standing(kind), book.check_of(kind)
    if told is None or check is None or slip_between(told, check) <= least_slip(told, check):
        return ""
    name, sigmas = kind.value.replace("_", "-"), slip_between(told, check) / math.hypot(told.sigma, check.sigma)
    return (
        f"{name} is told as {shown_value(told)} and checked as {shown_value(check)}, {sigmas:.0f} sigma apart: one of "
        "the two is wrong"
    )


def say_check(book: SetupBook, kind: SetupKind) -> str:
    """What checks an item, in words; nothing of an item that readings show, or that was not told."""
    check = book.check_of(kind)
    if is_unchecked(book, kind):
        return f"not checked: {WHAT_CHECKS[kind]} is"
    if check is None or book.standing(kind) is None:
        return ""
    found = "contradicted by" if say_contradiction(book, kind) else "checked by"
    return f"{found} {shown_value(check)} of {check.by}"


def say_unchecked(kinds: list[SetupKind]) -> str:
    """That nothing checks what was told once, and what would."""
    names = " and ".join(kind.value.replace("_", "-") for kind in kinds)
    checks = ", ".join(WHAT_CHECKS[kind] for kind in kinds)
    verb, them = ("was", "it") if len(kinds) == 1 else ("were", "them")
    return f"{names} {verb} told once, check {them} by {checks}"
