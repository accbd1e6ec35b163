"""Which test files are to notice a defect: those that are named, or those that import its module, nearest first.

Where few import it, those of who uses it are added.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterator
from pathlib import Path

from defect_lists import Defect, DefectError

COSTLY = ("processes", "studies", "page", "gauntlet", "truth", "planted", "tools")  # folders that are named, not chosen
FEW = 3  # files; where fewer import the module itself, those are added that import who imports it
MOST = 6  # files
FARTHEST = 4  # imports between a test and a module that no test imports itself
CALIBRATIONS, PAPERS, STATIONS, WALLS = (
    f"groundstation/{name}_whole.py"
    for name in ("calibration/test_calibrations", "test_papers", "test_stations", "test_walls")
)
DAMAGED, SURVEYS = (f"groundstation/survey/test_{name}_whole.py" for name in ("damaged_files", "surveys"))
OF_JOINTS = ("telemetry/test_end_of_a_joint_by_hand.py",)
UNDRAWN_GROUND, UNDRAWN_LINK, UNDRAWN_NODE = (
    "groundstation/test_undrawn_rooms_by_hand.py", "telemetry/test_undrawn_rooms_of_the_link.py",
    "node/test_undrawn_rooms_of_a_node.py",
)  # fmt: skip
OF_NODES = tuple(
    f"node/test_{name}_by_hand.py" for name in ("options", "told", "board", "cycle_of_a_process", "edges_of_a_process")
)
OF_INTAKE = ("groundstation/test_intake_by_hand.py", "groundstation/test_learnt_by_hand.py")
OF_BLOCKS = ("node/chip/test_blocks_by_hand.py",)
GATEWAY, LEASED, KEPT, CALIBRATED, STRING, *SETUP = (
    f"groundstation/test_{name}_by_hand.py"
    for name in ("gateway", "leased", "kept", "recalibration", "string", "setup", "setup_told", "setup_costs")
)
PAGE = ("groundstation/test_page_rooms_by_hand.py", "groundstation/test_page_papers_by_hand.py")
SEEDED = ("sim/test_seeded_worlds.py",)
SMALL = ("test_small_doors_by_hand.py",)
OF_ANSWERS, OF_CLIENT, OF_COMMANDS, OF_DRILLING, OF_GROUND, OF_RIGS, OF_STUDIES = (
    f"test_{name}_called_by_hand.py"
    for name in ("answers", "client", "commands", "drilling", "ground", "rigs", "studies")
)
WHOLE = {  # tests that look at a whole room: without importing it, or from a folder of which none is chosen
    "benchmarks/": ("test_benches_by_hand.py", "test_benches_of_rigs_by_hand.py", *SMALL),
    **{f"borechain/cli/{room}": (OF_COMMANDS,) for room in ("calibrate/", "campaign/", "whole_files")},
    **{f"borechain/cli/{room}/": (OF_STUDIES,) for room in ("experiment", "firmware", "gauntlet")},
    **{f"borechain/{room}": (OF_CLIENT,) for room in ("__main__", "api", "client", "rig_search")},
    "borechain/cli/ground/": (OF_GROUND,),
    "borechain/cli/rig/": (*SMALL, OF_RIGS, OF_DRILLING),
    "borechain/drilling/": (OF_DRILLING,),
    "borechain/cli/": ("test_options_whole.py", "test_command_edges_by_hand.py"),
    **{f"borechain/cli/{room}/": (OF_ANSWERS,) for room in ("export", "link", "pki", "survey")},
    "borechain/gauntlet/": ("gauntlet/test_oracles_by_hand.py", "gauntlet/test_wellness_by_hand.py", *SMALL),
    "borechain/studies/": ("studies/test_studies_whole.py", "studies/test_set_up_study_whole.py"),
    "node/__main__": SMALL,
    "node/firmware/": ("node/test_seeded_nodes.py",),
    "node/kernels/": ("node/test_seeded_nodes.py",),
    "node/process/": (UNDRAWN_NODE, *OF_NODES, "test_seeded_rigs.py"),
    "node/translation/chip_blocks": OF_BLOCKS,
    "node/translation/c_": ("node/chip/test_translated_forms.py",),
    "telemetry/application/end": ("telemetry/test_endpoint_by_hand.py", "telemetry/test_mail_by_hand.py"),
    "telemetry/application/": (UNDRAWN_LINK, "test_seeded_rigs.py"),
    "telemetry/media/can_": ("telemetry/test_whole_wire.py", *OF_JOINTS),
    "telemetry/media/chip_bridge": OF_JOINTS,
    "telemetry/runtime/disk": OF_JOINTS,
    "telemetry/media/memory": (UNDRAWN_LINK,),
    "telemetry/media/isotp.py": ("telemetry/test_whole_wire.py",),
    "telemetry/media/send_queue.py": ("telemetry/test_whole_wire.py",),
    "telemetry/presentation/": ("telemetry/test_whole_wire.py", "test_seeded_rigs.py"),
    "telemetry/radio/": ("telemetry/test_whole_wire.py",),
    "telemetry/runtime/": (UNDRAWN_LINK, "test_seeded_rigs.py"),
    "telemetry/transport/": ("test_seeded_rigs.py",),
    "groundstation/calibration/": (CALIBRATIONS, DAMAGED),
    "groundstation/entry/": (DAMAGED,),
    "groundstation/plan_settings": (DAMAGED,),
    "groundstation/recording/": (STATIONS,),
    "groundstation/report/calibration": (CALIBRATIONS,),
    "groundstation/report/plots": (SURVEYS, WALLS),
    "groundstation/report/rest": (CALIBRATIONS,),
    "groundstation/report/s": (CALIBRATIONS, SURVEYS),
    "groundstation/report/": (PAPERS,),
    **{f"groundstation/gateway/page/{begin}": PAGE for begin in ("a", "c", "e", "o", "p", "r", "se")},  # no script
    "groundstation/gateway/le": (LEASED,),
    "groundstation/gateway/zenoh": (GATEWAY,),
    "groundstation/service/disk/": (KEPT,),
    "groundstation/service/orders/recalibration/": (CALIBRATED,),
    "groundstation/service/setup/": tuple(SETUP),
    "groundstation/service/hole/collar": (UNDRAWN_GROUND,),
    "groundstation/service/process/": (*OF_INTAKE, UNDRAWN_GROUND),
    "groundstation/service/string/": (STRING, "groundstation/test_depth_by_hand.py", UNDRAWN_GROUND),
    "groundstation/service/": (STATIONS,),
    "groundstation/survey/adjustment/": (STATIONS,),
    "groundstation/survey/exports/": (SURVEYS, WALLS),
    "groundstation/survey/files/dip": (UNDRAWN_GROUND,),
    "groundstation/survey/files/": (DAMAGED, SURVEYS),
    "groundstation/survey/fusion/": (STATIONS,),
    "groundstation/survey/path/": (STATIONS, SURVEYS),
    "groundstation/survey/requests/": (SURVEYS, WALLS),
    "groundstation/survey/tools/": (SURVEYS, PAPERS),
    "groundstation/survey/wall/": (WALLS, DAMAGED, UNDRAWN_GROUND),
    "groundstation/survey/well/": (SURVEYS, STATIONS),
    "sim/campaign/": SEEDED,
    "sim/gauntlet/": ("gauntlet/test_faults_as_they_were.py", *SMALL),
    "sim/instruments/": SEEDED,
    "sim/string/": SEEDED,
    "sim/studies/": ("sim/test_study_tables.py", *SMALL),
    "sim/world/": SEEDED,
}
IMPORT = re.compile(r"^ *(?:from|import) ([\w.]+)(?: import ([\w, ]*))?", re.MULTILINE)


def choose_tests(defect: Defect, root: Path) -> list[str]:
    """Test files below ``tests/`` for a defect, the nearest first."""
    if defect.tests:
        for name in defect.tests:
            if not (root / "tests" / name.partition("::")[0]).exists():
                raise DefectError(f"{defect.name}: expected a file of tests, got {name}")
        return list(defect.tests)
    module = defect.file.removesuffix(".py").replace("/", ".")
    wanted = {module}
    chosen = [test for room, tests in WHOLE.items() if defect.file.startswith(room) for test in tests]
    at_most = MOST + len(chosen)
    for away in range(FARTHEST):
        chosen += _nearest_first(module, root, wanted, chosen)
        if len(chosen) >= FEW + at_most - MOST or (chosen and away > 0):
            break
        wanted = {user for user, uses in _imports_of_sources(root).items() if uses & wanted}
    if not chosen:
        raise DefectError(f"{defect.name}: expected tests that import {defect.file}, found none; name them")
    return chosen[:at_most]


def _nearest_first(module: str, root: Path, wanted: set[str], known: Collection[str]) -> list[str]:
    """Tests that import one of the ``wanted``: those of the module's package and name first, then of little else."""
    package, stem = module.partition(".")[0], module.rpartition(".")[2]

    def distance(test: str) -> tuple[bool, bool, int, str]:
        return test.partition("/")[0] != package, stem not in test, len(_imports_of_tests(root)[test]), test

    found = [test for test, uses in _imports_of_tests(root).items() if uses & wanted and test not in known]
    return sorted(found, key=distance)


@functools.cache
def _imports_of_tests(root: Path) -> dict[str, frozenset[str]]:
    tests = root / "tests"
    files = [f for f in sorted(tests.rglob("test_*.py")) if f.relative_to(tests).parts[0] not in COSTLY]
    return {f.relative_to(tests).as_posix(): frozenset(_imported(f)) for f in files}


@functools.cache
def _imports_of_sources(root: Path) -> dict[str, frozenset[str]]:
    found = {}
    for package in ("telemetry", "node", "groundstation", "sim", "borechain"):
        for file in sorted((root / package).rglob("*.py")):
            name = file.relative_to(root).as_posix().removesuffix(".py").replace("/", ".")
            found[name] = frozenset(_imported(file))
    return found


def _imported(file: Path) -> Iterator[str]:
    """Modules that a source imports, and the names on the line; to parse all sources would take two seconds."""
    for module, names in IMPORT.findall(file.read_text(encoding="utf-8")):
        yield module
        yield from (f"{module}.{name.split()[0]}" for name in names.split(",") if name.split())
