"""The integers of a node beside its float64 record: they take up outside changes, and show what they are now.

Bytes are compared and not numbers, because some of the numbers are NaN. Of the events the ring is shown where one was
told; the cluster only where there is one; an alignment and a static record only while they are under way.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import TIME_Q, UNIT, VAR_Q, Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_conversion import show_aiding, show_covariance, show_cycle, show_ring, show_survey
from node.kernels.record.integer_node import (
    AIDING_POWERS,
    AIDING_SCALES,
    ALIGNER_AT,
    AROUND_AT,
    AROUND_COUNTS,
    AROUND_POWERS,
    AROUND_SCALES,
    CLUSTER_AT,
    CONFIG_AT,
    CONFIG_WORDS,
    END_AT,
    FILTER_AT,
    INSIDE,
    MOMENT_POWERS,
    MOMENT_SCALES,
    PARAMETER_POWERS,
    PARAMETER_SCALES,
    PARAMETERS_INSIDE,
    READING_POWERS,
    READING_SCALES,
    RECORDING_AT,
    RING_AT,
    SETTINGS_INSIDE,
    SETTINGS_POWERS,
    SETTINGS_SCALES,
    SETTINGS_WORDS,
    STATE_WORDS,
)
from node.kernels.record.word_conversion import copy_words, learn_numbers, learn_words, show_words, words_differ
from node.kernels.step.shadow_record import learn_changes

ALIGNER: Final = (ALIGNER_AT - AROUND_AT, RECORDING_AT - AROUND_AT)  # words of what is ordered; the first says
RECORDING: Final = (RECORDING_AT - AROUND_AT, END_AT - AROUND_AT)  # whether it is under way


@kernel
def compared_word_count(imus: int) -> int:
    """How many of the words around the filter are compared and shown at every call."""
    return (ALIGNER_AT if imus > 1 else RING_AT) - AROUND_AT


@kernel
def learn_node(nodes: Array, settings: Array, integers: Array) -> None:
    """Read settings, configuration, filter and what stands around it where they are not what was shown last."""
    own, words, inside = integers[0], nodes.view(np.int64), integers.view(np.int64)
    met = own.met
    learn_changes(
        own,
        nodes[0].filter,
        nodes[0].config,
        words[FILTER_AT : FILTER_AT + STATE_WORDS],
        words[CONFIG_AT : CONFIG_AT + CONFIG_WORDS],
    )
    given = settings.view(np.int64)
    if met == 0 or words_differ(own.read_settings, given):
        copy_words(own.read_settings, given)
        made = inside[SETTINGS_INSIDE : SETTINGS_INSIDE + SETTINGS_WORDS]
        floats = settings.view(np.float64)
        learn_words(own.node.filter, made, given, floats, SETTINGS_SCALES, SETTINGS_POWERS, own.gravity)
    last = (END_AT if met == 0 else ALIGNER_AT if settings[0].imus > 1 else CLUSTER_AT) - AROUND_AT
    around, floats = words[AROUND_AT:END_AT], nodes.view(np.float64)[AROUND_AT:END_AT]
    made = inside[INSIDE : INSIDE + END_AT - AROUND_AT]
    if met == 0 or words_differ(own.shown_around, around[: compared_word_count(settings[0].imus)]):
        learn_part(own, made, around, floats, 0, last)
    for begin, end in (ALIGNER, RECORDING):
        part = around[begin:end]
        if (part[0] | made[begin]) != 0 and words_differ(own.shown_around[begin:end], part):
            learn_part(own, made, around, floats, begin, end)


@kernel
def learn_part(own: Any, made: Array, around: Array, floats: Array, begin: int, end: int) -> None:
    """Learn words ``begin`` to ``end`` of what stands around the filter."""
    part = slice(begin, end)
    scales, powers = AROUND_SCALES[part], AROUND_POWERS[part]
    learn_words(own.node.filter, made[part], around[part], floats[part], scales, powers, own.gravity)
    copy_words(own.last[part], made[part])
    copy_words(own.shown_around[part], around[part])


@kernel
def learn_inputs(parameters: Array, readings: Array, moment: Array, integers: Array) -> None:
    """Read what one cycle brings, and the corrections where they are other ones."""
    own, words = integers[0], parameters.view(np.int64)
    counter, gravity = own.node.filter, own.gravity
    if words_differ(own.read_parameters, words):
        copy_words(own.read_parameters, words)
        made = integers.view(np.int64)[PARAMETERS_INSIDE : PARAMETERS_INSIDE + words.shape[0]]
        floats = parameters.view(np.float64)
        learn_words(counter, made, words, floats, PARAMETER_SCALES, PARAMETER_POWERS, gravity)
    for k in range(readings.shape[0]):
        learn_numbers(counter, own.readings[k], readings[k], READING_SCALES, READING_POWERS, gravity)
    learn_numbers(counter, own.moment, moment, MOMENT_SCALES, MOMENT_POWERS, gravity)


@kernel
def learn_aiding(aiding: Array, integers: Array) -> None:
    """Read an aiding."""
    own = integers[0]
    learn_numbers(own.node.filter, own.aiding, aiding, AIDING_SCALES, AIDING_POWERS, own.gravity)


@kernel
def show_node(nodes: Array, settings: Array, integers: Array, cycle: bool) -> None:
    """Write what the integers are now, after a ``cycle`` or an aiding, into the float64 record, and keep its bytes."""
    own, state, words = integers[0], nodes[0].filter, nodes.view(np.int64)
    fixed, gravity = own.node.filter, own.gravity
    if cycle:
        show_cycle(fixed, state, gravity)
        show_survey(fixed, state, gravity)
    inside = integers.view(np.int64)[INSIDE : INSIDE + END_AT - AROUND_AT]
    around, floats = words[AROUND_AT:END_AT], nodes.view(np.float64)[AROUND_AT:END_AT]
    if around[ALIGNER[0]] != 0 and inside[ALIGNER[0]] == 0:
        show_ring(fixed, state, gravity)
    show_covariance(fixed, state)
    show_aiding(fixed, state)
    copy_words(own.shown, words[FILTER_AT : FILTER_AT + STATE_WORDS])
    if own.node.config.changes != own.shown_changes:
        show_config(own.node.config, nodes[0].config, gravity)
        own.shown_changes = own.node.config.changes
        copy_words(own.read, words[CONFIG_AT : CONFIG_AT + CONFIG_WORDS])
    told, count = nodes[0].events.told, compared_word_count(settings[0].imus)
    show_part(own, inside, around, floats, gravity, 0, count)
    for begin, end in (ALIGNER, RECORDING):
        if (around[begin] | inside[begin]) != 0:
            show_part(own, inside, around, floats, gravity, begin, end)
            copy_words(own.shown_around[begin:end], around[begin:end])
    if told != nodes[0].events.told:
        show_part(own, inside, around, floats, gravity, RING_AT - AROUND_AT, CLUSTER_AT - AROUND_AT)
    copy_words(own.shown_around, around[:count])


@kernel
def show_part(own: Any, inside: Array, around: Array, floats: Array, gravity: float, begin: int, end: int) -> None:
    """Show words ``begin`` to ``end`` of what stands around the filter."""
    part = slice(begin, end)
    last, counts, powers = own.last[part], AROUND_COUNTS[part], AROUND_POWERS[part]
    show_words(inside[part], last, around[part], floats[part], counts, powers, gravity)


@kernel
def show_config(fixed: Any, config: Any, gravity: float) -> None:
    """Write what a node changes of its configuration into the float64 one."""
    unit2 = 2.0 ** -(VAR_Q + 2 * UNIT)
    config.force_std = math.sqrt(fixed.force_var * 2.0**-VAR_Q) * gravity
    config.stamp_std = fixed.stamp_std * 2.0**-TIME_Q
    config.stamp_walk = math.sqrt(fixed.stamp_walk_var * unit2)
    for k in range(3):
        config.gyro_noise[k] = math.sqrt(fixed.rate_noise[k] * unit2)
        config.bias_std[k] = math.sqrt(fixed.bias_var[k] * unit2)
