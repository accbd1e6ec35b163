"""What a crew's screen knows of a rig, and how old it is. No terminal, no bus.

Every answer is aged by when it arrived here: a ground station that is frozen sends nothing, and what it said last is
then worth nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

View = dict[str, Any]
FRESH_WITHOUT_WORD = 4.5  # s, until a ground station has said how long its verdict is good
PATHS = (
    "status",
    "verdict",
    "string",
    "column",
    "wall",
    "alarms",
    "orders",
    "setup",
    "adjustment",
)  # asked for at the beginning
NODES = "nodes/"
MILD, SERIOUS, GRAVE = "notice", "degraded", "bad"
KEEP_OUT = "do not drill on by this screen until the cause is mended"
UNKNOWN_VERDICT: View = {
    "verdict": "dont_know",
    "by_surveys": "dont_know",
    "todo": KEEP_OUT,
    "why": [],
    "off": None,
    "steer": None,
}


@dataclass(slots=True)
class Picture:
    """Newest answers of one ground station; times are seconds of the clock of the screen."""

    rig: str
    answers: dict[str, View] = field(default_factory=dict)
    heard_at: float = -math.inf  # of anything that was published or answered
    verdict_at: float = -math.inf
    done: list[str] = field(default_factory=list)  # course of what was ordered here, the newest last

    def on_answer(self, path: str, view: View, now: float) -> None:
        """Take an answer that arrived at ``now``; an older one than is known changes nothing."""
        known = self.answers.get(path)
        self.heard_at = now
        if known is not None and view.get("revision", 0) < known.get("revision", 0) and view["utc"] < known["utc"]:
            return
        self.answers[path] = view
        if path == "verdict":
            self.verdict_at = now

    @property
    def missed(self) -> list[str]:
        """Paths of which a newer answer was published than is known: under load a bus drops some."""
        told = self.answers.get("changes")
        if told is None:
            return []
        changed_at = {row["path"]: row["changed_at"] for row in told["changes"]}
        return [path for path in PATHS if is_outdated(self.answers.get(path), told, changed_at.get(path, 0))]

    def age(self, now: float) -> float:
        """Seconds since anything was heard."""
        return now - self.heard_at

    def verdict(self, now: float) -> View:
        """The verdict, or DON'T KNOW once it is too old to count on."""
        found = self.answers.get("verdict")
        if found is None:
            return UNKNOWN_VERDICT | {"line": "DON'T KNOW: no ground station has been heard yet"}
        old = now - self.verdict_at
        if old <= float(found.get("good_for_s", FRESH_WITHOUT_WORD)):
            return found
        silent = f"no verdict from the ground station for {old:.0f} s"
        return found | {"verdict": "dont_know", "line": f"DON'T KNOW: {silent}", "todo": KEEP_OUT, "why": [silent]}

    def is_live(self, now: float) -> bool:
        """Whether what is shown can be counted on to be of now."""
        found = self.answers.get("verdict")
        good_for = FRESH_WITHOUT_WORD if found is None else float(found.get("good_for_s", FRESH_WITHOUT_WORD))
        return now - self.verdict_at <= good_for

    @property
    def status(self) -> View:
        """Newest status."""
        return self.answers.get("status", {})

    @property
    def alarms(self) -> list[View]:
        """Open alarms, the worst first."""
        return list(self.answers.get("alarms", {}).get("open", []))

    @property
    def orders(self) -> list[View]:
        """Newest orders, the oldest first."""
        return list(self.answers.get("orders", {}).get("orders", []))

    @property
    def nodes(self) -> list[View]:
        """State of each tube from the top down; one that has sent none has only its number and its age."""
        string = self.answers.get("string", {})
        found = []
        for row in string.get("tubes", []):
            node = self.answers.get(f"{NODES}{row['tube']}", {})
            found.append(row | node if node.get("revision", 0) >= string["revision"] else node | row)
        return found

    @property
    def lowest(self) -> int | None:
        """The tube at the bit."""
        rows = self.answers.get("string", {}).get("tubes", [])
        return int(rows[-1]["tube"]) if rows else None


def is_outdated(known: View | None, told: View, changed_at: int) -> bool:
    """Whether an answer is older than the last change of its path, or of an earlier start of the ground station."""
    if known is None or known["revision"] < changed_at:
        return True
    return bool(known["revision"] > told["revision"] and known["utc"] < told["utc"])
