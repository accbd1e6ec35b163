"""The tables of the documentation are those of the code."""

import importlib.util
import inspect
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from node.firmware.event_table import EVENT_TABLE
from node.kernels.record.events import Code
from node.kernels.record.node_record import NODE
from node.kernels.step import node_step

DOCS = Path(__file__).parents[1] / "docs"


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def make_tables() -> ModuleType:
    return script("make_tables")


def test_the_asyncapi_document_is_made_from_the_code_and_leads_nowhere_outside() -> None:
    made = script("make_asyncapi")
    assert (DOCS / "asyncapi.json").read_text() == made.text(), "run python docs/make_asyncapi.py"
    document = made.document()
    for channel in document["channels"].values():
        name = channel["messages"]["answer"]["$ref"].rpartition("/")[2]
        assert document["components"]["messages"][name]["payload"]["type"] == "object"
    heard = {operation["channel"]["$ref"].rpartition("/")[2] for operation in document["operations"].values()}
    assert heard >= {"verdict", "alarms", "events", "nodes_tube", "wall"}
    assert "schema" not in heard


@pytest.mark.parametrize("page", ["wire.md", "keys.md", "firmware.md", "operate.md"])
@pytest.mark.slow
def test_the_tables_of_a_page_are_made_from_the_code(make_tables: ModuleType, page: str) -> None:
    assert (DOCS / page).read_text() == make_tables.filled(page), "run python docs/make_tables.py"


def test_every_key_below_ground_has_its_fields(make_tables: ModuleType) -> None:
    from groundstation.service.answers.answer_table import known_keys
    from telemetry.keys import GROUND

    below = {
        key.template.removeprefix(GROUND.format(rig="{rig}", path=""))
        for key in known_keys()
        if "/ground/" in key.template
    }
    text = (DOCS / "keys.md").read_text()
    assert below == {line.strip("# `") for line in text.splitlines() if line.startswith("### `")}


def plain_fields(dtype: np.dtype, path: str = "") -> list[str]:
    """Paths of all fields of a record that are no records."""
    found = []
    for name in dtype.names or ():
        base = dtype[name].base
        found += plain_fields(base, f"{path}{name}.") if base.fields else [path + name]
    return found


@pytest.mark.slow
def test_every_field_of_the_node_is_in_the_map(make_tables: ModuleType) -> None:
    found, part = [], ""
    for line in make_tables.node_record().splitlines():
        if line.startswith("### "):
            part = f"{line.split('`')[1]}." if "`" in line else ""
        elif cells := re.match(r"\| \d+ \| `([^`]+)` \| (?!record)[^|]+ \| [^|]* \| [^| ][^|]* \|$", line):
            found.append(part + re.sub(r"\[\d+\]", "", cells[1]))
    assert found == sorted(plain_fields(NODE), key=lambda path: "." not in path)


def test_a_field_without_its_comment_is_named(make_tables: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = make_tables.node_tables
    types = [(dtype, name, {**texts, "torque": "N m"}) for dtype, name, texts in tables.described()]
    monkeypatch.setattr(tables, "described", lambda: types)
    with pytest.raises(ValueError, match=r"record\.TWIST: expected a comment .* behind 'torque', got 'N m'"):
        make_tables.node_record()


def test_every_code_of_the_step_has_its_line(make_tables: ModuleType) -> None:
    assert list(EVENT_TABLE) == list(Code)
    assert all(line.meaning for line in EVENT_TABLE.values())
    shown = re.findall(r"^\| (\d+) \| `(\w+)`", make_tables.events(), re.MULTILINE)
    assert shown == [(str(int(code)), line.name) for code, line in EVENT_TABLE.items()]


def source_of(name: str) -> str:
    """Body of a function of the step."""
    function = getattr(node_step, name)
    return inspect.getsource(getattr(function, "py_func", function)).partition('"""')[2].partition('"""')[2]


def test_the_step_is_told_in_its_order() -> None:
    """Functions of the page's table stand in the code of the step in the same order."""
    section = (DOCS / "firmware.md").read_text().partition("## The step\n")[2].partition("\n## ")[0]
    named = [
        name
        for cell in re.findall(r"^\| [a-z' ]+ \| (`[^|]+) \|", section, re.MULTILINE)
        for name in cell.split("`")[1::2]
    ]
    whole = source_of("node_step")
    for name in ("step_around", "begin_step", "before_loop", "end_step", "after_loop", "conclude_cycle"):
        whole = whole.replace(f"{name}(", source_of(name) + "(", 1)
    places = [whole.find(f"{name}(") for name in named]
    assert len(named) == 10
    assert -1 not in places
    assert places == sorted(places)


def test_the_types_of_the_page_are_made_from_the_classes_of_the_answers() -> None:
    made = script("make_page_types")
    assert made.TYPES.read_text() == made.types_text(), "run python docs/make_page_types.py"
