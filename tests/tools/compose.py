"""docker-compose.yml in containers: every service in one of its own, until two tubes are surveyed: make test-compose.

podman runs the services by their own command lines in one network that has nothing but itself. Their file system is
this machine's, with every change thrown away, so that no registry is asked for the image; the Dockerfile is not built.
Where it cannot be had, one line says why and nothing is tested.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

REPOSITORY = Path(__file__).parents[2]
LIMIT = 420.0  # s
SPEED = "40"  # times real time; with 1 a survey takes minutes
LIMITS = ("--ulimit", "nofile=16384:16384", "--ulimit", "nproc=4096:4096")
QUERY = "borechain/*/ground/{what}"
WANTED = [2, 1]  # measurements of each station


def lacking() -> str:
    """Why it cannot be had here; empty where it can."""
    if shutil.which("podman") is None:
        return "no podman: install Debian's podman and runc"
    if os.geteuid() != 0:
        return "containers on this machine's own file system take root"
    tried = podman("run", "--rm", *LIMITS, "--network", "none", "--rootfs", "/:O", "/bin/true")
    if tried.returncode != 0:
        return f"podman runs no container here: {tried.stderr.strip().splitlines()[-1]}"
    return ""


def podman(*words: str) -> subprocess.CompletedProcess[str]:
    """Run podman, with runc where there is one: crun knows fewer kinds of control groups."""
    runtime = ["--runtime", found] if (found := shutil.which("runc")) else []
    return subprocess.run(["podman", *runtime, *words], capture_output=True, text=True, check=False)


class Compose:
    """The services, each in a container whose name begins with ``prefix``."""

    def __init__(self, prefix: str, folder: Path, *, cold: bool) -> None:
        composition = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())
        self._services: dict[str, dict[str, Any]] = composition["services"]
        self._prefix, self._folder, self._cold = prefix, folder, cold
        self.names: list[str] = []
        self._hosts = folder / "hosts"
        self._hosts.write_text("127.0.0.1 localhost router\n")  # all share the network of the router

    def start(self, name: str, *, wait: bool = False) -> None:
        """Start a service, or run it to its end."""
        network = "none" if name in ("keys", "router") else f"container:{self._prefix}-router"
        kept = self._folder / name
        kept.mkdir()
        volumes = [
            "-v",
            f"{self._folder / 'shared'}:/keys",
            "-v",
            f"{kept}:/state",
            "-v",
            f"{self._hosts}:/etc/hosts:ro",
        ]
        environment = ["--env", f"PYTHONPATH={REPOSITORY}"]
        if self._cold:
            environment += ["--env", "NUMBA_CACHE_DIR=/state/compiled"]
        how = [] if wait else ["--detach", "--restart", str(self._services[name].get("restart", "no"))]
        words = [str(word) for word in self._services[name]["command"]]
        if "--speed" in words:
            words[words.index("--speed") + 1] = SPEED
        self.names.append(f"{self._prefix}-{name}")
        done = podman(
            "run", *how, "--name", self.names[-1], *LIMITS, "--network", network, "--no-hosts", *volumes, *environment,
            "--workdir", "/state", "--rootfs", "/:O", sys.executable, "-m", "borechain", *words,
        )  # fmt: skip
        if done.returncode != 0:
            raise SystemExit(f"{name}: {done.stderr.strip()}")

    def start_all(self) -> None:
        """All of them, the keys first and then the router, as the file says."""
        (self._folder / "shared").mkdir()
        self.start("keys", wait=True)
        for name in sorted(set(self._services) - {"keys"}, key=lambda name: name != "router"):
            self.start(name)

    def ask(self, what: str) -> Any:
        """Answer of the ground station, asked in its own container; empty before there is one."""
        words = ["query", QUERY.format(what=what), "--endpoint", "tls/router:7447", "--keys", "/keys", "--json"]
        found = podman("exec", f"{self._prefix}-ground", sys.executable, "-m", "borechain", *words)
        with contextlib.suppress(ValueError):
            return json.loads(found.stdout)
        return {}

    def logs(self, name: str) -> str:
        """What a service said."""
        done = podman("logs", name)
        return done.stdout + done.stderr


@contextlib.contextmanager
def composed(*, cold: bool) -> Iterator[Compose]:
    """Services until the end of the block."""
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        compose = Compose(f"borechain-{os.getpid()}", Path(folder), cold=cold)
        try:
            compose.start_all()
            yield compose
        finally:
            for name in reversed(compose.names):
                podman("rm", "--force", "--time", "5", name)


def surveyed(compose: Compose) -> bool:
    """Wait until both tubes are surveyed; False where the time is over. A service that ends starts again."""
    deadline = time.monotonic() + LIMIT
    while time.monotonic() < deadline:
        answer = compose.ask("stations")
        stations = answer.get("stations", []) if isinstance(answer, dict) else []
        if [station["measurements"] for station in stations] == WANTED:
            return True
        time.sleep(2.0)
    for name in compose.names:
        print(f"{name}: {compose.logs(name)[-500:]}")
    return False


def main() -> int:
    """Prove it, or say why not."""
    if reason := lacking():
        print(f"test-compose: skipped: {reason}")
        return 0
    cold = "--cold" in sys.argv
    begun = time.monotonic()
    with composed(cold=cold) as compose:
        started = len(compose.names)
        passed = surveyed(compose)
    outcome = "passed" if passed else "failed"
    print(f"test-compose: {outcome}: {started} services{', cold' if cold else ''}, {time.monotonic() - begun:.0f} s")
    return 0 if passed else 1


if __name__ == "__main__":
    raise SystemExit(main())
