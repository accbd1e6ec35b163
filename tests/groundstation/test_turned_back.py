"""A reading that points back up the hole: told by the depth of its station, and nothing is raised."""

import math
from pathlib import Path

import numpy as np
import pytest
from hand_fed import Rig

from groundstation.survey.fusion.resolve import known_direction
from groundstation.survey.well.trajectory import Trajectory


def test_a_survey_that_points_back_up_is_named_and_the_verdict_is_that_it_is_not_known(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=8.0)
    rig.run(5.0)
    rig.drill(1, 1.0)
    rig.drill(2, 179.0)
    told = rig.ask("verdict")
    assert told["verdict"] == "dont_know"
    assert any("the survey at 4.0 m points back up the hole" in why for why in told["why"])
    rig.run(5.0)
    alarms = [row for row in rig.ask("alarms")["rig"] if row["code"] == "survey_refused"]
    assert [row["subject"] for row in alarms] == ["station at 4.00 m"]
    for path in ("trajectory", "stations", "uncertainty", "column"):
        assert rig.ask(path)
    rig.ground.close()


@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_stations_exactly_opposite_are_drawn_and_told(azimuth: float) -> None:
    drawn = Trajectory()
    drawn.put([(2.0, known_direction(0.5, azimuth)), (4.0, known_direction(math.pi - 0.5, azimuth + math.pi))])
    assert drawn.turned_back == [4.0]
    assert np.all(np.isfinite(drawn.positions))
    assert np.all(np.isfinite(drawn.covs))
    drawn.put([(4.0, known_direction(0.5, azimuth))])
    assert drawn.turned_back == []


def test_a_hole_through_the_horizontal_and_beyond_turns_nowhere_back() -> None:
    drawn = Trajectory()
    drawn.put([(float(k), known_direction(math.radians(5.0 * k), 0.3)) for k in range(1, 35)])
    assert drawn.turned_back == []
