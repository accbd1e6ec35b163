"""From the measurements of tubes to the stations of the hole: also of those that wait for a depth. No I/O."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.config import GroundConfig
from groundstation.errors import SurveyError
from groundstation.service.hole.resolved_stops import cluster_of
from groundstation.service.hole.resolving import ResolvedSurvey, resolve_survey, resolve_surveys
from groundstation.service.hole.surveyed_hole import Hole
from groundstation.service.string.drill_string import DrillString
from groundstation.survey.fusion.resolve import Quality, Resolved
from groundstation.survey.fusion.shared import Reading, SharedErrors, weigh_together
from groundstation.survey.fusion.survey_trust import Trust, trust_of, with_uncertain_yaw, with_unknown_yaw
from telemetry.messages import SurveyMeasurement

UNTRUSTED = "survey_untrusted"  # alarm: a survey is fused with an unknown yaw


@dataclass(frozen=True, slots=True)
class Waiting:
    """A stored survey that waits for its depth, and the length (m) of string below its tube when it came.

    ``kept`` is the depth (m) that the store has of it already; the next reading may yet say otherwise.
    """

    measurement: SurveyMeasurement
    below: float | None
    kept: float | None = None


@dataclass(frozen=True, slots=True)
class Prepared:
    """A survey that is about to be fused: what is wrong with its stop, and its direction with what it shares."""

    quality: Quality
    direction: Reading


class Placement:
    """Measurements on their way into a hole.

    Parameters
    ----------
    config : of the ground station
    string : that was surveyed
    hole : that they belong to
    shared : the errors that they share

    Attributes
    ----------
    waiting : measurements whose depth is not known yet
    set_aside : measurements of a faulty sensor, never fused
    refused : measurements with invalid numbers
    """

    def __init__(self, config: GroundConfig, string: DrillString, hole: Hole, shared: SharedErrors) -> None:
        self._config, self._string, self._hole, self._shared = config, string, hole, shared
        self.waiting: list[Waiting] = []
        self.set_aside: list[SurveyMeasurement] = []
        self.refused = 0
        self._undated = 0  # measurements without rig time, which never have a depth

    @property
    def unplaced(self) -> int:
        """Measurements without a known depth."""
        return len(self.waiting) + self._undated

    def take_placeable(self) -> list[tuple[Waiting, float]]:
        """Measurements that waited for their depth and have it now; they wait no more."""
        if not self.waiting:
            return []  # as nearly always: it is asked at every reading
        found = [(one, self._string.depth_of(one.measurement, one.below)) for one in self.waiting]
        self.waiting = [one for one, md in found if md is None]
        return [(one, md) for one, md in found if md is not None]

    def on_measurement(
        self,
        measurement: SurveyMeasurement,
        md: float | None,
        below: float | None = None,
        prepared: Prepared | None = None,
        kept: float | None = None,
    ) -> str:
        """Resolve and fuse a stored measurement; returns the kind of alarm where it is not used as it is, or ''.

        ``prepared`` is what it comes to, where ``prepare`` has worked that out; ``kept`` is for one that waits, see
        ``Waiting``.
        """
        trust = trust_of(measurement.flags)
        if trust is Trust.UNDATED:
            self._undated += 1
            return "survey_unplaced"
        if trust is Trust.SET_ASIDE:
            self.set_aside.append(measurement)
            return "survey_set_aside"
        if md is None:
            self.waiting.append(Waiting(measurement, below, kept))
            return ""  # most wait for a moment; the watch tells of those that wait longer
        try:
            self._fuse(measurement, md, trust, prepared or self._prepare_one(measurement))
        except (SurveyError, np.linalg.LinAlgError):
            self.refused += 1
            return "survey_refused"
        return "" if trust is Trust.FULL else UNTRUSTED

    def prepare(self, measurements: Sequence[SurveyMeasurement]) -> list[Prepared | None]:
        """What many measurements come to, worked out together; to be fused in this order, and the next after them.

        None for each that is not fused, or is to be looked at by itself.
        """
        placed = [one for one in measurements if trust_of(one.flags) not in (Trust.UNDATED, Trust.SET_ASIDE)]
        resolved = resolve_surveys(placed, self._config.gravity)
        if any(one is None for one in resolved):
            return [None] * len(measurements)
        found = {id(one): self._prepare(one, own) for one, own in zip(placed, resolved, strict=True) if own is not None}
        with contextlib.suppress(np.linalg.LinAlgError):  # of one, which is refused when its turn has come
            weigh_together([one.direction for one in found.values()])
        return [found.get(id(one)) for one in measurements]

    def _prepare_one(self, measurement: SurveyMeasurement) -> Prepared:
        return self._prepare(measurement, resolve_survey(measurement, self._config.gravity))

    def _prepare(self, measurement: SurveyMeasurement, resolved: ResolvedSurvey) -> Prepared:
        return Prepared(resolved.quality, self._direction(measurement, trust_of(measurement.flags), resolved.resolved))

    def _fuse(self, measurement: SurveyMeasurement, md: float, trust: Trust, prepared: Prepared) -> None:
        number = self._hole.newest + 1
        cluster = cluster_of(measurement, md, prepared.direction, prepared.quality, trust, number)
        self._hole.add_cluster(cluster, self._string.epoch_of(measurement))

    def _direction(self, m: SurveyMeasurement, trust: Trust, resolved: Resolved) -> Reading:
        """Direction of a measurement with what it shares with others."""
        if trust is Trust.UNKNOWN_YAW:
            resolved = with_unknown_yaw(resolved)
        else:
            resolved = with_uncertain_yaw(resolved, m.yaw_var + m.systematic_var)
        return self._shared.reading(
            resolved,
            m.tube,
            self._string.tally.above(m.tube, m.hops),
            m.systematic_var,
            math.radians(self._config.mount_std_deg) ** 2,
            math.radians(self._config.accelerometer_bias_std_deg) * self._config.gravity,
        )
