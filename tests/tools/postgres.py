"""A PostgreSQL server of a test's own: Debian's program over an empty folder, reached by a socket in it."""

from __future__ import annotations

import contextlib
import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PROGRAMS = Path("/usr/lib/postgresql")
UNPRIVILEGED = "nobody"  # user


def find_program(name: str) -> str | None:
    """Path of one of PostgreSQL's programs; Debian keeps them by version."""
    found = sorted(PROGRAMS.glob(f"*/bin/{name}"))
    return str(found[-1]) if found else shutil.which(name)


@contextlib.contextmanager
def running_postgres() -> Iterator[str]:
    """URL of an empty database; the server refuses to run as root, which starts it as another user."""
    initdb, postgres = find_program("initdb"), find_program("postgres")
    assert initdb is not None, "no PostgreSQL: run make browser"
    assert postgres is not None
    with tempfile.TemporaryDirectory(prefix="borechain-") as name:  # a socket's path must be short
        folder = Path(name)
        who: dict[str, Any] = {}
        if os.geteuid() == 0:
            user = pwd.getpwnam(UNPRIVILEGED)
            os.chown(folder, user.pw_uid, user.pw_gid)
            who = {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
        data = folder / "data"
        subprocess.run(
            [initdb, "--pgdata", data, "--username=rig", "--auth=trust", "--no-sync", "--encoding=UTF8", "--locale=C"],
            check=True,
            capture_output=True,
            cwd=folder,
            **who,
        )
        words = [postgres, "-D", data, "-k", folder, "-c", "listen_addresses="]
        with subprocess.Popen(words, stderr=subprocess.PIPE, text=True, cwd=folder, **who) as server:
            assert server.stderr is not None
            assert any("ready to accept connections" in line for line in server.stderr)
            try:
                yield f"postgresql://rig@/postgres?host={folder}"
            finally:
                server.terminate()
                server.stderr.read()
