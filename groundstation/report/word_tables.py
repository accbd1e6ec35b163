"""Reports in other languages, by tables of words: every English phrase, with braces for what stands in it.

A table is a TOML file of ``words/``, a line a phrase: ``"surveyed to {} m" = "vermessen bis {} m"``. What stands in the
braces is looked up as well, there among the ``parts`` too, such as "{} and {}", which would change a client's name if
they counted for a whole text. What no line knows, such as a name or a number, stays as it is.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from typing import Any

from groundstation.errors import SurveyError

ENGLISH = "en"
NOT_STATED = "not stated"
OWN_WORDS = (
    "Document", "Revision", "Contractor", "Project", "Client", "Height datum", "Serial number", "Calibration",
    "Certificate", "Next due",
)  # fmt: skip


def known_languages() -> list[str]:
    """Codes of the languages that a report may have."""
    names = (entry.name for entry in (resources.files("groundstation.report") / "words").iterdir())
    return sorted([ENGLISH, *(name.removesuffix(".toml") for name in names if name.endswith(".toml"))])


class WordTable:
    """Phrases of one language.

    Parameters
    ----------
    words : English phrase to the other, with as many braces; ``{1}`` in the other is the second of the English
    parts : the same of what stands inside a phrase alone
    """

    def __init__(self, words: Mapping[str, str], parts: Mapping[str, str]) -> None:
        self._exact = {phrase: other for phrase, other in words.items() if "{" not in phrase}
        longest = sorted((phrase for phrase in words if "{" in phrase), key=lambda phrase: -len(phrase))
        self._patterns = [(_pattern_of(phrase), words[phrase]) for phrase in longest]
        self._parts = [(_pattern_of(phrase), other) for phrase, other in parts.items()]

    def text(self, english: str) -> str:
        """A whole text in the language; as it is where the table does not know it."""
        return self._said(english, self._patterns)

    def part(self, english: str) -> str:
        """A text inside another, or a cell of a table."""
        return self._said(english, [*self._patterns, *self._parts])

    def _said(self, english: str, patterns: list[tuple[re.Pattern[str], str]]) -> str:
        if english in self._exact:
            return self._exact[english]
        for pattern, other in patterns:
            if found := pattern.fullmatch(english):
                return other.format(*map(self.part, found.groups()))
        return english

    def every(self, value: Any) -> Any:
        """Every text of a list of texts, or of lists."""
        return self.text(value) if isinstance(value, str) else [self.every(one) for one in value]

    def rows(self, rows: Any) -> list[list[str]]:
        """Cells of a table."""
        return [[self.part(cell) for cell in row] for row in rows]

    def facts(self, facts: Any) -> list[list[str]]:
        """Names and texts; what a user wrote stays as it is."""
        return [
            [self.text(name), text if name in OWN_WORDS and text != NOT_STATED else self.text(text)]
            for name, text in facts
        ]


def _pattern_of(phrase: str) -> re.Pattern[str]:
    return re.compile("(.+?)".join(map(re.escape, phrase.split("{}"))), re.DOTALL)


@cache
def word_table(language: str) -> WordTable:
    """Table of a language by its code.

    Raises
    ------
    SurveyError
        When there is none.
    """
    if language not in known_languages():
        raise SurveyError(f"--language: expected one of {', '.join(known_languages())}, got {language!r:.20}")
    if language == ENGLISH:
        return WordTable({}, {})
    file = resources.files("groundstation.report") / "words" / f"{language}.toml"
    tables = tomllib.loads(file.read_text("utf-8"))
    return WordTable(tables["phrases"], tables["parts"])


def labels_of(names: Mapping[str, str], language: str) -> dict[str, str]:
    """Fixed words of a template."""
    say: Callable[[str], str] = word_table(language).text
    return {name: say(words) for name, words in names.items()}
