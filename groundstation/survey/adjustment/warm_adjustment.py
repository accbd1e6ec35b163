"""The compiled parts of an adjustment, compiled or loaded from the cache before the first hole is adjusted."""

from __future__ import annotations

import numpy as np

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.looks import Looks, PathPrior, StringPrior


def warm_adjustment() -> None:
    """Adjust one look of one tube at one station, and work out what follows."""
    first, gravity = np.zeros(1, np.intp), 9.81
    force, known = np.array([[0.0, 0.0, -gravity]]), np.full(1, 1e-6)
    looks = Looks(first + 1, first, first, first, force, known, np.zeros(1), known)
    string = StringPrior(known, known, np.zeros(2), 1e-6 * np.eye(2), gravity, 1e-3, 1e-4)
    path = PathPrior(np.array([0.0, 2.0]), np.array([0.0, 0.0, 1.0]), np.diag([1e-4, 1e-4, 0.0]), 1e-3, 20.0)
    adjust_hole(looks, string, path).cofactor(np.zeros((2, 2, 1)), np.zeros((string.width, 1)))
