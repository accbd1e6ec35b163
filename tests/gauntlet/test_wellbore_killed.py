"""Wellbore 1 with the ground station killed twenty times, every node and the encoder twice: the same surveys."""

from pathlib import Path

import numpy as np
import pytest

from borechain.gauntlet.gauntlet_rig import GauntletRig
from borechain.gauntlet.oracles import Observer
from sim.gauntlet.fault import Step
from sim.gauntlet.faulty_disk import FaultyDisk
from sim.gauntlet.faulty_world import FaultyWorld
from sim.rig.ground_settings import ground_settings
from sim.world.random_streams import random_stream
from sim.world.scenario import load_scenario
from sim.world.shipped import find_scenario
from telemetry.messages import BASE, ENCODER

SEED, GROUND_KILLS, OTHER_KILLS = 1, 20, 2
OFF_S = 6.0


def drilled(folder: Path, *, killed: bool) -> tuple[GauntletRig, Observer]:
    folder.mkdir()
    world = FaultyWorld(load_scenario(find_scenario(Path("wellbore-1"))), SEED)
    tubes = range(1, world.scenario.tubes + 1)
    disks = {address: FaultyDisk(random_stream(SEED, 1, address)) for address in (BASE, ENCODER, *tubes)}
    rig = GauntletRig(world, disks, ground_settings(world), SEED, folder)
    rig.begin(world.begin)
    observer = Observer(rig, world.begin)
    rig.drill(kills(world) if killed else [], observer.look)
    return rig, observer


def kills(world: FaultyWorld) -> list[Step]:
    """Cuts of the power of each process, drawn over the time in which it is there, none in the survey at the end."""
    random = np.random.default_rng(SEED)
    added = {phase.tube: phase.joint_closed for phase in world.phases if phase.kind == "add"}
    since = {BASE: world.begin, ENCODER: world.begin} | added
    steps = []
    for address, begin in since.items():
        for at in random.uniform(begin + 90.0, world.end - 120.0, GROUND_KILLS if address == BASE else OTHER_KILLS):
            steps.append(Step(float(at), lambda rig, a=address: rig.cut(a)))
            steps.append(Step(float(at) + OFF_S, lambda rig, a=address: rig.start(a)))
    return sorted(steps, key=lambda step: step.at)


@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_wellbore_1_under_many_kills_has_the_surveys_of_the_undisturbed_run(tmp_path: Path) -> None:
    calm, _ = drilled(tmp_path / "calm", killed=False)
    killed, observer = drilled(tmp_path / "killed", killed=True)
    assert observer.found == []
    surveys = [
        {(row["tube"], round(row["md_m"], 2)) for row in rig.inline.ask("measurements")["measurements"]}
        for rig in (calm, killed)
    ]
    missing = surveys[0] - surveys[1]
    standing = {row["code"] for row in killed.inline.ask("alarms")["rig"]}
    assert surveys[1] <= surveys[0]
    assert bool(missing) == ("survey_missing" in standing)
    assert "reference" not in standing  # the encoder never slipped
    assert len(missing) <= 0.1 * len(surveys[0])
    both = [rig.inline.ask("trajectory")["points"] for rig in (calm, killed)]
    for undisturbed, other in zip(*both, strict=True):
        for axis in ("north", "east", "tvd"):
            off = abs(undisturbed[f"{axis}_m"] - other[f"{axis}_m"])
            assert off <= 3.0 * max(other[f"sigma_{axis}_m"], undisturbed[f"sigma_{axis}_m"])
    told = {(code, subject) for code, subject, _ in observer.seen}
    assert {("tube_restarted", f"tube {tube}") for tube in range(1, calm.world.scenario.tubes + 1)} <= told
    assert ("epoch", "encoder") in told
    calm.close()
    killed.close()
