"""Figures of a request that are numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from groundstation.errors import SurveyError


def check_figures(request: Any) -> None:
    """Refuse a request, a dataclass whose fields are named as the options are, with a figure that is no finite number.

    Raises
    ------
    SurveyError
        Naming the option and what came.
    """
    for one in fields(request):
        value = getattr(request, one.name)
        if is_dataclass(value):
            check_figures(value)
            continue
        for figure in _parts(value):
            if isinstance(figure, float) and not math.isfinite(figure):
                raise SurveyError(f"--{one.name.replace('_', '-')}: expected a finite number, got {figure:g}")


def _parts(value: Any) -> tuple[Any, ...]:
    if isinstance(value, Mapping):
        return tuple(value.values())
    return tuple(value) if isinstance(value, (tuple, list)) else (value,)
