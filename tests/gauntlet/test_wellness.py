"""A minute after the last fault all is well in every seed, and what is not well is told."""

import tempfile
from pathlib import Path

import pytest

from borechain.gauntlet.gauntlet_rig import GauntletRig, make_ready, new_rig
from borechain.gauntlet.gauntlet_run import ALL, judge_seed
from borechain.gauntlet.wellness import still_unwell
from telemetry.messages import BASE

SEEDS = range(5_200_000, 5_200_012)


@pytest.mark.slow
def test_a_minute_after_the_last_fault_all_is_well() -> None:
    failed = [one for seed in SEEDS if (one := judge_seed((seed, ALL, None, "calmed"))).violations]
    assert [(one.seed, one.kinds, one.violations) for one in failed] == []


@pytest.fixture
def rig() -> GauntletRig:
    make_ready("calmed", [0])
    return new_rig("calmed", 0, Path(tempfile.mkdtemp(prefix="gauntlet-")))


@pytest.mark.slow
def test_what_is_still_wrong_is_told(rig: GauntletRig) -> None:
    rig.advance(rig.world.end - 30.0)
    assert list(still_unwell(rig)) == []
    rig.cut(1)
    rig.disk(BASE).refusal = 28
    rig.advance(rig.world.end)
    told = " ".join(still_unwell(rig))
    assert "without power: [1]" in told
    assert "tube_silent of tube 1" in told
    assert "not live" in told
    rig.close()
