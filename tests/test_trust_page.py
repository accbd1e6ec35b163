"""Each row of the page of what was attacked names tests that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "trust.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (\d+|[a-z][^|]*?) \|.*$", PAGE.split("<!-- rows -->")[1], re.MULTILINE)
NAMED = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE)))


def test_every_row_and_every_bad_input_is_there() -> None:
    assert [row for row in ROWS if row.isdigit()] == [str(number) for number in range(2, 15)]
    assert len([row for row in ROWS if not row.isdigit() and row != "what comes"]) == 5
    lines = [line for line in PAGE.splitlines() if line.startswith("|") and "---" not in line]
    assert sum("tests/" in line for line in lines) == 13 + 5


@pytest.mark.parametrize(("file", "test"), NAMED, ids=[f"{file}::{test}" for file, test in NAMED])
def test_a_named_test_is_there(file: str, test: str) -> None:
    source = (ROOT / file).read_text(encoding="utf-8")
    assert re.search(rf"^(async )?def {test}\(", source, re.MULTILINE)
