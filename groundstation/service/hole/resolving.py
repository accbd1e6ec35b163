"""From measurements as they were sent to resolved stops, many at a time. No I/O.

What a measurement comes to by itself depends on nothing but itself, so a ground station that starts upon ten thousand
of them works them out by the hundred: in small matrices one by one most of the time goes to calls.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from operator import attrgetter

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.service.hole.resolved_stops import AXES, NO_NUMBER, ResolvedStops
from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.resolve import check_all, combine_imus, resolve_all
from groundstation.survey.fusion.shared import SharedErrors, causes_of_all
from groundstation.survey.fusion.survey_trust import trust_of, with_trusts
from telemetry.messages import SurveyMeasurement

Array = npt.NDArray[np.float64]
SENT = ("tube", "sequence", "station_at", "hops", "yaw", "yaw_var", "systematic_var", "samples", "settle_time", "flags")
COLUMNS = ("tube", "sequence", "at", *SENT[3:])  # of a table, that hold them
sent_of, force_of, force_cov_of = attrgetter(*SENT), attrgetter("force"), attrgetter("force_cov")
ACCELEROMETER_NOISE_DEG = 0.02  # one sample, for the check of motion


Found = tuple[ResolvedStops, int]  # a resolved stop: its table, and its row there


class Resolver:
    """Makes resolved stops of measurements.

    Parameters
    ----------
    gravity : m/s^2, of the site
    shared : the errors that stops share
    mount_var : rad^2, of an IMU in its tube, about the axis
    bias_std : m/s^2, of each axis of an accelerometer
    """

    def __init__(self, gravity: float, shared: SharedErrors, mount_var: float, bias_std: float) -> None:
        self._gravity, self._shared, self._mount_var, self._bias_std = gravity, shared, mount_var, bias_std
        self._noise = math.radians(ACCELEROMETER_NOISE_DEG) * gravity

    def resolve_measurements(
        self,
        measurements: Sequence[SurveyMeasurement],
        mds: Sequence[float],
        above: Sequence[Sequence[int] | None],
        below: Sequence[Sequence[int]],
    ) -> list[Found | None]:
        """What each comes to; None of one whose numbers are no measurement.

        Many come to the same as one after the other, bit for bit.

        Parameters
        ----------
        measurements : in the order in which they are placed
        mds : m, depths of their tubes
        above : tubes above each, lowest first; None where the order of the string is not known
        below : tubes below the node of each, from the bit up
        """
        try:
            stops = self._resolve_together(measurements, above)
            stops.check_weights()
        except (SurveyError, np.linalg.LinAlgError):
            if len(measurements) == 1:
                return [None]
            each = zip(measurements, mds, above, below, strict=True)  # which of them it is comes out by itself
            return [self.resolve_measurements([m], [md], [over], [under])[0] for m, md, over, under in each]
        stops.rows["md"] = mds
        stops.depth_places = [*map(self._shared.depth_places_of, below)]
        return [(stops, row) for row in range(len(measurements))]

    def _resolve_together(
        self, measurements: Sequence[SurveyMeasurement], above: Sequence[Sequence[int] | None]
    ) -> ResolvedStops:
        stops = ResolvedStops(len(measurements))
        rows, by_force = stops.rows, np.empty((len(measurements), AXES, AXES))
        by_yaw, across = np.empty((len(measurements), AXES)), np.empty((len(measurements), 2, AXES))
        for name, values in zip(COLUMNS, zip(*map(sent_of, measurements), strict=True), strict=True):
            rows[name] = values
        rows["replaces"], rows["departed"], rows["departure"] = NO_NUMBER, 0.0, np.nan
        alike: dict[int, list[int]] = defaultdict(list)
        for row, m in enumerate(measurements):
            rows["trust"][row] = trust_of(m.flags)
            alike[len(m.imus)].append(row)
        for own in alike.values():
            alike_here = [measurements[row] for row in own]
            by_force[own], by_yaw[own], across[own] = self._resolve_alike(stops, own, alike_here)
        for row, (m, tubes) in enumerate(zip(measurements, above, strict=True)):
            stops.places.append(self._shared.places_of(m.tube, tubes))
            rows["width"][row], rows["chain"][row] = self._shared.count, self._shared.chain_of(m.tube, tubes)
        rows["causes"] = across @ causes_of_all(
            by_yaw, by_force, stops.places, rows["systematic_var"], self._mount_var, self._bias_std
        )
        return stops

    def _resolve_alike(
        self, stops: ResolvedStops, own: Sequence[int], measurements: Sequence[SurveyMeasurement]
    ) -> tuple[Array, Array, Array]:
        """Directions and quality of measurements with the same number of IMUs, into some rows of a table.

        Returns how their unit vectors change by force (n, 3, 3) and by yaw (n, 3), and two (n, 2, 3) across them.
        """
        forces = np.array([[*map(force_of, m.imus)] for m in measurements])
        covs = np.array([[*map(force_cov_of, m.imus)] for m in measurements])
        rows, sent = stops.rows, stops.rows[own]
        combined = combine_imus(forces, covs)
        resolved = resolve_all(*combined, sent["yaw"].tolist(), sent["yaw_var"])
        quality = check_all(forces, covs, combined, self._gravity, sent["samples"], sent["settle_time"], self._noise)
        found = with_trusts(resolved, sent["trust"].tolist())
        axes = planes_across(found.tangent)
        rows["tangent"][own], rows["cov"][own] = found.tangent, axes @ found.cov @ axes.transpose(0, 2, 1)
        rows["quality"][own], rows["force_var"][own] = quality, force_vars(covs)
        for row, each in zip(own, forces, strict=True):
            stops.forces[row] = each.tobytes()
        return found.by_force, found.by_yaw, axes


def force_vars(covs: Array) -> Array:
    """Variances (n,), (m/s^2)^2, of the mean forces on one axis, from those of the IMUs (n, imus, 3, 3).

    The IMUs of a tube weigh by their own variance; zero where one of them has none.
    """
    each = (covs[..., 0, 0] + covs[..., 1, 1] + covs[..., 2, 2]) / AXES
    first, total = each[:, 0], np.zeros(len(each))
    known = each.min(axis=1) > 0.0
    for variances in each.T:
        total += first / np.where(known, variances, 1.0)
    return np.where(known, first / np.where(known, total, 1.0), 0.0)
