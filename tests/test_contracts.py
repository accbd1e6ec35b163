"""The import law holds, and each of its contracts notices the imports it forbids.

All forbidden imports are written into one copy of the packages and the linter runs over it once: it lists every chain
of every broken contract, so each import is found, or missed, by its own line.
"""

import configparser
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
    ("telemetry/calibration.py", "import telemetry.media.port"),
    ("node/errors.py", "import sim.errors"),
    ("groundstation/errors.py", "import sim.errors"),
    ("sim/errors.py", "import borechain.cli.shared_options"),
    ("telemetry/transport/hop.py", "import telemetry.application.clock"),
    ("node/kernels/arithmetic/angles.py", "import node.firmware.encoder_node"),
    ("groundstation/config.py", "import node.firmware.tube_settings"),
    ("groundstation/survey/fusion/resolve.py", "import groundstation.service.disk.ground_store"),
    ("groundstation/calibration/quality.py", "import groundstation.report.style"),
    ("sim/rig/report.py", "import groundstation.service.disk.ground_store"),
    ("sim/string/hops.py", "import sim.campaign.chunk"),
    ("sim/campaign/summary.py", "import sim.world.world"),
    ("groundstation/service/process/operator_access.py", "import groundstation.gateway.zenoh"),
    ("groundstation/service/orders/order_book.py", "import asyncio"),
    ("groundstation/service/string/tally.py", "import groundstation.service.hole.history"),
    ("groundstation/service/process/ground_process.py", "import telemetry.media.zenoh_bus"),
    ("groundstation/service/answers/shapes/wall_shapes.py", "import groundstation.service.answers.model"),
    ("telemetry/application/clock.py", "import zenoh"),
    ("borechain/cli/shared_options.py", "import can"),
    ("node/kernels/record/filter_record.py", "import msgpack"),
    ("node/firmware/encoder_node.py", "import asyncio"),
    ("node/firmware/inputs.py", "import msgspec"),
    ("groundstation/survey/tools/formulas.py", "import groundstation.survey.wall.voids"),
    ("node/kernels/record/ring.py", "import node.kernels.filter.resets"),
    ("node/kernels/filter/fixed/cycle.py", "import node.kernels.filter.float64.cycle"),
    ("borechain/drilling/rig_job.py", "import borechain.cli.notices"),
]
CIRCLES = [
    ("borechain/cli/console_tables.py", "import borechain.cli.rig.result", "borechain.cli"),
    ("borechain/cli/rig/medium.py", "import borechain.cli.rig.demo", "borechain.cli.rig"),
    ("borechain/cli/rig/demo.py", "import borechain.cli.rig.medium", "borechain.cli.rig"),
]  # the linter names the room of a circle, not its lines


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    program = "import sys; sys.path.insert(0, '.'); from importlinter.cli import lint_imports_command as c; c()"
    environment = os.environ | {"PYTHONPATH": str(folder), "COLUMNS": "300"}
    return subprocess.run(
        [sys.executable, "-c", program, "--no-cache"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def copy_packages(folder: Path) -> None:
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / ".importlinter", folder)


def contracts() -> list[str]:
    parser = configparser.ConfigParser()
    parser.read(ROOT / ".importlinter")
    return [parser[section]["name"] for section in parser.sections() if ":contract:" in section]


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What the linter prints about a copy in which every forbidden import was written."""
    folder = tmp_path_factory.mktemp("broken")
    copy_packages(folder)
    for module, line in [*FORBIDDEN, *((module, line) for module, line, _ in CIRCLES)]:
        path = folder / module
        path.write_text(path.read_text() + f"\n{line}\n")
    done = lint(folder)
    assert done.returncode != 0, done.stdout
    return done.stdout


def test_the_law_holds(tmp_path: Path) -> None:
    copy_packages(tmp_path)
    done = lint(tmp_path)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("module", "line"), FORBIDDEN)
def test_a_forbidden_import_is_noticed(broken: str, module: str, line: str) -> None:
    importer = module.removesuffix(".py").replace("/", ".")
    last = len((ROOT / module).read_text().splitlines()) + 2
    print(broken)
    assert f"{importer} -> {line.removeprefix('import ')} (l.{last})" in broken


@pytest.mark.parametrize("room", sorted({room for _, _, room in CIRCLES}))
def test_a_circle_is_noticed(broken: str, room: str) -> None:
    assert f"No cycles are allowed in {room}.\n" in broken


@pytest.mark.parametrize("name", contracts())
def test_every_contract_can_break(broken: str, name: str) -> None:
    assert f"{name} BROKEN" in broken
