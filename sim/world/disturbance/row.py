"""A disturbance: the keys of a scenario that it owns, what it draws once, and what it does to a reading.

It has two forms. One acts on arrays, for a rig; the other is compiled, for a campaign, which makes every cycle anew. A
disturbance without the second one is refused by a campaign, by the name of its key.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_section import RoughSection
from sim.world.scenario_file import ScenarioFile
from sim.world.section import ScenarioSection
from sim.world.truth import TubeTruth

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Constants = Mapping[str, Any]  # by the name of the row that drew them


class ActsOn(enum.Enum):
    """Where on its way from the tube to the reading a disturbance acts."""

    DISC = "angle that the encoder's disc shows, on the grid of a rough world; the tube is 0, the drive head"
    MOTION = "angle of a tube about its axis, on the grid of a rough world"
    FELT = "what the housing of an IMU feels: means of cycles, or the grid of a rough world"
    GRID = "the signal before the converter's filter, on the grid of a rough world"
    SAMPLES = "samples of the sensor: means of cycles, or the frames of a FIFO"
    TAKING = "how samples are taken; what it does stands in sim.world.disturbance.fifo and .reading"


class OneImu:
    """One IMU of one tube in one run, with its streams of random numbers.

    Rows that draw from one stream go on where the row before them in the table has stopped.

    Parameters
    ----------
    file : of the scenario
    seed : of the run
    tube, imu : 1 is the lowest tube, 0 the first IMU
    noise : times the noise that the scenario states
    turns_from : s, rig time of the first turning
    cold_at : s, rig time at which the sensor is cold
    """

    def __init__(
        self,
        file: ScenarioFile,
        seed: int,
        tube: int,
        imu: int = 0,
        *,
        noise: float = 1.0,
        turns_from: float = 0.0,
        cold_at: float = 0.0,
    ) -> None:
        self.file, self.seed, self.tube = file, seed, tube
        self.noise, self.turns_from, self.cold_at = noise, turns_from, cold_at
        self._key = (tube, imu) if imu else (tube,)  # the first IMU of a tube draws what it draws alone
        self._randoms: dict[tuple[int, ...], np.random.Generator] = {}

    @property
    def rough(self) -> RoughSection:
        """Table ``rough``, that a rough world has."""
        if self.file.rough is None:
            raise ValueError("rough: expected a rough world")
        return self.file.rough

    def random(self, purpose: RandomStream, *further: int) -> np.random.Generator:
        """Stream of a purpose, one generator for the whole reading."""
        key = (int(purpose), *further)
        if key not in self._randoms:
            self._randoms[key] = random_stream(self.seed, purpose, *self._key, *further)
        return self._randoms[key]

    def section_of(self, row: Disturbance) -> Any:
        """Own section of a disturbance, with its defaults where the scenario has none."""
        return row.section_of(self.file)


@dataclass(slots=True, eq=False)
class ImuSamples:
    """What one IMU reads, as it is being made: rows change ``rate`` and ``force``.

    Attributes
    ----------
    t : (n,) s, rig time at the end of each sample
    rate : (n, 3) rad/s
    force : (n, 3) m/s^2
    turning : (n,) 1 while the bit shakes the string, or the head is driven, else 0
    truth : perfect sensor of the tube
    ends : (m,) s, rig times at which the cycles of the tube end
    period : s, over which a sample is a mean
    is_frame : of a FIFO, and not the mean of a cycle
    felt_force : (n, 3) m/s^2, what the housing felt when the samples were taken
    shaken : (n, 3) g, of it the vibration
    clipped : (n,) bits of the converters that stood at their range
    """

    t: Array
    rate: Array
    force: Array
    turning: Array
    truth: TubeTruth | None = None
    ends: Array = field(default_factory=lambda: np.zeros(0))
    period: float = PERIOD
    is_frame: bool = False
    felt_force: Array = field(default_factory=lambda: np.zeros((0, 3)))
    shaken: Array | None = None
    clipped: Flags = field(default_factory=lambda: np.zeros(0, np.int64))


@dataclass(slots=True, eq=False)
class TubeMotion:
    """Angle of a tube about its axis, or of the encoder's disc, as it is being made.

    Attributes
    ----------
    t : (n,) s, rig time, the grid of a rough world
    angle : (n,) rad
    driven : (n,) 1 while the head is turned, else 0
    """

    t: Array
    angle: Array
    driven: Array

    def stops(self) -> Array:
        """Rig times (k,) s at which a turning ends."""
        return np.asarray(self.t[1:][np.diff(self.driven) < 0.0])


class CycleNow(NamedTuple):
    """What the compiled form of a disturbance is told of a cycle."""

    end: float  # s, rig time
    is_first: bool  # of the tube: what wanders begins anew
    shaken: float  # 1 while the bit shakes the string of a plain world, else 0
    rate: tuple[float, float, float]  # rad/s, mean of what the housing feels
    force: tuple[float, float, float]  # m/s^2, likewise
    found: int  # samples, whose mean the reading is
    frame: float  # s, from one sample to the next
    share: float  # of the noise of one sample, that their mean has
    is_mean: bool  # the one sample is the mean of a cycle; of frames the noise about z comes by the parts of the window
    since: float  # s, from when the sensor was cold to the middle of the samples
    age: float  # s, from when the sensor was cold to the end of the cycle


@dataclass(frozen=True)
class Compiled:
    """What a campaign does in place of the arrays; a row whose effect lies in the frames' sums has none of it.

    Attributes
    ----------
    shared, tube : fields (name, dtype, shape) of the record of all tubes and of that of one
    set_shared : fills the first, (1,), from the scenario
    set_tube : fills the second from what the row drew
    gains : what the sensor shows of rates and forces, (6, 6), from what the row drew
    lane : of ``Lane``, which three normal numbers of a cycle it takes, from ``drawn[at]`` on; None: none
    felt, read : ``act(shared, tube, now, drawn, at, row)``, a ``shared_body`` that adds to the rates and forces of the
        reading ``row``, before what is felt becomes what is read and after it
    parts : ``act(shared, tube, now, drawn, at, further, borders, pieces, parts)``, likewise, that adds to what the z
        gyroscope shows of each part of a window, summed over its frames, beside what is the same in all of them
    """

    shared: tuple[Any, ...] = ()
    tube: tuple[Any, ...] = ()
    set_shared: Callable[[Any, ScenarioFile], None] | None = None
    set_tube: Callable[[Any, Any], None] | None = None
    gains: Callable[[Any, ScenarioFile], Array] | None = None
    lane: int | None = None
    felt: Any = None
    read: Any = None
    parts: Any = None


@dataclass(frozen=True)
class Disturbance:
    """One row of the table.

    Attributes
    ----------
    name : said of it in tables and tests; of a new one also its table ``[disturbance.NAME]`` in a scenario
    keys : of a scenario that it owns; one that names a table owns all of it
    acts_on : where it acts
    act : array form ``act(samples, imu, drawn)``, or ``act(motion, imu, drawn)`` on ``DISC`` and ``MOTION``
    draw : constants of one IMU from its streams
    compiled : form for a campaign; None: a campaign refuses its keys
    beyond : by key, whether a scenario goes beyond what the compiled form can do
    section : of the keys of ``[disturbance.NAME]``
    """

    name: str
    keys: tuple[str, ...]
    acts_on: ActsOn
    act: Callable[[Any, OneImu, Any], None] | None = None
    draw: Callable[[OneImu], Any] | None = None
    compiled: Compiled | None = None
    beyond: Callable[[ScenarioFile], dict[str, bool]] | None = None
    section: type[ScenarioSection] | None = None

    def section_of(self, file: ScenarioFile) -> Any:
        """Its section in a scenario, defaults where that has none."""
        return None if self.section is None else self.section.model_validate(file.disturbance.get(self.name, {}))

    def owns(self, key: str) -> bool:
        """Whether a key of a scenario is one of its own."""
        own = (*self.keys, *((f"disturbance.{self.name}",) if self.section else ()))
        return any(key == one or key.startswith(f"{one}.") for one in own)
