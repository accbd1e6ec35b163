"""Orders to a node in C, and its events: two files beside those of the step, whose records they work on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from node.kernels.record.integer_node import FIXED_PARAMETERS
from node.kernels.record.node_record import EVENTS
from node.translation.c_file import HEADER, NODES, SETTINGS_OF, declare_arguments, rename_entries, write_code
from node.translation.c_lines import break_line
from node.translation.c_program import CProgram
from node.translation.c_structs import PREFIX, CStructs
from node.translation.chip_blocks import judge_block, take_block, try_block
from node.translation.chip_orders import next_event, order_alignment, order_record, order_survey, resume_filter
from node.translation.kernel_source import integer_source
from node.translation.kinds_of_values import INTEGER, ArrayOf, Kind, RecordOf, declare_variable

ORDERS_HEADER, ORDERS_CODE = "borechain_orders.h", "borechain_orders.c"
NUMBERS: Final = int(EVENTS["ring"].base["numbers"].shape[0])
CORRECTIONS: Final = ArrayOf(RecordOf(FIXED_PARAMETERS), (1,))
AXES: Final = ArrayOf(INTEGER, (3,))
ORDERS: Final[dict[str, tuple[Callable[..., Any], tuple[Kind, ...]]]] = {
    "order_survey": (order_survey, (NODES,)),
    "order_record": (order_record, (NODES, INTEGER, INTEGER)),
    "order_alignment": (order_alignment, (NODES, INTEGER, INTEGER)),
    "resume_filter": (resume_filter, (NODES,)),
    "judge_block": (judge_block, (CORRECTIONS, CORRECTIONS)),
    "try_block": (try_block, (NODES, CORRECTIONS, AXES, AXES)),
    "take_block": (take_block, (NODES, SETTINGS_OF, CORRECTIONS, CORRECTIONS, INTEGER)),
    "next_event": (next_event, (NODES, ArrayOf(INTEGER, (NUMBERS,)))),
}
ANSWERS: Final = """\
enum borechain_answer { /* to an order */
    BORECHAIN_TAKEN = 0,
    BORECHAIN_OUT_OF_RANGE = 1,
    BORECHAIN_NOT_STANDING = 2, /* it turns, or has not stood still for long enough */
    BORECHAIN_NO_BIAS = 3,      /* the static bias is not known yet */
    BORECHAIN_FAULTY = 4,       /* a sensor is */
    BORECHAIN_TOO_FAST = 5,
    BORECHAIN_UNDER_WAY = 6     /* an alignment is */
};

enum borechain_fit { /* of a block of parameters; of an accelerometer BORECHAIN_ACCELEROMETER is added */
    BORECHAIN_FIT = 0,
    BORECHAIN_BAD_REFERENCE = 1,
    BORECHAIN_BAD_MATRIX = 2,
    BORECHAIN_DRIFTS = 3,
    BORECHAIN_LARGE_BIAS = 4,
    BORECHAIN_FAR = 5,
    BORECHAIN_ACCELEROMETER = 8
};

enum borechain_trial { /* of a block in one cycle */
    BORECHAIN_NO_REST = 0,
    BORECHAIN_AGREES = 1,
    BORECHAIN_DIFFERS = 2,
    BORECHAIN_MAY_TURN = 3
};

enum borechain_changed { /* by a block, bits */
    BORECHAIN_RATES = 1,
    BORECHAIN_FORCES = 2
};
"""


class OrderFiles(NamedTuple):
    """Texts of ``ORDERS_HEADER`` and ``ORDERS_CODE``."""

    header: str
    code: str


def write_order_files(digest: str) -> OrderFiles:
    """The orders of this program in C, for the step of ``digest``: ``write_c_files`` writes it.

    Raises
    ------
    UntranslatableKernelError
        When an order says what is not translated.
    """
    program = CProgram(CStructs())
    prototypes = [_entry(program, name) for name in ORDERS]
    functions = "\n".join(program.texts)
    code = write_code(
        "Orders to a node in integers", "the firmware's own", ORDERS_HEADER, program.constants_text(), functions
    )
    return OrderFiles(_header(prototypes, digest), code)


def _entry(program: CProgram, name: str) -> str:
    """Prototype of an order, whose function is written as it stands."""
    function, kinds = ORDERS[name]
    source = integer_source(function)
    made = program.write(source, kinds, PREFIX + name, static="")
    arguments = declare_arguments(program, source, kinds)
    return f"/* {source.summary} */\n" + break_line(
        f"{declare_variable(made.returned, made.name, program.struct_name)}({arguments});"
    )


def _header(prototypes: list[str], digest: str) -> str:
    renamed = rename_entries(ORDERS, digest)
    return f"""\
/* Orders to a node in integers, between two steps, and what it has to tell. Written by `borechain firmware build`. */
#ifndef BORECHAIN_ORDERS_H
#define BORECHAIN_ORDERS_H

#include "{HEADER}"

{ANSWERS}
{renamed}

{chr(10).join(prototypes)}

#endif
"""
