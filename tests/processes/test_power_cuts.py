"""Rigs of real processes that lose their power by schedule: what the crew gets is what one process works out."""

import contextlib
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs import running_rig

from groundstation.service.disk.ground_store import Store
from sim.node_kills import KillNode
from sim.world.scenario import load_scenario
from sim.world.world import World
from telemetry.messages import BASE, ENCODER

pytestmark = pytest.mark.process

WELLBORE = Path("scenarios/wellbore-1.toml")
GROUND_KILLS, OTHER_KILLS, DOWN = 20, 2, 6.0
LONGEST = 1500.0  # s, of a rig that starts a process again forty times on a busy machine
LEFT_ALONE = 8.0  # s at least, between two kills of one process


def drilled(folder: Path, faults: list[KillNode], *arguments: str, scenario: str) -> dict[str, Any]:
    words = [word for fault in faults for word in ("--fault", str(fault))]
    with running_rig(folder, "--seed", "1", *words, *arguments, scenario=scenario) as rig:
        return rig.result(LONGEST)


def told(folder: Path) -> set[str]:
    """Kinds of all alarms that the crew was shown, over every life of the ground station."""
    with contextlib.closing(Store(f"sqlite:///{folder / 'run' / 'state' / 'ground' / 'ground.sqlite'}")) as store:
        return {alarm.condition.code for alarm in store.alarms()}


def test_a_ground_station_that_is_off_across_a_stop_and_an_encoder_cut_lose_no_survey(tmp_path: Path) -> None:
    """The second stop lasts from 197 to 223 s; the digest over processes is that of one process."""
    scenario, faults = "scenarios/rig-3.toml", [KillNode(BASE, 190.0, 40.0), KillNode(ENCODER, 290.0, 8.0)]
    over_processes = drilled(tmp_path / "processes", faults, scenario=scenario)
    inline = drilled(tmp_path / "inline", faults, "--inline", scenario=scenario)
    assert over_processes["digest"] == inline["digest"]
    assert [(s["md_m"], s["measurements"]) for s in over_processes["stations"]] == [(2.0, 3), (4.0, 2), (6.0, 1)]
    assert over_processes["missing"] == []
    assert "epoch" in told(tmp_path / "processes")
    assert over_processes["restarts"] == 0  # of processes that were to live


def kills(world: World) -> list[KillNode]:
    """The ground station twenty times, the encoder and each tube twice, at random times and apart."""
    random = np.random.default_rng(1)
    added = {phase.tube: phase.joint_closed for phase in world.phases if phase.kind == "add"}
    found = []
    for address, since in ({BASE: world.begin, ENCODER: world.begin} | added).items():
        count = GROUND_KILLS if address == BASE else OTHER_KILLS
        edges = np.linspace(since + 20.0, world.end - 60.0, count + 1) - world.begin
        for first, last in itertools.pairwise(edges.tolist()):
            found.append(KillNode(address, round(float(random.uniform(first, last - DOWN - LEFT_ALONE)), 3), DOWN))
    return found


@pytest.mark.statistical
@pytest.mark.timeout(3000)
def test_wellbore_1_under_many_kills_over_processes_is_that_of_one_process(tmp_path: Path) -> None:
    faults = kills(World(load_scenario(WELLBORE), 1))
    undisturbed = drilled(tmp_path / "calm", [], "--inline", scenario=str(WELLBORE))
    inline = drilled(tmp_path / "inline", faults, "--inline", scenario=str(WELLBORE))
    over_processes = drilled(tmp_path / "processes", faults, scenario=str(WELLBORE))
    print({key: (inline[key], over_processes[key]) for key in ("digest", "measurements", "missing")})
    assert over_processes["digest"] == inline["digest"]
    surveys = [[(s["md_m"], s["measurements"]) for s in run["stations"]] for run in (undisturbed, over_processes)]
    crew_saw = told(tmp_path / "processes")
    assert surveys[0] == surveys[1] or "survey_missing" in crew_saw
    assert {"epoch", "tube_restarted"} <= crew_saw
    for calm, killed in zip(undisturbed["stations"], over_processes["stations"], strict=True):
        for axis in ("north", "east", "tvd"):
            sigma = max(calm[f"sigma_{axis}_m"], killed[f"sigma_{axis}_m"])
            assert abs(calm[f"{axis}_m"] - killed[f"{axis}_m"]) <= 3.0 * sigma
