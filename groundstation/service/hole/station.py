"""One depth of the hole and every cluster that was measured there. No I/O."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from groundstation.service.hole.resolved_stops import Cluster, Clusters
from groundstation.survey.fusion.fusion import Departure, GrowingBayes, Stack, Weighting, departure_from, weighted
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import Reading
from groundstation.survey.fusion.survey_trust import UNKNOWN_YAW_VAR, Trust


@dataclass(slots=True)
class SurveyStation:
    """One depth of the hole (m) and every cluster measured there, oldest first.

    ``drops`` are the places of clusters that found another hole than those before them.
    """

    md: float
    clusters: Clusters = field(default_factory=Clusters)
    drops: list[int] = field(default_factory=list)
    untrusted: int = 0  # clusters whose yaw is not believed
    revised: int = 0  # clusters that were put in the place of others
    _fused: tuple[tuple[int, ...], Direction] | None = None  # with what it was made of
    _shown: tuple[tuple[int, ...], dict[str, Any]] | None = None
    _all: GrowingBayes = field(default_factory=GrowingBayes)
    _trusted: GrowingBayes | None = None

    @property
    def count(self) -> int:
        """Clusters measured here."""
        return len(self.clusters)

    @property
    def first(self) -> int:
        """Place of the first cluster that counts."""
        return self.first_before(self.count)

    def first_before(self, place: int) -> int:
        """Place of the first cluster that counted when the one at ``place`` came."""
        return max((drop for drop in self.drops if drop < place), default=0) if self.drops else 0

    def add_cluster(self, cluster: Cluster) -> None:
        """Add a cluster in the order of time; what was judged of later ones is forgotten.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; it was not added.
        """
        place = self.clusters.insert(cluster)
        self.untrusted += cluster.trust is not Trust.FULL
        self._forget(place)

    def revise_cluster(self, place: int, cluster: Cluster) -> bool:
        """Put a cluster in the place of the survey that it is again, unless a newer one of it is known: False.

        Raises
        ------
        numpy.linalg.LinAlgError
            When it cannot be weighed; the one before stays.
        """
        before = self.clusters[place]
        if cluster.sequence <= before.sequence:
            return False
        self.clusters.replace_cluster(place, cluster)
        self.untrusted += (cluster.trust is not Trust.FULL) - (before.trust is not Trust.FULL)
        self.revised += 1
        self._forget(place)
        return True

    def _forget(self, place: int) -> None:
        """What was judged of the cluster at a place and of later ones is to be judged anew."""
        self.drops = [drop for drop in self.drops if drop < place]
        self._all.forget(place)
        if self._trusted is not None:
            self._trusted.forget(place)

    @property
    def counting(self) -> list[int]:
        """Places of the clusters that count: of those since the hole moved the trusted ones, or all where none is."""
        since = range(self.first, self.count)
        if not self.untrusted:
            return list(since)
        is_trusted = self.clusters.column("trust") == Trust.FULL
        return [place for place in since if is_trusted[place]] or list(since)

    @property
    def is_trusted(self) -> bool:
        """Whether the yaw of a cluster that counts is believed."""
        return bool((self.clusters.column("trust")[self.counting] == Trust.FULL).any())

    def mean_variances(self) -> tuple[float, float, float]:
        """Of the clusters that count: of the yaw as it is fused, systematic (both rad^2), of the force (m/s^2)^2."""
        rows = self.clusters.rows(self.counting)
        unknown = UNKNOWN_YAW_VAR * (rows["trust"] == Trust.UNKNOWN_YAW)
        each = (rows["yaw_var"] + unknown, rows["systematic_var"], rows["force_var"])
        yaw, systematic, force = (float(values.sum()) / len(values) for values in each)
        return yaw, systematic, force

    @property
    def _made_of(self) -> tuple[int, ...]:
        """What changes with every cluster that comes, is revised or does not count any more."""
        return self.count, self.revised, *self.drops

    @property
    def shown(self) -> dict[str, Any] | None:
        """What a view showed last of the clusters that count; None where another has come since."""
        return self._shown[1] if self._shown is not None and self._shown[0] == self._made_of else None

    def show(self, view: dict[str, Any]) -> None:
        """Keep what a view shows of the clusters that count."""
        self._shown = self._made_of, view

    def fused(self, weighting: Weighting) -> Direction:
        """Direction from the clusters that count; worked out anew where another has come."""
        made_of = self._made_of
        if self._fused is None or self._fused[0] != made_of:
            self._fused = made_of, self._fuse(weighting)
        return self._fused[1]

    def _fuse(self, weighting: Weighting) -> Direction:
        if weighting is not Weighting.BAYES:
            return weighted([self.clusters.reading(place) for place in self.counting], weighting)
        if not self.untrusted or len(self.counting) == self.count - self.first:
            return self._sum_of_all(self.count)
        if self._trusted is None:
            self._trusted = GrowingBayes()
        return self._trusted.of(self.first, self.count, self._trusted_readings)

    @property
    def lacks_newest(self) -> bool:
        """Whether the direction is that of all clusters that count, of which the newest alone is not in it yet."""
        return not self.untrusted and self._all.lacks_one(self.first, self.count)

    @staticmethod
    def add_newest(stations: Sequence[SurveyStation], readings: Stack) -> None:
        """Add to each of several stations its newest cluster, the one that it lacks."""
        GrowingBayes.grow_each([one._all for one in stations], readings)

    def known_before(self, place: int) -> Direction | None:
        """What the clusters before one came to, where it has not departed from them yet and that is known."""
        begin = self.first_before(place)
        is_open = begin < place and not self.clusters.knows_departure(place)
        return self._all.known(begin, place) if is_open else None

    def _sum_of_all(self, end: int) -> Direction:
        """Direction from the clusters before a place since the hole moved, whether they are believed or not."""
        return self._all.of(self.first_before(end), end, self._readings)

    def _readings(self, begin: int, end: int) -> Iterator[Reading]:
        return map(self.clusters.reading, range(begin, end))

    def _trusted_readings(self, begin: int, end: int) -> Iterator[Reading]:
        trust = self.clusters.column("trust")
        return (self.clusters.reading(place) for place in range(begin, end) if trust[place] == Trust.FULL)

    def departure(self, place: int) -> Departure | None:
        """How far the cluster at ``place`` departed from those before; None for the first of its hole."""
        if self.first_before(place) == place:
            return None
        known = self.clusters.departure(place)
        if known is None:
            known = departure_from(self._sum_of_all(place), self.clusters.reading(place))
            self.clusters.keep_departure(place, known)
        return known
