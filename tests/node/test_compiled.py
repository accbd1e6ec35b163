"""How the kernels run: from the cache on a second start, and without allocating."""

import os
import shutil
import subprocess
import sys

import pytest
from numba import config

COUNT_COMPILATIONS = """
from node.kernels.step.precompile import warm_up
from node.kernels.step.node_step import node_aiding, node_step
warm_up()
for function in (node_step, node_aiding):
    print(sum(function.stats.cache_misses.values()), sum(function.stats.cache_hits.values()))
"""
COUNT_ALLOCATIONS = """
import os
from importlib import import_module
import numpy as np
from numba import njit
from numba.core.runtime import _nrt_python, rtsys
from node.kernels.sensors.correction import correct_cycle, identity_parameters
from node.kernels.record.filter_record import default_config, new_state
from node.kernels.record.sensor_record import STATIC
from node.kernels.sensors.static_average import add_static, has_moved

run_cycle = import_module(os.environ["CYCLE"]).run_cycle
offer_aiding = import_module(os.environ["RELAY"]).offer_aiding
_nrt_python.memsys_enable_stats()

@njit
def drive(state, config, parameters, average, raw_rate, raw_force, cycles):
    rate, force = raw_rate.copy(), raw_force.copy()
    for k in range(cycles):
        start = 1000.0 + k * 0.5
        for i in range(3):
            rate[i], force[i] = raw_rate[i], raw_force[i]
        add_static(average, rate, force, 30.0, 1)
        has_moved(average, 3.0)
        correct_cycle(parameters, 30.0, rate, force)
        run_cycle(state, config, rate, force, start, start + 0.5, 1)
        offer_aiding(state, config, 0.1, 1e-6, 1e-6, 0.0, start + 0.4, k, 0)

def allocations(cycles):
    config = default_config()
    state = new_state(config)
    parameters, average = identity_parameters(), np.zeros(1, STATIC)
    parameters["identity"] = 0
    before = rtsys.get_allocation_stats().alloc
    drive(state[0], config[0], parameters[0], average[0], np.array([0.0, 0.0, 1.2]), np.array([0.0, 0.0, -9.8]), cycles)
    return rtsys.get_allocation_stats().alloc - before

allocations(1)
print(allocations(1), allocations(1000))
"""
STEP_ALLOCATIONS = """
import os
import numpy as np
from numba import njit
from numba.core.runtime import _nrt_python, rtsys
from node.kernels.sensors.correction import identity_parameters
from node.kernels.record.integer_node import new_integers
from node.kernels.step.fixed_step import fixed_aiding, fixed_step
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import AIDING, MOMENT, READING, SETTINGS, new_node
from node.kernels.step.node_step import node_aiding, node_step

_nrt_python.memsys_enable_stats()

@njit
def drive(nodes, settings, parameters, readings, moment, aiding, cycles):
    for k in range(cycles):
        moment[0], moment[1] = 1000.0 + k * 0.5, 1000.5 + k * 0.5
        readings[0, 2] = 1.2 if k % 300 > 200 else 1e-4 * (k % 7)
        readings[0, 3], readings[0, 5] = 1e-3 * (k % 5), -9.8 - 1e-3 * (k % 3)
        node_step(nodes, settings, parameters, readings, moment)
        aiding[5], aiding[6] = moment[0] + 0.4, k
        node_aiding(nodes, settings, aiding)

@njit
def drive_fixed(nodes, settings, parameters, readings, moment, aiding, integers, cycles):
    for k in range(cycles):
        moment[0], moment[1] = 1000.0 + k * 0.5, 1000.5 + k * 0.5
        readings[0, 2] = 1.2 if k % 300 > 200 else 1e-4 * (k % 7)
        readings[0, 3], readings[0, 5] = 1e-3 * (k % 5), -9.8 - 1e-3 * (k % 3)
        fixed_step(nodes, settings, parameters, readings, moment, integers)
        aiding[5], aiding[6] = moment[0] + 0.4, k
        fixed_aiding(nodes, settings, aiding, integers)

def allocations(cycles):
    configs = default_config()
    nodes, settings, parameters = new_node(configs), np.zeros(1, SETTINGS), np.concatenate([identity_parameters()] * 2)
    settings["state_every"], settings["stiffness"], settings["aiding_old_after"] = 2, np.inf, 3.0
    settings["imus"] = 1
    settings["rate_range"], settings["force_range"] = 9.0, 80.0
    parameters["identity"][0] = 0
    readings, moment, aiding = np.zeros((1, READING)), np.ones(MOMENT), np.zeros(AIDING)
    aiding[1] = 1e-6
    own, integers = (drive_fixed, (new_integers(),)) if os.environ["KERNEL"] == "fixed" else (drive, ())
    before = rtsys.get_allocation_stats().alloc
    own(nodes, settings, parameters, readings, moment, aiding, *integers, cycles)
    return rtsys.get_allocation_stats().alloc - before

allocations(1)
print(allocations(1), allocations(1000))
"""


def run(program: str, **environment: str) -> list[list[int]]:
    done = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return [[int(number) for number in line.split()] for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def unoptimised(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Surroundings in which a loop around the kept kernels compiles fast, and nothing of it is kept."""
    run(COUNT_COMPILATIONS)
    copy = tmp_path_factory.mktemp("cache") / "kernels"
    shutil.copytree(config.CACHE_DIR, copy, copy_function=os.symlink)
    return {"NUMBA_OPT": "0", "NUMBA_CACHE_DIR": str(copy)}


@pytest.mark.slow
def test_a_second_start_does_not_compile() -> None:
    run(COUNT_COMPILATIONS)
    assert all(misses == 0 and hits > 0 for misses, hits in run(COUNT_COMPILATIONS))


def test_the_cache_follows_the_sources() -> None:
    from node.kernels.arithmetic.jit import cache_folder, source_digest

    assert source_digest() in cache_folder().name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cycle", "relay"),
    [
        ("node.kernels.filter.float64.cycle", "node.kernels.string.relay"),
        ("sim.studies.published_form.feed_forward", "sim.studies.published_form.feed_forward"),
    ],
)
def test_a_cycle_allocates_nothing(cycle: str, relay: str, unoptimised: dict[str, str]) -> None:
    ((once, often),) = run(COUNT_ALLOCATIONS, CYCLE=cycle, RELAY=relay, **unoptimised)
    assert once == often


@pytest.mark.slow
@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_a_step_allocates_nothing(kernel: str, unoptimised: dict[str, str]) -> None:
    ((once, often),) = run(STEP_ALLOCATIONS, KERNEL=kernel, **unoptimised)
    assert once == often
