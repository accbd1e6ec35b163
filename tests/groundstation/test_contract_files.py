"""What others rely on, as it was read and approved: the addresses of the page and the settings of a ground station.

A line a leaf, so that a changed unit, bound, default or name is one line of a review. `test_page.py` asks each address
and `test_small_parts.py` computes the bounds of orders; here nothing else may change unseen. Written anew by
`python tests/groundstation/test_contract_files.py`.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from groundstation.config import GroundConfig
from groundstation.gateway.page.openapi import openapi_document
from groundstation.plan_settings import PlanSettings

DATA = Path(__file__).parents[1] / "data" / "contracts"
MADE: dict[str, Callable[[], Any]] = {
    "openapi": lambda: without_answers(openapi_document("1.2.3")),
    "ground-settings": lambda: schema_of(GroundConfig),
    "plan-settings": lambda: schema_of(PlanSettings),
}


def without_answers(document: dict[str, Any]) -> dict[str, Any]:
    """The document with a line a response; the fields of answers stand in the page's types, see `test_tables.py`."""
    for path in document["paths"].values():
        for operation in path.values():
            told = {
                status: f"{one['description']}: {', '.join(one['content'])}"
                for status, one in operation["responses"].items()
            }
            operation["responses"] = told
    return document


def schema_of(model: type[BaseModel]) -> Any:
    """JSON schema of a model, and of every field its default as it is in Python."""
    defaults = {name: repr(field.get_default(call_default_factory=False)) for name, field in model.model_fields.items()}
    return {"schema": model.model_json_schema(), "defaults": defaults, "frozen": model.model_config.get("frozen")}


def leaves(value: Any, path: str = "") -> Iterator[str]:
    """Every leaf with the way to it; of an empty table that it is empty."""
    if isinstance(value, dict) and value:
        for name, one in value.items():
            yield from leaves(one, f"{path} > {name}" if path else str(name))
    elif isinstance(value, list) and any(isinstance(one, dict) for one in value):
        for place, one in enumerate(value):
            yield from leaves(one, f"{path} > {place}")
    else:
        yield f"{path}: {json.dumps(value, ensure_ascii=False)}"


@pytest.mark.parametrize("name", MADE)
def test_a_contract_is_as_approved(name: str) -> None:
    assert list(leaves(MADE[name]())) == (DATA / f"{name}.txt").read_text("utf-8").splitlines()


def test_a_refusal_is_an_object_with_one_line() -> None:
    line = {"type": "object", "properties": {"error": {"type": "string"}}, "required": ["error"]}
    refused = {"description": "refused, and why", "content": {"application/json": {"schema": line}}}
    for path in openapi_document("1")["paths"].values():
        for operation in path.values():
            assert all(one == refused for status, one in operation["responses"].items() if int(status) >= 400)


if __name__ == "__main__":
    for one, make in MADE.items():
        (DATA / f"{one}.txt").write_text("\n".join(leaves(make())) + "\n", "utf-8")
