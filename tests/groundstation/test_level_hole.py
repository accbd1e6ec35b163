"""Rigs whose hole builds to the horizontal and beyond it: surveys, depths within their sigma, nothing raised."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from borechain.drilling.inline import InlineRig
from groundstation.survey.fusion.fusion import Weighting
from sim.rig.ground_settings import ground_settings
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow
LENGTH, BUILD, AZIMUTH = 2.0, 2.5, 40.0  # m, deg/m and deg


def rig_of(folder: Path, tubes: int, begin_deg: float, **settings: Any) -> tuple[World, InlineRig]:
    """A rig that has drilled an arc of a circle in the vertical from an inclination."""
    end = tubes * LENGTH
    (folder / "path.csv").write_text(
        f"md_m,inclination_deg,azimuth_deg\n0,{begin_deg},{AZIMUTH}\n{end},{begin_deg + BUILD * end},{AZIMUTH}\n"
    )
    tables: dict[str, Any] = {
        "rig": {"tubes": tubes, "tube_length_m": LENGTH},
        "path": {"stations": str(folder / "path.csv")},
        "rotation": {"turns": 5},
        "schedule": {"add_s": 58.0, "stop_s": 26.0},
        "design": {
            "inclination_deg": begin_deg,
            "azimuth_deg": AZIMUTH,
            "leg": [{"length_m": end, "build_deg_per_m": BUILD}],
        },
        "accelerometer": {"bias_std_deg": 0.002},
    }
    world = World(scenario_of(tables), 1)
    rig = InlineRig(world, ground_settings(world) | settings, "rig-1", folder)
    rig.run()
    return world, rig


def depth_on_circle(md: float, begin_deg: float) -> float:
    """True vertical depth (m) on the circle."""
    radius = 1.0 / math.radians(BUILD)
    return radius * (math.sin(math.radians(begin_deg + BUILD * md)) - math.sin(math.radians(begin_deg)))


@pytest.mark.parametrize(
    ("weighting", "begin_deg"),
    [(Weighting.BAYES, 80.0), (Weighting.ADJUSTED, 80.0), (Weighting.ADJUSTED, 160.0)],
)
def test_a_rig_that_drills_to_the_horizontal_and_beyond(tmp_path: Path, weighting: Weighting, begin_deg: float) -> None:
    _, rig = rig_of(tmp_path, 3, begin_deg, weighting=weighting.value)
    found, column = rig.ask("stations")["stations"], rig.ask("column")
    verdict = rig.ask("verdict")
    rig.close()
    below = [row for row in found if row["md_m"] > 0.0]
    assert [row["md_m"] for row in below] == [2.0, 4.0, 6.0]
    for row, measured in zip(below, (3, 2, 1), strict=True):
        assert row["measurements"] == measured
        assert abs(row["tvd_m"] - depth_on_circle(row["md_m"], begin_deg)) < 2.0 * row["sigma_tvd_m"] < 0.03
        true = begin_deg + BUILD * row["md_m"]
        assert abs(row["inclination_deg"] - true) < 3.5 * row["sigma_inclination_deg"] < 0.05, row
        assert abs(row["azimuth_deg"] - AZIMUTH) < 3.5 * row["sigma_azimuth_deg"] < 2.0
        assert all(np.isfinite(value) for value in row.values() if isinstance(value, float))
    assert column["worst"]["used_percent"] < 25.0
    assert verdict["verdict"] == "on_target"
