"""From the measurements of tubes to the stations of the hole, also of those that wait for a depth. No I/O."""

from __future__ import annotations

import math
from collections.abc import Sequence

from groundstation.config import GroundConfig
from groundstation.service.hole.resolving import Found, Resolver
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_correction import corrected_measurement, depth_shift
from groundstation.service.setup.setup_items import accelerometer_std
from groundstation.service.string.known_string import KnownString
from groundstation.service.string.stored import Stored
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.survey_trust import trust_of
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import SurveyMeasurement

UNTRUSTED = "survey_untrusted"  # alarm: a measurement is fused with an unknown yaw
NEVER_FUSED = (Trust.UNDATED, Trust.SET_ASIDE)
Waiting = Stored[SurveyMeasurement]


class Placement:
    """Measurements on their way into a hole.

    Parameters
    ----------
    config : of the ground station
    string : that was surveyed
    hole : that they belong to
    shared : the errors that they share
    setup : what was told, by which they are corrected

    Attributes
    ----------
    waiting : measurements whose depth is not known yet; what the store has of it may yet be another
    set_aside : measurements of a faulty sensor, never fused
    refused : measurements with invalid numbers
    """

    def __init__(
        self, config: GroundConfig, string: KnownString, hole: SurveyedHole, shared: SharedErrors, setup: SetupBook
    ) -> None:
        mount_var = math.radians(config.mount_std_deg) ** 2
        self._string, self._hole, self._setup = string, hole, setup
        self._tube_length = config.tube_length
        self._resolver = Resolver(config.gravity, shared, mount_var, accelerometer_std(config))
        self.waiting: list[Waiting] = []
        self.set_aside: list[SurveyMeasurement] = []
        self.refused = 0
        self._undated = 0  # measurements without rig time, which never have a depth

    @property
    def unplaced(self) -> int:
        """Measurements without a known depth."""
        return len(self.waiting) + self._undated

    def wait_for_depth(self, one: Waiting) -> str:
        """Have a stored measurement wait for a reading; returns the kind of alarm where it never is used, or ''."""
        if unused := self._unused(one.message):
            return unused
        self.waiting.append(one)
        return ""  # most wait for a moment; the watch tells of those that wait longer

    def take_placeable(self) -> list[tuple[Waiting, float]]:
        """Measurements that waited for their depth and have it now; they wait no more."""
        if not self.waiting:
            return []  # the usual case: called at every reading
        waiting, self.waiting, placeable = self.waiting, [], []
        doubled = self._setup.doubled
        for one in waiting:
            m = doubled.survey_apart(one.message) if doubled.places else one.message
            md = self._string.depth_of(m, one.below)
            if md is None:
                self.waiting.append(one)
            else:
                placeable.append((one, md))
        return placeable

    def resolve_measurements(
        self, measurements: Sequence[SurveyMeasurement], mds: Sequence[float]
    ) -> list[Found | None]:
        """What measurements with their depths (m) come to, worked out together; they are to be placed in this order.

        None for each that is not fused.
        """
        fused, above, below, places, depths = [], [], [], [], []
        doubled = self._setup.doubled
        for place, m in enumerate(map(doubled.survey_apart, measurements) if doubled.places else measurements):
            if trust_of(m.flags) not in NEVER_FUSED:
                chain = self._string.tally.above(m.tube, m.hops)
                fused.append(corrected_measurement(m, chain, self._setup))
                above.append(chain)
                below.append(self._string.tally.below(m.tube))
                places.append(place)
                md = mds[place]
                if self._setup.moves_depths:
                    md += depth_shift(m.tube, self._string.tubes, self._tube_length, self._setup)
                depths.append(max(md, 0.0))
        found: list[Found | None] = [None] * len(measurements)
        if fused:
            resolved = self._resolver.resolve_measurements(fused, depths, above, below)
            for place, one in zip(places, resolved, strict=True):
                found[place] = one
        return found

    def place(self, measurement: SurveyMeasurement, found: Found | None) -> str:
        """Give the hole what a measurement came to; returns the kind of alarm where it is not used as it is, or ''."""
        if unused := self._unused(measurement):
            return unused
        if self._setup.doubled.places and self._setup.doubled.is_held(measurement):
            return ""  # it is told as an alarm of its own, once
        if found is None:
            self.refused += 1
            return "survey_refused"
        self._hole.add_stop(*found, self._string.epoch_of(measurement))
        return "" if trust_of(measurement.flags) is Trust.FULL else UNTRUSTED

    def place_one(self, measurement: SurveyMeasurement, md: float) -> str:
        """Resolve and place a measurement with its depth (m), see ``place``."""
        return self.place(measurement, self.resolve_measurements([measurement], [md])[0])

    def _unused(self, measurement: SurveyMeasurement) -> str:
        trust = trust_of(measurement.flags)
        if trust is Trust.UNDATED:
            self._undated += 1
            return "survey_unplaced"
        if trust is Trust.SET_ASIDE:
            self.set_aside.append(measurement)
            return "survey_set_aside"
        return ""
