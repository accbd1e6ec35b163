"""Reads changed files for a time and tells what is raised beside errors of ours: ``run_fuzz.py --seconds 60``.

Each group (recordings, tools, scenarios, tables) has its time. Refused is what a command would print as a line; what
raises anything else is kept as a file. The memory of the process may grow by what is stated and no more.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import resource
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from file_readers import COMPANIONS, GROUPS, FileKind
from mutations import mutate

from telemetry.errors import BorechainError

GROWTH_MB = 300.0  # of the most that was in memory, after the first files
WARM = 50  # files
SLOW_S = 20.0  # of one file, which is told as well


def peak_mb() -> float:
    """Most memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def read_changed(kind: FileKind, content: bytes, path: Path) -> str:
    """What came of a file: ``read``, ``refused``, or what was raised and where."""
    path.write_bytes(content)
    begun = time.monotonic()
    try:
        kind.read(path)
    except BorechainError as error:
        return "refused" if len(str(error).splitlines()) <= 1 else f"{type(error).__name__} of several lines"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}"
    return "read" if time.monotonic() < begun + SLOW_S else "slow"


def fuzz_group(name: str, seconds: float, seed: int, kept: Path) -> int:
    """Read changed files of a group for a time; returns how many kinds of faults were found."""
    lot, counts, faults = random.Random(f"{name}-{seed}"), Counter[str](), {}
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for companion, beside in COMPANIONS.items():
            (Path(folder) / companion).write_bytes(beside)
        until, base, number = time.monotonic() + seconds, 0.0, 0
        while time.monotonic() < until:
            kind = lot.choice(GROUPS[name])
            content = mutate(lot, list(kind.seeds))
            found = read_changed(kind, content, Path(folder) / f"changed{kind.ending}")
            number += 1
            base = peak_mb() if number == WARM else base
            counts[found if found in ("read", "refused") else "fault"] += 1
            if found not in ("read", "refused") and (kind.name, found) not in faults:
                kept.mkdir(parents=True, exist_ok=True)
                file = kept / f"{kind.name.replace(' ', '-')}-{hashlib.sha256(content).hexdigest()[:12]}{kind.ending}"
                file.write_bytes(content)
                faults[kind.name, found] = file
    grown = peak_mb() - base if number > WARM else 0.0
    print(f"{name}: {number} files, {counts['read']} read, {counts['refused']} refused, {grown:.0f} MB more memory")
    for (kind_name, what), file in faults.items():
        print(f"  {kind_name}: {what}; {file}")
    if grown > GROWTH_MB:
        print(f"  expected at most {GROWTH_MB:.0f} MB more memory, got {grown:.0f}")
    return len(faults) + (grown > GROWTH_MB)


def main() -> None:
    """Fuzz every group, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("groups", nargs="*", default=[], help=f"of {', '.join(GROUPS)}; all when left out")
    parser.add_argument("--seconds", type=float, default=60.0, help="for each group")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of every change")
    parser.add_argument("--kept", type=Path, default=Path("out/fuzz"), help="folder for files that found a fault")
    told = parser.parse_args()
    print(f"seed {told.seed}")
    groups = told.groups or list(GROUPS)
    sys.exit(min(sum([fuzz_group(name, told.seconds, told.seed, told.kept) for name in groups]), 1))


if __name__ == "__main__":
    main()
