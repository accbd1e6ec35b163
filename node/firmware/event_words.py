"""The table of a node's events in C, from the one that Python tells them by: name, severity, arguments and their words.

On a chip an argument is a number of the step in Q24, or a word that stands for one. Where Python makes a sentence of
several numbers (why an alignment ended), the chip says the part of it that needs none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from node.firmware.alignment_orders import NAMES_OF_METHODS
from node.firmware.event_table import (
    EVENT_TABLE,
    JOINT_REASONS,
    EventSpec,
    alignment_dropped,
    alignment_reason,
    alignment_refused,
    exclusion_reason,
    fault_name,
    joint_reason,
    method_name,
)
from node.kernels.record.events import Code, Fault
from node.kernels.sensors.aligner import Reason

EVENTS_HEADER: Final = "borechain_events.h"
KINDS: Final[dict[Any, str]] = {float: "EVENT_FLOAT", int: "EVENT_WHOLE", bool: "EVENT_FLAG"}
FIGURES: Final = re.compile(r":| after nan| of nan")  # from where a reason needs numbers


class ChipArgument(NamedTuple):
    """One argument: its name, what it is made of, and its words by number, empty where none."""

    name: str
    kind: str
    words: tuple[str, ...] = ()


def words_of(made: Callable[[float], Any], numbers: Sequence[int]) -> tuple[str, ...]:
    """Words of the numbers from 0 to the largest of these; those between that mean nothing are empty."""
    return tuple(str(made(float(k))) if k in numbers else "" for k in range(max(numbers) + 1))


def short_reason(number: float) -> str:
    """Why an alignment ended, without figures."""
    return FIGURES.split(alignment_reason(number, math.nan, math.nan, math.nan))[0]


WORDS: Final[dict[Any, tuple[str, ...]]] = {
    method_name: words_of(method_name, sorted(map(int, NAMES_OF_METHODS))),
    fault_name: words_of(fault_name, sorted(map(int, Fault))),
    exclusion_reason: words_of(exclusion_reason, [0, *sorted(int(fault) for fault in Fault if fault)]),
    joint_reason: words_of(joint_reason, sorted(map(int, JOINT_REASONS))),
}
REASONS: Final = ChipArgument("reason", "EVENT_WORD", words_of(short_reason, sorted(map(int, Reason))))
SENTENCES: Final[dict[Any, tuple[ChipArgument, ...]]] = {
    alignment_refused: (REASONS, ChipArgument("turns", "EVENT_FLOAT")),
    alignment_dropped: (REASONS,),
}


def arguments_in_c(spec: EventSpec) -> tuple[ChipArgument, ...]:
    """Arguments of an event as a chip says them, in the order of their numbers."""
    if spec.words is not None:
        return SENTENCES[spec.words]
    return tuple(
        ChipArgument(name, KINDS[made]) if made in KINDS else ChipArgument(name, "EVENT_WORD", WORDS[made])
        for name, made in spec.arguments
    )


def write_event_table() -> str:
    """Text of ``EVENTS_HEADER``."""
    words: dict[tuple[str, ...], str] = {}
    rows = [_row(code, EVENT_TABLE[code], words) for code in sorted(EVENT_TABLE)]
    lists = [
        f"static const char *const {name}[{len(said)}] = {{\n    " + ",\n    ".join(f'"{word}"' for word in said) + "};"
        for said, name in words.items()
    ]
    most = max(len(arguments_in_c(spec)) for spec in EVENT_TABLE.values())
    return f"""\
/* Events of a node: what each code is called. Written by `borechain firmware build`: do not edit. */
#ifndef BORECHAIN_EVENTS_H
#define BORECHAIN_EVENTS_H

#include <stdint.h>

enum event_kind {{ EVENT_FLOAT, EVENT_WHOLE, EVENT_FLAG, EVENT_WORD }};

struct event_argument {{
    const char *name;
    const char *const *words; /* of a word, by its number; one that means nothing is empty */
    uint8_t kind;
    uint8_t count; /* of the words */
}};

struct event_line {{
    const char *name; /* NULL: no event has this code */
    struct event_argument arguments[{most}];
    uint8_t severity;
    uint8_t count; /* of the arguments */
}};

#define EVENT_CODES {max(EVENT_TABLE) + 1}

{chr(10).join(lists)}

static const struct event_line event_lines[EVENT_CODES] = {{
{chr(10).join(rows)}
}};

#endif
"""


def _row(code: Code, spec: EventSpec, words: dict[tuple[str, ...], str]) -> str:
    made = []
    for argument in arguments_in_c(spec):
        name = "0"
        if argument.words:
            name = words.setdefault(argument.words, f"event_words_{len(words) + 1}")
        made.append(f'{{"{argument.name}", {name}, {argument.kind}, {len(argument.words)}}}')
    inside = ", ".join(made) if made else "{0, 0, 0, 0}"
    return f'    [{int(code)}] = {{"{spec.name}", {{{inside}}}, {int(spec.severity)}, {len(made)}}},'
