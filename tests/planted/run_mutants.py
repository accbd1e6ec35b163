"""Judges mutants of the pure modules by the tests that import them, a sample drawn by a seed.

``make mutation`` runs it. Ends with 1 where fewer than ``--at-least`` percent are noticed, and with 2 where a test
fails without any change. Of those that survive each is named with its line, to be read.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections import defaultdict
from pathlib import Path

from defect_lists import ROOT, DefectError
from mutants import Mutant, drawn_below, drawn_mutants, drawn_of_trusted
from run_planted import LIBRARIES, PASSES, judge_all


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=300, help="of the sample")
    parser.add_argument("--seed", type=int, default=52, help="that draws it")
    parser.add_argument("--trusted", action="store_true", help="of service, store, link and keys, statements too")
    parser.add_argument("--under", default="", metavar="PLACES", help="of these files and folders, parted by commas")
    parser.add_argument("--list", dest="listed", action="store_true", help="name them, and judge nothing")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="at a time")
    parser.add_argument("--fast", action="store_true", help="without the tests that are marked slow")
    parser.add_argument("--only", default="", metavar="PATTERN", help="those whose line holds it")
    parser.add_argument("--at-least", type=float, default=85.0, metavar="PERCENT", help="that are to be noticed")
    parser.add_argument("--out", type=Path, help="file of the survivors, a line each")
    arguments = parser.parse_args()
    for library in LIBRARIES.split():
        importlib.import_module(library)
    mutants = [one for one in drawn_as_asked(arguments) if arguments.only in one.name]
    if arguments.listed:
        print("\n".join(f"{one.package}  {one.name}" for one in mutants))
        return 0
    found: dict[str, list[bool]] = defaultdict(list)
    survivors = []
    try:
        for outcome in judge_all(mutants, max(arguments.jobs, 1), PASSES[:1] if arguments.fast else PASSES):
            for name in (outcome.defect.package, "all"):
                found[name].append(outcome.is_found)
            verdict = "found" if outcome.is_found else "SURVIVES"
            print(f"{outcome.seconds:5.1f} s  {verdict}  {outcome.defect.name}", flush=True)
            survivors += [] if outcome.is_found else [outcome.defect.name]
    except DefectError as error:
        print(error, file=sys.stderr)
        return 2
    for name, rows in sorted(found.items(), key=lambda row: (row[0] == "all", row[0])):
        print(f"{sum(rows):4} of {len(rows):3}  {100 * sum(rows) // len(rows):3} %  {name}")
    if arguments.out:
        arguments.out.write_text("".join(f"{name}\n" for name in sorted(survivors)), encoding="utf-8")
    return 0 if 100.0 * sum(found["all"]) >= arguments.at_least * len(found["all"]) else 1


def drawn_as_asked(arguments: argparse.Namespace) -> list[Mutant]:
    """The sample that the options ask for."""
    if arguments.under:
        return drawn_below(ROOT, arguments.under.split(","), arguments.size, arguments.seed)
    return (drawn_of_trusted if arguments.trusted else drawn_mutants)(ROOT, arguments.size, arguments.seed)


if __name__ == "__main__":
    sys.exit(main())
