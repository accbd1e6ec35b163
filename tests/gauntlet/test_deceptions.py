"""Deceptions of the gauntlet bite: what they are said to make wrong is wrong, and each is in both tables."""

import math
from pathlib import Path

import numpy as np
import pytest

from borechain.gauntlet.gauntlet_rig import PLANS, GauntletRig, new_rig
from sim.gauntlet.expected_doubts import EXPECTED, misled_by
from sim.gauntlet.fault_kinds import ANSWERS, KIND_OF, LASTING
from sim.gauntlet.faulty_world import MINUTE, FaultyWorld
from sim.gauntlet.plan import steps_of

SEEDS = range(1, 9)


def test_every_deception_is_a_kind_of_fault_that_lasts() -> None:
    assert set(EXPECTED) <= set(KIND_OF)
    assert set(EXPECTED) <= LASTING
    assert all(ANSWERS[name] == expected.answer for name, expected in EXPECTED.items())
    assert misled_by(["force-step", "depth-stuck"]) == {"direction", "depth"}


def drilled(kind: str, seed: int, folder: Path) -> GauntletRig:
    rig, plan = new_rig("minute", seed, folder), PLANS["minute"]
    steps = steps_of(seed, [kind], rig.world.begin + plan.rested + plan.after_begin, rig.world.end)
    rig.drill([step for _, step in steps])
    return rig


def worst_error_deg(rig: GauntletRig) -> float:
    """Angle between the hole and what is said of it, at the worst station."""
    worst = 0.0
    for station in rig.inline.ask("stations")["stations"]:
        truth = rig.world.truth_station(station["md_m"])
        one, other = (
            [math.radians(row[f"{key}_deg"]) for key in ("inclination", "azimuth")] for row in (station, truth)
        )
        dot = math.cos(one[0]) * math.cos(other[0]) + math.sin(one[0]) * math.sin(other[0]) * math.cos(
            one[1] - other[1]
        )
        worst = max(worst, math.degrees(math.acos(min(dot, 1.0))))
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("kind", [name for name, expected in EXPECTED.items() if expected.misleads == "direction"])
def test_a_deception_of_directions_bends_what_is_said_of_the_hole(
    kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    found = []
    for seed in SEEDS:
        rig = drilled(kind, seed, tmp_path_factory.mktemp(kind))
        assert kind in rig.world.deceptions
        found.append(worst_error_deg(rig))
        rig.close()
    # a hole that leans over is surveyed as it leans now, but by what was read before
    assert max(found) > (0.05 if kind != "hole-moves" else 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "least_m"), [("depth-scale", 0.02), ("depth-stuck", 0.2)])
def test_a_deception_of_depths_moves_what_is_said_of_them(
    kind: str, least_m: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    off = []
    for seed in SEEDS:
        rig = drilled(kind, seed, tmp_path_factory.mktemp(kind))
        off.append(abs(rig.world.measured_depth(rig.world.end) - rig.world.bit_depth(rig.world.end)))
        rig.close()
    assert max(off) > least_m


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["north-wrong", "collar-wrong", "length-wrong"])
def test_what_the_crew_tells_wrongly_is_entered(kind: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    for seed in SEEDS:
        rig = drilled(kind, seed, tmp_path_factory.mktemp(kind))
        assert kind in rig.world.deceptions
        item = kind.partition("-")[0]
        told = [
            row for row in rig.inline.ask("setup")["items"] if row["item"].partition(".")[0] == item and row["told"]
        ]
        assert len(told) == 1
        rig.close()


def test_a_hole_that_leans_over_is_read_as_it_leans() -> None:
    world = FaultyWorld.of_tables(MINUTE, 1).healthy()
    cycle = 150
    before = world.imu_sample(1, cycle)
    world.lean_hole(np.array([0.02, -0.01]))
    after = world.imu_sample(1, cycle)
    truth = world.truth_station(2.0)
    lean = math.degrees(math.acos(-after[5] / math.sqrt(sum(x * x for x in after[3:6]))))
    assert lean == pytest.approx(truth["inclination_deg"], abs=0.05)
    assert math.sqrt(sum(x * x for x in before[3:6])) == pytest.approx(math.sqrt(sum(x * x for x in after[3:6])))
    assert world.healthy().imu_sample(1, cycle) == before
