"""Functions in the language of the kernels: one with each form that is translated into C, and each that is refused."""

from typing import Any

from node.kernels.arithmetic.jit import kernel

TABLE = (3, -5, 70_000)
SIZE, LIMIT = 16, 1 << 40
NAMES = {"one": 1}
HALF = 0.5


@kernel
def scaled_by(a: int, places: int) -> int:
    """A shift and a power."""
    return (a << 3) + (a >> places) - 2**5 * a + (a if places > 2 else SIZE - LIMIT)


@kernel
def joined_words(a: int, b: int) -> int:
    """Bits, quotients and remainders."""
    c = (a & 0xFF) | (b ^ ~a)
    return c // SIZE + a % SIZE - c // b * (a % b) + -c + +a


@kernel
def chosen_one(a: int, b: int) -> int:
    """Choices within choices, chains of comparisons and truths."""
    near = -SIZE <= a - b < SIZE
    far = 1 < scaled_by(a, 2) <= b
    if (near and not far) or a in (1, -2, SIZE):
        return min(a, b, 3) if a not in (4, 5) else max(abs(a), b)
    if bool(a) == (b != 0):
        b -= 1
    else:
        a, b = b, a
    return (a if a > b else b if b > 0 else 0) + int(near)


@kernel
def walked_over(values: Any, first: int) -> int:
    """Loops of each kind, with an index down, a tuple and a while."""
    total = 0
    for k in range(values.shape[0]):
        total += values[k] * TABLE[k % 3]
    for k in range(7, first, -1):
        if k == 3:
            continue
        total -= k
    for part in (1, first, TABLE[2]):
        total = total * 2 + part
    while total > LIMIT:
        total >>= 1
        if total == 5:
            break
    return total


@kernel
def two_of(a: int, b: int) -> Any:
    """Two numbers."""
    return a + b, a - b


@kernel
def stored_in(state: Any, a: int) -> None:
    """Fields, elements and slices of a record."""
    total, difference = two_of(a, state.cycles)
    state.cycles = total
    state.static_bias[1] = difference
    row = state.P[2]
    row[3] += a
    state.P[0, 1] = walked_over(state.static_bias, a) + state.P[1, 0]
    state.yaw = a
    for j in range(1, 3):
        state.P[j, 3 - j] = state.yaw
    fill_slice(state.P[3, 1:], state.ring_rate[a, 0])


@kernel
def fill_slice(values: Any, by: int) -> None:
    """A slice that is handed on, with its length."""
    for k in range(values.shape[0]):
        values[k] = by if k > 0 else values[k] - by


PLAIN = scaled_by, joined_words, chosen_one  # of two integers


@kernel
def loops_pairs(a: int) -> int:
    for j, k in ((0, 1), (2, 0)):
        a += j * k
    return a


@kernel
def says_float(a: int) -> Any:
    return a * 0.5


@kernel
def says_word(a: int) -> Any:
    return "word"


@kernel
def names_float(a: int) -> Any:
    return a + HALF


@kernel
def names_nothing(a: int) -> Any:
    return a + missing  # noqa: F821


@kernel
def names_dict(a: int) -> Any:
    return NAMES


@kernel
def divides(a: int) -> Any:
    return a / 2


@kernel
def raises_unknown(a: int) -> Any:
    return 2**a


@kernel
def orders_down(a: int) -> Any:
    return 5 > scaled_by(a, 1) > 1


@kernel
def looks_among(a: int) -> Any:
    return a in a


@kernel
def names_argument(a: int) -> Any:
    return scaled_by(a, places=1)


@kernel
def calls_number(a: int) -> Any:
    return a(1)


@kernel
def calls_builtin(a: int) -> Any:
    return sum(a, a)


@kernel
def calls_short(a: int) -> Any:
    return scaled_by(a)


@kernel
def calls_itself(a: int) -> int:
    return calls_itself(a - 1)


@kernel
def reads_field(a: int) -> Any:
    return a.field


@kernel
def reads_element(a: int) -> Any:
    return a[0]


@kernel
def reads_length(a: int) -> Any:
    return a.shape[0]


@kernel
def loops_else(a: int) -> int:
    while a > 0:
        a -= 1
        if a == 3:
            break
    else:
        a = 5
    return a - 1


@kernel
def loops_wide(a: int) -> int:
    for k in range(0, a, 2):
        a += k
    return a


@kernel
def loops_array(a: int) -> int:
    for k in a:
        a += k
    return a


@kernel
def parts_three(a: int) -> int:
    b, c, d = two_of(a, a)
    return b + c + d


@kernel
def keeps_function(a: int) -> int:
    other = scaled_by
    return other(a, 1)


@kernel
def asserts(a: int) -> int:
    assert a
    return a


@kernel
def lists(a: int) -> Any:
    return [b + a for b in (1, 2)][1]


@kernel
def negates_several(a: int) -> Any:
    return -two_of(a, a)


@kernel
def compares_several(a: int) -> Any:
    return two_of(a, a) < a


@kernel
def chooses_two_kinds(a: int) -> Any:
    return a if a > 0 else two_of(a, a)


@kernel
def asks_several(a: int) -> int:
    return 1 if two_of(a, a) else 2


REFUSED = (
    loops_pairs, says_float, says_word, names_float, names_nothing, names_dict, divides, raises_unknown,
    orders_down, looks_among,
    names_argument, calls_number, calls_builtin, calls_short, calls_itself, reads_field, reads_element, reads_length,
    loops_else, loops_wide, loops_array, parts_three, keeps_function, asserts, lists, negates_several,
    compares_several, chooses_two_kinds, asks_several,
)  # fmt: skip
