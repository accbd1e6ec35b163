"""View of the setup: every item with its value, its source, its age and what it costs at the toe."""

from __future__ import annotations

import datetime
import math
import time
from collections.abc import Mapping

from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import largest_first
from groundstation.service.answers.setup_costs import setup_costs
from groundstation.service.answers.shapes.setup_shapes import SetupAnswer, SetupRow
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.setup.readiness import next_step, say_hold, say_worst, words_of
from groundstation.service.setup.setup_checks import contradicted_kinds, say_contradiction
from groundstation.service.setup.setup_items import ALONG, SetupItem, missing_names, setup_items
from groundstation.service.setup.toe_costs import designed_course

SHOWN_UNITS = {"rad": "deg", "rad/s": "deg/s", "rad/m": "deg/m"}  # what people read in place of a unit
LEFT_OUT = (
    "random noise of the readings, and blunders that are not found. A slip in telling north or the stick-up is in no "
    "reading, and is shown by a check alone; one in a length by the depth at the make-ups, or by a tape"
)


@view_of(SetupAnswer)
def answer_setup(k: RigModel, _p: Parameters) -> SetupAnswer:
    """What is known of the rig, the worst first."""
    items, trajectory = setup_items(k.config, k.setup, k.string), k.hole.trajectory
    is_surveyed = len(trajectory) > 1
    course = trajectory if is_surveyed else designed_course(k.config.design, k.config.tube_length)
    costs = setup_costs(k, items, course)
    missing, unchecked = missing_names(items), [item.name for item in items if item.is_unchecked]
    contradicted = [say_contradiction(k.setup, kind) for kind in contradicted_kinds(k.setup)]
    hold = say_hold(missing, unchecked, contradicted)
    # a column is judged across its axis: what is wrong of the depth comes after all else
    ordered = sorted(items, key=lambda item: (not item.is_missing, item.kind in ALONG, largest_first(costs[item.name])))
    return SetupAnswer(
        ready=not hold,
        missing=missing,
        unchecked=unchecked,
        hold=hold,
        contradicted=contradicted,
        todo=next_step(items, costs),
        worst=max(items, key=lambda item: (item.kind not in ALONG, costs[item.name])).name,
        costs_most=say_worst(items, costs),
        at_m=round(float(course.md[-1]), 3),
        surveyed=is_surveyed,
        left_out=LEFT_OUT,
        items=[setup_row(item, costs, time.time()) for item in ordered],
    )


def setup_row(item: SetupItem, costs: Mapping[str, float], now: float) -> SetupRow:
    """One item; ``now`` is the time of day (s, UTC)."""
    scale = math.degrees(1.0) if item.unit in SHOWN_UNITS else 1.0
    return SetupRow(
        item=item.name,
        kind=item.kind.value,
        subject=item.subject,
        words=words_of(item),
        value=[round(scale * value, 9) for value in item.values],
        sigma=float(f"{scale * item.sigma:.6g}"),
        unit=SHOWN_UNITS.get(item.unit, item.unit),
        source=item.source.value,
        detail=item.detail,
        told=item.is_told,
        missing=item.is_missing,
        by=item.by,
        utc=item.utc,
        age_s=None if not item.utc else max(now - datetime.datetime.fromisoformat(item.utc).timestamp(), 0.0),
        times_told=item.times_told,
        toe_cm=float(f"{100.0 * costs[item.name]:.3g}"),
        check=item.check,
        least_slip=None if item.least_slip is None else float(f"{scale * item.least_slip:.6g}"),
        way="along" if item.kind in ALONG else "across",
    )
