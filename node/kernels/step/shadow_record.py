"""The integers of one node beside its float64 record: they take up outside changes, run, and show.

The integers are the filter. The float64 record is their shadow: it is written after every call, for reports and the
saved state, and read back when its bytes are not those shown last (a new parameter block, a start from the saved
state, a survey asked for). Bytes are compared and not numbers, because some of the numbers are NaN.
"""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.formats import ANGLE_Q, CEILING, TIME_Q, VAR_Q, Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.filter.fixed.cycle import run_cycle
from node.kernels.record.filter_conversion import (
    LARGEST,
    learn_config,
    learn_state,
    show_aiding,
    show_covariance,
    show_cycle,
    show_survey,
    take_reading,
    to_fixed,
)
from node.kernels.record.filter_record import CycleStatus
from node.kernels.record.word_conversion import copy_words, words_differ
from node.kernels.string.relay import offer_aiding

BAD_SAMPLE, SURVEY_READY = int(CycleStatus.BAD_SAMPLE), int(CycleStatus.SURVEY_READY)
REFERENCE_CHANGED = int(CycleStatus.REFERENCE_CHANGED)


@kernel
def fixed_cycle(
    own: Any,
    state: Any,
    config: Any,
    state_words: Array,
    config_words: Array,
    rate: Array,
    force: Array,
    start: float,
    end: float,
    joined: int,
) -> int:
    """One execution cycle as ``node.kernels.filter.float64.cycle.run_cycle``, by the integers.

    Parameters
    ----------
    own : record of dtype ``INTEGERS``
    state, config : records of dtype ``STATE`` and ``CONFIG``
    state_words, config_words : (n,) the bytes of the two, as 64-bit integers
    rate, force, start, end, joined : as ``node.kernels.filter.float64.cycle.run_cycle``
    """
    for k in range(3):
        if not (math.isfinite(rate[k]) and math.isfinite(force[k])):
            return BAD_SAMPLE
    learn_changes(own, state, config, state_words, config_words)
    fixed = own.node.filter
    take_reading(fixed, rate, force, own.gravity, own.rate, own.force)
    begin, until = to_fixed(fixed, start, TIME_Q, LARGEST), to_fixed(fixed, end, TIME_Q, LARGEST)
    status = run_cycle(fixed, own.node.config, own.rate, own.force, begin, until, joined)
    show_cycle(fixed, state, own.gravity)
    show_covariance(fixed, state)
    show_aiding(fixed, state)
    if status & SURVEY_READY:
        show_survey(fixed, state, own.gravity)
    copy_words(own.shown, state_words)
    return status


@kernel
def fixed_offer(
    own: Any,
    state: Any,
    config: Any,
    state_words: Array,
    config_words: Array,
    yaw: float,
    yaw_var: float,
    systematic_var: float,
    offset: float,
    valid_at: float,
    sequence: int,
    hops: int,
) -> int:
    """Queue one aiding as ``node.kernels.string.relay.offer_aiding``, in the integers; records as ``fixed_cycle``."""
    learn_changes(own, state, config, state_words, config_words)
    fixed = own.node.filter
    status = offer_aiding(
        fixed,
        own.node.config,
        to_fixed(fixed, yaw, ANGLE_Q, LARGEST),
        to_fixed(fixed, yaw_var, VAR_Q, CEILING),
        to_fixed(fixed, systematic_var, VAR_Q, CEILING),
        to_fixed(fixed, offset, ANGLE_Q, LARGEST),
        to_fixed(fixed, valid_at, TIME_Q, LARGEST),
        sequence,
        hops,
    )
    show_aiding(fixed, state)
    if status & REFERENCE_CHANGED:
        show_covariance(fixed, state)
    copy_words(own.shown, state_words)
    return status


@kernel
def learn_changes(own: Any, state: Any, config: Any, state_words: Array, config_words: Array) -> None:
    """Read configuration and state when they are not what was read or shown last."""
    if own.met == 0 or words_differ(own.read, config_words):
        copy_words(own.read, config_words)
        own.gravity = config.gravity
        learn_config(own.node.config, config, own.node.filter)
        own.shown_changes = 0
    if own.met == 0 or words_differ(own.shown, state_words):
        learn_state(own.node.filter, state, own.gravity)
    own.met = 1
