"""What a check of a board finds: one line a part, good or not, with what was found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BoardFinding:
    """One line: the part, whether it is good, and what was found, or expected and found."""

    part: str
    good: bool
    text: str

    def as_object(self) -> dict[str, object]:
        """For JSON."""
        return {"part": self.part, "good": self.good, "text": self.text}


def good_finding(part: str, text: str) -> BoardFinding:
    """A part that is as it should be."""
    return BoardFinding(part, True, text)


def bad_finding(part: str, text: str) -> BoardFinding:
    """A part that is not."""
    return BoardFinding(part, False, text)
