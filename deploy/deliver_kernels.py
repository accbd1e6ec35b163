"""Compile the kernels for the baseline of this processor's family, into ``node/delivered``: part of `make wheel`.

A wheel that is built afterwards brings them along. They are compiled in a cache folder of their own, by what uses them:
the parts of a rig, the models of surveys, two whole rigs.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

from borechain.drilling.compile_ahead import compile_ahead
from node.kernels.arithmetic.delivered import BASELINES, pack_kernels
from node.kernels.arithmetic.jit import folder_in_use, source_digest

RIGS = ("rig-3", "wellbore-1", "rough")  # whose worlds have kernels of their own


def main() -> None:
    """Compile and pack, in a process that compiles for the baseline."""
    baseline = BASELINES.get(platform.machine())
    if baseline is None:
        sys.exit(f"expected a machine of {', '.join(BASELINES)}, got {platform.machine()}: the wheel brings no kernels")
    if os.environ.get("NUMBA_CPU_NAME") != baseline.name:
        build_anew(dict(zip(("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"), baseline, strict=True)))
    else:
        compile_all()
        archive = pack_kernels(folder_in_use(), source_digest())
        sys.stdout.write(f"{archive} ({archive.stat().st_size / 1e6:.1f} MB)\n")


def build_anew(processor: dict[str, str]) -> None:
    """Run this program for the baseline, with a cache of its own and without what was delivered before."""
    kept = Path(__file__).parents[1] / "build" / "kernels"
    environment = os.environ | processor | {"NUMBA_CACHE_DIR": str(kept / source_digest())}
    sys.exit(subprocess.run([sys.executable, __file__], env=environment, check=False).returncode)


def compile_all() -> None:
    """What a rig, a survey and the shipped worlds call."""
    from contextlib import nullcontext

    compile_ahead("fixed", lambda _count: nullcontext(lambda _done: None))
    from groundstation.survey.well.compiled_model import preload_models

    preload_models()
    for rig in RIGS:
        with tempfile.TemporaryDirectory() as folder:
            words = ["-m", "borechain", "rig", rig, "--inline", "--seed", "1", "--speed", "max", "--json"]
            subprocess.run(
                [sys.executable, *words, "--out", str(Path(folder) / "run")], check=True, stdout=subprocess.DEVNULL
            )


if __name__ == "__main__":
    main()
