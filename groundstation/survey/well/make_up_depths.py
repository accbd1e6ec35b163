"""What the depths at make-ups say of the depth: tubes are added at one height of a rig, so the bit advances by them.

With n tubes in the string, of lengths L_i from the bit up, the deepest bit that was surveyed is

    bit_n = L_1 + ... + L_n - height of the topmost end over the collar at a make-up

and the height is the same at every make-up, as well as a rig repeats it. So a depth that stood still for a while, or
jumped, shows as one step that no other step is like; a depth that counts too much shows as a drift; and a bit that is
deeper than its tubes are long has a wrong zero. A crew that surveys between make-ups has no such habit, and is judged
by none of this but the last. No height is known beforehand, so a zero that is too high is not seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.survey.well.depth_errors import DepthErrors

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
REPEATED: Final = 0.01  # m, standard deviation of the height at make-ups before they tell it
KNOWN_AS: Final = 4.0  # steps that what is known before counts for
HABIT: Final = 4  # other steps by which one is judged
TO_JUDGE: Final = 2  # numbers of tubes with which it was surveyed
LEAST_STEP: Final = 0.05  # m that is told
SURELY: Final = 5.0  # standard deviations, of sums of many errors
UNLIKE: Final = 8.0  # of the other steps: their own scale is known from a few alone
SCATTERED: Final = 0.25  # of a tube, of steps by their median, from which on stops are not at make-ups
OF_MEDIAN: Final = 1.4826  # standard deviation of a normal number by the median of its size


@dataclass(frozen=True, slots=True)
class MakeUpDepths:
    """Deepest bit that was surveyed with each number of tubes in the string.

    Parameters
    ----------
    tubes : (k,) numbers of tubes, growing
    bit : (k,) m
    reach : (k,) m, lengths of these tubes together
    """

    tubes: Places
    bit: Array
    reach: Array

    @property
    def rest(self) -> Array:
        """By how much (k,), m, the bit is deeper than its tubes are long: less the height at the make-up."""
        return self.bit - self.reach

    @property
    def steps(self) -> Array:
        """By how much more (k - 1,), m, the bit advanced than tubes were added."""
        return np.diff(self.rest)

    def is_at_make_ups(self, tube_length: float) -> bool:
        """Whether the steps are those of a crew that surveys where it adds a tube."""
        steps = np.abs(self.steps)
        return len(steps) > 0 and OF_MEDIAN * float(np.median(steps)) < SCATTERED * tube_length


def make_up_depths(tubes: Places, bit: Array, lengths: Array) -> MakeUpDepths:
    """Depths at make-ups of all surveys of the tube at the bit.

    Parameters
    ----------
    tubes : (n,) how many tubes the string had
    bit : (n,) m
    lengths : (m,) m, of the tubes of the string from the bit up, at least as many as ``tubes`` names
    """
    numbers, which = np.unique(tubes, return_inverse=True)
    deepest = np.full(len(numbers), -np.inf)
    np.maximum.at(deepest, which, bit)
    return MakeUpDepths(numbers, deepest, np.cumsum(lengths)[numbers - 1])


def learnt_reading_std(found: MakeUpDepths, errors: DepthErrors, tube_length: float) -> float:
    """Standard deviation (m) of each reading of the bit: as it is stated, or more where the steps scatter by more."""
    if not found.is_at_make_ups(tube_length):
        return errors.reading_std
    steps = found.steps
    seen = np.maximum(steps**2 - errors.tube_std**2 * np.diff(found.tubes), 0.0)
    return _beside_known(errors, 0.5 * float(np.sum(seen)), len(steps))


def usual_reading_std(found: MakeUpDepths, errors: DepthErrors, tube_length: float) -> float:
    """The same by the median of the steps: one depth that jumped or stood still is no scatter."""
    if not found.is_at_make_ups(tube_length):
        return errors.reading_std
    steps = found.steps
    usual_var = 0.5 * (OF_MEDIAN * float(np.median(np.abs(steps)))) ** 2
    return _beside_known(errors, len(steps) * usual_var, len(steps))


def _beside_known(errors: DepthErrors, squares: float, count: int) -> float:
    """Standard deviation (m) of a reading by ``count`` squares, summed (m^2), beside what is stated; never less."""
    var = (KNOWN_AS * errors.reading_std**2 + squares) / (KNOWN_AS + count)
    return max(errors.reading_std, math.sqrt(var))


def misfit_of_depths(found: MakeUpDepths, errors: DepthErrors, tube_length: float) -> str:
    """Why the depths do not fit the tubes, in words, or nothing.

    A string that was run in before, and to which no tube was added since, may hang from anything.
    """
    if len(found.tubes) < TO_JUDGE:
        return ""
    if found.is_at_make_ups(tube_length) and (unlike := _unlike_step(found) or _drift(found, errors)):
        return unlike
    return _too_deep(found, errors)


def _unlike_step(found: MakeUpDepths) -> str:
    """The step that no other is like, where there is one."""
    sizes = np.abs(found.steps)
    worst = int(np.argmax(sizes))
    others = np.delete(sizes, worst)
    if len(others) < HABIT:
        return ""
    usual = max(OF_MEDIAN * float(np.median(others)), REPEATED)
    if sizes[worst] <= max(UNLIKE * usual, LEAST_STEP):
        return ""
    upper, lower = found.bit[worst : worst + 2].tolist()
    added = float(found.reach[worst + 1] - found.reach[worst])
    return (
        f"from {upper:.2f} to {lower:.2f} m the bit went {lower - upper:.2f} m while tubes of {added:.2f} m were added:"
        " the depth stood still or jumped, or the bit was not where the others were added"
    )


def _drift(found: MakeUpDepths, errors: DepthErrors) -> str:
    """That the depth counts too much or too little, all steps together."""
    count, drifted = len(found.steps), float(found.rest[-1] - found.rest[0])
    gone, added = float(np.ptp(found.bit)), int(found.tubes[-1] - found.tubes[0])
    once = max(REPEATED, float(np.std(found.steps)) / math.sqrt(2.0))
    std = math.sqrt((errors.scale_std * gone) ** 2 + added * errors.tube_std**2 + 2.0 * once**2)
    if count < HABIT or abs(drifted) <= max(SURELY * std, LEAST_STEP):
        return ""
    sense = "more" if drifted > 0.0 else "less"
    part = 100.0 * abs(drifted) / float(found.reach[-1] - found.reach[0])
    return f"the depth counts {part:.1f} % {sense} than the tubes are long: its scale or their lengths are wrong"


def _too_deep(found: MakeUpDepths, errors: DepthErrors) -> str:
    """That the bit is deeper than its tubes are long."""
    known = (errors.scale_std * found.bit) ** 2 + errors.tube_std**2 * found.tubes
    stds = np.sqrt(known + errors.offset_std**2 + errors.reading_std**2)
    over = found.rest - np.maximum(SURELY * stds, LEAST_STEP)
    worst = int(np.argmax(over))
    if over[worst] <= 0.0:
        return ""
    bit, tubes, reach = float(found.bit[worst]), int(found.tubes[worst]), float(found.reach[worst])
    string = f"{tubes} tube{'s' if tubes > 1 else ''} of {reach:.2f} m"
    return f"the bit was at {bit:.2f} m with {string}: stick-up, depth or lengths are wrong"
