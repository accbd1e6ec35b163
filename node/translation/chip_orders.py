"""Orders to a node in integers, for a chip: what Python does to the float64 record, over the record that the step has.

Plain functions in the language of the kernels, to be translated into C (``orders_file``). Python's own orders
(``node.firmware.tube``) are the oracle of their test.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import TIME_Q, TURNS_Q, Array
from node.kernels.arithmetic.quantity import NO_NUMBER
from node.kernels.filter.modes import STATIC_BIAS
from node.kernels.filter.resets import resume_filter as resume_saved
from node.kernels.record.events import TOLD_Q, Code
from node.kernels.record.node_record import EVENTS_KEPT
from node.kernels.sensors.aligner import FASTEST as FASTEST_TURN
from node.kernels.sensors.alignment import CIRCLE, EXTREMES
from node.kernels.step.node_step import STILL_CYCLES

TAKEN, OUT_OF_RANGE, NOT_STANDING, NO_BIAS, FAULTY, TOO_FAST, UNDER_WAY = 0, 1, 2, 3, 4, 5, 6  # answers
SHORTEST: Final = 5 << TIME_Q  # s, of a static record
LONGEST: Final = 3600 << TIME_Q
FEWEST: Final = 1 << TURNS_Q  # turns of an alignment
MOST: Final = 20 << TURNS_Q
FASTEST: Final = FASTEST_TURN.fixed  # rad/s
BEGUN: Final = int(Code.ALIGNMENT_BEGUN)
MEANS: Final = 6  # of rates and forces


def order_survey(nodes: Array) -> int:
    """Measure this station again at the next settled cycle of the present or the next stop."""
    nodes[0].filter.surveyed = 0
    return TAKEN


def order_record(nodes: Array, seconds: int, command: int) -> int:
    """Average raw readings for seconds (Q28) from the next cycle on, for the order of that number; 0, or why not."""
    node = nodes[0]
    if seconds < SHORTEST or seconds > LONGEST:
        return OUT_OF_RANGE
    if not is_at_rest(node):
        return NOT_STANDING
    recording = node.recording
    clear_sums(recording.sums)
    recording.running, recording.command = 1, command
    recording.seconds, recording.begun = seconds, NO_NUMBER
    return TAKEN


def is_at_rest(node: Any) -> bool:
    """Whether the node may be at rest, as is_standing of the step."""
    if node.filter.still_cycles >= STILL_CYCLES:
        return True
    return bool(node.filter.mode == STATIC_BIAS and node.slow_cycles >= STILL_CYCLES)


def clear_sums(sums: Any) -> None:
    """Begin anew."""
    sums.samples, sums.temperature, sums.moved = 0, 0, 0
    for i in range(MEANS):
        sums.mean[i], sums.last[i], sums.steps[i] = 0, 0, 0
        for j in range(MEANS):
            sums.scatter[i, j] = 0


def order_alignment(nodes: Array, method: int, turns: int) -> int:
    """Find the tube's axis in the coming slow turns (Q of TURNS_Q), by circle 1 or extremes 2; 0, or why not."""
    node = nodes[0]
    if node.filter.mode == STATIC_BIAS:
        return NO_BIAS
    if node.guard.gyro.fault != 0 or node.guard.force.fault != 0:
        return FAULTY
    if abs(node.filter.now_rate) > FASTEST:
        return TOO_FAST
    is_known = method == CIRCLE or method == EXTREMES  # noqa: PLR1714  the translation knows no sets
    if not is_known or turns < FEWEST or turns > MOST:
        return OUT_OF_RANGE
    if node.aligner.method != 0:
        return UNDER_WAY
    begin_turns(node, method, turns)
    return TAKEN


def begin_turns(node: Any, method: int, turns: int) -> None:
    """Wait for slow turns from the next cycle on."""
    aligner = node.aligner
    aligner.method, aligner.wanted = method, turns
    aligner.ordered_at, aligner.last_end = NO_NUMBER, NO_NUMBER
    aligner.steady, aligner.slow, aligner.angle, aligner.sense = 0, 0, 0, 0
    node.mount.aligning = 1
    events = node.events
    event = events.ring[events.told % EVENTS_KEPT]
    event.code = BEGUN
    event.numbers[0] = method << TOLD_Q
    event.numbers[1] = turns << (TOLD_Q - TURNS_Q)
    event.numbers[2], event.numbers[3] = NO_NUMBER, NO_NUMBER
    events.told += 1


def resume_filter(nodes: Array) -> int:
    """Make a saved filter ready for its first cycle after an outage of unknown length."""
    resume_saved(nodes[0].filter)
    return TAKEN


def next_event(nodes: Array, numbers: Array) -> int:
    """Take the oldest event that was not said yet: its code, and its numbers (10, Q24); 0 where there is none."""
    events = nodes[0].events
    if events.told - events.said > EVENTS_KEPT:
        events.said = events.told - EVENTS_KEPT
    if events.said >= events.told:
        return 0
    event = events.ring[events.said % EVENTS_KEPT]
    for k in range(numbers.shape[0]):
        numbers[k] = event.numbers[k]
    events.said += 1
    return int(event.code)
