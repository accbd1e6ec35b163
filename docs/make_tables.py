"""Write the tables of the pages that are made from the code: ``python docs/make_tables.py``.

A table stands between ``<!-- NAME -->`` and ``<!-- end NAME -->``; what is around it is written by hand.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]

import node_tables  # noqa: E402

from groundstation.service.alarms.rig_alarms import KINDS  # noqa: E402
from groundstation.service.answers.answer_table import ANSWERS, known_keys  # noqa: E402
from groundstation.service.answers.shapes.answer_fields import Fields  # noqa: E402
from groundstation.survey.fusion.survey_trust import EFFECTS, TOGETHER  # noqa: E402
from telemetry.application.arguments import shown_name, shown_range  # noqa: E402
from telemetry.application.commands import COMMANDS, Argument, CommandSpec  # noqa: E402
from telemetry.quantities import Quantity  # noqa: E402
from telemetry.schema import SCHEMA, MessageField, MessageSpec  # noqa: E402


def table(head: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    """A table; a bar inside a cell is escaped."""
    first = list(head)
    rows = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in [first, *lines]]
    return "\n".join([rows[0], "|---" * len(first) + "|", *rows[1:]]) + "\n"


def words(name: str) -> str:
    """Name of a kind as it is written in a text."""
    return name.lower().replace("_", " ")


def kinds() -> str:
    """Every message: number, way, how long its sender keeps it."""
    rows = [(words(s.kind.name), str(int(s.kind)), s.travels, s.kept) for s in SCHEMA]
    return table(("message", "`k`", "travels", "kept until"), rows)


def messages() -> str:
    """Fields of every message."""
    return "\n".join(f"### {words(spec.kind.name).capitalize()}\n\n{fields_of(spec)}" for spec in SCHEMA)


def fields_of(spec: MessageSpec) -> str:
    """Fields of one message."""
    head = ("key", "field", "type", "unit", "range", "resolution", "since", "meaning")
    return table(head, [field_row(field) for field in spec.fields])


def field_row(f: MessageField) -> tuple[str, ...]:
    """One field of a message."""
    return f"`{f.key}`", f.name, f.kind.value, f.unit, f.range_text, f.step_text, str(f.since), f.meaning


def key_table() -> str:
    """Every key expression."""
    return table(("key", "kind", "meaning"), [(f"`{k.template}`", k.kind, k.meaning) for k in known_keys()])


def tube_commands() -> str:
    """Commands with the parameter ``tube``."""
    specs = [spec for spec in COMMANDS if not spec.action]
    head = ("name", "obeyed by", "what it does", "parameters", "values of the reply")
    return table(head, [(f"`{s.name}`", s.by.value, s.meaning, parameters(s), values(s)) for s in specs])


def actions() -> str:
    """Steps of the commands that have several."""
    rows = [(f"`{s.name}`", f"`{s.action}`", s.meaning, parameters(s)) for s in COMMANDS if s.action]
    return table(("name", "action", "what it does", "parameters"), rows)


def parameters(spec: CommandSpec) -> str:
    """Parameters of a command in a cell."""
    return "; ".join(parameter(argument) for argument in spec.arguments)


def parameter(argument: Argument) -> str:
    """Name, range, default and meaning of one parameter."""
    q = argument.quantity
    shown = f"{argument.default:g}" if isinstance(argument.default, float) else argument.default
    default = f" (default {shown})" if shown else ""
    optional = "" if argument.needed or default else " (may be left out)"
    return f"`{shown_name(q)}` {shown_range(q)}{default}{optional}: {q.meaning}".replace("  ", " ").replace(" :", ":")


def values(spec: CommandSpec) -> str:
    """Values of a reply in a cell; those of one stage of a cycle stand for all."""
    return "; ".join(f"`{shown_name(q)}` {q.meaning}" for q in shortened(spec.reply))


def shortened(quantities: tuple[Quantity, ...]) -> list[Quantity]:
    """Without the stages of a cycle but the last, which is the whole cycle."""
    stages = [q for q in quantities if q.name.endswith(("_p99", "_max"))]
    return [q for q in quantities if q not in stages[:-2]]


def answers() -> str:
    """Fields of every answer."""
    return "\n".join(f"### `{path}`\n\n{answer(found.fields)}" for path, found in ANSWERS.items())


def answer(fields: Fields) -> str:
    """Fields of one answer."""
    rows = [row for field in fields for row in field.rows()]
    return table(("field", "type", "meaning"), [(f"`{name}`", kind, meaning) for name, kind, meaning in rows])


def node_record() -> str:
    """The node's record as a map, one table for each part."""
    head = ("byte", "field", "type", "unit", "meaning")
    return "\n".join(f"### {title}\n\n{table(head, rows)}" for title, rows in node_tables.record_parts())


def encoder_record() -> str:
    """The encoder node's record as a map."""
    return table(("byte", "field", "type", "unit", "meaning"), node_tables.encoder_rows())


def events() -> str:
    """Events of the node's step."""
    return table(("code", "event", "severity", "arguments", "meaning"), node_tables.event_rows())


def outage() -> str:
    """What turns unseen in an outage."""
    return table(("outage", "may have turned unseen, deg (1 sigma)"), node_tables.outage_rows())


def worth() -> str:
    """How long a saved yaw is worth something."""
    return table(("sigma of the saved yaw, deg", "worth it for, h"), node_tables.worth_rows())


def rig_alarms() -> str:
    """Kinds of alarms of the rig itself."""
    rows = [(f"`{kind.code}`", kind.level.name.lower(), kind.meaning) for kind in KINDS]
    return table(("alarm", "level", "means"), rows)


def trust() -> str:
    """Effect of every flag of a survey."""
    rows = [(f"`{flag.name}`".lower(), effect.name.lower()) for flag, effect in EFFECTS.items()]
    together = [(" with ".join(f"`{f.name}`".lower() for f in flags), t.name.lower()) for flags, t in TOGETHER.items()]
    return table(("flag", "trust"), [*rows, *together])


PARTS = {
    "operate.md": {"rig alarms": rig_alarms, "trust": trust},
    "wire.md": {"kinds": kinds, "messages": messages},
    "keys.md": {"keys": key_table, "commands": tube_commands, "actions": actions, "answers": answers},
    "firmware.md": {
        "record": node_record,
        "encoder": encoder_record,
        "events": events,
        "outage": outage,
        "worth": worth,
    },
}


def filled(name: str) -> str:
    """Text of a page with its tables made anew.

    Raises
    ------
    ValueError
        When the page has no place for a table.
    """
    text = (DOCS / name).read_text()
    for part, make in PARTS[name].items():
        place = re.compile(rf"(<!-- {part} -->\n).*(<!-- end {part} -->)", re.DOTALL)
        if not place.search(text):
            raise ValueError(f"{name}: expected <!-- {part} --> and <!-- end {part} -->")
        made = make()
        text = place.sub(lambda found, made=made: f"{found[1]}\n{made}\n{found[2]}", text)
    return text


if __name__ == "__main__":
    for page in PARTS:
        (DOCS / page).write_text(filled(page))
