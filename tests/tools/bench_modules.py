"""Benchmarks as modules that a test may change, and a clock that it turns."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

FOLDER = Path(__file__).parents[2] / "benchmarks"


def bench(name: str) -> Any:
    """A module of its own for each test, of which names may be changed."""
    spec = importlib.util.spec_from_file_location(f"benches_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses and kernels look for it there
    spec.loader.exec_module(module)
    return module


class Clock:
    """A clock that stands still but for what is done."""

    def __init__(self, *names: str) -> None:
        self.now, self.calls = 50.0, 0
        self.time: Any = SimpleNamespace(**dict.fromkeys(names, lambda: self.now))

    def taking(self, *seconds: float) -> Callable[..., None]:
        """Something that takes so long, one after the other and from the first again."""
        left = itertools.cycle(seconds)

        def act(*_: object) -> None:
            self.calls += 1
            self.now += next(left)

        return act
