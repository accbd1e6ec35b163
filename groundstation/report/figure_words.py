"""The words inside a picture, in the language of the report that it stands in."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.text import Text

from groundstation.report.style import svg_of
from groundstation.report.word_tables import word_table


def translate_figure(figure: Figure, language: str) -> Figure:
    """Say every title, name of an axis and line of a legend in a language; errors as ``word_table``."""
    words = word_table(language)
    for text in figure.findobj(Text):
        text.set_text(words.part(text.get_text()))
    return figure


def svg_in(figure: Figure, language: str) -> str:
    """Text of a figure for a report in a language; errors as ``word_table``."""
    return svg_of(translate_figure(figure, language))
