"""A hole of many looks begins where one of earlier looks ended, and comes to the same whatever was asked before."""

from pathlib import Path

import numpy as np
import pytest
from string_passes import knowing, passes

from groundstation.service.answers.model import RigModel
from groundstation.survey.adjustment import normal_equations
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.fusion.shared import KIND_NAMES, SharedErrors

STOPS = 22  # so that there is a beginning of sixteen stops and one of twenty


def adjusted(model: RigModel) -> Adjusted:
    assert model.hole.examined is not None
    return model.hole.examined.adjusted


def test_many_looks_come_to_the_same_whatever_was_asked_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(normal_equations, "MANY", 150)
    measurements = passes(STOPS, lambda _stop, station: 1.0 + 0.02 * station)
    known, more = measurements[:-STOPS], measurements[-STOPS:]
    asked = knowing(tmp_path, known, STOPS)
    for measurement, md in more[::-1]:  # in another order, and asked after each
        assert asked.placement.place_one(measurement, md) == ""
        asked.hole.settle()
    never = knowing(tmp_path, measurements, STOPS)
    one, other = adjusted(asked), adjusted(never)
    assert len(other.looks) == len(measurements)
    assert one.now.tangents.tobytes() == other.now.tangents.tobytes()
    assert one.now.tubes.tobytes() == other.now.tubes.tobytes()
    assert asked.hole.trajectory.covs.tobytes() == never.hole.trajectory.covs.tobytes()
    settled = adjust_hole(other.looks, other.string, other.path, start=other.now)
    toes = [one.now.tangents.sum(axis=0) for one in (other, settled)]
    assert np.linalg.norm(toes[1] - toes[0]) < 1e-3 * np.sqrt(np.trace(other.covs[-1, :2, :2]))
    check_shared_depths(never)


def check_shared_depths(model: RigModel) -> None:
    """What depths share of every position, as a sum of its own and among all shared columns."""
    drawn, shared = model.hole.trajectory, shared_of(model)
    by_kind = np.concatenate([shared.variances(columns) for columns in drawn.columns()])
    of_depth = by_kind[:, KIND_NAMES.index("depth")]
    assert of_depth.max() > 0.0
    np.testing.assert_allclose(drawn.shared_depth_vars, of_depth, rtol=1e-9, atol=1e-12 * of_depth.max())


def shared_of(model: RigModel) -> SharedErrors:
    return model.hole._shared
