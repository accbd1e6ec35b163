"""A ground station that hears a string without its link knows what the one of a rig knows."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from borechain.drilling.inline import InlineRig
from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, tables_of
from borechain.studies.heard_ground import heard_ground
from borechain.studies.judged_hole import judge_hole_of, quadratic_forms
from borechain.studies.set_up.run import run_rig
from sim.rig.ground_settings import ground_settings
from sim.studies.scenarios import change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow

TUBES = 3
TABLES: dict[str, Any] = dict(
    change_sections(tables_of(RigDraw(KnownSetUp(), 5, "walk")), rig={"tubes": TUBES}, told={"lengths_off_m": ()})
)


def test_it_surveys_what_a_rig_of_the_same_world_surveys(tmp_path: Path) -> None:
    linked = World(scenario_of({**TABLES, "medium": {"link": "on"}}), 5)
    rig = InlineRig(linked, ground_settings(linked), "rig-1", tmp_path, lambda _below: 0)
    rig.run()
    expected = rig.ask("stations")["stations"]
    rig.close()
    with heard_ground(World(scenario_of(TABLES), 5)) as ground:
        found = ground.operator.ask("stations")["stations"]
        assert not ground.model.placement.unplaced
    assert [one["measurements"] for one in found] == [one["measurements"] for one in expected] == [3, 2, 1]
    for one, other in zip(found, expected, strict=True):
        assert one["md_m"] == pytest.approx(other["md_m"], abs=1e-6)
        assert one["inclination_deg"] == pytest.approx(other["inclination_deg"], abs=0.01)
        assert one["azimuth_deg"] == pytest.approx(other["azimuth_deg"], abs=0.5)


def test_a_hole_is_judged_at_the_true_depth_of_its_readings() -> None:
    world = World(scenario_of({**TABLES, "told": {"depth_offset_m": 0.5}}), 5)
    with heard_ground(world) as ground:
        judged = judge_hole_of(world, ground.model.hole)
    np.testing.assert_allclose(judged.md, [2.5, 4.5, 6.5], atol=1e-6)
    # told half a metre too deep, the hole is told half a metre too long
    np.testing.assert_allclose(judged.error[:, 2], 0.5, atol=0.02)


def test_a_rig_of_the_study_is_judged_by_its_own_numbers() -> None:
    run = run_rig(RigDraw(KnownSetUp(), 3, "random"))
    assert len(run.judged.md) == len(run.best_std) == 10
    assert np.all(run.best_std > 0.0)
    assert np.all(np.isfinite(run.judged.ellipsoid_squares))


def test_a_quadratic_form_is_the_square_in_standard_deviations() -> None:
    error, std = np.array([[1.0, -2.0, 3.0], [0.0, 1.0, 0.0]]), np.array([0.5, 2.0, 3.0])
    cov = np.stack([np.diag(std**2)] * 2)
    np.testing.assert_allclose(quadratic_forms(error, cov), [4.0 + 1.0 + 1.0, 0.25])
