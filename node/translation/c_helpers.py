"""Functions of C that stand for what Python's integers do and C's do not, each written where it is called."""

from __future__ import annotations

import re
from typing import Final

SIGN: Final = """\
/* Of a negative number >> repeats the sign: the code relies on it, as every compiler for these chips does it. */
typedef char shifts_repeat_the_sign[(((int64_t)-1) >> 1 == -1) ? 1 : -1];
"""
HELPERS: Final = {
    "shift_left": """\
static inline int64_t shift_left(int64_t value, int64_t places)
{
    return (int64_t)((uint64_t)value << places);
}
""",
    "shift_right": """\
static inline int64_t shift_right(int64_t value, int64_t places)
{
    return value >> places;
}
""",
    "least": """\
static inline int64_t least(int64_t a, int64_t b)
{
    return b < a ? b : a;
}
""",
    "most": """\
static inline int64_t most(int64_t a, int64_t b)
{
    return b > a ? b : a;
}
""",
    "magnitude": """\
static inline int64_t magnitude(int64_t a)
{
    return a < 0 ? -a : a;
}
""",
    "floor_divide": """\
/* The quotient towards minus infinity; 0 by 0. */
static inline int64_t floor_divide(int64_t a, int64_t b)
{
    if (b == 0) {
        return 0;
    }
    const int64_t whole = a / b;
    return (a % b != 0 && (a < 0) != (b < 0)) ? whole - 1 : whole;
}
""",
    "floor_modulo": """\
/* What floor_divide leaves, of the sign of b. */
static inline int64_t floor_modulo(int64_t a, int64_t b)
{
    if (b == 0) {
        return 0;
    }
    const int64_t left = a % b;
    return (left != 0 && (left < 0) != (b < 0)) ? left + b : left;
}
""",
    "is_beyond_below": """\
static inline bool is_beyond_below(int64_t low, int64_t a, int64_t high)
{
    return low < a && a < high;
}
""",
    "is_from_upto": """\
static inline bool is_from_upto(int64_t low, int64_t a, int64_t high)
{
    return low <= a && a <= high;
}
""",
    "is_from_below": """\
static inline bool is_from_below(int64_t low, int64_t a, int64_t high)
{
    return low <= a && a < high;
}
""",
    "is_beyond_upto": """\
static inline bool is_beyond_upto(int64_t low, int64_t a, int64_t high)
{
    return low < a && a <= high;
}
""",
}


def helpers_text(functions: str) -> str:
    """Those of the helpers that ``functions`` call."""
    called = set(re.findall(r"\b(\w+)\(", functions))
    return "\n".join([SIGN, *(text for name, text in HELPERS.items() if name in called)])
