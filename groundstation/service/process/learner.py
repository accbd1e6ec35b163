"""From messages to the model: stored first, all that came together at once, then learnt in their order."""

from __future__ import annotations

import itertools
from dataclasses import replace

from groundstation.errors import StoreError
from groundstation.service.alarms.watch import Watch
from groundstation.service.answers.model import Prepared, RigModel
from groundstation.service.disk.ground_store import Store, Stored
from groundstation.service.disk.keeper import Keeper
from groundstation.service.hole.deviation_alarms import Alarm
from groundstation.service.string.stands import take_survey
from telemetry.messages import Event, Kept, StaticRecord, SurveyMeasurement

CHANGED_BY_SURVEY = ("measurements", "stations", "trajectory", "uncertainty", "column")
RESTORED_TOGETHER = 256  # messages


class Learner:
    """Stores what comes and adds it to a model.

    Parameters
    ----------
    store : open
    model, watch : that learn
    keeper : of the order of the string, by which surveys are placed
    """

    def __init__(self, store: Store, model: RigModel, watch: Watch, keeper: Keeper) -> None:
        self._store, self._model, self._watch, self._keeper = store, model, watch, keeper
        self._arrived: list[Stored] = []  # since the last transaction
        self._known: tuple[list[Alarm], int, int] = ([], 0, 0)  # alarms of the hole, moves and stops that were told
        self._by_survey = (*CHANGED_BY_SURVEY, *(["wall"] if model.wall is not None else []))

    def take(self, message: Kept) -> None:
        """A message has come; it is stored with those that come beside it, a survey with the depth that it has now."""
        md = below = None
        if isinstance(message, SurveyMeasurement):
            below = self._model.string_below(message)
            md = None if below is None else self._model.depth_of(message, below)
        self._arrived.append(Stored(message, md, below))

    def learn_arrived(self) -> tuple[list[Kept], list[str]]:
        """Store and learn what came together; returns what is on the disk now, to be acknowledged, and changed paths.

        What was stored already changes nothing; what is not stored is not acknowledged, and comes again. A survey is
        fused at the next reading or look, with all that came meanwhile and in their order: whether a reading brackets
        its time already is a matter of a millisecond. Where one does, the usual case, its row needs no second
        transaction.
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
                changed |= dict.fromkeys(self._learn(one.message, None, one.below, kept=one.md))
                if isinstance(one.message, Event):
                    self._watch.on_event(one.message)
        return [one.message for one in arrived], list(changed)

    def store_arrived(self, arrived: list[Stored]) -> list[bool]:
        """Put messages on the disk, with the order of the string that places them; which of them are new.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        self._keeper.keep_tally()
        return self._store.add_messages(arrived)

    def place_waiting(self) -> list[str]:
        """Fuse the surveys whose depth is known by now; returns the paths that changed."""
        model = self._model
        placeable = model.placeable()
        moved: list[tuple[Kept, float | None]] = [(one.measurement, md) for one, md in placeable if one.kept != md]
        moved += [(one.measurement, None) for one in model.waiting if one.kept is not None]
        try:
            if moved:
                self._store.place_messages(moved)
        except StoreError:
            model.waiting += [one for one, _ in placeable]
            return []
        if moved:
            model.waiting = [replace(one, kept=None) for one in model.waiting]
        return sorted({path for one, md in placeable for path in self._learn(one.measurement, md, one.below)})

    def find_consequences(self) -> list[str]:
        """Work out the hole, and return the paths of what changed with it: alarms of deviations, stops that ended.

        Surveys come one by one, tube by tube: to be asked at every look, and not for each of them.
        """
        hole = self._model.hole
        before, self._known = self._known, (list(hole.alarms.alarms), len(hole.moved), hole.history.count)
        paths = {"alarms": before[:2] != self._known[:2], "history": before[2] != self._known[2]}
        return [path for path, has_changed in paths.items() if has_changed]

    def restore(self) -> None:
        """Go on with everything that was stored, some hundred messages at a time."""
        messages = self._store.messages()
        while some := list(itertools.islice(messages, RESTORED_TOGETHER)):
            placed = {
                place: one.message
                for place, one in enumerate(some)
                if isinstance(one.message, SurveyMeasurement) and one.md is not None
            }
            prepared = dict(zip(placed, self._model.prepare(list(placed.values())), strict=True))
            for place, one in enumerate(some):
                self._learn(one.message, one.md, one.below, prepared.get(place))
        self.find_consequences()

    def _learn(
        self,
        message: Kept,
        md: float | None,
        below: float | None,
        prepared: Prepared | None = None,
        kept: float | None = None,
    ) -> tuple[str, ...]:
        """Add a stored message to the model; returns the paths that changed."""
        model = self._model
        model.numbers.add_number(message.tube, message.sequence)
        if isinstance(message, Event):
            model.on_event(message)
            self._watch.on_known_event(message)
            return ("events",)
        if isinstance(message, StaticRecord):
            model.on_static_record(message)
            return ("static_records",)
        epoch = message.epoch or model.epoch
        model.stops.on_survey(epoch, message.station_at, message.tube)
        if md is not None:
            take_survey(model.depths, model.stops, epoch, message.station_at)
        self._watch.on_survey(message, model.on_survey(message, md, below, prepared, kept))
        return self._by_survey
