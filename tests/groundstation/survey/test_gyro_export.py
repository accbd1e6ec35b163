"""Our own chain as a gyro tool: what it leaves out of a record, and what comes back from its file."""

import datetime
import math

import numpy as np
import pytest

from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.tools.iscwsa_json import parse_json, to_json
from groundstation.survey.well.analysis import analyse_survey
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.gyro_export import as_gyro, needs_record
from groundstation.survey.well.methods import Method
from groundstation.survey.well.well_record import SurveyRecord

DATE = datetime.date(2026, 11, 22)
RELAY = load_tool("relay")


def record(yaw_deg: np.ndarray | None = None) -> SurveyRecord:
    md = np.arange(0.0, 31.0, 2.0)
    columns = {"sigma_force_mps2": np.full(16, 5e-4), "measurements": np.full(16, 4.0)}
    if yaw_deg is not None:
        columns["sigma_yaw_deg"] = yaw_deg
    inclination = np.radians(np.where(md > 0.0, 1.5, 0.0))
    return SurveyRecord(md, inclination, np.full(16, 1.0), list(range(16)), columns)


@pytest.mark.parametrize(("reference", "walk"), [(0.3, 0.0), (0.0, 0.1), (0.2, 0.1)])
def test_a_reference_and_a_walk_come_back_as_they_are(reference: float, walk: float) -> None:
    found = record(np.sqrt(reference**2 + walk**2 * np.arange(0.0, 31.0, 2.0)))
    tool = parse_json(to_json(as_gyro(RELAY, found), DATE), "relay.json")
    assert tool.kind == "Gyroscopic"
    assert not tool.slot_allowance
    assert not needs_record(tool)
    ours, theirs = (analyse_survey(found, Method.MINIMUM_CURVATURE, t, Site()).uncertainty.cov for t in (RELAY, tool))
    np.testing.assert_allclose(theirs, ours, rtol=1e-9, atol=1e-15)


def test_a_yaw_of_any_course_is_told_within_a_tenth() -> None:
    rng = np.random.default_rng(5)
    found = record(0.2 + 0.01 * np.arange(16) + 0.02 * rng.random(16))
    tool = as_gyro(RELAY, found)
    ours, theirs = (analyse_survey(found, Method.MINIMUM_CURVATURE, t, Site()).uncertainty.cov for t in (RELAY, tool))
    for k in (5, 10, 15):
        assert math.sqrt(np.trace(theirs[k])) == pytest.approx(math.sqrt(np.trace(ours[k])), rel=0.1)


def test_a_record_without_columns_takes_the_defaults() -> None:
    bare = SurveyRecord(*(x for x in (record().md, record().inclination, record().azimuth)), record().lines, {})
    tool = as_gyro(RELAY, bare)
    ours, theirs = (analyse_survey(bare, Method.MINIMUM_CURVATURE, t, Site()).uncertainty.cov for t in (RELAY, tool))
    np.testing.assert_allclose(theirs, ours, rtol=1e-9, atol=1e-15)
    assert needs_record(RELAY)
    assert not needs_record(load_tool("mwd-rev5.1"))
