"""Habits: every target is explained, every result has its caption, hook and check run what they claim to run."""

import ast
import inspect
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent
from typing import Any

import click
import pytest
import yaml

from borechain.__main__ import cli
from node.process.commands import commands
from sim.studies.study_table import STUDIES

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs" / "results"
MOST_PARAMETERS, MOST_LINES = 10, 40  # of the function of a command


def targets() -> dict[str, str]:
    """Targets of the Makefile with their texts."""
    lines = re.findall(r"^([a-z-]+):([^=\n]*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    return {name: rest.partition("## ")[2].strip() for name, rest in lines}


def captions() -> str:
    return (RESULTS / "README.md").read_text()


def test_every_target_has_its_text_in_the_help() -> None:
    phony = re.search(r"^\.PHONY: (.+)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert phony
    found = targets()
    assert set(phony[1].split()) == found.keys()
    assert all(found.values()), found
    shown = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name, text in found.items():
        assert re.search(rf"^make {name} +{re.escape(text)}$", shown, re.MULTILINE)


def test_the_hook_runs_the_checks_from_this_checkout() -> None:
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local"
    (hook,) = repository["hooks"]
    assert hook["entry"] == "make check"
    assert hook["language"] == "system"


def test_the_check_of_a_submission_is_the_command_of_the_readme() -> None:
    assert (ROOT / ".ci" / "run").read_text().splitlines()[-1] == "make test"
    assert "    make test " in (ROOT / "README.md").read_text()


def test_every_result_has_one_caption_and_every_caption_its_file() -> None:
    captioned = re.findall(r"^\| \[`([^`]+)`\]\(([^)]+)\) \|", captions(), re.MULTILINE)
    assert all(name == link for name, link in captioned)
    names = [name for name, _ in captioned]
    assert sorted(names) == sorted(p.name for p in RESULTS.iterdir() if p.name != "README.md")


@pytest.mark.parametrize("command", [f"{s.name} {words}".strip() for s in STUDIES.values() for words in s.full])
def test_a_caption_names_the_command_as_it_is_run(command: str) -> None:
    assert f"`{command}`" in captions()


@pytest.mark.parametrize("document", ["docs/architecture.md", "CONTRIBUTING.md"])
def test_every_file_a_guide_names_is_there(document: str) -> None:
    named = re.findall(
        r"`((?:borechain|docs|groundstation|node|sim|telemetry|tests)/[a-z0-9_./-]+)`", (ROOT / document).read_text()
    )
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_every_decision_is_in_the_index() -> None:
    folder = ROOT / "docs" / "decisions"
    listed = re.findall(r"^\| \[(\d+)\]\(([^)]+)\) \| (.+) \|$", (folder / "README.md").read_text(), re.MULTILINE)
    pages = sorted(path.name for path in folder.glob("0*.md"))
    assert [page for _, page, _ in listed] == pages
    for number, page, title in listed:
        assert (folder / page).read_text().startswith(f"# {number}. {title}\n")


def callbacks(command: click.Command, context: click.Context) -> Iterator[Callable[..., Any]]:
    """Functions of a command and of all below it, without what decorates them."""
    if command.callback is not None:
        yield inspect.unwrap(command.callback)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from callbacks(found, click.Context(found, parent=context, info_name=name))


def test_a_command_is_options_one_call_and_print() -> None:
    functions = {f for group in (cli, commands) for f in callbacks(group, click.Context(group))}
    assert len(functions) > 40
    large = []
    for function in functions:
        (node,) = ast.parse(dedent(inspect.getsource(function))).body
        assert isinstance(node, ast.FunctionDef)
        lines = (node.end_lineno or node.lineno) - node.lineno + 1
        taken = len(inspect.signature(function).parameters)
        if lines > MOST_LINES or taken > MOST_PARAMETERS:
            large.append(f"{function.__module__}.{function.__name__}: {taken} parameters, {lines} lines")
    assert large == []
