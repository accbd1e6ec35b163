"""A minute after the last fault all is well in every seed, and what is not well is told."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from borechain.gauntlet.gauntlet_rig import GauntletRig, make_ready, new_rig
from borechain.gauntlet.gauntlet_run import SeedJob, judge_seed, run_seed
from borechain.gauntlet.wellness import still_unwell
from telemetry.messages import BASE

PLAN = "calmed"


@pytest.mark.parametrize(
    ("first", "count"),
    [pytest.param(9_100_000, 4, marks=pytest.mark.slow), pytest.param(9_100_004, 400, marks=pytest.mark.statistical)],
)
def test_a_minute_after_the_last_fault_all_is_well(first: int, count: int) -> None:
    failed = [one for seed in range(first, first + count) if (one := judge_seed(SeedJob(seed, plan=PLAN))).violations]
    assert [(one.seed, one.kinds, one.violations) for one in failed] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "kinds"),
    [
        (9000006, ("database-deleted",)),  # each gap of the numbers waited for half a minute, one after the other
        (9001, ("database-rots",)),  # the newest survey was damaged: its gap waited until the one before was given up
        (9000000, ("folders-swapped",)),  # each tube sent the other's messages for ever
        (
            9600000,
            ("database-deleted",),
        ),  # a survey came before the first state: no tube was ever known, nothing placed
        (9500007, ("ground-off-across-stop", "same-number")),  # the crew told which tube it is while nothing heard it
        (9400760, ("ground-cut", "database-old")),  # restored under a running ground station, it took nothing any more
        (9400895, ("database-old", "depth-jumps-up")),  # the stop that went on after a jump was another, not surveyed
        (9401004, ("force-creep",)),  # a force of 1.05 g begins an average anew: no survey is owed, the word of it is
    ],
)
def test_what_was_not_well_within_a_minute_is(seed: int, kinds: tuple[str, ...]) -> None:
    assert run_seed(seed, kinds=kinds, plan=PLAN).violations == []


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[GauntletRig]:
    make_ready(PLAN, [0])
    made = new_rig(PLAN, 0, tmp_path)
    made.advance(made.world.end - 34.0)
    yield made
    made.close()


def nothing(_: GauntletRig) -> None: ...


def a_tube_without_power(rig: GauntletRig) -> None:
    rig.cut(1)


def a_disk_that_refuses(rig: GauntletRig) -> None:
    rig.disk(BASE).refusal = 28


def no_depth(rig: GauntletRig) -> None:
    rig.world.depth_hidden = True


def a_slip(rig: GauntletRig) -> None:
    rig.world.slipped = 400


@pytest.mark.slow
@pytest.mark.parametrize(
    ("harm", "told"),
    [
        (nothing, ()),
        (a_tube_without_power, ("without power: [1]", "tube_silent of tube 1", "tube 1: no survey", "live: stale")),
        (a_disk_that_refuses, ("process 1: ", "wait for their receipts", "disk of database", "tube 1: no survey")),
        (no_depth, ("depth_silent of depth", "survey_unplaced of tube 2", "live: stale")),
        (a_slip, ("reference of encoder",)),
    ],
)
def test_what_is_still_wrong_is_told(
    rig: GauntletRig, harm: Callable[[GauntletRig], None], told: tuple[str, ...]
) -> None:
    harm(rig)
    rig.advance(rig.world.end)
    found = "; ".join(still_unwell(rig))
    assert bool(found) == bool(told), found
    for text in told:
        assert text in found
