"""What an earlier release of ours runs as, beside the present one: its sources from this repository's own history.

As a script it is a command of that release: ``python earlier_release.py SOURCES WORDS...``. Its kernels run as the
Python that they are, by the present release's stand-in for numba: to compile those of a release costs most of a minute,
and a tube's cycle takes 3 ms as it stands.
"""

from __future__ import annotations

import importlib.util
import io
import subprocess
import sys
import tarfile
from pathlib import Path
from types import ModuleType

REPOSITORY = Path(__file__).parents[2]
PACKAGES = ("borechain", "groundstation", "node", "sim", "telemetry")
UNCOMPILED = ("__init__", "record_views", "numba_stand_in")  # in the order of their imports


class HistoryError(Exception):
    """The sources cannot be had: no repository, or one that does not reach so far back."""


def extract_release(commit: str, folder: Path) -> Path:
    """Write the packages of a commit below ``folder``, as they were.

    Raises
    ------
    HistoryError
        Where git or the commit is absent, as in a shallow clone or an unpacked archive.
    """
    words = ["git", "-C", str(REPOSITORY), "archive", "--format=tar", commit, *PACKAGES]
    try:
        done = subprocess.run(words, capture_output=True, check=False, timeout=60)
    except OSError as error:
        raise HistoryError(f"git: {error}") from error
    if done.returncode:
        raise HistoryError(f"{commit}: {done.stderr.decode(errors='replace').strip()}")
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(folder, filter="data")
    return folder


def started_release(sources: Path, *words: str) -> subprocess.Popen[str]:
    """A command of the release whose packages lie in ``sources``."""
    return subprocess.Popen(
        [sys.executable, __file__, str(sources), *words],
        cwd=sources,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def stand_in_for_numba() -> None:
    """Have the kernels of the packages that are found first run as Python."""
    names = {name: "node.uncompiled" if name == "__init__" else f"node.uncompiled.{name}" for name in UNCOMPILED}
    modules = {name: loaded(names[name], REPOSITORY / "node" / "uncompiled" / f"{name}.py") for name in UNCOMPILED}
    modules["numba_stand_in"].stand_in_for_numba()


def loaded(name: str, path: Path) -> ModuleType:
    """The module of a file, by the name that others import it by."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    sys.path[0] = sys.argv.pop(1)
    stand_in_for_numba()
    warm = importlib.import_module("node.kernels.warm")
    from borechain.__main__ import main

    warm.warm_step = lambda *_: None  # its record of zeros is for the compiler: Python refuses what numba divides
    main(sys.argv[1:])
