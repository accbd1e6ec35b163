"""The nodes of a string as arrays, and the compiled firmware that steps them."""

from __future__ import annotations

import functools
from typing import Any, Final, NamedTuple

import numba
import numpy as np
from numba import types
from numba.extending import typeof_impl

from node.firmware.kernel_choice import kernel_of
from node.firmware.tube_settings import settings_record
from node.kernels.arithmetic.compiler import ByAddress
from node.kernels.arithmetic.formats import Array
from node.kernels.record.filter_record import default_config
from node.kernels.record.integer_node import new_integers
from node.kernels.record.node_record import AIDING, MOMENT, READING, SETTINGS, new_node
from node.kernels.record.sensor_record import PARAMETERS
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.address import BY_ADDRESS, firmware_addresses
from sim.errors import ScenarioError
from sim.world.scenario_file import ScenarioFile
from sim.world.world import World

NEVER: Final = 10**9  # cycles


class StringNodes(NamedTuple):
    """The firmware's memory of every node of a string, tube 1 first."""

    records: Array  # (tubes,) of dtype ``NODE``
    settings: Array  # (tubes,) of dtype ``SETTINGS``
    corrections: Array  # (tubes, 1 + IMUs) of dtype ``PARAMETERS``


def new_nodes(world: World, state_every: int = NEVER) -> StringNodes:
    """Nodes that know nothing yet; ``state_every``: cycles between two states of one."""
    config = tuned_config(world.scenario.file)
    told = [world.tube_settings(k + 1) for k in range(world.scenario.tubes)]
    corrections = np.zeros((len(told), 1 + world.scenario.file.node.imus), PARAMETERS)
    corrections[:] = identity_parameters()
    settings = np.concatenate([settings_record(one, config) for one in told])
    settings["state_every"] = state_every
    return StringNodes(np.repeat(new_node(config), len(told)), settings, corrections)


def tuned_config(file: ScenarioFile) -> Array:
    """Configuration of a scenario's nodes, one-element array of dtype ``CONFIG``.

    Raises
    ------
    ScenarioError
        Names a key of ``node.tuning`` that is no field of it.
    """
    config = default_config()
    names = config.dtype.names or ()
    for name, value in file.node.tuning.items():
        if name not in names:
            raise ScenarioError(f"node.tuning.{name}: expected one of {', '.join(names)}")
        config[0][name] = value
    return config


class IntegerLoop(NamedTuple):
    """Firmware of nodes in integers, by address, with its memory."""

    step: ByAddress
    aid: ByAddress
    memory: Array  # (tubes,) of dtype ``INTEGERS``


@typeof_impl.register(IntegerLoop)
def _kind_of(loop: IntegerLoop, _: Any) -> types.NamedTuple:
    """Its type, made once: numba, which knows an array by its dtype, does not look into a tuple that holds firmware.

    It would go through every field of the memory in every call, which takes forty times as long as the call.
    """
    return _kind_of_loop(loop.step.kind, loop.aid.kind)


@functools.cache
def _kind_of_loop(step: Any, aid: Any) -> types.NamedTuple:
    memory = numba.typeof(new_integers())  # type: ignore[no-untyped-call]
    return types.NamedTuple((step, aid, memory), IntegerLoop)  # type: ignore[no-untyped-call]


class FirmwareLoop(NamedTuple):
    """Compiled firmware as ``sim.string.drill`` takes it: of nodes in floats by address, or of nodes in integers."""

    step: ByAddress | None
    aid: ByAddress | None
    integers: IntegerLoop | None


def loop_of(kernel: str, tubes: int) -> FirmwareLoop:
    """What so many nodes with a kernel run; all but the default are loaded only when used."""
    if kernel == "fixed":
        return FirmwareLoop(None, None, IntegerLoop(*firmware_addresses(kernel), np.repeat(new_integers(), tubes)))
    if kernel in BY_ADDRESS:
        return FirmwareLoop(*firmware_addresses(kernel), None)
    loop = kernel_of(kernel)
    return FirmwareLoop(*addresses_of(loop.step, loop.aiding), None)


@functools.cache
def addresses_of(step: Any, aiding: Any) -> tuple[ByAddress, ByAddress]:
    """Step and intake of aiding of a study's own form of the filter, each an ``entry_kernel``, by address."""
    records, settings = new_node(default_config()), np.zeros(1, SETTINGS)
    parameters = np.concatenate([identity_parameters()] * 2)
    return (
        ByAddress(step, records, settings, parameters, np.zeros((1, READING)), np.zeros(MOMENT)),
        ByAddress(aiding, records, settings, np.zeros(AIDING)),
    )
