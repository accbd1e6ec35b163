"""What comes to the nodes of a string, whatever they do: who is powered and joined, when, and what the encoder says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.world.disturbance.lost_cycles import are_run
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario_file import AidingSection
from sim.world.world import World

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
SILENT_AFTER = 3.5  # s, until a node takes the neighbour above for gone


class StringSchedule(NamedTuple):
    """A run of a string, tube 1 first; hops are counted from the drive head, and rig time is the encoder's."""

    begins: Array  # (cycles,) s, rig time
    ends: Array  # (cycles,) s, rig time
    later: Array  # (tubes,) s, by which the cycles of a tube end after the encoder's
    powered: npt.NDArray[np.int64]  # (cycles,) tubes in the string
    joined: Array  # (cycles, tubes) 1 where a tube's upper joint is closed for all it knows
    clock_var: Array  # (hops,) s^2, of rig time, as a node states it
    measured: Array  # (cycles, AIDING) by the encoder
    is_sent: Mask  # (cycles,) whether that goes down the string
    is_run: Mask  # (cycles,) whether the nodes run it
    dated_late: Array  # (hops,) s, by which a node takes an aiding to be valid too late
    locked: bool  # what is measured arrives after the cycles that end with the encoder's, else before


def schedule_of(world: World, measured: Array) -> StringSchedule:
    """Schedule of a world's string, whose encoder ``measured`` (cycles, AIDING)."""
    file, count, ends = world.scenario.file, world.scenario.tubes, world.ends
    clocks = file.clocks
    stated = clocks.joint_std_ms if clocks.stated_std_ms is None else clocks.stated_std_ms
    powered, later = count_powered(world), phases_of(world)
    return StringSchedule(
        begins=world.begin + PERIOD * np.arange(float(world.cycles)),
        ends=ends,
        later=later,
        powered=powered,
        joined=joined_of(world, powered, later),
        clock_var=(1e-3 * stated) ** 2 * np.arange(1.0, count + 1.0),
        measured=measured,
        is_sent=is_sent(world),
        is_run=are_run(file, ends),
        dated_late=lateness_of(world),
        locked=file.encoder.phase == "locked",
    )


def redraw_schedule(schedule: StringSchedule, world: World, measured: Array) -> StringSchedule:
    """The schedule of another seed's world: of phases that are locked the joints are the same."""
    later = phases_of(world)
    joined = schedule.joined if schedule.locked else joined_of(world, schedule.powered, later)
    return schedule._replace(later=later, joined=joined, measured=measured, is_sent=is_sent(world))


def phases_of(world: World) -> Array:
    """Times (tubes,) s by which the cycles of the tubes end after the encoder's."""
    return np.array([world.phase(tube) for tube in range(1, world.scenario.tubes + 1)])


def count_powered(world: World) -> npt.NDArray[np.int64]:
    """Tubes that are powered in each cycle, (cycles,)."""
    starts = np.array([phase.start for phase in world.phases if phase.kind == "add"])
    added = (starts <= world.ends[:, None]).sum(axis=1, dtype=np.int64)
    return np.asarray(world.scenario.file.rig.tubes_at_start + added, np.int64)


def is_sent(world: World) -> Mask:
    """Whether what the encoder measures goes down the string, (cycles,): it is heard, and the joint below it closed."""
    heard = aiding_passes(world.scenario.file.aiding, world.ends - world.begin, world.seed)
    return np.asarray(heard & ~are_open(world, world.ends))


def lateness_of(world: World) -> Array:
    """Times (hops,) s by which an aiding that is dated by its arrival is dated late."""
    file, hops = world.scenario.file, np.arange(1, world.scenario.tubes + 1)
    medium = file.medium
    if medium.dated_by == "validity":
        return np.zeros(len(hops))
    travelled = hops if file.node.scheme == "forward" else np.ones(len(hops))  # since the node above said it
    return np.asarray(1e-3 * medium.delay_ms + medium.latency * travelled)


def are_open(world: World, t: Array, since: float = 0.0) -> Mask:
    """Whether the joint below the head is open at ``t`` (s), of any shape, and was for ``since`` s."""
    found = np.zeros(t.shape, np.bool_)
    for phase in world.phases:
        if phase.kind == "add":
            found |= (phase.start + since < t) & (t < phase.joint_closed)
    return found


def joined_of(world: World, powered: npt.NDArray[np.int64], later: Array) -> Array:
    """1 where a tube's upper joint is closed for all it knows, (cycles, tubes), else 0.

    A link would tell so: the new tube's joint is open at once, that below it once the neighbour is missed.

    Parameters
    ----------
    powered : (cycles,) tubes in the string
    later : (tubes,) s, by which cycles end after the encoder's
    """
    at, place, top = world.ends[:, None] + later, np.arange(len(later)), powered[:, None] - 1
    opened, missed = are_open(world, at), are_open(world, at, SILENT_AFTER)
    return np.where(opened & ((place == top) | ((place == top - 1) & missed)), 0.0, 1.0)


def aiding_passes(section: AidingSection, t: Array, seed: int) -> Mask:
    """Whether the encoder is heard in each cycle that ends at ``t`` (cycles,) s. Source: update modes, thesis 4.2."""
    every = section.every_s
    repeats = section.on_s + section.off_s if every is None else every
    shifted = t + repeats * float(random_stream(seed, RandomStream.AIDING_PHASE).random())
    if every is None:
        return np.asarray(np.mod(shifted, repeats) < section.on_s)
    number = np.floor(shifted / every + 1e-9)  # the first cycle of every interval
    return np.asarray(np.diff(number, prepend=np.floor((shifted[0] - PERIOD) / every + 1e-9)) > 0.0)
