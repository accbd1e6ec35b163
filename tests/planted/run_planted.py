"""Plants the listed defects one at a time in a copy of the sources and sees whether the tests notice.

``make planted`` runs all of them; ``--sample 40`` some of each package and kind, ``--only PATTERN`` those whose
package, name or file holds it. Ends with 1 where fewer than ``--at-least`` percent are noticed, and with 2 where a list
is wrong or a test fails without any defect.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from choice_of_tests import choose_tests
from defect_lists import KINDS, LISTS, ROOT, Defect, DefectError, read_defects, sample_of
from kernel_switch import VARIABLE, plant_switched

USUAL = "process or install or statistical"  # what is left out
PASSES = (f"not (slow or {USUAL})", f"slow and not ({USUAL})")  # the second only where the first notices nothing
NOTHING_COLLECTED = 5  # exit code of pytest
FAILED_TO_RUN = 70
LIMIT_S = 900  # of one pass; one that never ends is noticed, too
# imported once: a test run in a fork of this process begins at once. None of ours, which may hold the defect
LIBRARIES = "pytest hypothesis numpy numba msgpack msgspec pydantic can zenoh cryptography.x509"


class Outcome(NamedTuple):
    """What became of one defect, and which test noticed."""

    defect: Defect
    is_found: bool
    by: str
    seconds: float


class Bench:
    """A copy of the sources in which one defect after the other is planted."""

    def __init__(self, folder: Path, passes: Sequence[str] = PASSES, switched: Sequence[Defect] = ()) -> None:
        self.root, self.passes, self._switched = folder, passes, [defect.name for defect in switched]
        listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True).stdout.split(b"\0")
        for name in sorted(filter(None, map(os.fsdecode, names))):
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)
        self._written_at = time.time()
        if switched:
            plant_switched(folder, switched)

    @contextlib.contextmanager
    def planted(self, defect: Defect) -> Iterator[None]:
        """Hold a defect in the sources, or switch it on."""
        if defect.switched:
            os.environ[VARIABLE] = str(1 + self._switched.index(defect.name))
            yield
            os.environ[VARIABLE] = "0"
            return
        file = self.root / defect.file
        sound = file.read_text(encoding="utf-8")
        self._write(file, defect.planted_text(self.root))
        try:
            yield
        finally:
            self._write(file, sound)

    def judge(self, defect: Defect) -> tuple[bool, str]:
        """Whether the tests notice a defect, and which."""
        tests = choose_tests(defect, ROOT)
        with self.planted(defect):
            for chosen in self.passes:
                if by := self.run_tests(tests, chosen):
                    return True, by
        return False, ""

    def run_tests(self, tests: Sequence[str], chosen: str) -> str:
        """First test that fails, or nothing."""
        told = self.root.with_suffix(".txt")
        child = os.fork()
        if not child:
            become_tests(self.root, tests, chosen, told)
        try:
            _, status = os.waitpid(child, 0)
        except BaseException:
            os.kill(child, signal.SIGKILL)
            raise
        if os.waitstatus_to_exitcode(status) in (0, NOTHING_COLLECTED):
            return ""
        lines = told.read_text(encoding="utf-8", errors="replace").splitlines()
        failed = [line.split(" - ")[0] for line in lines if line.startswith(("FAILED ", "ERROR "))]
        return (failed or lines[-1:] or ["ended without a word"])[0]

    def _write(self, file: Path, text: str) -> None:
        """Write a source with a date of its own: what was compiled of it is known by its date in whole seconds."""
        file.write_text(text, encoding="utf-8")
        self._written_at += 2.0
        os.utime(file, (self._written_at, self._written_at))


def become_tests(root: Path, tests: Sequence[str], chosen: str, told: Path) -> None:
    """Turn this process, a fork, into a run of tests in a copy of the sources; it does not return."""
    code = FAILED_TO_RUN
    try:
        signal.alarm(LIMIT_S)
        with told.open("w", encoding="utf-8") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        os.chdir(root)
        os.environ |= {"PYTHONPATH": str(root), "BORECHAIN_CORES": "1"}
        own = (Path(__file__).parent, ROOT)
        sys.path[:] = [str(root), *(place for place in sys.path if Path(place) not in own)]
        for name in ("defect_lists", "choice_of_tests", "kernel_switch"):
            del sys.modules[name]  # the copy has its own
        command = ["-x", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider", "-p", "no:xdist"]
        command.append("--timeout=0")  # the limit is that of the whole run, on a machine that may be busy
        command += ["-W", "ignore::pytest.PytestAssertRewriteWarning", "-m", chosen]
        code = int(importlib.import_module("pytest").main([*command, *(f"tests/{test}" for test in tests)]))
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def judge_part(defects: Sequence[Defect], folder: Path, passes: Sequence[str], told: int) -> None:
    """Judge defects one after the other in a copy of their own; a line of JSON for each to ``told``."""
    switched = [defect for defect in defects if defect.switched]
    plain = Bench(folder / "plain", passes)
    kernels = Bench(folder / "kernels", passes, switched) if switched else plain
    if switched:
        refuse_failing(switched, kernels)
    for defect in defects:
        bench = kernels if defect.switched else plain
        begun = time.monotonic()
        is_found, by = bench.judge(defect)
        os.write(told, json.dumps([defect.name, is_found, by, time.monotonic() - begun]).encode() + b"\n")


def tell_part(part: Sequence[Defect], folder: Path, passes: Sequence[str], told: int) -> None:
    """Judge a part in this process, a fork, and end it."""
    code = 0
    try:
        judge_part(part, folder, passes, told)
    except DefectError as error:
        print(error, file=sys.stderr)
        code = 2
    finally:
        os._exit(code)


def judge_all(defects: Sequence[Defect], jobs: int, passes: Sequence[str] = PASSES) -> Iterator[Outcome]:
    """Judge all defects, ``jobs`` at a time."""
    by_name = {defect.name: defect for defect in defects}
    # all kernels go into one copy, that they are compiled once
    plain, kernels = [d for d in defects if not d.switched], [d for d in defects if d.switched]
    parts = [plain[job::jobs] + (kernels if job == 0 else []) for job in range(jobs)]
    with tempfile.TemporaryDirectory(prefix="planted-") as folder:
        refuse_failing(defects, Bench(Path(folder) / "sound", passes))
        reader, writer = os.pipe()
        children = []
        for job, part in enumerate(parts):
            children.append(os.fork())
            if not children[-1]:
                os.close(reader)
                tell_part(part, Path(folder) / str(job), passes, writer)
        os.close(writer)
        try:
            with os.fdopen(reader, encoding="utf-8") as lines:
                for line in lines:
                    name, is_found, by, seconds = json.loads(line)
                    yield Outcome(by_name.pop(name), is_found, by, seconds)
        finally:
            for child in children:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(child, signal.SIGTERM)
                os.waitpid(child, 0)
    if by_name:
        raise DefectError(f"{len(by_name)} of {len(defects)} defects could not be judged, the first: {min(by_name)}")


def refuse_failing(defects: Iterable[Defect], bench: Bench) -> None:
    """Raise where a test fails without any defect: it would find them all."""
    tests = sorted({test for defect in defects for test in choose_tests(defect, ROOT)})
    for chosen in bench.passes:
        if by := bench.run_tests(tests, chosen):
            raise DefectError(f"without any defect: expected tests that pass, got {by}")


def summary_of(outcomes: Iterable[Outcome]) -> list[str]:
    """Lines: found of planted by package and by kind, and who survives."""
    rows: dict[str, list[bool]] = defaultdict(list)
    for outcome in outcomes:
        for name in (f"package {outcome.defect.package}", f"kind {outcome.defect.kind}", "all"):
            rows[name].append(outcome.is_found)
    lines = []
    for name, found in sorted(
        rows.items(), key=lambda row: (row[0] == "all", not row[0].startswith("package"), row[0])
    ):
        word = f" ({KINDS[int(name[5:])]})" if name.startswith("kind") else ""
        lines.append(f"{sum(found):4} of {len(found):3}  {100 * sum(found) // len(found):3} %  {name}{word}")
    return lines + [f"survives: {o.defect.name} ({o.defect.file})" for o in outcomes if not o.is_found]


def chosen_of(arguments: argparse.Namespace) -> list[Defect]:
    """Return the defects that were asked for; every one of the lists must be there to plant."""
    defects = read_defects(arguments.lists)
    for defect in defects:
        defect.planted_text(ROOT)
    if arguments.only:
        defects = [d for d in defects if any(word in f"{d.package} {d.name} {d.file}" for word in arguments.only)]
    return sample_of(defects, arguments.sample) if arguments.sample else defects


def arguments_of(words: Sequence[str] | None = None) -> argparse.Namespace:
    """Arguments of the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", type=int, help="so many defects instead of all")
    parser.add_argument("--only", action="append", metavar="PATTERN", help="those whose package, name or file holds it")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="at a time")
    parser.add_argument("--fast", action="store_true", help="without the tests that are marked slow")
    parser.add_argument("--at-least", type=float, default=95.0, metavar="PERCENT", help="that are to be noticed")
    parser.add_argument("--lists", type=Path, default=LISTS, help="folder of lists, instead of the project's own")
    parser.add_argument("--out", type=Path, help="JSON file of the outcomes")
    return parser.parse_args(words)


def main() -> int:
    """Run it."""
    arguments = arguments_of()
    for library in LIBRARIES.split():
        importlib.import_module(library)
    outcomes = []
    try:
        passes = PASSES[:1] if arguments.fast else PASSES
        for outcome in judge_all(chosen_of(arguments), max(arguments.jobs, 1), passes):
            outcomes.append(outcome)
            verdict = f"found by {outcome.by}" if outcome.is_found else "SURVIVES"
            print(f"{outcome.seconds:5.1f} s  {outcome.defect.package}: {outcome.defect.name}: {verdict}", flush=True)
    except DefectError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join(summary_of(outcomes)))
    if arguments.out:
        rows = [{"name": o.defect.name, "kind": o.defect.kind, "found": o.is_found, "by": o.by} for o in outcomes]
        arguments.out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0 if 100.0 * sum(o.is_found for o in outcomes) >= arguments.at_least * len(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
