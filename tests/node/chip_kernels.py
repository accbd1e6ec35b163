"""Kernels of the tests of the translation: what Python's integers do that C's do not, and every form of statement."""

from typing import Any

from node.kernels.arithmetic.jit import kernel

STEPS = (7, -3, 12)
SIZE = 8


@kernel
def divide_down(a: int, b: int) -> int:
    return a // b + 1000 * (a % b)


@kernel
def divide_by_eight(a: int) -> int:
    return a // SIZE * 100 + a % SIZE


@kernel
def shift_both(a: int, places: int) -> int:
    return (a << places) + (a >> places)


@kernel
def bounded(a: int, b: int) -> int:
    return max(min(a, b), -abs(b), -5)


@kernel
def ordered_sum(a: int, b: int) -> int:
    low, high = (a, b) if a < b else (b, a)
    low, high = high - low, low
    return low * 3 + high


@kernel
def counted(a: int, b: int) -> int:
    total = 0
    for step in (7, -3, 12):
        total = total * 2 + step
    for k in range(a & 7):
        if k == 3:
            continue
        if k > 5:
            break
        total += k * b
    while total > 1000:
        total -= 777
    return total + STEPS[a & 1]


@kernel
def between(a: int, b: int) -> int:
    found = 1 if -10 < bounded(a, b) <= 10 and not (a == b or b in (1, 2)) else 0
    return -found if a < 0 else found


@kernel
def own_truth(a: int, b: int) -> bool:
    same = a == b
    if not same:
        same = a == -b
    return same


@kernel
def uses_float(a: int) -> Any:
    return a * 0.5


@kernel
def adds_unsigned(record: Any) -> int:
    return int(record.yaw + record.now_yaw)


@kernel
def two_kinds(record: Any, a: int) -> int:
    found = a
    if a > 0:
        found = record
    return int(found)
