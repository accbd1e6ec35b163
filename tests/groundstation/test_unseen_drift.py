"""What a belt of the encoder that slips at every stop may do unfound: held against readings that were turned so."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from string_passes import DEG, Placed, knowing, survey

from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.answers.model import RigModel
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.least_found import DRIFT, LARGEST
from groundstation.survey.adjustment.reliability import measure_reliability
from groundstation.survey.adjustment.toe_weights import toe_weights
from groundstation.survey.adjustment.unseen_drift import UnseenDrift, places_moved

STOPS = 8
LEAN_DEG = 25.0
PLAY_DEG = 0.01
KNOWN = {
    "mount_tilt_std_deg": 0.05, "accelerometer_bias_std_deg": 0.01, "mount_std_deg": 0.05, "north_std_deg": 0.1,
    "collar_inclination_deg": LEAN_DEG, "collar_azimuth_deg": 0.0, "collar_std_deg": 0.2, "play_std_deg": PLAY_DEG,
}  # fmt: skip


def drilled(folder: Path, a_stop: float, stops: int = STOPS) -> RigModel:
    """A straight hole of tubes that lie askew, whose readings are turned by ``a_stop`` rad more at every stop."""
    askew = np.random.default_rng(5).normal(0.0, PLAY_DEG, (STOPS + 1, STOPS + 1, 2)).tolist()
    readings: list[Placed] = []
    for stop, tube in itertools.product(range(1, stops + 1), repeat=2):
        if tube > stop:
            continue
        up, across = askew[stop][tube]
        azimuth_deg = across / math.sin(LEAN_DEG * DEG) + a_stop / DEG * stop
        reading = survey(tube, stop, stop - tube + 1, LEAN_DEG + up, azimuth_deg)
        readings.append((reading, 2.0 * (stop - tube + 1)))
    return knowing(folder, readings, stops, **KNOWN)


def unseen(model: RigModel) -> UnseenDrift:
    assert model.hole.examined is not None
    found = model.hole.examined.unseen_drift
    assert found is not None
    return found


@pytest.mark.parametrize("part", [-0.6, 0.5])
def test_a_drift_that_is_not_found_moves_the_hole_by_its_part_of_what_is_told(tmp_path: Path, part: float) -> None:
    honest = drilled(tmp_path / "honest", 0.0)
    told = unseen(honest)
    assert 0.0 < told.a_stop < LARGEST[BlunderKind.ENCODER_DRIFTS]
    slipped = drilled(tmp_path / "slipped", part * told.a_stop)
    assert slipped.hole.examined is not None
    assert slipped.hole.examined.examination.blunders == ()
    moved = slipped.hole.trajectory.positions - honest.hole.trajectory.positions
    np.testing.assert_allclose(moved[:, :2], part * told.positions[:, :2], rtol=0.02, atol=6e-4)  # legs bend
    turned = [
        slipped.hole.direction_of(one).lean - honest.hole.direction_of(other).lean
        for one, other in zip(slipped.hole.stations, honest.hole.stations, strict=True)
        if one.md > 0.0
    ]
    np.testing.assert_allclose(turned, part * told.tangents[1:, :2], rtol=0.02, atol=6e-5)  # a turn is an arc


def test_one_well_above_it_is_found_and_is_no_longer_told_as_unseen(tmp_path: Path) -> None:
    told = unseen(drilled(tmp_path / "honest", 0.0))
    found = drilled(tmp_path / "slipped", 2.0 * told.a_stop)
    assert found.hole.examined is not None
    assert [one.best.hypothesis for one in found.hole.examined.examination.blunders] == [DRIFT]
    assert found.hole.examined.is_drift_known
    assert found.hole.examined.unseen_drift is None
    assert DRIFT not in [one.hypothesis for one in found.hole.examined.reliabilities]


def test_it_is_the_drift_of_the_reliabilities_and_counts_in_the_verdict(tmp_path: Path) -> None:
    model = drilled(tmp_path, 0.0)
    told, examined = unseen(model), model.hole.examined
    assert examined is not None
    (one,) = [one for one in examined.reliabilities if one.hypothesis == DRIFT]
    assert told.a_stop == one.smallest
    (by_scores,) = measure_reliability(
        examined.adjusted, examined.run, [DRIFT], toe_weights(examined.adjusted), LARGEST, examined.chance
    )
    assert one.smallest == pytest.approx(by_scores.smallest, rel=1e-9)
    np.testing.assert_allclose(one.at_toe, by_scores.at_toe, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(one.by_size, by_scores.by_size, rtol=1e-9, atol=1e-15)
    known = known_of(model.config, model.string, model.setup, model.hole, model.rig_alarms)
    assert known.drift == told.toe == math.hypot(*told.positions[-1, :2])


@pytest.mark.parametrize("stops", [1, 2, 3])
def test_two_stops_cannot_tell_a_drift_from_a_slip(tmp_path: Path, stops: int) -> None:
    """Of three it is told by little, and is reckoned with as large as a wheel that slips."""
    examined = drilled(tmp_path, 0.0, stops).hole.examined
    if stops < 3:
        assert examined is None or examined.unseen_drift is None
        return
    assert examined is not None
    assert examined.unseen_drift is not None
    assert examined.unseen_drift.a_stop <= 0.5 * DEG


def test_places_are_the_sums_of_legs_along_the_mean_of_their_ends() -> None:
    tangents = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.03, -0.02, 0.0]])
    np.testing.assert_allclose(
        places_moved(np.array([0.0, 2.0, 5.0]), tangents), [[0.0] * 3, [0.01, 0.0, 0.0], [0.07, -0.03, 0.0]]
    )
