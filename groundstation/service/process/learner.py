"""From messages to what is known: stored first, all that came together at once, then learnt in their order."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

from groundstation.errors import StoreError
from groundstation.service.alarms.watch import Watch
from groundstation.service.answers.model import RigModel
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import StringKeeper
from groundstation.service.disk.moment_keeper import MomentKeeper
from groundstation.service.hole.deviation_alarms import DeviationAlarm
from groundstation.service.hole.resolving import Found
from groundstation.service.string.stored import Stored
from telemetry.messages import Event, Kept, StaticRecord, SurveyMeasurement

CHANGED_BY_SURVEY = ("measurements", "stations", "trajectory", "uncertainty", "column")
ONCE_RESTED = ("adjustment", "setup")  # what all surveys say of each thing, which takes long to work out
RESTORED_TOGETHER = 256  # messages


class Learner:
    """Stores what comes and adds it to what is known.

    Parameters
    ----------
    store : open
    model : whose parts learn
    watch : that is told of it
    keeper : of the order of the string, by which measurements are placed
    """

    def __init__(self, store: Store, model: RigModel, watch: Watch, keeper: StringKeeper) -> None:
        self._store, self._watch, self._keeper = store, watch, keeper
        self._string, self._hole, self._placement = model.string, model.hole, model.placement
        self._orders, self._recalibration = model.orders, model.recalibration
        self._setup = model.setup
        self._moments = MomentKeeper(store, model.config, model.setup, model.hole)
        self._followed = 0  # version of the setup by which the hole is
        self._arrived: list[Stored[Kept]] = []  # since the last transaction
        # alarms of the hole, moves and stops of the string that were told
        self._known: tuple[list[DeviationAlarm], int, int] = ([], 0, 0)
        # versions of the hole at the last look, and as its adjustment was published
        self._rested = self._shown = model.hole.version
        self._by_survey = CHANGED_BY_SURVEY if model.wall is None else (*CHANGED_BY_SURVEY, "wall")

    def take(self, message: Kept) -> None:
        """A message has come, to be stored with those that come beside it, a measurement with the depth it has now."""
        md = below = None
        if isinstance(message, SurveyMeasurement):
            apart = self._apart(message) if self._string.doubled.places else message
            below = self._string.length_below(apart)
            md = None if below is None else self._string.depth_of(apart, below)
        self._arrived.append(Stored(message, md, below))

    def learn_arrived(self) -> tuple[list[Kept], list[str]]:
        """Store and learn what came together; returns what is on the disk now, to be acknowledged, and changed paths.

        What was stored already changes nothing; what is not stored is not acknowledged, and comes again. A measurement
        is fused at the next reading or look, with all that came meanwhile and in their order: whether a reading
        brackets its time already is a matter of a millisecond. Where one does, which is the rule, its row needs no
        second transaction.
        """
        if not self._arrived:
            return [], []  # the usual case: called after every event
        arrived, self._arrived = self._arrived, []
        try:
            are_new = self.store_arrived(arrived)
        except StoreError:
            for one in arrived:
                if isinstance(one.message, Event):
                    self._watch.on_known_event(one.message)
            return [], []
        changed: dict[str, None] = {}
        for one, is_new in zip(arrived, are_new, strict=True):
            if is_new:
                changed |= dict.fromkeys(self._learn(one))
                if isinstance(one.message, Event):
                    self._watch.on_event(one.message)
        return [one.message for one in arrived], list(changed)

    def store_arrived(self, arrived: list[Stored[Kept]]) -> list[bool]:
        """Put messages on the disk, with the order of the string that places them; which of them are new.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        self._keeper.keep_tally()
        return self._store.add_messages(arrived)

    def place_waiting(self) -> list[str]:
        """Fuse the measurements whose depth is known by now; returns the paths that changed."""
        placement = self._placement
        placeable = placement.take_placeable()
        moved: list[tuple[Kept, float | None]] = [(one.message, md) for one, md in placeable if one.md != md]
        moved += [(one.message, None) for one in placement.waiting if one.md is not None]
        try:
            if moved:
                self._store.place_messages(moved)
        except StoreError:
            placement.waiting += [one for one, _ in placeable]
            return []
        if moved:
            placement.waiting = [replace(one, md=None) for one in placement.waiting]
        if not placeable:
            return []
        measurements = [one.message for one, _ in placeable]
        found = placement.resolve_measurements(measurements, [md for _, md in placeable])
        for measurement, stop in zip(measurements, found, strict=True):
            self._place(measurement, stop)
        return sorted(self._by_survey)

    def find_consequences(self) -> list[str]:
        """Work out the hole, and return the paths of what changed with it: alarms of deviations, stops that ended.

        Measurements come one by one, tube by tube: to be asked at every look, and not for each of them.
        """
        hole = self._hole
        is_explained = hole.adopt_found()
        before, self._known = self._known, (list(hole.alarms.alarms), len(hole.moved), hole.history.count)
        self._moments.keep()
        paths = {
            "alarms": before[:2] != self._known[:2],
            "history": before[2] != self._known[2],
            **dict.fromkeys(ONCE_RESTED, self._has_rested()),
        }
        changed = [path for path, has_changed in paths.items() if has_changed]
        return sorted({*changed, *self._by_survey, *ONCE_RESTED, "alarms"}) if is_explained else changed

    def _has_rested(self) -> bool:
        """Whether no survey has come since the last look, and some before."""
        before, self._rested = self._rested, self._hole.version
        if not before == self._rested != self._shown:
            return False
        self._shown = self._rested
        return True

    def restore(self) -> None:
        """Go on with everything that was stored, some hundred messages at a time."""
        self._setup.add(self._store.told())
        self._hole.begin_anew(self._moments.recall())
        self._restore_messages()
        self._hole.catch_up()
        self.follow_setup()  # what a node says of its joints may stand in a later survey
        self.find_consequences()

    def follow_setup(self) -> list[str]:
        """Adjust the hole to what was told of the rig since; returns the paths that changed.

        Where the database cannot be read the hole stays as it is until it can.
        """
        version = self._setup.version
        if version == self._followed:
            return []
        damaged = self._store.damaged
        try:
            placed = [
                (message, one.md)
                for one in self._store.messages()
                if isinstance(message := one.message, SurveyMeasurement) and one.md is not None
            ]
            kept = self._moments.recall()
        except StoreError:
            return []
        self._store.damaged = damaged  # they were counted at the start
        self._hole.begin_anew(kept)
        for begin in range(0, len(placed), RESTORED_TOGETHER):
            some = placed[begin : begin + RESTORED_TOGETHER]
            found = self._placement.resolve_measurements([m for m, _ in some], [md for _, md in some])
            for (measurement, _), stop in zip(some, found, strict=True):
                if stop is not None and not self._string.doubled.is_held(measurement):
                    self._hole.add_stop(*stop, self._string.epoch_of(measurement))
        self._string.on_doubled()
        self._followed = version
        self._hole.catch_up()
        self.find_consequences()
        return sorted({*self._by_survey, "setup", "alarms", "history", "verdict", "status"})

    def _restore_messages(self) -> None:
        """Learn everything that was stored."""
        self._followed = self._setup.version
        messages = self._store.messages()
        while some := list(itertools.islice(messages, RESTORED_TOGETHER)):
            placed = {
                place: (one.message, one.md)
                for place, one in enumerate(some)
                if isinstance(one.message, SurveyMeasurement) and one.md is not None
            }
            measurements, mds = [m for m, _ in placed.values()], [md for _, md in placed.values()]
            found = dict(zip(placed, self._placement.resolve_measurements(measurements, mds), strict=True))
            for place, one in enumerate(some):
                if place in placed:
                    measurement = placed[place][0]
                    apart = self._apart(measurement) if self._string.doubled.places else measurement
                    self._setup.on_flags(apart.tube, apart.hops, apart.flags)
                    self._string.numbers.add_number(one.message.tube, one.message.sequence)
                    self._place(placed[place][0], found[place])
                else:
                    self._learn(one)

    def _learn(self, one: Stored[Kept]) -> Sequence[str]:
        """Add a stored message to what is known, a measurement to those that wait; returns the paths that changed."""
        message = one.message
        self._string.numbers.add_number(message.tube, message.sequence)
        match message:
            case Event():
                self._string.events.append_row(message)
                self._orders.on_event(message)
                self._watch.on_known_event(message)
                return ("events",)
            case StaticRecord():
                self._string.static_records.append_row(message)
                self._orders.on_static_record(message)
                self._recalibration.on_static_record(message)
                return ("static_records",)
            case SurveyMeasurement():
                apart = self._apart(message) if self._string.doubled.places else message
                self._setup.on_flags(apart.tube, apart.hops, apart.flags)
                self._string.on_measurement(apart, is_placed=False)
                self._watch.on_measurement(message, self._placement.wait_for_depth(Stored(message, one.md, one.below)))
                return self._by_survey

    def _apart(self, measurement: SurveyMeasurement) -> SurveyMeasurement:
        """A measurement under the number by which its tube is known; asked for where a number is doubled at all."""
        return self._string.doubled.survey_apart(measurement)

    def _place(self, measurement: SurveyMeasurement, found: Found | None) -> None:
        """Give the hole what a measurement was resolved to."""
        apart = self._apart(measurement) if self._string.doubled.places else measurement
        self._string.on_measurement(apart, is_placed=True)
        self._watch.on_measurement(measurement, self._placement.place(measurement, found))
