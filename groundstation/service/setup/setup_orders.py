"""What an operator tells of the setup: checked, kept on the disk, then entered; taken back by one order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from groundstation.errors import SelectorError
from groundstation.service.setup.setup_book import Pair, SetupBook
from groundstation.service.setup.setup_checks import say_contradiction
from groundstation.service.setup.told_value import DRIVE, SetupKind, ToldValue, joint_subject, shown_value
from telemetry.application.commands import CommandSpec

VALUES: Final = {  # arguments that hold what an order tells
    SetupKind.NORTH: ("angle",),
    SetupKind.COLLAR: ("inclination", "azimuth"),
    SetupKind.JOINT: ("angle",),
    SetupKind.LENGTH: ("length",),
    SetupKind.STICK_UP: ("height",),
    SetupKind.SAME_NUMBER: ("which",),
}

OF_TUBES: Final = (SetupKind.LENGTH, SetupKind.SAME_NUMBER)
UPPER: Final = "upper"


class SetupStore(Protocol):
    """Where what was told is kept."""

    def keep_told(self, told: ToldValue) -> None:
        """Keep an entry; durable on return."""


class SetupOrder(Protocol):
    """An order as it tells something."""

    @property
    def spec(self) -> CommandSpec:
        """Its line in the table of commands."""

    @property
    def tube(self) -> int | None:
        """Tube that it names."""

    @property
    def arguments(self) -> dict[str, float]:
        """What it tells, in SI."""

    @property
    def by(self) -> str:
        """Who ordered it."""

    @property
    def utc(self) -> str:
        """When."""


class SetupOrders:
    """Orders about the setup of one rig; each returns what is to be said of it.

    Parameters
    ----------
    book : that they are entered in
    store : where they are kept before
    tubes : of the string, from the top down
    follow : has the surveys adjusted to what is told now; returns how many there are
    check : of a collar, beside what the first station says; empty where they agree
    """

    def __init__(
        self,
        book: SetupBook,
        store: SetupStore,
        tubes: Callable[[], Sequence[int]],
        follow: Callable[[], int],
        check_collar: Callable[[], str],
    ) -> None:
        self._book, self._store, self._tubes = book, store, tubes
        self._follow, self._check_collar = follow, check_collar

    def obey(self, order: SetupOrder) -> str:
        """Do what an order says; returns what became of it.

        Raises
        ------
        SelectorError
            When what it tells cannot be; nothing was kept.
        StoreError
            When the disk refuses; nothing was entered.
        """
        if order.spec.name == "setup":
            return self._enter(self._taken_back(order))
        if order.spec.action == "check":
            return self._check(order)
        kind, told = SetupKind(order.spec.name), order.arguments
        subject, number = self._subject_of(kind, order), self._book.next_number()
        if kind is SetupKind.SAME_NUMBER:
            values, sigma = (float(str(told["which"]) == UPPER),), 1.0
        else:
            values, sigma = tuple(told[name] for name in VALUES[kind]), told["sigma"]
        entry = ToldValue(number, kind, subject, values, sigma, order.by, order.utc, told.get("used"))
        before = self._book.standing(kind, subject)
        detail = self._enter(entry)
        if before is not None and (before.values, before.sigma) != (entry.values, entry.sigma):
            detail = f"{detail}; before it was {shown_value(before)} by {before.by}, which is kept too"
        doubt = self._check_collar() if kind is SetupKind.COLLAR else ""
        return f"{detail}; {doubt}" if doubt else detail

    def _check(self, order: SetupOrder) -> str:
        """Enter a second reading beside what was told."""
        kind, told = SetupKind(order.spec.name), order.arguments
        if self._book.standing(kind) is None:
            raise SelectorError(f"{kind.value}: expected it to be told before it is checked: action=tell")
        values, number = tuple(told[name] for name in VALUES[kind]), self._book.next_number()
        detail = self._enter(ToldValue(number, kind, "", values, told["sigma"], order.by, order.utc, checks=True))
        if wrong := say_contradiction(self._book, kind):
            return f"{detail}; {wrong}; tell it again, or take the check back"
        return f"{detail}; it bears out what was told"

    def _subject_of(self, kind: SetupKind, order: SetupOrder) -> str:
        if kind is SetupKind.JOINT:
            return joint_subject(*self._checked_joint(order))
        if kind is SetupKind.SAME_NUMBER and order.tube not in self._book.doubled:
            raise SelectorError(f"same_number: tube {order.tube}: expected a number that two tubes give themselves")
        return str(order.tube) if kind in OF_TUBES else ""

    def _enter(self, entry: ToldValue) -> str:
        self._store.keep_told(entry)
        self._book.add([entry])
        surveys = self._follow()
        name = f"the check of {entry.kind.value}" if entry.checks else entry.name
        done = f"{name} is taken back" if entry.takes_back else f"{name} is {shown_value(entry)}"
        return f"{done}; {surveys} surveys were adjusted to it" if surveys else done

    def _taken_back(self, order: SetupOrder) -> ToldValue:
        newest, number = self._book.newest(), self._book.next_number()
        if newest is None:
            raise SelectorError("setup: expected something that an order told, there is nothing to take back")
        return ToldValue(
            number, newest.kind, newest.subject, (), newest.sigma, order.by, order.utc, takes_back=newest.number,
            checks=newest.checks,
        )  # fmt: skip

    def _checked_joint(self, order: SetupOrder) -> Pair:
        """The joint at the upper end of the tube that an order names."""
        tubes, lower, used = list(self._tubes()), order.tube or 0, order.arguments.get("used")
        place = tubes.index(lower) if lower in tubes else 0
        above = tubes[place - 1] if place else DRIVE
        upper = int(order.arguments.get("upper", above))
        subject = joint_subject(upper, lower)
        if upper not in (above, DRIVE):
            known = f"joint {joint_subject(above, lower)} above tube {lower}, or upper=0 for the drive head"
            raise SelectorError(f"joint {subject}: expected {known}")
        knows, teller = self._book.node_knows((upper, lower)), lower if upper == DRIVE else upper
        if knows is None:
            never = "hung from the drive head in a survey" if upper == DRIVE else "said which angles it was told"
            raise SelectorError(f"joint {subject}: expected a tube that has spoken, tube {teller} has not {never}")
        if knows and used is None:
            told = f"the node of tube {teller} was told its angle, which is in every yaw below"
            raise SelectorError(f"joint {subject}: {told}; expected used_deg=.. as it was told")
        if not knows and used is not None:
            raise SelectorError(f"joint {subject}: the node of tube {teller} was told no angle; expected no used_deg")
        return upper, lower
