"""docs/first-hour.md does what it says: its files are made, its changes applied, its programs run and compared."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COPIED = ("borechain", "groundstation", "node", "sim", "telemetry", "scenarios")
BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block of the page: its language, the words behind it, its text."""

    language: str
    words: list[str]
    text: str


def blocks() -> list[Block]:
    page = (ROOT / "docs" / "first-hour.md").read_text()
    return [Block(language, words.split(), text) for language, words, text in BLOCK.findall(page)]


def apply_change(path: Path, change: str) -> None:
    """Replace the lines that a change expects, once, by those it leaves."""
    before = "".join(line[1:] for line in change.splitlines(keepends=True) if line[0] in " -")
    after = "".join(line[1:] for line in change.splitlines(keepends=True) if line[0] in " +")
    source = path.read_text()
    assert source.count(before) == 1, f"{path.name}: expected once\n{before}"
    path.write_text(source.replace(before, after))


def run_program(copy: Path, program: str, words: list[str]) -> str:
    """What a program prints in the copy, with the environment that its block names."""
    environment = os.environ | dict(word.split("=", 1) for word in words) | {"PYTHONPATH": str(copy)}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_first_hour_does_what_it_says(tmp_path: Path) -> None:
    for package in COPIED:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    printed: str | None = None
    done = []
    for block in blocks():
        if block.language == "text":
            assert printed == block.text
            printed = None
            continue
        assert printed is None, "a program whose output the page does not show"
        match block.language, block.words:
            case "python", ["new", path]:
                assert not (tmp_path / path).exists()
                (tmp_path / path).write_text(block.text)
            case "diff", [path]:
                apply_change(tmp_path / path, block.text)
            case "python", ["run", *words]:
                printed = run_program(tmp_path, block.text, words)
            case _:
                pytest.fail(f"a block of no known kind: {block.language} {block.words}")
        done.append(block.words[0] if block.language == "python" else "diff")
    assert done.count("new") >= 1
    assert done.count("run") == 3
