"""Set up an environment and compile a rig's kernels meanwhile, with a bar from the first second: part of `make rig`.

    python3 deploy/set_up_shown.py VENV COMMAND...

COMMAND sets VENV up, and leaves a file ``.compiler`` in it as soon as what compiles kernels is there: from then on they
are compiled beside the rest. A terminal sees a bar, a file a line for each stage. Standard library alone: nothing else
is there yet. Kernels that fail to compile are left to the rig, which says why.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO

COMPILER_THERE = ".compiler"  # in the environment, by the Makefile
INSTALLING, COMPILING = 0.2, 0.8  # of the bar
USUALLY = 12.0  # s, that an installation takes
EVERY = 0.1  # s
WIDTH = 40  # characters


class Kernels:
    """Their compilation by a process of the new environment: begun once, then followed by the lines that it writes."""

    def __init__(self, python: Path) -> None:
        self._said = tempfile.TemporaryFile("w+")  # noqa: SIM115  as long as this object
        self._process = subprocess.Popen([python, "-m", "borechain.drilling.compile_early"], stdout=self._said)

    def done_of(self) -> tuple[int, int]:
        """How many functions are compiled, of how many; (0, 0) while that is not known."""
        words = lines_of(self._said)
        return (len(words) - 1, int(words[0])) if words else (0, 0)

    def has_ended(self) -> bool:
        """Whether there is nothing more to wait for."""
        return self._process.poll() is not None

    def wait(self, seconds: float) -> None:
        """Return when it has ended; ``subprocess.TimeoutExpired`` where it has not by then."""
        self._process.wait(seconds)

    def stop(self) -> None:
        """End it, where it runs."""
        self._process.terminate()
        self._process.wait()


def lines_of(file: IO[str]) -> list[str]:
    """The whole lines that another process has written so far."""
    text = os.pread(file.fileno(), 1 << 20, 0).decode()
    return text[: text.rfind("\n") + 1].splitlines()


def part_installed(seconds: float) -> float:
    """Share of an installation that has run for ``seconds``; how far it is it does not tell, so it never is all."""
    return seconds / (seconds + USUALLY / 3.0)


class Bar:
    """What is seen: one line that changes on a terminal, a line for each stage elsewhere."""

    def __init__(self, out: IO[str]) -> None:
        self._out, self._begun, self._stage = out, time.monotonic(), ""

    @property
    def seconds(self) -> float:
        """Since it began."""
        return time.monotonic() - self._begun

    def show(self, stage: str, share: float) -> None:
        """Say the stage, and how much of the whole is done."""
        if self._out.isatty():
            full = "#" * round(WIDTH * share)
            self._out.write(f"\r[{full:<{WIDTH}}] {self.seconds:3.0f} s  {stage:<34}")
        elif stage != self._stage:
            self._out.write(f"{stage}\n")
        self._stage = stage
        self._out.flush()

    def end(self) -> None:
        """Leave nothing of the bar."""
        if self._out.isatty():
            self._out.write("\r\033[K")
            self._out.flush()


def set_up(venv: Path, command: list[str], bar: Bar) -> int:
    """Run ``command`` and, beside it, the compiler; its exit status."""
    kernels: Kernels | None = None
    (venv / COMPILER_THERE).unlink(missing_ok=True)
    show_stage(bar, None, installs=True)
    with tempfile.TemporaryFile("w+") as said:
        installing = subprocess.Popen(command, stdout=said, stderr=said)
        try:
            while installing.poll() is None or (kernels is not None and not kernels.has_ended()):
                if kernels is None and (venv / COMPILER_THERE).exists():
                    kernels = Kernels(venv / "bin" / "python")
                show_stage(bar, kernels, installs=installing.poll() is None)
                if installing.poll():
                    break
                with contextlib.suppress(subprocess.TimeoutExpired):
                    (kernels if installing.poll() is not None and kernels is not None else installing).wait(EVERY)
        finally:
            bar.end()
            for process in (installing, *((kernels,) if kernels is not None else ())):
                (process.stop if isinstance(process, Kernels) else process.terminate)()
        code = installing.wait()
        if code:
            sys.stderr.write("\n".join([*lines_of(said)[-30:], f"setting up {venv} failed", ""]))
    return code


def show_stage(bar: Bar, kernels: Kernels | None, *, installs: bool) -> None:
    """What is under way: the installation, the kernels, or both."""
    done, count = kernels.done_of() if kernels is not None else (0, 0)
    share = INSTALLING * (part_installed(bar.seconds) if installs else 1.0)
    stage = "installing packages, once" if kernels is None else "compiling kernels, once"
    bar.show(stage, share + (COMPILING * min(done / count, 1.0) if count else 0.0))


if __name__ == "__main__":
    try:
        sys.exit(set_up(Path(sys.argv[1]), sys.argv[2:], Bar(sys.stderr)))
    except KeyboardInterrupt:
        sys.exit(130)
