"""The depths of a hole's stations: how well each is known, and whether they fit the tubes. No I/O."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from groundstation.config import GroundConfig
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.told_depths import NO_MAKE_UPS, depths_at_make_ups
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_priors import depth_errors, length_stds
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.well.depth_errors import DepthErrors, StationDepth, mean_depth
from groundstation.survey.well.make_up_depths import (
    MakeUpDepths,
    learnt_reading_std,
    misfit_of_depths,
    usual_reading_std,
)


class HoleDepths:
    """Depths by what was told of the rig and by what the make-ups say of them.

    Parameters
    ----------
    config, setup : of the ground station
    shared : the errors that readings share
    stops : every stop
    """

    def __init__(self, config: GroundConfig, setup: SetupBook, shared: SharedErrors, stops: ResolvedStops) -> None:
        self._config, self._setup, self._shared, self._stops = config, setup, shared, stops
        self._told = depth_errors(config, setup)
        self._misfit: tuple[int, float, str] = (0, 0.0, "")  # by version and since when
        self._make_ups = 0, NO_MAKE_UPS  # by version
        self._columns: dict[float, tuple[tuple[int, ...], Packed]] = {}  # by depth (m) of a station, and of what

    def misfit(self, version: int, since: float) -> str:
        """Why the depths of surveys after a rig time (s) do not fit the tubes, in words, or nothing.

        Parameters
        ----------
        version : of the hole; it is worked out once for each
        """
        if self._misfit[:2] != (version, since):
            found = depths_at_make_ups(self._stops, self._shared, self._config, self._setup, since)
            self._misfit = version, since, misfit_of_depths(found, self._told, self._config.tube_length)
        return self._misfit[2]

    def of_stations(
        self, stations: Sequence[SurveyStation], version: int, *, learns: bool
    ) -> dict[float, StationDepth]:
        """Errors of the depths of stations, by these (m).

        Parameters
        ----------
        version : of the hole
        learns : how depths scatter at make-ups is taken in; that is another thing at every stop, so where all stations
            are worked out anew
        """
        errors = self._learnt(version) if learns else self._told
        stds = length_stds(self._setup) if self._setup.lengths else {}
        told = {place: stds[tube] for tube, place in self._shared.places_of_lengths(stds).items()} if stds else {}
        found, places_of = {}, self._stops.depth_places.__getitem__
        reading_var, setup = errors.reading_std**2, self._setup.version
        for one in stations:
            made_of = (len(one.stops.rows), one.revised, setup)
            known = self._columns.get(one.md)
            if known is None or known[0] != made_of:  # what all of its readings share is as it was
                places = [*map(places_of, one.stops.rows)]
                columns = mean_depth(one.md, places, errors, self._config.tube_length, told).columns
                known = self._columns[one.md] = made_of, columns
            found[one.md] = StationDepth(known[1], reading_var / made_of[0])
        return found

    def scatter(self, version: int) -> float:
        """Variance (m^2) of each reading of the depth that most make-ups show beyond what is stated of it.

        What is stated, some millimetres, bends no hole by anything.
        """
        usual = usual_reading_std(self._at_make_ups(version), self._told, self._config.tube_length)
        return usual**2 - self._told.reading_std**2

    def _learnt(self, version: int) -> DepthErrors:
        """Errors of measured depths, as far as they scatter at make-ups."""
        std = learnt_reading_std(self._at_make_ups(version), self._told, self._config.tube_length)
        return replace(self._told, reading_std=std)

    def _at_make_ups(self, version: int) -> MakeUpDepths:
        """Depths at make-ups; they are looked up once for each version of the hole."""
        if self._make_ups[0] != version:
            found = depths_at_make_ups(self._stops, self._shared, self._config, self._setup)
            self._make_ups = version, found
        return self._make_ups[1]
