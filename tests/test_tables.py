"""The tables of the documentation are those of the code."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module")
def make_tables() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_tables", DOCS / "make_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", ["wire.md", "keys.md"])
def test_the_tables_of_a_page_are_made_from_the_code(make_tables: ModuleType, page: str) -> None:
    assert (DOCS / page).read_text() == make_tables.filled(page), "run python docs/make_tables.py"


def test_every_key_below_ground_has_its_fields(make_tables: ModuleType) -> None:
    from telemetry.keys import GROUND, TABLE

    below = {
        key.template.removeprefix(GROUND.format(rig="{rig}", path="")) for key in TABLE if "/ground/" in key.template
    }
    text = (DOCS / "keys.md").read_text()
    assert below == {line.strip("# `") for line in text.splitlines() if line.startswith("### `")}
