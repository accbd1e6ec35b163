"""A log of one CAN joint in a format that foreign tools open: BLF, or ASC as text. A full disk ends the log alone."""

from __future__ import annotations

from pathlib import Path

import can

from telemetry.errors import MediumError

FORMATS = (".blf", ".asc")


class CanLog:
    """Every frame that crosses a joint, and the errors that its controller reports.

    Parameters
    ----------
    path : of the log; ``end`` is put behind its stem, for each port has a file of its own
    end : whose it is

    Raises
    ------
    MediumError
        When the file cannot be written.
    """

    def __init__(self, path: Path, end: str) -> None:
        self.path = path.with_stem(f"{path.stem}-{end}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._writer: can.io.generic.MessageWriter | None = can.Logger(self.path)
        except OSError as error:
            raise MediumError(f"log {self.path}: {error.strerror}") from error

    def write(self, message: can.Message) -> None:
        """Write a message to the log."""
        if self._writer is None:
            return
        try:
            self._writer.on_message_received(message)
        except OSError:
            self._writer = None

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.stop()
            self._writer = None


def log_path(text: str) -> Path:
    """Path of a log.

    Raises
    ------
    MediumError
        When its format is unknown.
    """
    path = Path(text)
    if path.suffix not in FORMATS:
        raise MediumError(f"medium can: log: expected a file {' or '.join(FORMATS)}, got {text or 'nothing'}")
    return path
