"""Warnings of models and scenarios as lines for people."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def telling_warnings(say: Callable[[str], object]) -> Iterator[None]:
    """Give every warning of the context to ``say`` when it ends, each once and in one line."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for message in dict.fromkeys(str(warning.message) for warning in caught):
        say(f"Warning: {message}")
