"""Options of a command that reach it as typed objects: a command takes a request, not its thirty options."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

Command = Callable[..., Any]
Option = Callable[[Command], Command]  # of click


def gather_options(*options: Option, **objects: Callable[..., Any]) -> Option:
    """Give a command ``options``, in this order in its help, and call it with ``objects`` made of their values.

    Each object is made of the options that are named as its parameters, such as the fields of a dataclass, and of
    objects that stand before it. Several may share an option; one that no object takes is the command's own, and so
    is an object that no other takes.

    Parameters
    ----------
    options : of click, as decorators
    objects : name of the object to the function that makes it
    """
    fields = {name: list(inspect.signature(make).parameters) for name, make in objects.items()}

    def decorated(command: Command) -> Command:
        @functools.wraps(command)
        def gathering(*args: Any, **given: Any) -> Any:
            made: dict[str, Any] = {}
            taken_options, taken_objects = set[str](), set[str]()
            for name, make in objects.items():
                parts = {field: made[field] for field in fields[name] if field in made}
                plain = {field: given[field] for field in fields[name] if field in given and field not in made}
                taken_objects |= parts.keys()
                taken_options |= plain.keys()
                made[name] = make(**parts, **plain)
            own = {name: value for name, value in given.items() if name not in taken_options}
            own |= {name: value for name, value in made.items() if name not in taken_objects}
            return command(*args, **own)

        result: Command = gathering
        for option in reversed(options):
            result = option(result)
        return result

    return decorated
