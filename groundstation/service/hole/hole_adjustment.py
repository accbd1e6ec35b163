"""The adjustment of the hole that is being drilled, from its resolved stops. No I/O.

What it comes to depends on the stops alone and not on the order in which they came or on when it was asked for: the
same hole comes out of a rig of processes, of one process and of a restart, bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.beginnings import Beginnings
from groundstation.service.hole.blunder_search import BlunderSearch, LookedAt, RunApart
from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.service.hole.history import SAME_STOP
from groundstation.service.hole.hung_chains import HungChains
from groundstation.service.hole.resolved_stops import ResolvedStops, Rows
from groundstation.service.hole.string_prior import Hanging, prior_of_string
from groundstation.survey.adjustment.blunders import Examination
from groundstation.survey.adjustment.looks import OF_TUBE, Looks, PathPrior
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.fusion.direction_run import DirectionRun
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR, tangent_errors
from groundstation.survey.fusion.tangents import tangents_of
from groundstation.survey.fusion.trust_level import Trust

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
OWN_SHARE = 0.2  # of a tube's noise that is taken from the stop itself: the variance of 32 readings is not exact
FURTHER = (
    3 + 30
)  # columns of gravity, of north, of a suspicion, and of what is wrong: two explanations of five blunders
LOUD = 2.5  # times a tube's noise, from which on a stop is one at which it was shaken


class HoleAdjustment:
    """Adjusts a hole whenever something has come to it.

    Parameters
    ----------
    config : of the ground station
    shared : whose columns the directions get
    """

    def __init__(self, config: GroundConfig, shared: SharedErrors) -> None:
        self._config, self._shared = config, shared
        self._search: BlunderSearch | None = None
        self._hanging, self._met = Hanging(), set[int]()  # chains of which there was a stop
        mount_var = math.radians(config.mount_std_deg) ** 2
        self._chains = HungChains(shared, mount_var)
        self._beginnings = Beginnings(self._looked_at, lambda: HungChains(shared, mount_var))

    def search_apart(self, run_apart: RunApart) -> None:
        """From now on look for what is wrong beside everything else."""
        self._search = BlunderSearch(run_apart)

    def take_found(self) -> tuple[int, ExaminedHole] | None:
        """What a search of its own came to since the last call, with the number of its newest survey."""
        return None if self._search is None else self._search.take_found()

    def wait_for_search(self) -> bool:
        """Wait until the search that runs has ended; whether one ran."""
        return self._search is not None and self._search.wait()

    def make_room(self, chain: int) -> None:
        """Have the columns that a chain may need, in the order in which stops come and not in that of questions."""
        if chain in self._met:
            return
        self._met.add(chain)
        self._hanging.add_chain(self._shared.chain(chain))
        tubes, make_ups = len(self._hanging.tubes), len(self._hanging.make_ups)
        self._shared.adjusted_places(OF_TUBE * tubes + make_ups + FURTHER)

    def examine(
        self,
        stops: ResolvedStops,
        station_of_row: Places,
        mds: Array,
        collar: Direction,
        number: int,
        scatter: float,
    ) -> ExaminedHole | None:
        """Adjust the hole and say what is wrong with it; None where no look counts.

        Parameters
        ----------
        stops : all of them
        station_of_row : (n,), place of the station of each in the order of depth, from 1; 0 at the collar
        mds : (s,) m, of the stations below the collar
        collar : direction there, as it is known before
        number : of the newest survey
        scatter : m^2, of each reading of the depth, beyond what is stated of it
        """
        table = stops.rows[: len(stops)]
        below = np.flatnonzero(station_of_row > 0)
        rows = below[order_in_time(table["tube"][below], table["at"][below])]
        if not len(rows):
            return None
        # mostly they came in that order, and rows are wide
        path, of_stops = self.path_of(mds, collar), table if are_all(rows, len(table)) else table[rows]
        seen = self._looked_at(of_stops, stops.mean_forces(rows), station_of_row[rows], path, self._chains)
        if scatter > 0.0:
            shares = leg_reading_shares(seen.looks.station, seen.looks.stop)
            seen = replace(seen, path=replace(path, leg_length_var=scatter * shares))
        seen = replace(seen, start=self._beginnings.start_of(rows, of_stops, seen))
        return seen.examine() if self._search is None else self._search.examine(number, seen)

    def _looked_at(self, seen: Rows, forces: Array, station: Places, path: PathPrior, chains: HungChains) -> LookedAt:
        """Looks of rows of the table in the order of time, with their mean forces, at their stations along a path."""
        numbers, which = number_values(seen["chain"])
        hung = chains.hung(numbers)[which]
        systematic = np.ascontiguousarray(seen["systematic_var"])  # of a column in wide rows the next line is slow
        least = np.full(len(numbers), math.inf)
        np.minimum.at(least, which, systematic)
        causes = chains.causes(least)
        tube_of, make_up = np.ascontiguousarray(hung[:, 0]), np.ascontiguousarray(hung[:, 1])
        # what a node doubts beyond its mount and joints, as after a slip, is of that look
        unknown = UNKNOWN_YAW_VAR * (seen["trust"] == Trust.UNKNOWN_YAW) + (systematic - least[which])
        stop, force = stop_numbers(seen["at"]), np.ascontiguousarray(forces)
        noise, yaw = noise_of(seen, tube_of), seen["yaw"].copy()
        looks = Looks(station, tube_of, make_up, stop, force, noise, yaw, seen["yaw_var"] + unknown)
        first = np.searchsorted(stop, np.arange(stop[-1] + 1))
        deepest = np.maximum.reduceat(path.md[station], first)
        run = RunOfStops(deepest, seen["at"][first], path.md, causes)
        tubes = tuple(str(tube) for _, tube in chains.hanging.tubes)
        return LookedAt(looks, prior_of_string(self._config, len(tubes), causes), path, run, tubes)

    def path_of(self, mds: Array, collar: Direction) -> PathPrior:
        """What is known of the path before."""
        tangents = tangents_of([collar])
        cov, _ = tangent_errors(collar, tangents[0])
        return PathPrior(
            np.concatenate([[0.0], mds]),
            tangents[0],
            cov,
            math.radians(self._config.curvature_std_deg_per_m),
            self._config.curvature_length,
        )


def order_in_time(tubes: npt.NDArray[np.uint32], at: Array) -> Places:
    """Order (n,) of looks in time (s), and of those at one time by their tubes."""
    later = np.diff(at)
    if np.all((later > 0.0) | ((later == 0.0) & (tubes[1:] >= tubes[:-1]))):
        return np.arange(len(at))
    return np.lexsort((tubes, at))


def are_all(rows: Places, count: int) -> bool:
    """Whether rows are all of ``count``, in their order."""
    return len(rows) == count and bool(np.all(np.diff(rows, prepend=-1) == 1))


def number_values(values: npt.NDArray[np.uint32]) -> tuple[list[int], Places]:
    """Different values in the order of their coming, and the place (n,) of each among them."""
    count = len(values)
    first = np.full(int(values.max(initial=0)) + 1, count)
    first[values[::-1]] = np.arange(count)[::-1]  # of a value that comes again the last that is written stays
    different = np.flatnonzero(first < count)
    different = different[np.argsort(first[different])]
    first[different] = np.arange(len(different))
    return different.tolist(), first[values]


def stop_numbers(at: Array) -> Places:
    """Numbers (n,) of the stops of the string to which times (n,), s, in their order belong."""
    return np.concatenate([[0], np.cumsum(np.diff(at) >= SAME_STOP)]).astype(np.intp)[: len(at)]


def leg_reading_shares(station: Places, stop: Places) -> Array:
    """Variances (s,) of the lengths of legs where each reading of the depth has one of 1.

    A station is where its readings are on the mean, the collar where it is told to be; a reading that two stations
    share moves both, and their leg not at all.

    Parameters
    ----------
    station, stop : (n,) of looks: 1 for the first below the collar, each of which has some; growing from 0
    """
    width = int(stop.max()) + 1
    looks, count = np.bincount(station)[1:], int(station.max())
    at = station * width + stop
    shared = np.bincount(station[np.isin(at + width, at)], minlength=count + 1)[1:]
    own = 1.0 / looks
    return np.append(own[0], own[:-1] + own[1:] - 2.0 * shared[:-1] * own[:-1] * own[1:])


def noise_of(seen: Rows, tube_of: Places) -> Array:
    """Variances (n,), (m/s^2)^2, of the mean forces on one axis: mostly those that the tube has at all its stops."""
    own = seen["force_var"]
    counts = np.bincount(tube_of)
    usual = (np.bincount(tube_of, own) / np.maximum(counts, 1))[tube_of]
    return np.where(own > LOUD * usual, own, OWN_SHARE * own + (1.0 - OWN_SHARE) * usual)


def directions_of(examination: Examination, shared: SharedErrors, north_std: float) -> DirectionRun:
    """Directions of the collar and the stations below it, from the top down.

    The encoder's zero against north (rad) turns them all about the vertical and is in no look: it is one more column.
    So is what is suspected: by how much it would move them, as one standard deviation.
    """
    adjusted = examination.drawn
    bases, tangents = adjusted.bases, adjusted.now.tangents
    across = np.swapaxes(bases, 1, 2)
    own = across @ adjusted.own_covs[:, :2, :2] @ bases
    of_looks = adjusted.direction_columns
    if examination.supposed is not None:
        of_looks = np.concatenate([of_looks, examination.suspected[:, :, None]], axis=2)
    count = of_looks.shape[2] + 1
    columns = np.empty((3, len(tangents), count))
    np.matmul(across, of_looks, out=np.swapaxes(columns, 0, 1)[:, :, :-1])
    columns[:, :, -1] = north_std * np.stack([-tangents[:, 1], tangents[:, 0], np.zeros(len(tangents))])
    places = shared.adjusted_places(count)  # which may be new
    kept = Packed.of_values(columns[0], places, shared.count)  # with places of few bits
    return DirectionRun(tangents, own, columns, kept.places, kept.width)
