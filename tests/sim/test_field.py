"""The study of a field's world: what a row says of a node."""

import numpy as np
import pytest

from sim.rig.direct_string import DirectString
from sim.studies.field.cases import BLOCKS, CASES
from sim.studies.field.run import chosen_cases, judge, row
from sim.world.scenario import scenario_of
from sim.world.world import World


def test_keys_are_unique() -> None:
    assert len({case.key for case in CASES}) == len(CASES)


def test_a_row_says_what_it_saw() -> None:
    (case,) = chosen_cases("random-phase")
    world = World(scenario_of(dict(case.setup)), 1)
    run = DirectString(world, state_every=1).drill()
    found = judge(world, run)
    assert found.surveys == BLOCKS
    made = row(case, [found, found])
    assert made["surveys_percent"] == 100.0
    assert made["gyro_step"] == made["gyro_scale"] == made["other_faults"] == 0.0
    rms = float(np.degrees(np.sqrt(np.mean(found.error[found.resting] ** 2))))
    assert made["yaw_rms_rest_deg"] == pytest.approx(rms)
    assert made["unflagged_percent"] < 1.0
