"""The hole as it was surveyed: stations, what moved, trajectory, deviations and their alarms. No I/O.

Surveys come many at a time, one of every tube at a stop. What follows from all of them is worked out once, when
a query asks for it: fifty tubes would keep the ground station busy for the length of the stop otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.service.hole.adjusted_stations import AdjustedStations, adjusted_stations, learnt_wander
from groundstation.service.hole.blunder_search import RunApart
from groundstation.service.hole.deviation_alarms import AlarmList
from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.service.hole.history import History, Moment
from groundstation.service.hole.hole_adjustment import HoleAdjustment
from groundstation.service.hole.hole_depths import HoleDepths
from groundstation.service.hole.hole_stations import HoleStations
from groundstation.service.hole.movement import Moved, Movement
from groundstation.service.hole.position_sources import depth_variance_at_toe, variances_by_source
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_priors import collar_direction, north_std
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.transport import Carried, carry_directions
from groundstation.survey.fusion.trust_level import Trust
from groundstation.survey.path.curvature_tendency import CurvatureTendency, learn_curvature
from groundstation.survey.wall.column_deviation import Deviations, axis_deviations
from groundstation.survey.wall.projected_end import ProjectedEnd, project_to_target
from groundstation.survey.well.trajectory import Trajectory

Array = npt.NDArray[np.float64]


class SurveyedHole:
    """Every measurement of a hole that was placed, and what follows from them.

    Parameters
    ----------
    config : design, tolerance and weighting
    shared : the errors that its readings share
    setup : what was told of the rig, the direction at the collar among it
    """

    def __init__(self, config: GroundConfig, shared: SharedErrors, setup: SetupBook) -> None:
        self._config = config
        self._shared = shared
        self._setup = setup
        self._run_apart: RunApart | None = None
        self._is_adjusted = config.weighting is Weighting.ADJUSTED
        self._design = config.design
        self.version = 0  # grows with every survey
        self.newest = 0  # number of the measurement that came last, revisions included
        self.begin_anew()
        self.catch_up()

    def begin_anew(self, kept: Iterable[Moment] = ()) -> None:
        """Forget every stop; they are added again, as they are by what was told of the rig since, until caught up.

        Parameters
        ----------
        kept : what was known at the end of stops, where it is to be had
        """
        self.version += 1
        self._is_behind = True
        self._collar = collar_direction(self._config, self._setup)
        self._stops = ResolvedStops()
        self._depths = HoleDepths(self._config, self._setup, self._shared, self._stops)
        self._stations = HoleStations(self._stops, self._config.station_tolerance)
        self._movement = Movement(self._stops, self._stations.of_rows)
        self._adjustment = HoleAdjustment(self._config, self._shared)
        if self._run_apart is not None:
            self._adjustment.search_apart(self._run_apart)
        self._examined: tuple[int, ExaminedHole | None] = (0, None)  # of the version that it is of
        self._is_unsolved = False
        self._stands = AdjustedStations(self._collar)
        self._alarms = AlarmList()
        self._history = History(kept)
        self._carried: dict[float, Carried] = {}  # by the depth of a station, where the string turns in a bent hole
        self._trajectory = self._drawn_from(self._collar)
        self._deviations = self._deviate()
        self._projection: ProjectedEnd | None = None
        self._is_foreseen = True  # whether the projection is that of the trajectory
        self._unsettled_since = math.inf  # s, rig time of the oldest survey from which nothing follows yet
        self._newest_at = -math.inf  # s, rig time of the newest survey

    def _drawn_from(self, collar: Direction) -> Trajectory:
        """A trajectory that begins with a direction."""
        return Trajectory(collar=collar, wander=self._config.wander, keeps_columns=False)

    def add_stop(self, stops: ResolvedStops, row: int, epoch: int) -> bool:
        """Take a stop with rig time of an epoch; a revision of one that is known takes its place, unless it is older.

        Returns whether it was taken.
        """
        at = stops.rows["at"].item(row)
        if self._history.begins_stop(epoch, at):
            self._end_stop()
        if self._is_adjusted:
            self._adjustment.make_room(stops.rows["chain"].item(row))
        stops.rows["number"][row] = self.newest + 1
        if not self._stations.take_stop(stops, row):
            return False
        self.version += 1
        self.newest += 1
        self._history.on_survey(epoch, at)
        self._unsettled_since = min(self._unsettled_since, at)
        self._newest_at = max(self._newest_at, at)
        return True

    def search_apart(self, run_apart: RunApart) -> None:
        """From now on look for what is wrong beside everything else, so that no question waits for it."""
        self._run_apart = run_apart
        self._adjustment.search_apart(run_apart)

    def adopt_found(self) -> bool:
        """Take over what a search of its own has found since the last time; whether it has."""
        ended = self._adjustment.take_found()
        if ended is None:
            return False
        number, found = ended
        self.version += 1
        if number == self.newest:
            self._examined = self.version, found
        self._unsettled_since = min(self._unsettled_since, self._newest_at)
        return True

    def catch_up(self) -> None:
        """Every stop that was known has been added; what was known at the end of each later one is worked out."""
        self._is_behind = False

    def _end_stop(self) -> None:
        """Keep what is known at the end of a stop. What is kept of one already is judged as it was judged then.

        A search of its own that still runs is waited for, or what is kept would lack what it finds: a stop ends when
        the next one begins, so it hardly ever does.
        """
        history = self._history
        if self._is_adjusted and not self._is_behind:
            self.settle()
            while self._adjustment.wait_for_search():
                self.adopt_found()
        if not (self._is_adjusted and self._is_behind):
            history.add(self.deviations, self.projection)
        elif (kept := history.take_over(len(self._stops))) is not None:
            if len(kept.where) > 1:
                self._alarms.judge_deviation(kept.worst(first=1), kept.at)
            if (end := kept.projection) is not None:
                self._alarms.judge_projection(end, kept.at)
        elif history.is_worth(len(self._stops)):
            history.add(self.deviations, self.projection)
        else:
            history.pass_over()

    def has_untrusted(self, tube: int) -> bool:
        """Whether the yaw of any measurement of a tube is not believed."""
        column = self._stops.column
        return bool(((column("tube") == tube) & (column("trust") != Trust.FULL)).any())

    @property
    def stops(self) -> ResolvedStops:
        """Every resolved stop in the order of their coming."""
        return self._stops

    @property
    def stations(self) -> list[SurveyStation]:
        """Stations from the collar down."""
        self.settle()
        return self._stations.all

    def has_survey_of(self, tube: int) -> bool:
        """Whether a tube has surveyed below the collar."""
        return bool(np.any((self._stops.column("tube") == tube) & (self._stops.column("md") > 0.0)))

    @property
    def moved(self) -> list[Moved]:
        """Where the hole moved."""
        self.settle()
        return self._stands.moved if self._is_adjusted else self._movement.moved

    @property
    def alarms(self) -> AlarmList:
        """Levels of the tolerance that were reached."""
        self._foresee()
        return self._alarms

    @property
    def history(self) -> History:
        """What was known at the end of every stop."""
        return self._history

    @property
    def trajectory(self) -> Trajectory:
        """From the collar down."""
        self.settle()
        return self._trajectory

    @property
    def collar(self) -> Direction:
        """Direction at the collar as it was told."""
        return self._collar

    @property
    def turned_back(self) -> list[float]:
        """Depths (m) of stations whose surveys point back against those of the one above.

        The adjustment of the hole leaves such a survey out, and what is drawn points on.
        """
        self.settle()
        return self._stands.turned_back() if self._is_adjusted else self._trajectory.turned_back

    def direction_of(self, station: SurveyStation) -> Direction:
        """Direction of the hole at a station, the transport of the string in it."""
        self.settle()
        carried = self._carried.get(station.md)
        return self._found(station) if carried is None else carried.direction

    @property
    def is_adjusted(self) -> bool:
        """Whether all readings of the hole are adjusted in one, and not fused station by station."""
        return self._is_adjusted

    @property
    def examined(self) -> ExaminedHole | None:
        """The hole adjusted in one, and what is wrong with it; None before the first look at a station, or unsolved.

        Where the stations are fused one by one it stands beside them, and is worked out when it is asked for.
        """
        if self._examined[0] != self.version:
            try:
                stations, scatter = self._stations.numbered(), self._depths.scatter(self.version)
                found = self._adjustment.examine(self._stops, *stations, self._collar, self.newest, scatter)
                self._is_unsolved = False
            except (np.linalg.LinAlgError, ArithmeticError):
                found, self._is_unsolved = None, True
            self._examined = self.version, found
        return self._examined[1]

    @property
    def is_unsolved(self) -> bool:
        """Whether its surveys have no solution in common, so that each station stands for itself."""
        return self.examined is None and self._is_unsolved

    def _found(self, station: SurveyStation) -> Direction:
        """Direction of a station without transport; that of the collar is the collar's where the hole is adjusted."""
        if not self._is_adjusted:
            return station.fused(self._config.weighting)
        return self._stands.direction_at(station.md)

    @property
    def has_transport(self) -> bool:
        """Whether the string turns against its head in a bent hole."""
        return self._config.string_transport == "parallel"

    def transport_of(self, station: SurveyStation) -> tuple[float, float]:
        """Transport of the string that is in the azimuth of a station, and its standard deviation (rad)."""
        self.settle()
        carried = self._carried.get(station.md)
        return (0.0, 0.0) if carried is None else (carried.gamma, carried.std)

    @property
    def variances(self) -> dict[str, Array]:
        """Variances (n, 3) of the positions along the trajectory (m^2) by their sources, which add up to the whole.

        They are worked out when they are asked for: a start goes through hundreds of stops and shows none of them.
        """
        drawn, examined = self.trajectory, self.examined if self._is_adjusted else None
        return variances_by_source(drawn, self._shared, examined, north_std(self._setup))

    @property
    def toe_by_depth(self) -> Array:
        """Variance (3,), m^2, of the last position by what is not known of depths."""
        return depth_variance_at_toe(self.trajectory)

    def place_of(self, station: SurveyStation) -> int:
        """Place of a station in the trajectory; that of the collar for one at its depth."""
        return int(np.searchsorted(self.trajectory.md, station.md)) if station.md > 0.0 else 0

    @property
    def deviations(self) -> Deviations:
        """Deviation from the design axis at every point of the trajectory."""
        self.settle()
        return self._deviations

    @property
    def projection(self) -> ProjectedEnd | None:
        """Where the hole ends, if it goes on as it tends to; None before the first station."""
        self._foresee()
        return self._projection

    def settle(self) -> None:
        """Work out what follows from the stops that have come since the last time."""
        since, self._unsettled_since = self._unsettled_since, math.inf
        if since < math.inf:
            self._work_out(self._adjust() if self._is_adjusted else self._fuse(since))

    def _adjust(self) -> list[SurveyStation]:
        """Adjust the hole; all of its stations have changed, and so has the direction from which it is drawn."""
        self._stations.touched = {}
        below = self._stations.below
        for station in self._stations.all:
            station.forget_view()
        north = north_std(self._setup)
        self._stands = adjusted_stations(self.examined, below, self._collar, self._shared, north, self._stops)
        self._trajectory = self._drawn_from(self._stands.collar)
        if self._stands.found is not None:
            self._trajectory.bend_as(*learnt_wander(self._stands.found, self._config.curvature_length))
            self._trajectory.swing_by(north)
        return below

    def _fuse(self, since: float) -> list[SurveyStation]:
        """Fuse the stations of which something may have changed since a time (s), together those with one more stop."""
        touched, self._stations.touched = self._stations.touched, {}
        by_depth = touched | self._movement.judge_since(since)
        changed = [*map(by_depth.__getitem__, sorted(by_depth))]
        weighting = self._config.weighting
        if weighting is Weighting.BAYES and (grown := [station for station in changed if station.lacks_newest]):
            SurveyStation.fuse_together(grown, self._stops)
        return changed

    def depth_misfit(self, since: float) -> str:
        """Why the depths of surveys after a rig time (s) do not fit the tubes, in words, or nothing."""
        return self._depths.misfit(self.version, since)

    def _work_out(self, changed: Sequence[SurveyStation]) -> None:
        depths = self._depths.of_stations(changed, self.version, learns=self._is_adjusted)
        if self._is_adjusted and not self.has_transport:
            self._trajectory.put_below(self._stands.mds, self._stands.directions, depths)
        else:
            self._trajectory.put(self._directions(changed), depths)
        self._deviations = self._deviate()
        worst = self._deviations.worst(first=1)
        if worst is not None:
            self._alarms.judge_deviation(worst, self._newest_at)
            self._is_foreseen = False

    def _foresee(self) -> None:
        """Project the hole as it is worked out to its end, when that is asked for: it takes as long as all the rest."""
        self.settle()
        if not self._is_foreseen:
            self._is_foreseen = True
            here, direction = self._trajectory[-1], self.direction_of(self._stations.all[-1])
            self._projection = project_to_target(here, direction, self._learn(), self._design)
            self._alarms.judge_projection(self._projection, self._newest_at)

    def _learn(self) -> CurvatureTendency:
        """How the hole bends, by the directions along it."""
        drawn = self._trajectory
        return learn_curvature(drawn.md, drawn.tangents, drawn.tangent_covs)

    def _directions(self, changed: Sequence[SurveyStation]) -> list[tuple[float, Direction]]:
        """Stations in the hole (m, direction) that may be others than before.

        Where the string turns in a bent hole these are all: what it turns by is that of the stations above, and of the
        one below too.
        """
        if not self.has_transport:
            return [(one.md, one.fused(self._config.weighting)) for one in changed if one.md > 0.0]
        measured = [(one.md, self._found(one)) for one in self._stations.below]
        if not measured:
            return []
        mds, directions = zip(*measured, strict=True)
        places = self._shared.transport_places(len(measured) + 1)
        self._carried = dict(zip(mds, carry_directions(self._stands.collar, directions, places), strict=True))
        return [(md, carried.direction) for md, carried in self._carried.items()]

    def _deviate(self) -> Deviations:
        """Deviations of the trajectory as it is drawn."""
        drawn = self._trajectory
        return axis_deviations(drawn.md, drawn.positions, drawn.covs, self._design)
