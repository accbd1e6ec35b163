"""What every calibration answers: the object for JSON, the text of its file, its sheet and its figures."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.report.sheet import Sheet
from telemetry.errors import CalibrationError

if TYPE_CHECKING:  # figures need an extra package, and are drawn when asked for
    from groundstation.report.figure_panels import Panel


@dataclass(frozen=True, slots=True)
class CalibrationOutcome:
    """A calibration: the JSON object, the text of its file, its sheet and its figures, drawn when asked for."""

    result: dict[str, Any]
    document: str
    block_sha256: str | None
    record_sha256: str
    sheet: Sheet
    panels: Callable[[], Sequence[Panel]]
    gyroscope_document: str | None = None  # of a record that calibrates two sensors


@contextlib.contextmanager
def naming_file(file: Path) -> Iterator[None]:
    """Put the name of the file in front of what the mathematics refuses."""
    try:
        yield
    except CalibrationError as error:
        raise CalibrationError(f"{file.name}: {error}") from error
