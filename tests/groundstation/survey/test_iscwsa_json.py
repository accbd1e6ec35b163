"""The industry's JSON error models: what is read, what is written, and what is neither."""

import datetime
import json
import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from referencing import Registry, Resource
from wells import import_welleng

from groundstation.errors import ToolError
from groundstation.survey.tools.instruments import (
    PropagationMode,
    SurveyTool,
    Term,
    load_tool,
    parse_toml,
    shipped_tool_names,
)
from groundstation.survey.tools.iscwsa_json import XCL, parse_json, to_json
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions

WELLENG = find_spec("welleng")  # found, not imported
assert WELLENG is not None
assert WELLENG.origin is not None
PUBLISHED = Path(WELLENG.origin).parent / "errors"
FILES = sorted((PUBLISHED / "iscwsa_json" / "owsg_a").glob("*.json"))
# Free gyros whose files leave out how fast they run
NEEDING = {"CB_Film_GMS", "CB_Film_GSS"}
COMPARED_ELSEWHERE = {*NEEDING, "GYRO-NS-CT"}  # in test_gyro_modes.py
DATE = datetime.date(2024, 2, 29)
SITE = Site(9.80665, 50_000.0, math.radians(72.0), math.radians(3.0), math.radians(60.0))


def name_of(path: Path) -> str:
    return path.stem.removesuffix("_Fl")


def well(steepest_deg: float, count: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A hole that builds from the vertical and turns across north, degrees."""
    rng = np.random.default_rng(30)
    md = np.concatenate([[0.0], np.cumsum(rng.uniform(2.0, 30.0, count - 1))])
    return md, np.linspace(0.0, steepest_deg, count), np.mod(330.0 + 7.0 * np.arange(count), 360.0) * (md > 0.0)


def survey_of(md: np.ndarray, inclination: np.ndarray, azimuth: np.ndarray) -> WellSurvey:
    i, a = np.radians(inclination), np.radians(azimuth)
    return WellSurvey(md, i, a, station_positions(Method.MINIMUM_CURVATURE, md, i, a)[:, 2])


def covariance(tool: SurveyTool, steepest_deg: float) -> np.ndarray:
    return propagate_errors(survey_of(*well(steepest_deg)), [Leg(tool)], SITE, slot_allowance=True).cov


def row(**changed: Any) -> dict[str, Any]:
    good = {
        "name": "A",
        "value": 0.1,
        "units": "deg",
        "propagation_mode": "Systematic",
        "depth_formula": "0",
        "inclination_formula": "1",
        "azimuth_formula": "0",
    }
    return {**good, **changed}


def text_of(*rows: Any, **more: Any) -> str:
    return json.dumps({"metadata": {"short_name": "mine"}, "parameters": {}, "terms": list(rows), **more})


def refusal(text: str) -> str:
    """Message with which a text is refused, or nothing."""
    try:
        parse_json(text, "f.json")
    except ToolError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("path", [f for f in FILES if name_of(f) not in COMPARED_ELSEWHERE], ids=lambda path: path.stem)
def test_published_models_give_the_regions_their_publisher_computes(path: Path) -> None:
    text = path.read_text("utf-8")
    model, tool = json.loads(text), load_tool(str(path))
    assert tool.name == model["metadata"]["short_name"]
    assert [term.name for term in tool.terms] == [entry["name"] for entry in model["terms"]]
    # the publisher's limit excludes the limit itself
    md, inclination, azimuth = well(min(60.0, 0.95 * math.degrees(tool.inclination_range[1])))
    welleng = import_welleng()
    header = welleng.survey.SurveyHeader(
        latitude=60, longitude=2, altitude=0, b_total=50_000, dip=72, declination=3, convergence=0, G=9.80665,
        azi_reference="true",
    )  # fmt: skip
    theirs = welleng.survey.Survey(md, inclination, azimuth, header=header, error_model=model).err.errors.errors
    # the allowance for the direction of the slot came with revision 5
    allowance = model["metadata"]["revision_number"] >= 5
    ours = propagate_errors(
        survey_of(md, inclination, azimuth), [Leg(tool)], SITE, slot_allowance=allowance
    ).by_source()
    assert set(ours) == set(theirs)
    for name, cov in ours.items():
        expected = theirs[name].cov_NEV[1:]
        scale = np.trace(expected, axis1=1, axis2=2)[:, None, None] + 1e-30
        np.testing.assert_allclose(cov[1:] / scale, expected / scale, rtol=0.0, atol=1e-3, err_msg=name)


@pytest.mark.slow
def test_all_published_models_are_read_and_two_need_a_parameter() -> None:
    for path in FILES:
        given = {"GZRunningSpeed": 1800.0} if name_of(path) in NEEDING else None
        assert load_tool(str(path), given).slot_allowance
    assert len(FILES) == 58


@pytest.mark.parametrize("path", [f for f in FILES if name_of(f) in NEEDING], ids=lambda path: path.stem)
def test_a_model_that_leaves_out_a_parameter_is_refused_with_those_it_has(path: Path) -> None:
    message = r"term GZ-GD: formula .*unknown name GZRunningSpeed; .*a parameter of the tool \(XCLTortuosity, noise_"
    with pytest.raises(ToolError, match=message) as caught:
        load_tool(str(path))
    assert str(caught.value).startswith(str(path))


def test_course_length_terms_take_the_definition_and_not_the_angles_of_the_sheet() -> None:
    tool = parse_json(text_of(row(name="XCLA", units="-", azimuth_formula="Max(Inc, 1)"), row(name="XCLH")), "f")
    for term in tool.terms:
        assert term.position == XCL[term.name]
        assert term.weights == ("0", "0", "0")


def test_singular_weights_are_read_where_one_of_them_is_given() -> None:
    tool = parse_json(
        text_of(
            row(north_singularity=None, east_singularity="1", vertical_singularity=None),
            row(name="B", north_singularity=None, east_singularity=None),
        ),
        "f",
    )
    assert [term.singular for term in tool.terms] == [("0", "1", "0"), None]


def exportable() -> list[str]:
    """Shipped tools whose every term the schema can say."""
    return ["mwd-rev4", "mwd-rev5.1", "rst-inclinometer"]


@pytest.mark.parametrize("name", exportable())
def test_what_is_written_and_read_again_has_the_same_regions(tmp_path: Path, name: str) -> None:
    tool = load_tool(name)
    (path := tmp_path / "again.json").write_text(to_json(tool, DATE))
    assert "-ACROSS" not in path.read_text()  # companions in a vertical hole are ours
    again = load_tool(str(path))
    assert [term.name for term in again.terms] == [term.name for term in tool.terms]
    assert [term.mode for term in again.terms] == [term.mode for term in tool.terms]
    assert again.inclination_range == pytest.approx(tool.inclination_range)
    assert (again.name, again.title, again.kind) == (tool.name, tool.title, tool.kind)
    steepest = min(90.0, math.degrees(tool.inclination_range[1]))
    np.testing.assert_allclose(covariance(again, steepest), covariance(tool, steepest), rtol=1e-12, atol=1e-18)


def validator() -> Draft202012Validator:
    """Of the schema, whose references are files beside it; the names it gives them do not all match their places."""
    folder = PUBLISHED / "iscwsa_schema"
    base = "https://example.org/schemas/"
    registry: Registry = Registry()
    for path in folder.rglob("*.json"):
        schema = json.loads(path.read_text("utf-8"))
        schema["$id"] = base + path.relative_to(folder).as_posix()
        text = json.dumps(schema)
        for place in ("strings", "number"):
            if path.parent == folder:
                text = text.replace(f'"./{place}/', f'"{base}{place}/')
        registry = registry.with_resource(schema["$id"], Resource.from_contents(json.loads(text)))
    return Draft202012Validator({"$ref": base + "draft.json"}, registry=registry)


def test_the_schema_refuses_what_it_should() -> None:
    with_schema = validator()
    good = json.loads(to_json(load_tool("mwd-rev5.1"), DATE))
    assert with_schema.is_valid(good)
    for spoil in ("terms", "metadata", "hash_value"):
        assert not with_schema.is_valid({key: value for key, value in good.items() if key != spoil})
    assert not with_schema.is_valid({**good, "terms": [{**good["terms"][0], "units": "-"}]})


@pytest.mark.parametrize("name", exportable())
def test_what_is_written_obeys_the_published_schema(name: str) -> None:
    errors = [error.message for error in validator().iter_errors(json.loads(to_json(load_tool(name), DATE)))]
    assert errors == []


def test_a_tool_without_a_title_is_written_by_the_schema_too() -> None:
    tool = SurveyTool("mine", "", (Term("A", 1.0, "m", PropagationMode.RANDOM, ("1", "0", "0")),))
    errors = [error.message for error in validator().iter_errors(json.loads(to_json(tool, DATE)))]
    assert errors == []


def test_a_kind_the_schema_does_not_know_is_not_written() -> None:
    tool = parse_toml(
        '[tool]\nname = "mine"\ntitle = "t"\nkind = "Acoustic"\n[[term]]\nname = "A"\nvalue = 1\nunit = "m"\n'
        'mode = "random"\ndepth = "1"\n',
        "x.toml",
    )
    try:
        text = to_json(tool, DATE)
    except ToolError:
        return
    assert [error.message for error in validator().iter_errors(json.loads(text))] == []


def test_every_shipped_tool_is_written_or_refused_by_its_term() -> None:
    for name in shipped_tool_names():
        if name in exportable():
            assert json.loads(to_json(load_tool(name), DATE))["metadata"]["short_name"] == name
        else:
            with pytest.raises(ToolError, match=f"^{name}: .*the schema has no"):
                to_json(load_tool(name), DATE)


@pytest.mark.parametrize(
    ("term", "message"),
    [
        (Term("A", 1.0, "deg", PropagationMode.RANDOM, ("0", "0", "SigmaYaw")), "the schema has no variable sigmayaw"),
        (Term("A", 1.0, "deg", PropagationMode.RANDOM, ("0", "Time + READINGS", "0")), "no variable readings, time"),
        (
            Term("A", 1.0, "deg", PropagationMode.RANDOM, ("0", "0", "1"), ("SigmaForce", "0", "0")),
            "no variable sigmaforce",
        ),
        (
            Term("A", 1.0, "deg/s", PropagationMode.RANDOM, ("0", "1", "0")),
            "mine: term A: the schema has no unit deg/s",
        ),
        (Term("A", 1.0, "mm", PropagationMode.RANDOM, ("1", "0", "0")), "mine: term A: the schema has no unit mm"),
        (
            Term("A", 1.0, "m", PropagationMode.RANDOM, position=("1", "0", "0")),
            "mine: term A: the schema has no term that acts",
        ),
    ],
)
def test_a_term_that_the_schema_cannot_say_is_refused(term: Term, message: str) -> None:
    with pytest.raises(ToolError, match=message) as caught:
        to_json(SurveyTool("mine", "t", (term,)), DATE)
    assert "term A" in str(caught.value)


def test_a_term_of_depth_and_course_length_at_once_is_not_written_as_something_else() -> None:
    own = Term("XCLA", 0.1, "-", PropagationMode.RANDOM, ("1", "0", "0"), position=("MD", "0", "0"))
    with pytest.raises(ToolError, match="term XCLA"):
        to_json(SurveyTool("mine", "t", (own,)), DATE)


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("P * Inc", 2.0),
        ("(1 + P^2) * Inc", -2.0),
        ("(3 - P) * Inc", -0.5),
        ("Inc - P", -0.5),
        ("Inc^P", 2.0),
        ("-P * Inc", -1e-7),
        ("p * INC", 3.0),
    ],
)
def test_parameters_are_written_as_numbers_with_their_sign(formula: str, value: float) -> None:
    tool = SurveyTool(
        "mine", "t", (Term("A", 0.1, "deg", PropagationMode.SYSTEMATIC, ("0", formula, "0")),), {"P": value}
    )
    again = parse_json(to_json(tool, DATE), "again.json")
    np.testing.assert_allclose(covariance(again, 40.0), covariance(tool, 40.0), rtol=1e-12, atol=1e-30)


def test_a_parameter_named_like_the_exponent_of_a_number_leaves_numbers_alone() -> None:
    tool = SurveyTool(
        "mine", "t", (Term("A", 0.1, "deg", PropagationMode.SYSTEMATIC, ("0", "1e-1 * E * Inc", "0")),), {"E": 3.0}
    )
    again = parse_json(to_json(tool, DATE), "again.json")
    np.testing.assert_allclose(covariance(again, 40.0), covariance(tool, 40.0), rtol=1e-12, atol=1e-30)


def test_a_term_without_effect_in_a_vertical_hole_keeps_that() -> None:
    own = Term("A", 0.1, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "Cos(Inc) / Sin(Inc)"), ("0", "0", "0"))
    tool = SurveyTool("mine", "t", (own,))
    again = parse_json(to_json(tool, DATE), "again.json")
    md, zero = np.array([0.0, 10.0, 20.0]), np.array([0.0, 1e-7, 1e-7])
    vertical = WellSurvey(md, zero, np.ones(3), md)
    np.testing.assert_allclose(
        propagate_errors(vertical, [Leg(again)], SITE).cov,
        propagate_errors(vertical, [Leg(tool)], SITE).cov,
        atol=1e-30,
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "^f.json: not JSON: "),
        ("{", "^f.json: not JSON: "),
        ("[]", "^f.json: expected an ISCWSA error model with metadata, parameters and terms"),
        ("{}", "^f.json: expected an ISCWSA error model"),
        ('{"terms": 3}', "^f.json: expected an ISCWSA error model"),
        (text_of(), "^f.json: mine: expected at least one term"),
        (text_of(3), "^f.json: term number 1: expected an object, got 3"),
        (text_of(row(), row()), "^f.json: mine: term A stands there twice"),
        (text_of({k: v for k, v in row().items() if k != "value"}), "^f.json: term A: value is missing"),
        (text_of({k: v for k, v in row().items() if k != "name"}), "^f.json: term number 1: name is missing"),
        (text_of({k: v for k, v in row().items() if k != "azimuth_formula"}), "term A: azimuth_formula is missing"),
        (text_of(row(value="1")), "^f.json: term A: value: expected a finite number, got '1'"),
        (text_of(row(value=math.nan)), "^f.json: term A: value: expected a finite number, got nan"),
        (text_of(row(value=True)), "^f.json: term A: value: expected a finite number, got True"),
        (text_of(row(units="ft")), "^f.json: mine: term A: unknown unit 'ft'"),
        (text_of(row(propagation_mode="Often")), "^f.json: term A: expected a mode of random, .* got 'Often'"),
        (
            text_of(row(inclination_formula="Sin(Foo)")),
            r"^f.json: mine: term A: formula 'Sin\(Foo\)': unknown name Foo",
        ),
        (text_of(row(east_singularity="Foo")), "^f.json: mine: term A: formula 'Foo': unknown name Foo"),
        (text_of(row(), parameters={"inc_max": "steep"}), "^f.json: .*inc_max: expected a finite number, got 'steep'"),
        (text_of(row(), parameters={"Speed": None}), "^f.json: parameters.Speed: expected a finite number, got None"),
    ],
)
def test_what_is_no_model_is_refused_with_file_and_term(text: str, message: str) -> None:
    with pytest.raises(ToolError, match=message) as caught:
        parse_json(text, "f.json")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(text_of(row(), metadata=[1]), id="metadata are a list"),
        pytest.param(text_of(row(), metadata="x"), id="metadata are text"),
        pytest.param(text_of(row(), metadata=None), id="metadata are nothing"),
        pytest.param(text_of(row(), parameters=[1]), id="parameters are a list"),
        pytest.param(text_of(row(), parameters=None), id="parameters are nothing"),
        pytest.param(text_of(row(value=10**400)), id="a value beyond any number"),
        pytest.param(text_of(row()).replace("0.1", "1" + "0" * 5000), id="a value of five thousand digits"),
        pytest.param("[" * 100_000, id="nested too deep"),
        pytest.param(text_of(row(azimuth_formula="1e999")), id="an infinite weight"),
        pytest.param(text_of(row(azimuth_formula="9" * 400)), id="a weight beyond any number"),
        pytest.param(text_of(row(azimuth_formula="-" * 1900 + "1")), id="a weight too deep"),
        pytest.param(text_of(row(), parameters={"MD": 7.0}), id="a parameter named as a variable"),
        pytest.param(text_of(row(), parameters={"inc": 7.0}), id="a parameter named as a variable in another case"),
        pytest.param(text_of(row(), parameters={"Rad": 7.0}), id="a parameter named as a constant"),
    ],
)
def test_a_text_that_strains_its_reader_is_refused(text: str) -> None:
    with pytest.raises(ToolError, match=r"^f\.json: "):
        parse_json(text, "f.json")


ANYTHING: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
FORMULA = st.sampled_from(["0", "1", "Sin(Inc)", "1/0", "Foo", "", "-", "2^Inc", "(", "1e400", "MD*TVD", "a.b"])
ROWS = st.builds(
    lambda base, changed: {**base, **changed},
    st.just(row()),
    st.dictionaries(
        st.sampled_from([*row(), "north_singularity", "east_singularity", "vertical_singularity", "uuid"]),
        ANYTHING | FORMULA,
        max_size=3,
    ),
)
MODELS = st.fixed_dictionaries(
    {"terms": st.lists(ROWS | ANYTHING, max_size=3) | ANYTHING},
    optional={
        "metadata": ANYTHING | st.dictionaries(st.sampled_from(["short_name", "long_name"]), ANYTHING),
        "parameters": ANYTHING | st.dictionaries(st.sampled_from(["inc_min", "inc_max", "MD", "pi"]), ANYTHING),
    },
)


@pytest.mark.slow
@given((MODELS | ANYTHING).map(json.dumps) | st.text(max_size=30))
@example(text_of(row(), metadata=[1]))
@example(text_of(row(), parameters=[1]))
def test_random_json_is_a_model_or_refused(text: str) -> None:
    assert refusal(text).startswith("f.json: ") or parse_json(text, "f.json").terms
