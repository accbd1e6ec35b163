"""Instrument models as data files: what is shipped, and every way a file can be wrong."""

import math
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from groundstation.errors import ToolError
from groundstation.survey.tools.instruments import (
    UNITS,
    PropagationMode,
    SurveyTool,
    Term,
    finite_number,
    load_tool,
    mode_of,
    parse_toml,
    shipped_tool_names,
)

DEG = math.pi / 180.0
SHIPPED = [
    "gyro-continuous",
    "ipst-rqh",
    "mpu6500",
    "mwd-rev4",
    "mwd-rev5.1",
    "relay",
    "rst-inclinometer",
    "stim300",
    "vectornav-100t",
]
# Every source of the published model, its magnitude at one standard deviation and how it propagates
MWD = {
    "DRFR": (0.35, "m", PropagationMode.RANDOM),
    "DSFS": (0.00056, "-", PropagationMode.SYSTEMATIC),
    "DSTG": (2.5e-7, "1/m", PropagationMode.GLOBAL),
    "ABXY-TI1S": (0.004, "m/s2", PropagationMode.SYSTEMATIC),
    "ABXY-TI2S": (0.004, "m/s2", PropagationMode.SYSTEMATIC),
    "ABZ": (0.004, "m/s2", PropagationMode.SYSTEMATIC),
    "ASXY-TI1S": (0.0005, "-", PropagationMode.SYSTEMATIC),
    "ASXY-TI2S": (0.0005, "-", PropagationMode.SYSTEMATIC),
    "ASXY-TI3S": (0.0005, "-", PropagationMode.SYSTEMATIC),
    "ASZ": (0.0005, "-", PropagationMode.SYSTEMATIC),
    "MBXY-TI1S": (70.0, "nT", PropagationMode.SYSTEMATIC),
    "MBXY-TI2S": (70.0, "nT", PropagationMode.SYSTEMATIC),
    "MBZ": (70.0, "nT", PropagationMode.SYSTEMATIC),
    "MSXY-TI1S": (0.0016, "-", PropagationMode.SYSTEMATIC),
    "MSXY-TI2S": (0.0016, "-", PropagationMode.SYSTEMATIC),
    "MSXY-TI3S": (0.0016, "-", PropagationMode.SYSTEMATIC),
    "MSZ": (0.0016, "-", PropagationMode.SYSTEMATIC),
    "DEC-U": (0.16, "deg", PropagationMode.WELL),
    "DEC-OS": (0.24, "deg", PropagationMode.GLOBAL),
    "DEC-OH": (0.21, "deg", PropagationMode.GLOBAL),
    "DEC-OI": (0.05, "deg", PropagationMode.GLOBAL),
    "DECR": (0.1, "deg", PropagationMode.RANDOM),
    "DBH-U": (2350.0, "deg.nT", PropagationMode.WELL),
    "DBH-OS": (3359.0, "deg.nT", PropagationMode.GLOBAL),
    "DBH-OH": (2840.0, "deg.nT", PropagationMode.GLOBAL),
    "DBH-OI": (356.0, "deg.nT", PropagationMode.GLOBAL),
    "DBHR": (3000.0, "deg.nT", PropagationMode.RANDOM),
    "AMIL": (220.0, "nT", PropagationMode.SYSTEMATIC),
    "SAGE": (0.2, "deg", PropagationMode.SYSTEMATIC),
    "XYM1": (0.1, "deg", PropagationMode.SYSTEMATIC),
    "XYM2": (0.1, "deg", PropagationMode.SYSTEMATIC),
    "XYM3E": (0.3, "deg", PropagationMode.RANDOM),
    "XYM4E": (0.3, "deg", PropagationMode.RANDOM),
    "XCLA": (0.167, "-", PropagationMode.RANDOM),
    "XCLH": (0.167, "-", PropagationMode.RANDOM),
}
HEAD = '[tool]\nname = "mine"\ntitle = "My tool"\n'
TERM = '[[term]]\nname = "A"\nvalue = 0.1\nunit = "deg"\nmode = "systematic"\ninclination = "1"\n'
GOOD = HEAD + TERM


def refusal(read: Callable[[], object]) -> str:
    """Message with which something is refused, or nothing."""
    try:
        read()
    except ToolError as error:
        return str(error)
    return ""


def shipped_data(name: str) -> dict[str, float]:
    return {term.name: term.value for term in load_tool(name).terms if not term.name.endswith("-ACROSS")}


def test_every_instrument_that_is_promised_is_shipped() -> None:
    assert shipped_tool_names() == SHIPPED


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_instrument_loads_and_says_where_its_numbers_come_from(name: str) -> None:
    tool = load_tool(name)
    assert tool.name == name
    assert tool.title
    assert tool.source
    assert tool.kind in ("Magnetic", "Gyroscopic", "Inertial", "Unknown")
    for term in tool.terms:
        assert term.value > 0.0
        assert term.sigma == pytest.approx(term.value * UNITS[term.unit])
        assert any(formula != "0" for formula in term.formulas)


def test_the_mwd_model_is_complete() -> None:
    tool = load_tool("mwd-rev5.1")
    assert len(MWD) == 35
    assert {term.name: (term.value, term.unit, term.mode) for term in tool.terms} == MWD


@pytest.mark.parametrize(
    ("name", "published"),
    [
        ("rst-inclinometer", {"ABXY": 7.85e-4, "ASF": 9.81e-5, "DSF": 1.4e-4}),
        (
            "vectornav-100t",
            {"ABXY": 4.99611e-4, "ABZ": 1.2722e-8, "ASF": 8.0e-3, "MIS": 0.05 / 100, "GD": 2.78e-3, "GRW": 3.5e-3},
        ),
        (
            "stim300",
            {"ABXY": 4.905e-4, "ABZ": 1.222e-8, "ASF": 2.0e-4, "MIS": 0.057 / 100, "GD": 1.39e-4, "GRW": 2.5e-4},
        ),
        ("ipst-rqh", {"ABXY": 4.9653e-3, "ABZ": 1.25658e-6, "ASF": 9.81e-4, "GD": 8.33e-7, "GRW": 5.0e-5}),
        (
            "mpu6500",
            {"ABXY": 5.886e-1, "ABZ": 5.378e-6, "ASF": 1.0e-3, "MIS": 1.0e-3, "GD": 1.0e-2, "GRW": 1.0e-2},
        ),
    ],
)
def test_the_instruments_of_the_thesis_have_its_magnitudes(name: str, published: dict[str, float]) -> None:
    assert shipped_data(name) == pytest.approx(published)


def test_the_inclinometer_has_its_full_scale() -> None:
    assert load_tool("rst-inclinometer").inclination_range == (0.0, pytest.approx(30.0 * DEG))
    assert load_tool("relay").inclination_range == (0.0, math.pi)


@pytest.mark.parametrize(
    ("unit", "si"),
    [("m", 1.0), ("mm", 1e-3), ("deg", DEG), ("rad", 1.0), ("deg/s", DEG), ("nT", 1.0), ("deg.nT", DEG), ("-", 1.0)],
)
def test_a_magnitude_is_read_in_its_unit(unit: str, si: float) -> None:
    tool = parse_toml(GOOD.replace('unit = "deg"', f'unit = "{unit}"'), "x.toml")
    assert tool.terms[0].sigma == pytest.approx(0.1 * si)


def test_a_file_of_the_user_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = (
        HEAD.replace("[tool]", '[tool]\ninclination_max_deg = 45\nkind = "Inertial"')
        + "[parameters]\nSpeed = 2\n"
        + TERM.replace('inclination = "1"', 'azimuth = "Speed * MD"\nsingular_east = "Speed"')
    )
    path.write_text(text, encoding="utf-8")
    tool = load_tool(str(path))
    assert (tool.name, tool.kind, tool.parameters) == ("mine", "Inertial", {"Speed": 2.0})
    assert tool.inclination_range == (0.0, pytest.approx(45.0 * DEG))
    assert tool.terms == (
        Term("A", 0.1, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "Speed * MD"), ("0", "Speed", "0"), None),
    )


def test_terms_can_be_taken_out_and_the_rest_stays() -> None:
    tool = load_tool("rst-inclinometer")
    less = tool.without("ABXY", "none")
    assert [term.name for term in less.terms] == ["ASF", "DSF", "ASF-ACROSS"]
    assert less.inclination_range == tool.inclination_range
    assert less.title == tool.title
    with pytest.raises(ToolError, match="rst-inclinometer: expected at least one term"):
        tool.without("ABXY", "ASF", "DSF")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "tool.toml: term is missing"),
        (HEAD, "tool.toml: term is missing"),
        (HEAD + "term = []\n", "term: unknown key|term is missing|at least one term"),
        ("term = []\n" + HEAD, "tool.toml: mine: expected at least one term"),
        (TERM, "tool.toml: tool is missing"),
        ("not toml", "tool.toml: not TOML: "),
        (GOOD + "[other]\nx = 1\n", "tool.toml: other: unknown key; expected one of parameters, term, tool"),
        (GOOD.replace("title", "titel"), "tool.toml: tool: titel: unknown key; expected one of .*title"),
        (GOOD.replace('title = "My tool"\n', ""), "tool.toml: tool: title is missing"),
        (GOOD.replace('name = "mine"\n', ""), "tool.toml: tool: name is missing"),
        (GOOD.replace("inclination =", "inclinaton ="), "tool.toml: term A: inclinaton: unknown key; expected one of"),
        (GOOD.replace("value = 0.1\n", ""), "tool.toml: term A: value is missing"),
        (GOOD.replace('unit = "deg"\n', ""), "tool.toml: term A: unit is missing"),
        (GOOD.replace('mode = "systematic"\n', ""), "tool.toml: term A: mode is missing"),
        (GOOD.replace('name = "A"\n', ""), "tool.toml: term number 1: name is missing"),
        (GOOD.replace('"deg"', '"furlong"'), "tool.toml: mine: term A: unknown unit 'furlong'; expected one of -, m"),
        (GOOD.replace("systematic", "sometimes"), "term A: expected a mode of random, .* got 'sometimes'"),
        (GOOD.replace("value = 0.1", "value = nan"), "term A: value: expected a finite number, got nan"),
        (GOOD.replace("value = 0.1", "value = inf"), "term A: value: expected a finite number, got inf"),
        (GOOD.replace("value = 0.1", 'value = "0.1"'), "term A: value: expected a finite number, got '0.1'"),
        (GOOD.replace("value = 0.1", "value = true"), "term A: value: expected a finite number, got True"),
        (GOOD.replace('"1"', '"Sin(Foo)"'), r"term A: formula 'Sin\(Foo\)': unknown name Foo"),
        (GOOD.replace('"1"', '"Sin(Inc"'), r"term A: formula 'Sin\(Inc': expected a formula"),
        (GOOD.replace('"1"', "\"open('x')\""), "term A: formula .*(unknown function open|expected numbers)"),
        (GOOD + TERM, "tool.toml: mine: term A stands there twice"),
        (HEAD + "[parameters]\nMD = 3\n" + TERM, "parameters.MD: the name is that of a variable; choose another"),
        (HEAD + "[parameters]\nsigmayaw = 3\n" + TERM, "parameters.sigmayaw: the name is that of a variable"),
        (HEAD + "[parameters]\nSpeed = 'x'\n" + TERM, "parameters.Speed: expected a finite number, got 'x'"),
        (HEAD + "inclination_max_deg = 'x'\n" + TERM, "tool.inclination_max_deg: expected a finite number, got 'x'"),
        ("tool = 3\n" + TERM, "tool.toml: tool: expected a table, got 3"),
        (HEAD + "[term]\nname = 'A'\n", "tool.toml: term"),
    ],
)
def test_a_file_that_is_no_instrument_is_refused_with_file_and_term(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "tool.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ToolError, match=message) as caught:
        load_tool(str(path))
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("parameters = 3\n" + GOOD, id="parameters are a number"),
        pytest.param("term = 3\n" + HEAD, id="terms are a number"),
        pytest.param("term = 'A'\n" + HEAD, id="terms are text"),
        pytest.param("term = [1, 2]\n" + HEAD, id="terms are numbers"),
        pytest.param(GOOD.replace("value = 0.1", "value = 1" + "0" * 400), id="a value beyond any number"),
        pytest.param(GOOD.replace("value = 0.1", "value = 1" + "0" * 5000), id="a value of five thousand digits"),
        pytest.param("x = " + "[" * 5000, id="nested too deep"),
        pytest.param(GOOD.replace('"1"', '"1e999"'), id="an infinite weight"),
        pytest.param(GOOD.replace('"1"', '"' + "-" * 1900 + '1"'), id="a weight too deep"),
        pytest.param(GOOD.replace('"1"', '"' + "9" * 400 + '"'), id="a weight beyond any number"),
    ],
)
def test_a_file_that_strains_its_reader_is_refused(text: str) -> None:
    with pytest.raises(ToolError, match=r"^x\.toml: "):
        parse_toml(text, "x.toml")


@pytest.mark.parametrize("name", ["pi", "rad", "Rad"])
def test_a_parameter_that_would_be_read_as_a_constant_is_refused(name: str) -> None:
    with pytest.raises(ToolError, match=f"parameters.{name}"):
        parse_toml(HEAD + f"[parameters]\n{name} = 7\n" + TERM, "x.toml")


def test_parameters_that_differ_in_case_alone_are_refused() -> None:
    with pytest.raises(ToolError, match=r"parameters\.(Speed|speed)"):
        parse_toml(HEAD + "[parameters]\nSpeed = 7\nspeed = 8\n" + TERM, "x.toml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mwd", "mwd: no such instrument; expected one of gyro-continuous, .*, or a .toml or .json file"),
        ("", "no such instrument"),
        ("../relay", "no such instrument"),
        ("none.toml", "none.toml: No such file or directory; expected an instrument file or one of gyro-continuous"),
        ("none.json", "none.json: No such file or directory"),
    ],
)
def test_an_instrument_nobody_has_is_refused_and_the_others_named(name: str, message: str) -> None:
    with pytest.raises(ToolError, match=message):
        load_tool(name)


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_a_file_that_is_no_text_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"photo{suffix}"
    path.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ToolError, match="not a text file; expected an instrument file"):
        load_tool(str(path))


def test_a_tool_made_in_code_is_checked_like_a_file() -> None:
    good = Term("A", 1.0, "m", PropagationMode.RANDOM, ("1", "0", "0"))
    with pytest.raises(ToolError, match="mine: term A stands there twice"):
        SurveyTool("mine", "", (good, good))
    with pytest.raises(ToolError, match="mine: term A: expected a finite value, got nan"):
        SurveyTool("mine", "", (Term("A", math.nan, "m", PropagationMode.RANDOM, ("1", "0", "0")),))
    with pytest.raises(ToolError, match="mine: term A: formula 'Q': unknown name Q"):
        SurveyTool("mine", "", (Term("A", 1.0, "m", PropagationMode.RANDOM, ("Q", "0", "0")),))
    for place in ("singular", "position"):
        with pytest.raises(ToolError, match="mine: term A: formula 'Q'"):
            SurveyTool("mine", "", (Term("A", 1.0, "m", PropagationMode.RANDOM, **{place: ("0", "0", "Q")}),))  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", PropagationMode)
def test_a_mode_is_read_in_any_case(mode: PropagationMode) -> None:
    assert mode_of("f", "A", mode.value) is mode_of("f", "A", mode.value.upper()) is mode


VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@given(VALUES)
@example(10**400)
def test_a_number_is_finite_or_refused(value: Any) -> None:
    message = refusal(lambda: finite_number("f", "x", value))
    if message:
        assert message.startswith("f: x: expected a finite number")
    else:
        assert finite_number("f", "x", value) == value
        assert math.isfinite(value)


@given(st.text(alphabet='[]{}=."#\n\t tolermnavuidpsg0123456789', max_size=120) | st.text(max_size=80))
def test_random_text_is_an_instrument_or_refused(text: str) -> None:
    for head in ("", HEAD, GOOD):
        message = refusal(partial(parse_toml, head + text, "x.toml"))
        assert message.startswith("x.toml: ") or (not message and tomllib.loads(head + text)["term"])


CELL = st.sampled_from(
    ["", '""', '"1"', '"Sin(Inc)"', "1", "-1.5", "nan", "true", "[]", "{}", '"deg"', '"well"', "[1]"]
)


@given(st.dictionaries(st.sampled_from(["name", "value", "unit", "mode", "depth", "north", "down", "x"]), CELL))
@pytest.mark.slow
def test_random_terms_are_an_instrument_or_refused(cells: dict[str, str]) -> None:
    row = "".join(f"{key} = {value}\n" for key, value in cells.items())
    message = refusal(lambda: parse_toml(f"{GOOD}[[term]]\n{row}", "x.toml"))
    assert message.startswith("x.toml: ") or (not message and {"name", "value", "unit", "mode"} <= set(cells))
