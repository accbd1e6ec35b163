"""Run every kind of fault by itself and write ``faults.md``: ``python docs/make_faults.py [SEEDS]``, some minutes."""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]

from make_tables import table  # noqa: E402

from borechain.gauntlet.run import Outcome, run_seed  # noqa: E402
from sim.gauntlet.kinds import KINDS, FaultKind  # noqa: E402

SEEDS = 2
PAGE = """# Faults

Each kind of fault of `borechain gauntlet` by itself, {seeds} seeds a kind: what happens, how many of the three surveys
of the schedule the ground station had at the end, and which alarms the crew saw meanwhile
([what they mean](operate.md#what-the-crew-is-told)). A new tube is silent and does not know its yaw until it is screwed
on, so `tube_silent` and `tube_sensor` come in every run and are left out here. Made by `python docs/make_faults.py`.

{table}"""
USUAL = {"tube_silent", "tube_sensor"}


def row_of(kind: FaultKind, outcomes: list[Outcome]) -> tuple[str, ...]:
    """One line of the table."""
    alarms = sorted({alarm for outcome in outcomes for alarm in outcome.alarms} - USUAL)
    surveys = ", ".join(str(outcome.measurements) for outcome in outcomes)
    wrong = "; ".join(sorted({text for outcome in outcomes for text in outcome.violations})) or "nothing"
    return f"`{kind.name}`", kind.meaning, surveys, ", ".join(f"`{alarm}`" for alarm in alarms) or "none", wrong


def page(seeds: int) -> str:
    """The page, from as many seeds a kind."""
    rows = [row_of(kind, [run_seed(seed, kinds=[kind.name]) for seed in range(1, seeds + 1)]) for kind in KINDS]
    head = ("fault", "what happens", "surveys of 3, each seed", "alarms", "wrong without a flag")
    return PAGE.format(seeds=seeds, table=table(head, rows))


if __name__ == "__main__":
    (DOCS / "faults.md").write_text(page(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS))
