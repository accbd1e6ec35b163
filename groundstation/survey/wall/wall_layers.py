"""Radii of columns by depth, as the tables of a wall file tell them; m."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from groundstation.errors import SurveyError
from groundstation.survey.wall.column_plans import Layer

MOST_RADIUS_CV = 0.5
LAYER_KEYS = ("from_m", "radius_m", "radius_cv")


def layers_of(path: Path, tables: Any, radius_cv: float) -> tuple[Layer, ...]:
    """Radii by depth; above the first layer the radius is that of the wall.

    Raises
    ------
    SurveyError
        Names the layer, its key, what was expected and what came.
    """
    layers = [Layer(-math.inf, None, radius_cv)]
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise SurveyError(f"{path}: layer: expected tables [[layer]] with {', '.join(LAYER_KEYS)}")
    for k, table in enumerate(tables, 1):
        for key in table:
            if key not in LAYER_KEYS:
                raise SurveyError(f"{path}: layer {k}: {key}: unknown key; expected one of {', '.join(LAYER_KEYS)}")
        if "from_m" not in table:
            raise SurveyError(f"{path}: layer {k}: from_m is missing")
        given = {key: _layer_value(path, k, key, value) for key, value in table.items()}
        if given["from_m"] <= layers[-1].top:
            raise SurveyError(
                f"{path}: layer {k}: expected from_m beyond {layers[-1].top:g} m, got {given['from_m']:g} m"
            )
        layers.append(Layer(given["from_m"], given.get("radius_m"), given.get("radius_cv", radius_cv)))
    return tuple(layers)


def _layer_value(path: Path, k: int, key: str, value: Any) -> float:
    usable = not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
    if not usable or (key != "from_m" and value < 0.0) or (key == "radius_m" and value == 0.0):
        raise SurveyError(f"{path}: layer {k}: {key}: expected a positive number, got {value!r:.60}")
    if key == "radius_cv" and value > MOST_RADIUS_CV:
        raise SurveyError(f"{path}: layer {k}: radius_cv: expected at most {MOST_RADIUS_CV:g}, got {value!r:.60}")
    return float(value)
