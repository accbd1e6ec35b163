"""Compile what a node runs, or load it from the cache, before its first cycle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import default_config, new_state
from node.kernels.record.node_record import AIDING, END, FZ, JOINED, MOMENT, READING, SETTINGS, START, new_node
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.node_step import end_step, node_aiding, node_step
from node.kernels.string.drive_torque import DRIVE
from node.kernels.string.encoder_step import SAMPLE, encoder_step, new_encoder


def warm_loop(run_cycle: Callable[..., int], offer_aiding: Callable[..., int]) -> None:
    """Run two cycles and two aidings of a loop on a state that is thrown away."""
    config = default_config()
    state = new_state(config)
    rate, force = np.zeros(3), np.array([0.0, 0.0, -9.81])
    for k in range(2):
        run_cycle(state[0], config[0], rate, force, k * PERIOD, (k + 1) * PERIOD, 1)
        offer_aiding(state[0], config[0], 0.0, 1e-6, 0.0, 0.0, 0.0, 1, 0)


def warm_step(step: Callable[..., int], aiding: Callable[..., int]) -> None:
    """Run two steps and two aidings of a node that is thrown away."""
    nodes, settings = new_node(default_config()), np.zeros(1, SETTINGS)
    parameters = np.concatenate([identity_parameters()] * 2)
    settings["state_every"] = settings["imus"] = 1
    readings, moment, heard = np.zeros((1, READING)), np.zeros(MOMENT), np.zeros(AIDING)
    readings[0, FZ], moment[JOINED] = -9.81, 1.0
    for k in range(2):
        moment[START], moment[END] = k * PERIOD, (k + 1) * PERIOD
        step(nodes, settings, parameters, readings, moment)
        aiding(nodes, settings, heard)


def warm_up() -> None:
    """Run a node with the default kernel: all that a cycle or an aiding calls is inside these two."""
    warm_step(node_step, node_aiding)


def warm_end() -> None:
    """Run what comes after the loop of a step: a third of what there is to compile, which another process may do."""
    nodes, settings, moment = new_node(default_config()), np.zeros(1, SETTINGS), np.zeros(MOMENT)
    settings["state_every"] = settings["imus"] = 1
    moment[END] = PERIOD
    end_step(nodes, settings, moment, 0, 0)


def warm_encoder() -> None:
    """Run the encoder node."""
    encoder_step(new_encoder(0, 0.0), np.zeros(1, DRIVE), np.zeros(SAMPLE), np.zeros(AIDING))
