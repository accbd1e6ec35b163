"""The two files of the integer step in C: a header for its caller, and the code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple

from node.kernels.arithmetic.formats import CYCLE_RATE_HZ
from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS
from node.kernels.record.node_record import AIDING, MOMENT, NODE_LAYOUT, READING
from node.kernels.record.sensor_record import MAX_IMUS
from node.kernels.step.fixed_step import integer_aiding, integer_step
from node.translation.c_helpers import helpers_text
from node.translation.c_lines import break_line
from node.translation.c_program import CProgram
from node.translation.c_structs import PREFIX, CStructs
from node.translation.c_value import c_word
from node.translation.kernel_source import KernelSource, integer_source
from node.translation.kinds_of_values import INTEGER, ArrayOf, Kind, RecordOf, declare_variable

HEADER, CODE = "borechain_step.h", "borechain_step.c"
NODES: Final = ArrayOf(RecordOf(FIXED_NODE), (1,))
SETTINGS_OF: Final = ArrayOf(RecordOf(FIXED_SETTINGS), (1,))
ENTRIES: Final[dict[str, tuple[Callable[..., Any], tuple[Kind, ...]]]] = {
    "step": (
        integer_step,
        (
            NODES,
            SETTINGS_OF,
            ArrayOf(RecordOf(FIXED_PARAMETERS), (1 + MAX_IMUS,)),
            ArrayOf(INTEGER, (MAX_IMUS, READING)),
            ArrayOf(INTEGER, (MOMENT,)),
        ),
    ),
    "aiding": (integer_aiding, (NODES, SETTINGS_OF, ArrayOf(INTEGER, (AIDING,)))),
}
CHECKS: Final = """\
#define IS_LONG(record, bytes) typedef char record##_is_long[(sizeof(struct record) == (bytes)) ? 1 : -1]
#define LIES_AT(record, field, place) \\
    typedef char record##_##field##_lies[(offsetof(struct record, field) == (place)) ? 1 : -1]
"""


class CFiles(NamedTuple):
    """The integer step in C.

    Attributes
    ----------
    header, code : texts of ``HEADER`` and ``CODE``
    digest : of both
    entries : names of the entry points, as the linker knows them
    """

    header: str
    code: str
    digest: str
    entries: tuple[str, ...]


def write_c_files() -> CFiles:
    """The integer step of this program in C, from the kernels that it runs itself.

    Raises
    ------
    UntranslatableKernelError
        When a kernel says what is not translated.
    """
    records = CStructs()
    program = CProgram(records)
    entries = [_entry(program, name) for name in ENTRIES]
    prototypes = [prototype for prototype, _ in entries]
    functions = "\n".join([*program.texts, *(text for _, text in entries)])
    constants, structs = program.constants_text(), records.text()
    digest = hashlib.sha256("\0".join((structs, constants, functions)).encode()).hexdigest()[:16]
    header = _header(structs, prototypes, digest)
    code = write_code("One node of a drill string in integers", "the kernels", HEADER, constants, functions)
    return CFiles(header, code, digest, tuple(f"{PREFIX}{name}_{digest}" for name in ENTRIES))


def _entry(program: CProgram, name: str) -> tuple[str, str]:
    """Prototype and text of an entry point: a node with more IMUs than the records have room for is refused."""
    function, kinds = ENTRIES[name]
    source = integer_source(function)
    made = program.write(source, kinds, source.name)
    arguments = declare_arguments(program, source, kinds)
    prototype = break_line(f"{declare_variable(made.returned, PREFIX + name, program.struct_name)}({arguments})")
    call = f"{made.name}({', '.join(map(c_word, source.arguments))})"
    text = f"""\
{prototype}
{{
    if (settings->imus < 1 || settings->imus > BORECHAIN_IMUS) {{
        return BORECHAIN_OTHER_LAYOUT;
    }}
    return {call};
}}
"""
    return f"{prototype};", text


def _header(structs: str, prototypes: list[str], digest: str) -> str:
    renamed = rename_entries(ENTRIES, digest)
    return f"""\
/* One node of a drill string in integers: its records and what is called. Written by `borechain firmware build`.
 *
 * A number in Qn counts 2^-n of its unit; angles without a Q are binary, 2^32 a turn. The layout is that of a saved
 * record, version {NODE_LAYOUT}. A step is called {CYCLE_RATE_HZ} times a second. Compile with -fwrapv, or what your
 * compiler has for it.
 * What is called carries the digest of the source in its name: a header of another source does not link.
 */
#ifndef BORECHAIN_STEP_H
#define BORECHAIN_STEP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BORECHAIN_DIGEST "{digest}"
#define BORECHAIN_LAYOUT {NODE_LAYOUT}
#define BORECHAIN_IMUS {MAX_IMUS}
#define BORECHAIN_OTHER_LAYOUT (-2) /* answer: the settings are of a node that these records have no room for */

{CHECKS}
{structs}
{renamed}

{chr(10).join(prototypes)}

#endif
"""


def declare_arguments(program: CProgram, source: KernelSource, kinds: Sequence[Kind]) -> str:
    """Arguments of a prototype, of these kinds."""
    return ", ".join(
        declare_variable(kind, c_word(argument), program.struct_name)
        for argument, kind in zip(source.arguments, kinds, strict=True)
    )


def rename_entries(names: Iterable[str], digest: str) -> str:
    """Lines by which what is called carries the digest of the source in the name that the linker sees."""
    return "\n".join(f"#define {PREFIX}{name} {PREFIX}{name}_{digest}" for name in names)


def write_code(what: str, source: str, header: str, constants: str, functions: str) -> str:
    """Text of a file of C: ``what`` it is, in words, and the ``source`` that it is written from."""
    return f"""\
/* {what}. Written by `borechain firmware build` from {source}: do not edit. */
#include "{header}"

{helpers_text(functions)}
{constants}

{functions}"""
