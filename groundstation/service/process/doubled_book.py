"""That two tubes give themselves one number, written down when it is found, so that it stands until one is told."""

from __future__ import annotations

import datetime

from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import refusing_disk
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.told_value import SetupKind, ToldValue
from groundstation.service.string.doubled_numbers import NumberWatch
from telemetry.messages import NodeState


class DoubledBook:
    """Finds numbers of two tubes in the states that come, and puts them into the book of the setup.

    Parameters
    ----------
    store : that keeps the book
    setup : the book
    by : name under which it is written down
    """

    def __init__(self, store: Store, setup: SetupBook, by: str) -> None:
        self._store, self._setup, self._by = store, setup, by
        self._watch = NumberWatch()

    def state_apart(self, state: NodeState) -> NodeState:
        """A state under the number by which its tube is known, once its own is looked at."""
        self._find(state)
        return self._setup.doubled.state_apart(state)

    def _find(self, state: NodeState) -> None:
        found, setup = self._watch.find_places(state), self._setup
        if found is None or (state.tube in setup.doubled and setup.doubled.newest(state.tube).is_same(found)):
            return
        values = (float(found.epoch), found.at, float(found.upper), float(found.lower))
        utc = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        entry = ToldValue(setup.next_number(), SetupKind.DOUBLED, str(state.tube), values, 1.0, self._by, utc)
        with refusing_disk():
            self._store.keep_told(entry)
        setup.add([entry])
