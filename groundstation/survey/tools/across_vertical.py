"""Errors of an inclination where the hole is vertical: a lean has no direction there, so it errs in every direction.

A term that turns the inclination alone moves a hole along its lean and not across. In a vertical hole that would be a
direction that nothing measured, with no error at all across it. So such a term has a companion there: as large, across,
fading to nothing at 0.1 deg, from where on the hole leans somewhere and the term is what was published.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from groundstation.survey.tools.formulas import ARRAY, VARIABLES, compile_formulas, is_zero
from groundstation.survey.tools.instruments import COMPANION, ZERO, SurveyTool, Term

FADED_DEG = 0.1  # inclination from which on a lean has its direction
FADE = f"Max(0, 1 - (Min(Inc, pi - Inc) / ({FADED_DEG} * rad))^2) / Sin(Inc)"
NOTHING = 1e-6  # of a weight in a vertical hole
UPRIGHT = 1e-30  # rad


def with_across_terms(tool: SurveyTool) -> SurveyTool:
    """The tool with a companion for every term that leans a vertical hole in one direction alone."""
    known = {term.name for term in tool.terms}
    more = [
        _across(term) for term in tool.terms if _leans_one_way(tool, term) and f"{term.name}{COMPANION}" not in known
    ]
    return tool.with_terms((*tool.terms, *more)) if more else tool


def _leans_one_way(tool: SurveyTool, term: Term) -> bool:
    """Whether a term moves the inclination alone, also that of a vertical hole."""
    alone = is_zero(term.weights[2]) and not is_zero(term.weights[1])
    if not alone or term.by_mode or term.singular is not None or term.position is not None:
        return False
    inputs = [UPRIGHT if name.startswith("Inc") else 1.0 for name in VARIABLES] + list(tool.parameters.values())
    with np.errstate(all="ignore"):
        (weight,) = compile_formulas((term.weights[1],), tuple(tool.parameters))(ARRAY, inputs)
    return bool(abs(weight) > NOTHING)


def _across(term: Term) -> Term:
    """The companion of a term; a vertical hole counts as leaning north."""
    weights = ("0", "0", f"({term.weights[1]}) * {FADE}")
    return replace(term, name=f"{term.name}{COMPANION}", weights=weights, singular=(ZERO[0], term.weights[1], ZERO[2]))
