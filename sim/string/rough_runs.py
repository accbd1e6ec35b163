"""What one run of a rough world draws: phases of cycles and frames, play, vibration, and what the encoder measured.

Phases, play and the sensitivity to forces are those of the world of the same seed; vibration is drawn anew.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import Array
from sim.string.moving_string import MovingString
from sim.string.rough_head import measured_in_field
from sim.world.disturbance.frame_layout import FINER
from sim.world.disturbance.frame_sums import FIFO, FrameField, StillString
from sim.world.disturbance.frame_times import PLACES, find_frames
from sim.world.disturbance.frame_vibration import Vibration, frames_drawn
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_motion import MARGIN
from sim.world.rough_section import RoughSection
from sim.world.world import World

Counts = npt.NDArray[np.int64]


class FieldRun(NamedTuple):
    """A rough world in one run."""

    field: FrameField
    measured: Array  # (cycles, AIDING) what the encoder said
    string: Array  # (n,) rad, on the grid of the motion, what the string has turned
    shaken: Array  # (cycles, tubes) rad, angle of each tube's torsional vibration at the end of its cycle


class RoughWorld:
    """A rough world made ready for many runs.

    Parameters
    ----------
    world : of any seed; nothing of it that is drawn is used
    section : its table ``rough``
    """

    def __init__(self, world: World, section: RoughSection) -> None:
        self._section, self._ends, self._motion = section, world.ends, world.motion
        still = StillString(world, section)
        self._field, self._frame = still.field(), still.frame
        self._string = MovingString(world, section, still.frame)
        # a head that stops dead may pass a line and come back in a millisecond: edges are found on the world's grid
        self._grid = still.moved.t, still.moved.head
        self._frames = self._field.sums.shape[1] // FINER
        self._vibration = Vibration(section, self._frame, frames_drawn(self._frames))

    def run(self, world: World) -> FieldRun:
        """What the run of a world's seed draws."""
        moving = self._string
        tubes = range(1, world.scenario.tubes + 1)
        phases = np.array([world.phase(tube) for tube in tubes])
        random = random_stream(world.seed, RandomStream.ROUGH_VIBRATION)
        torsional, shaken = self._vibration.drawn(random)
        string = moving.string(world.seed)
        field = self._field._replace(
            moved=moving.sums(string),
            torsional=torsional,
            shaken=shaken,
            fifos=self._fifos(world.seed, phases, len(torsional), random),
        )
        t, head = self._grid
        measured = measured_in_field(world, self._section.encoder, t, head + world.first_angle)
        return FieldRun(field, measured, string, self._shaken(phases, random))

    def turned(self, run: FieldRun, place: Counts, cycle: Counts, at: Array) -> Array:
        """Angles (n,) rad that tubes have turned at the ends ``at`` (n,) s of their cycles."""
        return np.asarray(np.interp(at, self._string.t, run.string) + run.shaken[cycle, place])

    def _shaken(self, phases: Array, random: np.random.Generator) -> Array:
        """Angles (cycles, tubes) rad of the torsional vibration at the ends of the tubes' cycles.

        Each is drawn by itself: the filter delays what the frames show of it by about half of a swing.
        """
        at = self._ends[:, None] + phases
        turns = self._motion.drive(at.ravel())[1].reshape(at.shape) > 0.0
        return np.asarray(self._vibration.angle_std * turns * random.standard_normal(at.shape))

    def _fifos(self, seed: int, phases: Array, drawn: int, random: np.random.Generator) -> Array:
        """Where every tube's frames lie among its reads, (tubes,) of dtype ``FIFO``."""
        fifos = np.zeros(len(phases), FIFO)
        for number, (fifo, phase) in enumerate(zip(fifos, phases.tolist(), strict=True), 1):
            of_frames = float(random_stream(seed, RandomStream.ROUGH_FRAMES, number).random())
            before = (MARGIN + phase) / self._frame
            whole = math.floor(before - of_frames)
            fifo["place"] = place = math.floor((before - of_frames - whole) * PLACES)
            moved = before - whole - (place + 0.5) / PLACES
            fifo["frame"] = whole + 1 + math.floor(moved)
            row = (moved - math.floor(moved)) * FINER
            fifo["row"], fifo["share"] = math.floor(row), row - math.floor(row)
            find_frames(self._field.times, place, self._section.sensor.frames_hz, self._frame)
        apart = drawn - 2 - self._frames
        fifos["torsional"] = random.integers(apart, size=len(fifos))
        fifos["shaken"] = random.integers(apart, size=(len(fifos), 3))
        return fifos
