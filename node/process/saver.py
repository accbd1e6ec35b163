"""When a node saves: at every event, when a saved rest ends, and slowly otherwise.

What must not be lost makes an event, a survey or a reply, and each is on the disk before its frame leaves: a
number that was sent is never given to another message. A node that has something to tell in every cycle would wear its
flash: after ``AT_ONCE`` saves in a row there is one every ``SPACING`` cycles, and what is told waits for it. What
changes without an event is worth little after a cut: a yaw at rest stands still, a yaw while turning is void, and the
bias that wanders is another one after a quarter of a minute.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from node.errors import SavedStateError
from node.firmware.saved_layouts import CarriedState
from node.kernels.arithmetic.formats import Array
from node.process.journal import SLOTS, Journal
from telemetry.application.endpoint_state import STATE_LAYOUT, UNOWNED, layout_of, owner_of
from telemetry.messages import Scalar, Severity
from telemetry.runtime.disk import MACHINE, Disk

SAVE_EVERY: Final = 570  # cycles without any other save, 300 s
RETRY_EVERY: Final = 57  # cycles until a save that the disk refused is tried again, 30 s

AT_ONCE: Final = 32  # saves that may follow each other cycle by cycle; a busy station makes six
SPACING: Final = 19  # cycles, 10 s, after which there may be one more

Say = Callable[[Severity, str, dict[str, Scalar]], None]


class Saver:
    """Saved state of one node in ``folder``.

    Parameters
    ----------
    folder, disk : where it is
    tube : whose state is loaded; that of another is not

    Attributes
    ----------
    fault : why nothing was loaded although there was something, or empty
    is_of_another : what was there is another tube's
    due : what must not be lost waits for the end of this cycle or frame
    """

    def __init__(self, folder: Path, disk: Disk = MACHINE, tube: int | None = None) -> None:
        self._tube = tube
        self._journal = Journal(folder, disk=disk)
        self._cycles = 0  # since the last save
        self._allowed = AT_ONCE  # saves that may still follow at once
        self._spaced = 0  # cycles since the newest of these was allowed
        self._saved_still = False
        self._refused = ""  # why the last save failed
        self._told_refused = False
        self._told_worn = 0
        self.fault = ""
        self.is_of_another = False
        self.due = False

    @property
    def spent(self) -> bool:
        """So many saves followed each other that the next one waits, for less than ``SPACING`` cycles."""
        return self._allowed == 0

    def load(self) -> tuple[Array, bytes] | None:
        """Record and telemetry blob of the newest good slot, or None where there is none that can be read."""
        try:
            saved = self._journal.load()
        except SavedStateError as error:
            self.fault = str(error)
            return None
        if saved is not None and (layout := layout_of(saved[1])) not in (STATE_LAYOUT, UNOWNED):
            self.fault = f"saved state: expected telemetry of layout {STATE_LAYOUT}, got {layout}"
            return None
        owner = None if saved is None or self._tube is None else owner_of(saved[1])
        if owner not in (None, self._tube):
            self.fault = f"it is that of tube {owner}: was a board, a card or a folder exchanged?"
            self.is_of_another = True
            return None
        self._saved_still = saved is not None and is_still(saved[0])
        return saved

    def save(self, nodes: Array, blob: bytes) -> None:
        """Save now. A disk that refuses does not end the node: it runs on and reports it (``report``)."""
        self.due, self._cycles, self._allowed = False, 0, max(self._allowed - 1, 0)
        try:
            self._journal.save(nodes, blob)
        except OSError as error:
            self._refused = str(error)
        else:
            self._refused, self._told_refused = "", False
            self._saved_still = is_still(nodes)

    def count_cycle(self, nodes: Array) -> None:
        """A cycle ended: save if the last save was long ago, or shows a rest that is over.

        A node that wakes believes a saved rest, so the newest slot must not show one while the string turns.
        """
        self._cycles += 1
        self._spaced += 1
        if self._spaced >= SPACING:
            self._spaced, self._allowed = 0, min(self._allowed + 1, AT_ONCE)
        rest_is_over = self._saved_still and not is_still(nodes)
        if rest_is_over:
            self._allowed = max(self._allowed, 1)
        limit = RETRY_EVERY if self._refused else SAVE_EVERY
        if self._cycles >= limit or rest_is_over:
            self.due = True

    @property
    def carried(self) -> CarriedState | None:
        """How much of what was loaded was carried over from another layout; None where it is of the present one."""
        return self._journal.carried

    @property
    def is_refused(self) -> bool:
        """Whether the disk refused the newest save."""
        return bool(self._refused)

    def report(self, say: Say) -> None:
        """Say once what the disk refused."""
        worn = self._journal.worn
        if len(worn) > self._told_worn:
            slots = ", ".join(map(str, sorted(worn)))
            say(Severity.WARNING, "saved_slot_worn", {"slots": slots, "left": SLOTS - len(worn)})
        self._told_worn = max(self._told_worn, len(worn))
        if self._refused and not self._told_refused:
            self._told_refused = True
            say(Severity.ERROR, "state_not_saved", {"detail": self._refused[:200]})


def is_still(nodes: Array) -> bool:
    """Whether a node that wakes with this record keeps its yaw."""
    return int(nodes[0]["filter"]["still_cycles"]) > 0
