"""Habits: every target is explained, every result has its caption, hook and check run what they claim to run."""

import ast
import functools
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
from borechain.studies.rig_study_table import RIG_STUDIES
from node.process.command_group import commands
from sim.studies.study_table import STUDIES

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "docs" / "results"
KEPT = [*STUDIES.values(), *RIG_STUDIES.values()]  # whose tables stand there
DECISIONS = ROOT / "docs" / "decisions"
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


@pytest.mark.parametrize("command", [f"{s.name} {words}".strip() for s in KEPT for words in s.full])
def test_a_caption_names_the_command_as_it_is_run(command: str) -> None:
    assert f"`{command}`" in captions()


@pytest.mark.parametrize("document", ["docs/architecture.md", "CONTRIBUTING.md"])
def test_every_file_a_guide_names_is_there(document: str) -> None:
    named = re.findall(
        r"`((?:borechain|docs|groundstation|node|sim|telemetry|tests)/[a-z0-9_./-]+)`", (ROOT / document).read_text()
    )
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


def decisions() -> dict[int, Path]:
    """Pages of the decisions by number."""
    return {int(path.name[:4]): path for path in sorted(DECISIONS.glob("[0-9]*.md"))}


def index_rows() -> list[tuple[str, str, str, str]]:
    """Rows of the index of decisions: number, page, title, status."""
    return re.findall(
        r"^\| \[(\d+)\]\(([^)]+)\) \| (.+) \| (.+) \|$", (DECISIONS / "README.md").read_text(), re.MULTILINE
    )


def stated_status(page: Path) -> str:
    """Status of a decision by the first line below its title, in the words of the index."""
    first = next(line for line in page.read_text().splitlines()[1:] if line)
    if not re.match(r"(Changed|Superseded) by ", first):
        return "in force"
    return f"{first.split()[0].lower()} by {', '.join(number for number, _ in successors(first))}"


def successors(line: str) -> list[tuple[str, str]]:
    return re.findall(r"\[(\d+)\]\((\d{4}-[a-z-]+\.md)\)", line)


def test_every_decision_is_in_the_index() -> None:
    listed = index_rows()
    assert [page for _, page, _, _ in listed] == [page.name for page in decisions().values()]
    for number, page, title, _ in listed:
        assert (DECISIONS / page).read_text().startswith(f"# {number}. {title}\n")


@pytest.mark.parametrize("number", decisions())
def test_a_decision_has_at_most_400_words(number: int) -> None:
    assert len(decisions()[number].read_text().split()) <= 400


def test_the_index_marks_what_a_page_says_of_its_successors() -> None:
    assert {page: status for _, page, _, status in index_rows()} == {
        page.name: stated_status(page) for page in decisions().values()
    }


@pytest.mark.parametrize("number", [int(row[0]) for row in index_rows() if row[3] != "in force"])
def test_a_decision_that_no_longer_holds_as_it_stands_names_a_later_one(number: int) -> None:
    """In the first line below the title, with a link to each later page and with what of it is another now."""
    title, blank, first, after = decisions()[number].read_text().splitlines()[:4]
    assert title.startswith("# ")
    assert (blank, after) == ("", "")
    assert re.fullmatch(r"(Changed|Superseded) by \[\d+\]\(.+\): \S.*\.", first)
    named = successors(first)
    assert named
    for later, page in named:
        assert int(later) > number
        assert decisions()[int(later)].name == page


def test_what_replaces_a_decision_is_named_by_it() -> None:
    """A page that says that it replaces another one, or a part of it, stands in the first line of that one."""
    replaced = [
        (later, int(earlier))
        for later, page in decisions().items()
        for earlier in re.findall(r"[Rr]eplaces [^.]*?\[(\d+)\]\(", page.read_text())
    ]
    assert replaced
    for later, earlier in replaced:
        assert str(later) in re.findall(r"\d+", stated_status(decisions()[earlier]))


def documents() -> list[Path]:
    """Pages of the project in Markdown."""
    return sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^a-z0-9 _-]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", documents(), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_of_a_document_leads_somewhere(page: Path) -> None:
    """Files are there, and headings of pages in Markdown too."""
    lost = []
    for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", page.read_text()):
        name, _, anchor = target.partition("#")
        there = page.parent / name if name else page
        if not there.exists() or (anchor and anchor not in anchors(there)):
            lost.append(target)
    assert lost == []


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


ODD = re.compile(
    r"(?i:\b(whoever|nobody|somebody|whence|thereof|as nearly always|who asks)\b|is no (number|time|measurement)\b)"
    r"|\b[Tt]hat is none\b"
)
ROOMS = (
    *("benchmarks", "borechain", "deploy", "docs", "examples", "groundstation", "node", "scenarios"),
    *("sim", "telemetry", "tests", ".ci"),
)
SUFFIXES = (
    *("", ".c", ".css", ".csv", ".dbc", ".h", ".html", ".js", ".json", ".md", ".mjs", ".py", ".service"),
    *(".sh", ".svg", ".toml", ".txt", ".typ", ".yaml", ".yml"),
)
EXCUSED = {  # file or folder: why the phrases stand there
    "LICENSE": "the words of the licence",
    "CONTRIBUTING.md": "quotes one as the example of what not to write",
    "tests/test_habits.py": "lists them",
    "tests/tools/postgres.py": "the name of a user of the operating system",
}


@functools.cache
def texts() -> list[Path]:
    """Files of the project that people write or read, relative to its root."""
    files = [*ROOT.glob("*"), *(path for room in ROOMS for path in (ROOT / room).rglob("*"))]
    return sorted(path.relative_to(ROOT) for path in files if path.is_file() and path.suffix in SUFFIXES)


def odd_lines(path: Path) -> list[str]:
    """Lines of a file with a phrase that a stranger stumbles over, as path, number and line."""
    text = (ROOT / path).read_text(encoding="utf-8", errors="replace")
    lines = text.splitlines() if ODD.search(text) else []
    return [f"{path.as_posix()}:{number}: {line.strip()}" for number, line in enumerate(lines, 1) if ODD.search(line)]


def is_excused(path: Path) -> bool:
    return any(path == Path(name) or Path(name) in path.parents for name in EXCUSED)


def test_no_text_speaks_of_whoever_and_nobody() -> None:
    """Subject, verb, object and the field's words: say which process, reader or crew, and which value is invalid."""
    assert [line for path in texts() if not is_excused(path) for line in odd_lines(path)] == []


@pytest.mark.parametrize("name", EXCUSED)
def test_an_excuse_that_is_no_longer_needed_goes(name: str) -> None:
    assert [line for path in texts() if path == Path(name) or Path(name) in path.parents for line in odd_lines(path)]
