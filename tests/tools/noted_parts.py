"""Parts of a process that note what they are asked, in order, and answer what they are given to answer."""

from __future__ import annotations

from typing import Any


class NotedPart:
    """A part of that name: what it has is given, a call of anything else is noted and answered.

    ``answers`` are by the name of the call, what is raised where it is an error; None of what is not named.
    """

    def __init__(self, noted: list[Any], name: str, answers: dict[str, Any] | None = None, **has: Any) -> None:
        self._noted, self._name, self._answers = noted, name, answers or {}
        for one, value in has.items():
            setattr(self, one, value)

    def __getattr__(self, call: str) -> Any:
        def note(*given: Any, **named: Any) -> Any:
            self._noted.append((f"{self._name}.{call}", *given, *((named,) if named else ())))
            answer = self._answers.get(call)
            if isinstance(answer, Exception):
                raise answer
            return answer

        return note


def bare(kind: type, **parts: Any) -> Any:
    """An object of a class with nothing but these parts."""
    made = kind.__new__(kind)
    for name, part in parts.items():
        setattr(made, name, part)
    return made


def message_of(kind: type, **fields: Any) -> Any:
    """A message with these fields alone."""
    fields = dict.fromkeys(kind.__struct_fields__, 0) | {"tube": 3, "sequence": 7} | fields  # type: ignore[attr-defined]
    return kind(**{name: value for name, value in fields.items() if name in kind.__struct_fields__})  # type: ignore[attr-defined]
