"""The import law holds, and each of its contracts notices the import it forbids."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("borechain", "groundstation", "node", "sim", "telemetry")
FORBIDDEN = [
    ("telemetry/messages.py", "import node.errors"),
    ("telemetry/parameters.py", "import telemetry.transport.hop"),
    ("node/errors.py", "import sim.errors"),
    ("groundstation/errors.py", "import sim.errors"),
    ("sim/errors.py", "import borechain.cli.options"),
    ("telemetry/transport/hop.py", "import telemetry.application.clock"),
    ("node/kernels/angles.py", "import node.firmware.encoder"),
    ("groundstation/config.py", "import node.firmware.settings"),
    ("groundstation/survey/resolve.py", "import groundstation.service.store"),
    ("sim/rig/report.py", "import groundstation.service.store"),
    ("telemetry/application/clock.py", "import zenoh"),
    ("borechain/cli/options.py", "import can"),
    ("node/kernels/layout.py", "import msgpack"),
    ("node/firmware/encoder.py", "import asyncio"),
]


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    program = "import sys; sys.path.insert(0, '.'); from importlinter.cli import lint_imports_command as c; c()"
    environment = os.environ | {"PYTHONPATH": str(folder)}
    return subprocess.run(
        [sys.executable, "-c", program, "--no-cache"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / ".importlinter", tmp_path)
    return tmp_path


def test_the_law_holds(checkout: Path) -> None:
    done = lint(checkout)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("module", "line"), FORBIDDEN)
def test_a_forbidden_import_is_noticed(checkout: Path, module: str, line: str) -> None:
    path = checkout / module
    path.write_text(path.read_text() + f"\n{line}\n")
    done = lint(checkout)
    assert done.returncode != 0, done.stdout
    assert "BROKEN" in done.stdout
