"""Frozen dataclasses that are made as quickly as others.

A frozen dataclass assigns each of its fields by a call: for the state of a node that takes three times as long as all
else. Its twin of the same slots can be assigned to; an instance is filled as the twin, and becomes what it is by
``__class__``, which Python allows between classes of the same slots.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, TypeVar, cast

Kind = TypeVar("Kind", bound=type[Any])


def writable(frozen: type[Any]) -> type[Any]:
    """Twin of a frozen dataclass with slots, whose fields can be assigned."""
    return type(f"Writable{frozen.__name__}", (), {"__slots__": frozen.__slots__})


def quickly_made(frozen: Kind) -> Kind:
    """Give a frozen dataclass with slots, of which no class is derived, a quick ``__init__`` of the same arguments."""
    space: dict[str, Any] = {"become": object.__setattr__, "Writable": writable(frozen), "Frozen": frozen}
    arguments, lines = ["self"], ["become(self, '__class__', Writable)"]
    for field in fields(frozen):
        name, value = field.name, field.name
        if field.default_factory is not MISSING:
            space[f"make_{name}"], space["MISSING"] = field.default_factory, MISSING
            value = f"make_{name}() if {name} is MISSING else {name}"
            arguments.append(f"{name}=MISSING")
        elif field.default is not MISSING:
            space[f"default_{name}"] = field.default
            arguments.append(f"{name}=default_{name}")
        else:
            arguments.append(name)
        lines.append(f"self.{name} = {value}")
    source = f"def __init__({', '.join(arguments)}):\n" + "".join(f"    {line}\n" for line in lines)
    exec(compile(f"{source}    self.__class__ = Frozen", "<made quickly>", "exec"), space)
    initialise, usual = space["__init__"], vars(frozen)["__init__"]
    initialise.__annotations__, initialise.__qualname__ = usual.__annotations__, usual.__qualname__
    cast("Any", frozen).__init__ = initialise
    return frozen
