"""The compiled loop against the arrays: the same numbers, the same refusals."""

import math
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool, shipped_tool_names
from groundstation.survey.well.analysis import analyse_survey
from groundstation.survey.well.compiled_model import (
    COMPILED_FROM,
    CompiledModel,
    _load,
    locate_many,
    preload_models,
    write_model,
)
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from groundstation.survey.well.reference_frames import Norths, ReferenceFrame
from groundstation.survey.well.well_record import SurveyRecord
from node.kernels.arithmetic import jit

SITE = Site(9.80665, 50_300.0, math.radians(68.0), math.radians(2.0), math.radians(55.0))


def wells(seed: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    random = np.random.default_rng(seed)
    found = []
    for count in (2, 3, 4, 30, 300):
        md = np.concatenate([[0.0], np.cumsum(random.uniform(0.5, 40.0, count - 1))])
        inclination = np.radians(np.clip(np.linspace(0.0, 25.0, count) + random.normal(0.0, 1.0, count), 0.0, 29.0))
        azimuth = random.uniform(0.0, 6.0) + np.cumsum(random.normal(0.0, 0.05, count))
        if count > 3:
            inclination[:3] = 0.0
        found.append((md, inclination, azimuth))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_tool_names())
def test_a_compiled_tool_gives_what_the_arrays_give(name: str) -> None:
    tool = load_tool(name)
    model = CompiledModel(tool)
    for md, inclination, azimuth in wells(len(name)):
        for method in (Method.MINIMUM_CURVATURE, Method.BALANCED_TANGENTIAL):
            places, cov = model.run(method, md, inclination, azimuth, SITE)
            expected = station_positions(method, md, inclination, azimuth)
            np.testing.assert_allclose(places, expected, rtol=0.0, atol=1e-9)
            survey = WellSurvey(md, inclination, azimuth, expected[:, 2])
            wanted = propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=tool.slot_allowance).cov
            scale = np.trace(wanted, axis1=1, axis2=2)[:, None, None] + 1e-30
            assert np.max(np.abs(cov - wanted) / scale) < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("name", ["relay", "stim300", "gyro-continuous"])
@pytest.mark.parametrize("method", list(Method))
def test_many_wells_at_one_go_are_what_each_is(name: str, method: Method) -> None:
    random = np.random.default_rng(3)
    md = np.cumsum(random.uniform(0.5, 30.0, (20, 12)), axis=1)
    md[::2] -= md[::2, :1]  # every other begins at the datum
    inclination, azimuth = random.uniform(0.0, 0.4, md.shape), random.uniform(0.0, math.tau, md.shape)
    record = {"SigmaYaw": random.uniform(0.001, 0.01, md.shape)}
    tool = load_tool(name)
    survey = WellSurvey(md, inclination, azimuth, md, record)
    places, cov = locate_many(method, survey, tool, SITE, slot_allowance=True)
    for w in range(len(md)):
        alone = WellSurvey(md[w], inclination[w], azimuth[w], md[w], {"SigmaYaw": record["SigmaYaw"][w]})
        expected, wanted, _ = CompiledModel(tool).locate(method, alone, SITE, slot_allowance=True)
        np.testing.assert_allclose(places[w], expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(cov[w], wanted, rtol=1e-9, atol=1e-15)


def test_a_well_of_many_that_cannot_be_is_named() -> None:
    md, zero = np.array([[0.0, 10.0, 20.0]] * 3), np.zeros((3, 3))
    back = zero.copy()
    back[1] = 0.0, math.pi, math.pi
    method, tool = Method.MINIMUM_CURVATURE, load_tool("stim300")
    deeper = md.copy()
    deeper[2] = 10.0, 20.0, 15.0
    with pytest.raises(SurveyError, match="well 1, station 1: the hole turns straight back"):
        locate_many(method, WellSurvey(md, back, zero, md), tool, SITE)
    with pytest.raises(SurveyError, match="station 2: expected a depth beyond 20 m, got 15 m"):
        locate_many(
            method, WellSurvey(md + [[0.0], [0.0], [10.0]] * np.array([1.0, 1.0, -0.5]), zero, zero, md), tool, SITE
        )


GYRO_MODELS = sorted((Path(__file__).parents[2] / "data" / "survey").glob("spe90408-model-4.toml"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "every"),
    [
        ("relay", 1),
        *((str(path), 8) for path in GYRO_MODELS),  # every eighth term; whole it compiles for a quarter of a minute
        *(pytest.param(str(path), 1, marks=pytest.mark.statistical) for path in GYRO_MODELS),
    ],
    ids=lambda value: Path(str(value)).stem,
)
def test_every_compiled_source_is_that_of_the_arrays(name: str, every: int) -> None:
    tool = load_tool(name)
    tool = replace(tool, terms=tool.terms[::every])
    model, whole = CompiledModel(tool, by_source=True), CompiledModel(tool)
    md, inclination, azimuth = wells(7)[-1]
    inclination = np.abs(np.radians(40.0) * np.sin(np.linspace(0.0, 7.0, len(md)))) * (
        inclination > 0.0
    )  # passes gates
    places = station_positions(Method.RADIUS_OF_CURVATURE, md, inclination, azimuth)
    record = {"SigmaYaw": np.linspace(0.001, 0.01, len(md)), "Time": np.linspace(0.0, 9000.0, len(md))}
    survey = WellSurvey(md, inclination, azimuth, places[:, 2], record)
    wanted = propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=True)
    cov, parts = model.covariance(survey, SITE, slot_allowance=True)
    scale = np.trace(wanted.cov, axis1=1, axis2=2)[:, None, None] + 1e-30
    assert list(parts) == [term.name for term in tool.terms]
    for source, expected in wanted.by_source().items():
        assert np.max(np.abs(parts[source] - expected)[1:] / scale[1:]) < 1e-11, source
    for found in (cov, whole.covariance(survey, SITE, slot_allowance=True)[0]):
        assert np.max(np.abs(found - wanted.cov) / scale) < 1e-11


def test_the_written_loop_is_cached_by_its_text() -> None:
    tool = load_tool("stim300")
    assert write_model(tool) == write_model(load_tool("stim300"))
    assert CompiledModel(tool)._function is not None


def test_what_cannot_be_is_refused() -> None:
    model = CompiledModel(load_tool("stim300"))
    md, zero = np.array([0.0, 10.0, 20.0]), np.zeros(3)
    with pytest.raises(SurveyError, match="expected a depth beyond 10 m"):
        model.run(Method.MINIMUM_CURVATURE, np.array([0.0, 10.0, 10.0]), zero, zero, SITE)
    with pytest.raises(SurveyError, match="station 1: the hole turns straight back"):
        model.run(Method.MINIMUM_CURVATURE, md, np.array([0.0, math.pi, math.pi]), zero, SITE)
    endless = SurveyTool("t", "t", (Term("A", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "1 / Sin(Inc)", "0")),))
    with pytest.raises(ToolError, match="term A: its weight has no value"):
        CompiledModel(endless).run(Method.MINIMUM_CURVATURE, md, zero, zero, SITE)


@pytest.mark.slow
def test_a_long_survey_is_compiled_and_a_short_one_of_it_is_the_same() -> None:
    md = np.linspace(0.0, 400.0, COMPILED_FROM)
    record = SurveyRecord(md, np.linspace(0.0, 0.4, len(md)), np.linspace(0.5, 1.0, len(md)), list(range(len(md))), {})
    short = SurveyRecord(*(x[:-1] for x in (md, record.inclination, record.azimuth)), record.lines[:-1], {})
    tool, method = replace(load_tool("relay"), name="held by this test alone"), Method.MINIMUM_CURVATURE
    frame = ReferenceFrame("site", "true", Norths(site=0.2))
    arrays, compiled, held = (
        analyse_survey(r, method, tool, SITE, frame=frame).uncertainty for r in (short, record, short)
    )
    assert compiled.model.quick_parts is not None
    assert arrays.model.quick_parts is None
    np.testing.assert_allclose(compiled.cov[:-2], arrays.cov[:-1], rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(compiled.cov[:-2], held.cov[:-1])  # the same loop over the same stations
    for name, cov in arrays.by_source().items():
        np.testing.assert_allclose(held.by_source()[name], cov, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(compiled.by_source()[name][1:-2], cov[1:-1], rtol=1e-9, atol=1e-15)
    assert (
        analyse_survey(short, method, tool, SITE).uncertainty.model.quick_parts is not None
    )  # the long one asked for them


@pytest.mark.slow
def test_a_warmed_tool_serves_surveys_of_any_length() -> None:
    preload_models(["relay"])
    record = SurveyRecord(np.array([0.0, 2.0, 4.0]), np.zeros(3), np.zeros(3), [0, 1, 2], {})
    assert analyse_survey(record, Method.BALANCED_TANGENTIAL, load_tool("relay"), SITE).uncertainty.model.quick_parts


def test_an_instrument_stays_compiled_whatever_other_is_compiled_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(vars(numba.config), "CACHE_DIR", str(tmp_path))

    def stamp(name: str) -> str:
        jit.folder_digest.cache_clear()  # as a process that has just begun
        return str(_load(write_model(load_tool(name)))[0]._cache._impl.locator.get_source_stamp())

    before = stamp("relay")
    assert stamp("mwd-rev5.1") != before
    assert stamp("relay") == before
    assert {path.suffix for path in tmp_path.rglob("model_*") if path.is_file()} <= {".py", ".pyc"}
