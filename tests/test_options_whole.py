"""Every option of every command as it was read and approved: name, type, range, default, unit and help.

The file is what `borechain COMMAND --help` says, and what it does not say: a range, how often, which variable of the
environment. A change of it is a change of what a driller may type, and is to be read as one. Written anew by
`python tests/test_options_whole.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest

from borechain.__main__ import cli

APPROVED = Path(__file__).parent / "data" / "commands"


def option_lines(parameter: click.Parameter) -> Iterator[str]:
    """What may be typed, then what it stands for."""
    names = " / ".join(", ".join(some) for some in (parameter.opts, parameter.secondary_opts) if some)
    default = parameter.default() if callable(parameter.default) else parameter.default
    told: dict[str, Any] = {
        "type": type_words(parameter.type),
        "default": str(default) if isinstance(default, Path) else repr(default),
        "of": parameter.nargs if parameter.nargs != 1 else None,
        "shown as": parameter.metavar,
        "from": parameter.envvar,
        "calls": getattr(parameter.callback, "__name__", None),
    }
    marks = [
        name for name in ("required", "multiple", "is_flag", "is_eager", "hidden") if getattr(parameter, name, False)
    ]
    marks += [] if parameter.expose_value else ["not given to the command"]
    facts = [f"{name} {value}" for name, value in told.items() if value is not None and value != "Sentinel.UNSET"]
    yield f"  {names}: {'; '.join([*facts, *marks])}"
    if text := getattr(parameter, "help", None):
        yield f"      {text}"


def type_words(kind: Any) -> str:
    """A type with its range or its choices."""
    if isinstance(kind, click.Choice):
        return f"one of {', '.join(map(str, kind.choices))}"
    if isinstance(kind, click.IntRange | click.FloatRange):
        low = "" if kind.min is None else f"{kind.min:g} {'<' if kind.min_open else '<='} "
        high = "" if kind.max is None else f" {'<' if kind.max_open else '<='} {kind.max:g}"
        return f"{low}{kind.name}{high}{', clamped' if kind.clamp else ''}"
    if isinstance(kind, click.Path):
        marks = ("exists", "file_okay", "dir_okay", "readable", "writable", "allow_dash", "resolve_path")
        return f"path of {', '.join(mark for mark in marks if getattr(kind, mark))}"
    if isinstance(kind, click.Tuple):
        return f"({', '.join(map(type_words, kind.types))})"
    if isinstance(kind, click.DateTime):
        return f"day as {', '.join(kind.formats)}"
    return kind.name


def command_lines(command: click.Command, path: str) -> Iterator[str]:
    """A command with its options, then those below it."""
    yield f"# {path}{'' if command.no_args_is_help is False else ' (help without arguments)'}"
    yield from (f"    {line}".rstrip() for line in (command.help or "").splitlines())
    for parameter in command.params:
        yield from option_lines(parameter)
    if isinstance(command, click.Group):
        context = click.Context(command, info_name=path)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None, name
            yield from command_lines(below, f"{path} {name}")


def lines_of(name: str) -> list[str]:
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    return list(command_lines(command, f"borechain {name}"))


@pytest.mark.parametrize("name", cli.list_commands(click.Context(cli)))
def test_every_option_is_as_approved(name: str) -> None:
    assert lines_of(name) == (APPROVED / f"{name}.txt").read_text("utf-8").splitlines()


def test_the_commands_are_these() -> None:
    names = cli.list_commands(click.Context(cli))
    assert sorted(path.stem for path in APPROVED.glob("*.txt")) == sorted(names)


if __name__ == "__main__":
    for one in cli.list_commands(click.Context(cli)):
        (APPROVED / f"{one}.txt").write_text("\n".join(lines_of(one)) + "\n", "utf-8")
