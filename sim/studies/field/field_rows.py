"""All rows of the study of the field, and what they are asked for by."""

from __future__ import annotations

from sim.studies.field.cases import ALL, CASES
from sim.studies.field.third_world import THIRD

EVERY = (*CASES, *THIRD)
KEYS = (ALL, *(case.key for case in EVERY))
