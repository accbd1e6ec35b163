"""What stands on the lowest tube's last look alone is told, and holds what a sensor that was knocked there does."""

import math
from pathlib import Path

import numpy as np
import pytest
from string_passes import DEG, Placed, inclination_deg, knowing, passes, survey

from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.answers.model import RigModel
from groundstation.service.hole.examined_hole import ExaminedHole

STOPS = 6
SURE = {"mount_tilt_std_deg": 0.05, "accelerometer_bias_std_deg": 0.01, "mount_std_deg": 0.05}


def straight(off_deg: float = 0.0) -> list[Placed]:
    """A hole of 1 deg, in which the lowest tube reads that much more at the last stop."""
    return passes(STOPS, lambda stop, station: 1.0 + off_deg * (stop == station == STOPS))


def examined(model: RigModel) -> ExaminedHole:
    found = model.hole.examined
    assert found is not None
    return found


@pytest.mark.parametrize("part", [0.1, 0.4, 0.8])
def test_a_knock_that_is_not_found_moves_the_hole_by_less_than_is_told(tmp_path: Path, part: float) -> None:
    """A look that is off by an angle moves its station by that angle at most, and the toe by half a leg of it."""
    honest = knowing(tmp_path / "honest", straight(), STOPS, **SURE)
    alone = examined(honest).last_look
    assert alone is not None
    assert (alone.tube, alone.md) == (0, pytest.approx(2.0 * STOPS))
    knocked = knowing(tmp_path / "knocked", straight(part * alone.direction / DEG), STOPS, **SURE)
    assert examined(knocked).examination.blunders == ()
    told = examined(knocked).last_look
    assert told is not None
    off = abs(inclination_deg(knocked, -1) - inclination_deg(honest, -1)) * DEG
    moved = np.linalg.norm((knocked.hole.trajectory.positions - honest.hole.trajectory.positions)[-1, :2])
    stated = math.sqrt(np.trace(honest.hole.direction_of(honest.hole.stations[-1]).cov))
    assert 0.5 * part * alone.direction < off <= told.direction
    assert moved <= told.toe
    assert part < 0.5 or off > 3.0 * stated  # what no sigma holds


def test_it_counts_in_the_verdict_and_is_gone_once_another_tube_has_read_the_station(tmp_path: Path) -> None:
    model = knowing(tmp_path, straight(), STOPS, **SURE)
    alone = examined(model).last_look
    known = known_of(model.config, model.string, model.setup, model.hole, model.rig_alarms)
    assert alone is not None
    assert known.unfound == alone.toe > 0.0
    lifted = [(survey(2, STOPS + 1, STOPS - 1, 1.0), 2.0 * STOPS)]
    both = knowing(tmp_path / "both", straight() + lifted, STOPS, **SURE)
    assert examined(both).last_look is None
    assert known_of(both.config, both.string, both.setup, both.hole, both.rig_alarms).unfound == 0.0


def test_stations_that_are_fused_one_by_one_tell_none(tmp_path: Path) -> None:
    model = knowing(tmp_path, straight(), STOPS, weighting="bayes")
    assert known_of(model.config, model.string, model.setup, model.hole, model.rig_alarms).unfound == 0.0
