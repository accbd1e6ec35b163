"""The entry for notebooks: the examples of its document hold, and what cannot be done is refused in words."""

import doctest
from pathlib import Path

import pytest

from borechain import api
from telemetry.errors import MediumError

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
def test_the_examples_of_the_document_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    done = doctest.testfile(
        str(ROOT / "docs" / "api.md"), module_relative=False, optionflags=doctest.FAIL_FAST | doctest.ELLIPSIS
    )
    assert done.attempted > 10
    assert done.failed == 0


def test_every_function_of_the_entry_is_in_its_document() -> None:
    text = (ROOT / "docs" / "api.md").read_text()
    functions = {name for name in api.__all__ if name[0].islower()}
    assert {name for name in functions if f"api.{name}(" in text} == functions


def test_a_folder_in_use_is_refused_before_anything_is_drilled(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("{}")
    with pytest.raises(api.BorechainError, match="expected a new or empty folder"):
        api.drill(api.load("rig-3"), folder=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]


def test_a_question_without_a_rig_is_an_error_in_words() -> None:
    with pytest.raises(MediumError, match=r"no router at tcp/127\.0\.0\.1:1"):
        api.query("borechain/*/ground/status", "tcp/127.0.0.1:1", timeout=0.2)
