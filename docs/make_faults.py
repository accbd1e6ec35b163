"""Run every kind of fault by itself and write ``faults.md``: ``python docs/make_faults.py [SEEDS]``, a minute."""

from __future__ import annotations

import math
import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]

from make_tables import table  # noqa: E402

from borechain.gauntlet.gauntlet_rig import LOOK_EVERY  # noqa: E402
from borechain.gauntlet.gauntlet_run import SeedOutcome, run_seed  # noqa: E402
from sim.gauntlet.expected_doubts import EXPECTED  # noqa: E402
from sim.gauntlet.fault_kinds import ANSWERS, KINDS, FaultKind  # noqa: E402

SEEDS = 4
PAGE = """# Faults

Each kind of fault of `borechain gauntlet` by itself, {seeds} seeds a kind, on a string of two tubes that drills and
takes one survey with each tube. The columns:

* what happens, and what the system does;
* surveys in the trajectory at the end, a seed each: two are due; a tube that takes a fault for a motion adds one;
* alarms that the crew saw after the fault began, and the latest time of each
  ([what they mean](operate.md#what-the-crew-is-told), looked at every {every:.0f} s); a kind without an alarm is made
  good by repetition;
* the time within which everything that can be repaired is, and the crew knows what was lost; of a deception, which
  nothing contradicts but the other tubes, what it makes wrong.

Made by `python docs/make_faults.py`.

{table}"""


def row_of(kind: FaultKind, outcomes: list[SeedOutcome]) -> tuple[str, ...]:
    """One line of the table."""
    times = {code: max(o.told.get(code, 0.0) for o in outcomes) for o in outcomes for code in o.told}
    told = ", ".join(f"`{code}` {math.ceil(s)} s" for code, s in sorted(times.items()))
    surveys = ", ".join(str(outcome.measurements) for outcome in outcomes)
    wrong = "; ".join(sorted({text for outcome in outcomes for text in outcome.violations})) or "nothing"
    well = f"{EXPECTED[kind.name].misleads} wrong to the end" if kind.name in EXPECTED else f"{kind.recovery:.0f} s"
    return f"`{kind.name}`", kind.meaning, ANSWERS[kind.name], surveys, told or "none", well, wrong


def page(seeds: int) -> str:
    """The page, from as many seeds a kind."""
    rows = [row_of(kind, [run_seed(seed, kinds=[kind.name]) for seed in range(1, seeds + 1)]) for kind in KINDS]
    head = (
        *("fault", "what happens", "what the system does", "surveys of 2"),
        *("alarms, within", "well again within", "wrong without a flag"),
    )
    return PAGE.format(seeds=seeds, every=LOOK_EVERY, table=table(head, rows))


if __name__ == "__main__":
    (DOCS / "faults.md").write_text(page(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS))
