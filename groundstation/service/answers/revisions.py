"""What tells a holder of an answer that a newer one is to be had: the revision, and when each path changed. No I/O."""

from __future__ import annotations

from collections.abc import Iterable

BEATS = ("verdict", "changes")  # paths that are published without end


class Revisions:
    """Revision of what is known, which grows with everything that comes in and with all that is published.

    Attributes
    ----------
    newest : revision now
    changed_at : revision at which each path without a number changed last
    """

    def __init__(self) -> None:
        self.newest = 0
        self.changed_at: dict[str, int] = {}

    def on_event(self) -> None:
        """Something has come in."""
        self.newest += 1

    def on_published(self, paths: Iterable[str]) -> None:
        """Paths have changed and are published."""
        self.newest += 1
        self.changed_at |= {path: self.newest for path in paths if "/" not in path and path not in BEATS}
