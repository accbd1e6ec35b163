"""What is known of a string beside its messages, kept on the disk as it changes: order, joints, stands, doubts."""

from __future__ import annotations

import contextlib

from groundstation.errors import StoreError
from groundstation.service.disk.ground_store import Store
from groundstation.service.string.known_string import KnownString
from groundstation.service.string.stands import take_stand
from telemetry.messages import DepthReading, Stand


def refusing_disk() -> contextlib.suppress:
    """Go on where the disk refuses: the store remembers why, and the next look tells it."""
    return contextlib.suppress(StoreError)


class StringKeeper:
    """Keeps what is known of a string, and starts it with what was kept.

    Parameters
    ----------
    store : open
    string : new; it goes on with what the store holds of it
    """

    def __init__(self, store: Store, string: KnownString) -> None:
        self._store, self._string = store, string
        self._stand: Stand | None = None  # that was kept last
        string.time.epoch = store.epoch()
        string.restore_tubes(store.tally())
        self._tally = list(string.tubes)
        self._joints = store.joints()
        string.joints.known.update(self._joints)
        self._doubt = store.depth_doubt()
        string.depths.recall(self._doubt)
        for stand in store.stands():
            take_stand(string.depths, string.stops, stand)
        string.depths.restore(list(string.depths.stands))

    def keep_tally(self) -> None:
        """Store a new order of the string before anything is placed by it.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        if self._string.tubes != self._tally:
            self._store.keep_tally(list(self._string.tubes))
            self._tally = list(self._string.tubes)

    def keep_joints(self) -> None:
        """Store the angle of a joint when it is known first.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        if self._string.joints.known != self._joints:
            self._store.keep_joints(self._string.joints.known)
            self._joints = dict(self._string.joints.known)

    def keep_depth_doubt(self) -> None:
        """Store when depths begin to be refused after a jump, and when they no longer are."""
        doubt = self._string.depths.doubt
        if doubt != self._doubt:
            with refusing_disk():
                self._store.keep_depth_doubt(doubt)
                self._doubt = doubt

    def keep_stand(self, reading: DepthReading) -> None:
        """Store a stand when it begins and when it has ended."""
        stands = self._string.depths.stands
        newest, kept = stands[-1] if stands else None, self._stand
        has_begun = newest is not None and (kept is None or newest.begun_at != kept.begun_at)
        has_ended = newest is not None and reading.md != newest.md and newest != kept
        if newest is not None and (has_begun or has_ended):
            with refusing_disk():
                for stand in stands[-2:]:
                    self._store.keep_stand(stand)
                self._stand = newest
