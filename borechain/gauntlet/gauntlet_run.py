"""One seed of the gauntlet: what it draws, what came of it, and the fewest faults that still make it fail."""

from __future__ import annotations

import hashlib
import math
import shutil
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from borechain.drilling.rare_collection import rare_collection
from borechain.gauntlet.covered_states import CoveredStates, Pair
from borechain.gauntlet.fault_observability import FaultObservability
from borechain.gauntlet.gauntlet_rig import PLANS, GauntletRig, make_ready, new_rig
from borechain.gauntlet.oracles import Observer, find_violations
from borechain.gauntlet.seams import drawn_seams, opened_seams
from borechain.gauntlet.wellness import still_unwell
from sim.gauntlet.fault_kinds import KINDS, SEALED
from sim.gauntlet.plan import drawn_kinds, steps_of
from sim.rig.report import station_digest
from sim.studies.pool import over_cores

ALL = tuple(kind.name for kind in KINDS)
USUAL = "minute"
WORTH_A_PROCESS = 50  # seeds, for which a process more is started
BATCH = 200  # seeds whose outcomes are given at a time
ANSWERED_AFTER = (20.0, 40.0)  # s of calm, after which the crew answers what the last fault has raised
FEW = 2  # kinds of faults that may never mislead the crew without a word, whatever can be seen


class SeedJob(NamedTuple):
    """What of a seed is run.

    Attributes
    ----------
    allowed : kinds of faults that it draws from
    kinds : that are switched on instead, whatever it draws
    has_seams : the seams that it draws are opened while its faults last
    covers : pairs of facts are noted
    """

    seed: int
    allowed: Sequence[str] = ALL
    kinds: Sequence[str] | None = None
    plan: str = USUAL
    has_seams: bool = False
    covers: bool = False


@dataclass(slots=True)
class SeedOutcome:
    """Outcome of a seed; ``schedule`` lists the acts of the faults with their time, s of the run."""

    seed: int
    kinds: tuple[str, ...]
    plan: str = USUAL
    seams: dict[str, float] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)
    digest: str = ""
    alarms: list[str] = field(default_factory=list)
    cleared: list[str] = field(default_factory=list)
    told: dict[str, float] = field(default_factory=dict)  # s after the first fault, by alarm
    measurements: int = 0
    schedule: list[str] = field(default_factory=list)
    pairs: set[Pair] = field(default_factory=set)  # of facts that were true at once, where they are noted
    cpu_s: float = field(default=0.0, compare=False)


def run_seed(
    seed: int,
    allowed: Sequence[str] = ALL,
    kinds: Sequence[str] | None = None,
    plan: str = USUAL,
    has_seams: bool = False,
    covers: bool = False,
) -> SeedOutcome:
    """Drill under the faults of a seed and judge; arguments as ``SeedJob``."""
    outcome = SeedOutcome(seed, tuple(drawn_kinds(seed, allowed) if kinds is None else kinds), plan)
    outcome.seams = drawn_seams(seed) if has_seams else {}
    make_ready(plan, [seed])
    began = time.process_time()
    folder = Path(tempfile.mkdtemp(prefix="gauntlet-"))
    try:
        with rare_collection():
            rig = new_rig(plan, seed, folder, sealed=not SEALED.isdisjoint(outcome.kinds))
            covered = CoveredStates(rig) if covers else None
            _run(rig, outcome, [covered.look] if covered is not None else [])
            outcome.pairs = set() if covered is None else covered.pairs
            rig.close()
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        outcome.violations.append(f"died: {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    outcome.cpu_s = time.process_time() - began
    return outcome


def judge_seed(job: SeedJob) -> SeedOutcome:
    """Outcome of one seed, shrunk where it fails."""
    outcome = run_seed(*job)
    return shrink_outcome(outcome) if outcome.violations else outcome


def judge_seeds(jobs: Sequence[SeedJob]) -> Iterator[SeedOutcome]:
    """Outcomes of many seeds on all cores, in order."""
    with over_cores(len(jobs) // WORTH_A_PROCESS, lambda: None) as run_all:
        for batch in (jobs[k : k + BATCH] for k in range(0, len(jobs), BATCH)):
            yield from run_all(judge_seed, batch)


def shrink_outcome(outcome: SeedOutcome) -> SeedOutcome:
    """Return the failing seed with the fewest kinds that still make it fail."""
    kept, worst = list(outcome.kinds), outcome
    for name in outcome.kinds:
        fewer = [other for other in kept if other != name]
        tried = (
            run_seed(outcome.seed, kinds=fewer, plan=outcome.plan, has_seams=bool(outcome.seams)) if fewer else worst
        )
        if fewer and tried.violations:
            kept, worst = fewer, tried
    return worst


def _run(rig: GauntletRig, outcome: SeedOutcome, looks: Sequence[Callable[[], None]] = ()) -> None:
    chosen, world = PLANS[outcome.plan], rig.world
    begin = world.begin + chosen.rested
    until = world.end - chosen.calm
    steps = steps_of(outcome.seed, outcome.kinds, begin + chosen.after_begin, until, recovers=not chosen.calm)
    outcome.schedule = [f"{step.at - begin:.1f} s {name}" for name, step in steps]
    is_of_few = len(outcome.kinds) <= FEW
    observer, sight = Observer(rig, steps[0][1].at, of_few=is_of_few), FaultObservability(rig)

    def look() -> None:
        for one in (observer.look, *looks):
            one()

    with opened_seams(outcome.seams):
        rig.drill([step for _, step in steps], look, until if chosen.calm else math.inf)
    if chosen.calm:
        rig.repair()
        for after in ANSWERED_AFTER:
            rig.advance(until + after, look)
            rig.answer_alarms()
        rig.advance(math.inf, look)
    outcome.told = observer.told
    if rig.ground is None:
        outcome.violations = ["the ground station is not there at the end"]
        return
    rows = _alarms(rig)
    outcome.digest = hashlib.sha256(
        f"{station_digest(rig.inline.ask('stations')['stations'])}{rows}".encode()
    ).hexdigest()
    outcome.alarms = sorted({code for code, _, _, standing in rows if standing})
    outcome.cleared = sorted({code for code, _, _, standing in rows if not standing})
    outcome.measurements = len(rig.inline.ask("measurements")["measurements"])
    outcome.violations = [
        *observer.found,
        *(still_unwell(rig) if chosen.calm else ()),
        *find_violations(
            rig,
            observer.told,
            encoder_can_be_judged=is_of_few or (sight.has_seen and not sight.nobody_could_know),
            depth_can_be_judged=is_of_few or not sight.has_believed_a_wrong_depth,
        ),
    ]


def _alarms(rig: GauntletRig) -> list[tuple[str, str, int, bool]]:
    """Code, subject and count of every alarm, and whether it stands."""
    shown: dict[str, Any] = rig.inline.ask("alarms")
    return [
        (row["code"], row["subject"], row["count"], key == "rig")
        for key in ("rig", "rig_cleared")
        for row in shown[key]
    ]
