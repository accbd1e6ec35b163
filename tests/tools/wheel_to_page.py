"""How long a newcomer waits: from an installed wheel to a live page with ten tubes. Part of `make wheel-to-page`.

An environment of its own and a home of its own, in which nothing was ever compiled, get the newest wheel in ``dist``
(`make wheel`) by the README's command, which compiles what is imported and nothing else; then `borechain demo` runs
until every tube of its string is heard on the page. A line for each stage: s since the command began, and s of
processor time of all its processes.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
TUBES = 10
LIMIT = 600.0  # s
ADOPT_ORPHANS = 36  # PR_SET_CHILD_SUBREAPER of prctl: what a rig's processes took counts once they have ended


def newest_wheel() -> Path:
    """The wheel that `make wheel` made last."""
    found = sorted((REPOSITORY / "dist").glob("*.whl"), key=lambda path: path.stat().st_mtime)
    if not found:
        sys.exit(f"expected a wheel in {REPOSITORY / 'dist'}, got none: run make wheel")
    return found[-1]


def free_port() -> int:
    """A port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def heard_tubes(page: str) -> int:
    """How many tubes the page shows with a state that is not stale; -1 while nothing answers."""
    try:
        with urllib.request.urlopen(f"http://{page}/api/string", timeout=5.0) as answer:
            tubes = json.load(answer)["tubes"]
    except (OSError, urllib.error.URLError, ValueError, KeyError):
        return -1
    return sum(tube["age_s"] is not None and not tube["stale"] for tube in tubes)


@contextlib.contextmanager
def demonstration(python: Path, environment: Mapping[str, str], page: str) -> Iterator[subprocess.Popen[bytes]]:
    """`borechain demo` until the end of the block."""
    words = ["-m", "borechain", "demo", "--page", page, "--endpoint", f"tcp/127.0.0.1:{free_port()}"]
    begun = subprocess.Popen([python, *words], env=environment, stdout=sys.stderr)
    try:
        yield begun
    finally:
        begun.send_signal(signal.SIGINT)
        begun.wait()


def wait_for_page(begun: subprocess.Popen[bytes], page: str) -> tuple[float, float]:
    """Seconds until the page answers, and until all tubes are heard."""
    start, answered = time.monotonic(), 0.0
    while (heard := heard_tubes(page)) < TUBES:
        waited = time.monotonic() - start
        if begun.poll() is not None or waited > LIMIT:
            sys.exit(f"expected {TUBES} tubes on the page, got {max(heard, 0)} in {waited:.0f} s")
        if heard >= 0 and not answered:
            answered = waited
        time.sleep(0.1)
    all_heard = time.monotonic() - start
    return answered or all_heard, all_heard


def say_stage(stage: str, seconds: float) -> None:
    """A line of the table."""
    sys.stdout.write(f"{stage:<34} {seconds:6.1f} s\n")
    sys.stdout.flush()


def main() -> None:
    """Install, start, wait, and say how long each took."""
    ctypes.CDLL(None).prctl(ADOPT_ORPHANS, 1, 0, 0, 0)
    wheel = newest_wheel()
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA", "XDG", "PYTHON"))}
    with tempfile.TemporaryDirectory(prefix="borechain-newcomer-") as folder:
        home, venv = Path(folder) / "home", Path(folder) / "venv"
        home.mkdir()
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        python, page = venv / "bin" / "python", f"127.0.0.1:{free_port()}"
        environment = kept | {"HOME": str(home)}
        start = time.monotonic()
        install = [python, "-m", "pip", "install", "--quiet", "--no-compile", f"{wheel}[page]"]
        subprocess.run(install, check=True, env=environment | {"PIP_CACHE_DIR": str(home / "pip")})
        say_stage(f"pip install {wheel.name[:9]}[page]", time.monotonic() - start)
        for which in ("first", "second"):
            with demonstration(python, environment, page) as begun:
                answered, heard = wait_for_page(begun, page)
            say_stage(f"{which} demo: the page answers", answered)
            say_stage(f"{which} demo: {TUBES} tubes are heard", heard)
        with contextlib.suppress(ChildProcessError):
            while True:
                os.wait()
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        say_stage("processor time, all of it", used.ru_utime + used.ru_stime)


if __name__ == "__main__":
    main()
