"""What was known of a hole at the end of every stop, kept on the disk: an adjusted hole is slow to work out again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

from groundstation.config import GroundConfig
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import refusing_disk
from groundstation.service.hole.history import Few, Moment
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.told_value import told_to_text

ELSEWHERE = {
    "rig", "folder", "database_url", "key_file", "keys", "steering_deg_per_m", "wall", "hole", "stale_after",
    "depth_rate", "depth_gap", "survey_after",
}  # fmt: skip  # of the configuration, on which no deviation rests


class MomentKeeper:
    """Keeps the history of a hole.

    Parameters
    ----------
    store : open
    config, setup : on which the moments rest
    hole : whose history is kept
    """

    def __init__(self, store: Store, config: GroundConfig, setup: SetupBook, hole: SurveyedHole) -> None:
        self._store, self._setup, self._hole = store, setup, hole
        self._settings = json.dumps(config.model_dump(mode="json", exclude=ELSEWHERE), sort_keys=True)
        self._kept: dict[int, Few | None] = {}  # what the database has; None of what rests on something else

    @property
    def basis(self) -> str:
        """Digest of all that moments rest on beside the surveys: what was told, and what is assumed."""
        told = [told_to_text(entry) for entry in self._setup.entries]
        return hashlib.sha256(json.dumps([self._settings, *told]).encode()).hexdigest()

    def recall(self) -> Sequence[Moment]:
        """Moments that were kept and rest on what is told now.

        Raises
        ------
        StoreError
            When the database cannot be read.
        """
        if not self._hole.is_adjusted:
            return ()
        moments = self._store.moments(self.basis)
        self._kept = dict.fromkeys(self._store.moment_numbers()) | {one.number: one.found for one in moments}
        return moments

    def keep(self) -> None:
        """Store the moments that are new, and drop those that the history does not have any more."""
        if not self._hole.is_adjusted:
            return
        moments = self._hole.history.moments
        changed = [one for one in moments if self._kept.get(one.number) is not one.found]
        dropped = self._kept.keys() - {one.number for one in moments}
        if changed or dropped:
            with refusing_disk():
                self._store.keep_moments(self.basis, changed, dropped)
                self._kept = {one.number: one.found for one in moments}
