"""A reading whose window is not the cycle's: the sensor's filter delays, and its frames end when its crystal says.

A window that ends ``late`` before its cycle lacks the turn of that time, and has that of the window before too much.
The missing turn is late (w + w' (window + late) / 2), from the mean w of the window and its change w' since the one
before; what is taken for missing now is what is too much in the next cycle, so no error of it stays. Where the rate
bends it is wrong by up to late w'' T^2 / 2 until then, and a string that has come to rest is not asked again.

Of a window whose parts are known (``node.kernels.sensors.parts``) the last of them go on about the tube's axis, and its
first show what the cycle before lacked: that cycle is put right in the ring, before the filter passes it.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import (
    angular_square,
    half_of,
    is_number,
    mean_of_total,
    proportional_share,
    turned_angle,
    turning_rate,
)
from node.kernels.arithmetic.quantity import NONE

MEMORY: Final = 256  # windows, over which an error that has grown is taken for one that stays


@kernel
def date_window(memory: Any, std: float) -> None:
    """Take in how well the end of a window is dated, ``std`` (s); ``memory`` is a record of dtype ``DELAYED``.

    The phase of a crystal is off by the same in every window until reads have shown better. What a date is off by
    beyond the best of late comes and goes.
    """
    known = is_number(memory.late) and memory.late != 0
    memory.std = std
    memory.lasting = min(memory.lasting + mean_of_total(std - memory.lasting, MEMORY), std) if known else std


@kernel
def make_up_delay(memory: Any, late: float, rate: Array, length: float) -> float:
    """Turn the mean rate (3, rad/s) of a window that ends ``late`` (s) into that of its cycle, of ``length`` (s).

    Returns the variance (rad^2) of the turn about z that is taken for missing and not put right later. ``memory`` is a
    record of dtype ``DELAYED``; after a reading that was none it begins anew.
    """
    memory.shown = 0
    if not (is_number(rate[0]) and is_number(rate[1]) and is_number(rate[2])):
        memory.late = NONE
        return 0
    known = is_number(memory.late)
    exact = late == 0 and not (known and memory.late != 0)
    window = length - late + (memory.late if known else late)
    bend = 0
    for k in range(3):
        measured = rate[k]
        change = measured - memory.rate[k] if known else 0
        bent = proportional_share(half_of(change), window + late, length)
        ahead = min(max(bent, -abs(measured)), abs(measured))  # not back through 0
        if k == 2 and memory.told == 1:
            ahead = memory.ahead
        missing = turned_angle(measured + ahead, late)
        if k == 2 and memory.told == 1 and memory.joins == 1 and known:
            shown = turned_angle(measured + memory.behind, memory.late)
            memory.shown, memory.missing[k] = shown - memory.missing[k], shown
        if known and not exact:
            rate[k] = turning_rate(turned_angle(measured, window) + missing - memory.missing[k], length)
        bend = change - memory.change[k]
        memory.rate[k], memory.missing[k], memory.change[k] = measured, missing, change
    memory.late = late
    return angular_square(turned_angle(bend, half_of(late))) if known and memory.told == 0 else 0
