"""Compile every entry point of the kernels, or load them from the cache, before the first cycle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from node.kernels.alignment import OFFSET, SWEEP, add_to_sweep, fit_circle, new_mount, take_extremes, to_tube
from node.kernels.angles import from_binary, wrap
from node.kernels.calibration import USUAL, identity_parameters
from node.kernels.cluster import follow_offsets, fuse
from node.kernels.cycle import run_cycle
from node.kernels.layout import PERIOD, default_config, new_state
from node.kernels.record import AIDING, END, FZ, JOINED, MOMENT, READING, SETTINGS, START, new_node
from node.kernels.relay import offer_aiding
from node.kernels.resets import forget_bias, lose_tilt, resume
from node.kernels.static_average import STATIC, add_static, has_moved
from node.kernels.step import is_quiet, is_standing, node_aiding, node_step
from node.kernels.twist import twist_var


def warm_loop(run_cycle: Callable[..., int], offer_aiding: Callable[..., int]) -> None:
    """Run two cycles and two aidings on a state that is thrown away."""
    config = default_config()
    state = new_state(config)
    rate, force = np.zeros(3), np.array([0.0, 0.0, -9.81])
    for k in range(2):
        run_cycle(state[0], config[0], rate, force, k * PERIOD, (k + 1) * PERIOD, 1)
        offer_aiding(state[0], config[0], 0.0, 1e-6, 0.0, 0.0, 0.0, 1, 0)
    from_binary(state[0]["now_yaw"])


def warm_step(step: Callable[..., int], aiding: Callable[..., int]) -> None:
    """Run two steps and two aidings of a node that is thrown away."""
    config = default_config()
    nodes, settings, parameters = new_node(config), np.zeros(1, SETTINGS), np.concatenate([identity_parameters()] * 2)
    settings["state_every"] = settings["imus"] = 1
    readings, moment, heard = np.zeros((1, READING)), np.zeros(MOMENT), np.zeros(AIDING)
    readings[0, FZ], moment[JOINED] = -9.81, 1.0
    for k in range(2):
        moment[START], moment[END] = k * PERIOD, (k + 1) * PERIOD
        step(nodes, config, settings, parameters, readings, moment)
        aiding(nodes, config, settings, heard)


def warm_up() -> None:
    """Run what the node needs with the default kernel."""
    rate, force = np.zeros(3), np.array([0.0, 0.0, -9.81])
    average = np.zeros(1, STATIC)
    add_static(average[0], rate, force, USUAL, 1)
    has_moved(average[0], 3.0)
    to_tube(new_mount()[0]["axis"][0], force)
    sweep, offset = np.zeros(1, SWEEP), np.zeros(1, OFFSET)
    add_to_sweep(sweep[0], force, 0.0)
    fit_circle(sweep[0], offset[0])
    take_extremes(sweep[0], offset[0])
    fuse(np.ones((2, 6)), np.ones(2), np.zeros(6))
    follow_offsets(np.ones((2, 3)), rate, 1, new_mount()[0]["rate_offset"])
    warm_loop(run_cycle, offer_aiding)
    warm_step(node_step, node_aiding)
    warm_border()
    wrap(0.0)


def warm_border() -> None:
    """Run what is called from outside a step, between two."""
    nodes, configs = new_node(default_config()), default_config()
    node = nodes[0]
    is_quiet(node)
    is_standing(node)
    twist_var(node["twist"])
    forget_bias(node["filter"], configs[0])
    lose_tilt(node["filter"])
    resume(node["filter"])
