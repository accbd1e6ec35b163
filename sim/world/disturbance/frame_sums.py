"""A rough world as a campaign has it: what all runs share of it, worked out once from ``sim.world``.

A cycle's reading is the mean of the frames that a read finds in the sensor's FIFO, and but for clipping everything that
a frame holds is linear. So the frames of a perfect sensor behind its filter are worked out once by the world of a rig,
in the frame of a joint of 0, and kept as sums over frames on a grid four times as fine as the frames: frames of any
phase lie between two of its phases, and the mean over a window, or over a part of a frame, is a difference of two sums.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.filter_record import PARTS
from sim.world.disturbance.frame_layout import FELT, FINER, MOVED, SUMS
from sim.world.disturbance.frame_times import FrameTimes, no_frames
from sim.world.disturbance.low_pass import low_passed
from sim.world.rough_run import RoughRun
from sim.world.rough_section import RoughSection, RoughVibrationSection
from sim.world.truth import TubeTruth
from sim.world.world import World

AT_ONCE: Final = 1 << 15  # samples of the grid, whose attitudes are held at one time
ALIKE: Final = 1e-9  # rad/s and m/s^2, within which two tubes see the same

FRONT_END: Final = np.dtype(
    [
        ("first", "f8"),  # s, rig time of the first frame of a FIFO of phase 0
        ("frame", "f8"),  # s, from one frame to the next, by the sensor's own crystal
        ("delay", "f8"),  # s, of the filter
    ],
    align=True,
)
FIFO: Final = np.dtype(
    [
        ("frame", "i8"),  # number of the first frame in the tube's first cycle
        ("row", "i8"),  # phase of the frames on the grid of the sums: a row, and a share of the way to the next
        ("share", "f8"),
        ("place", "i8"),  # see ``sim.world.disturbance.frame_times``
        ("torsional", "i8"),  # frames by which the tube's torsional vibration is read later
        ("shaken", "i8", (3,)),  # likewise of each axis of the forces
    ],
    align=True,
)


class Desk(NamedTuple):
    """Work space of a reading that is made of frames."""

    borders: Array  # (PARTS + 2,) frames
    before: Array  # (SUMS,) over the frames before the window
    felt: Array  # (SUMS,) over those before a border
    drawn: Array  # (2 PARTS,) normal
    noise: Array  # (PARTS + 1,) rad/s, of the z gyroscope, summed over the frames of each part


class FrameField(NamedTuple):
    """What the nodes of a rough world feel, beside ``sim.string.schedule.StringSchedule``."""

    sums: Array  # (kinds, rows, FELT) of a perfect sensor behind its filter, over the frames before
    kinds: npt.NDArray[np.int64]  # (tubes,) which of them a tube sees
    times: FrameTimes
    driven: Array  # (cycles, 2) s, rig time, from when to when vibration passes in it
    front_end: Array  # (1,) of dtype ``FRONT_END``
    moved: Array  # (rows, MOVED) of this run, sums likewise
    torsional: Array  # (drawn + 1,) rad/s, of this run, sums of frames, see ``sim.world.disturbance.frame_vibration``
    shaken: Array  # (drawn + 1,) m/s^2, likewise
    fifos: Array  # (tubes,) of dtype ``FIFO``, of this run
    desk: Desk


def rows_of(samples: int, hertz: float, frame: float) -> int:
    """Rows of the sums over the frames of so many samples."""
    return FINER * (math.floor((samples - 1) / (hertz * frame)) + 1)


def frame_sums(values: Array, hertz: float, frame: float) -> Array:
    """Sums (rows, m) over the frames before, of ``values`` (n, m) at ``hertz`` samples/s, linear between two.

    Row ``FINER f + r`` is of the frames before number f, whose first comes r / ``FINER`` of a frame after the grid's.
    """
    count = rows_of(len(values), hertz, frame) - FINER
    at = np.arange(count) * (frame * hertz / FINER)
    taken = np.stack([np.interp(at, np.arange(len(values)), column) for column in values.T], axis=1)
    sums = np.zeros((count + FINER, values.shape[1]))
    np.cumsum(taken.reshape(-1, FINER, values.shape[1]), axis=0, out=sums[FINER:].reshape(-1, FINER, values.shape[1]))
    return sums


def front_end_of(section: RoughSection, begin: float) -> Array:
    """Sensor of every tube, (1,) of dtype ``FRONT_END``; ``begin`` is the grid's, s."""
    sensor, made = section.sensor, np.zeros(1, FRONT_END)
    made["first"], made["frame"] = begin, 1.0 / (sensor.frames_hz * (1.0 + sensor.crystal))
    made["delay"] = sensor.delay
    return made


class StillString:
    """The string of a rough world with the head at 0 and its play at the flank that drives: the same in every run.

    Parameters
    ----------
    world : of any seed; nothing of it that is drawn is used
    section : its table ``rough``

    Attributes
    ----------
    moved : its motion
    frame : s, from one frame of a sensor to the next
    """

    def __init__(self, world: World, section: RoughSection) -> None:
        self._world = world
        quiet = section.model_copy(
            update={
                "vibration": RoughVibrationSection(),
                "string": section.string.model_copy(update={"backlash_deg": 0.0}),
            }
        )
        still = world.motion.starting_at(0.0)
        file = world.scenario.file.model_copy(update={"rough": quiet})
        self._run = RoughRun(file, still, world.begin, world.seed, world.disc.errors)
        self.moved = self._run.moved
        self._hertz, self._low_pass = section.samples_hz, section.sensor.low_pass_hz
        self._delay = section.sensor.delay
        self._front_end = front_end_of(section, float(self.moved.t[0]))
        self.frame = float(self._front_end["frame"][0])

    def field(self) -> FrameField:
        """What all runs share; what a run draws is empty."""
        drills = [phase for phase in self._world.phases if phase.kind == "drill"]
        # a window of two cycles holds the begin of a turning or its end: a rest is longer
        at = np.searchsorted([phase.start for phase in drills], self._world.ends + PERIOD, side="right") - 1
        spans = np.array([(phase.start, phase.end) for phase in drills]) + self._delay
        sums, kinds = self._sums()
        return FrameField(
            sums=sums,
            kinds=kinds,
            times=no_frames(self._world.cycles),
            driven=spans[np.maximum(at, 0)],
            front_end=self._front_end,
            moved=np.zeros((0, MOVED)),
            torsional=np.zeros(0),
            shaken=np.zeros(0),
            fifos=np.zeros(0, FIFO),
            desk=Desk(*(np.zeros(shape) for shape in (PARTS + 2, SUMS, SUMS, 2 * PARTS, PARTS + 1))),
        )

    def _sums(self) -> tuple[Array, npt.NDArray[np.int64]]:
        """Sums of every kind of tube, and the kind of each."""
        first, kinds = self._kinds()
        sums = np.zeros((len(first), rows_of(len(self.moved.t), self._hertz, self.frame), FELT))
        for kind, place in enumerate(first):
            passed = low_passed(self._felt(place, self.moved.t), self._low_pass, self._hertz)
            sums[kind] = frame_sums(passed, self._hertz, self.frame)
        return sums, kinds

    def _kinds(self) -> tuple[list[int], npt.NDArray[np.int64]]:
        """First tube of each kind, and the kind of each tube: those of one see the same at the end of every cycle."""
        seen: list[Array] = []
        first: list[int] = []
        kinds = np.zeros(self._world.scenario.tubes, np.int64)
        for place in range(len(kinds)):
            sees = self._felt(place, self._world.ends)
            alike = [kind for kind, other in enumerate(seen) if np.abs(sees - other).max() < ALIKE]
            if not alike:
                seen.append(sees)
                first.append(place)
            kinds[place] = alike[0] if alike else len(seen) - 1
        return first, kinds

    def _felt(self, place: int, t: Array) -> Array:
        """What a perfect sensor of a tube feels at rig times ``t`` (n,), (n, FELT), some at a time to spare memory."""
        truth, parts = self._truth(place), math.ceil(len(t) / AT_ONCE)
        felt = [np.concatenate(truth.rate_and_force(part), axis=1) for part in np.array_split(t, parts)]
        return np.concatenate(felt)

    def _truth(self, place: int) -> TubeTruth:
        scenario = self._world.scenario
        gravity, below = scenario.file.accelerometer.gravity_mps2, self._world.below(place + 1)
        return self._run.truth(place + 1, scenario.hole, below, None, 0.0, 0.0, gravity, None, None)
