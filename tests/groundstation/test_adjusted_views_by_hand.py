"""What an answer shows of the adjusted hole and its setup, number by number."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import pytest
from test_views_by_hand import setup_item, values_of

from groundstation.errors import SelectorError
from groundstation.service.answers import adjustment_views as adjustment_room
from groundstation.service.answers import setup_costs as costs_room
from groundstation.service.answers import setup_views as setup_room
from groundstation.service.answers.adjustment_views import (
    NamedShare,
    next_stop_advice,
    north_at_toe,
    toe_parts,
    toe_shares,
)
from groundstation.service.answers.csv_tables import table_of
from groundstation.service.answers.shapes.answer_fields import AnswerField, answer_class
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.setup.setup_items import SetupItem, SetupSource
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.adjustment.blunder_kind import BlunderKind


def share(source: str, north: float, east: float, down: float = 0.0, subject: str = "") -> NamedShare:
    return NamedShare(source, subject, 1e-4 * np.array([north, east, down]))


def test_parts_of_the_variance_at_the_toe_add_up_and_the_largest_is_first() -> None:
    """Across a hole that is worse known to the east: 1 + 3, 2 + 6, 0 + 4 square centimetres of 3 and 13."""
    budget = [
        share("tilt", 1.0, 3.0, 50.0), share("bias", 1.5, 2.0, subject="tube 3"),
        share("bias", 0.5, 4.0, subject="tube 4"), share("legs", 0.0, 4.0),
    ]  # fmt: skip
    parts = toe_parts(budget)
    assert [one.source for one in parts] == ["bias", "tilt", "legs"]
    assert [one.percent for one in parts] == pytest.approx([50.0, 25.0, 25.0])
    assert [one.sigma_cm for one in parts] == pytest.approx([math.sqrt(6.0), math.sqrt(3.0), 2.0])
    assert "4" in parts[0].words
    shares = toe_shares([*budget, share("play", 1e-12, 0.0)])
    assert [one.source for one in shares] == ["bias", "legs", "tilt", "bias"]
    assert [one.sigma_cm for one in shares] == sorted((one.sigma_cm for one in shares), reverse=True)


def test_a_north_that_is_off_moves_the_toe_across(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = SimpleNamespace(positions=np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 10.0]]), swung_covs=np.zeros((2, 3, 3)))
    drawn.swung_covs[-1] = np.diag([1e-6, 2e-6, 0.0])
    monkeypatch.setattr("groundstation.service.answers.adjustment_views.north_std", lambda _: 0.01)
    model: Any = SimpleNamespace(hole=SimpleNamespace(trajectory=drawn), setup=None)
    assert north_at_toe(model) == pytest.approx([(4.0 * 0.01) ** 2 + 1e-6, (3.0 * 0.01) ** 2 + 2e-6, 0.0])


def test_the_next_stop_is_advised_with_what_no_turn_makes_better() -> None:
    planned = SimpleNamespace(
        angles=np.array([-1.5, 0.1, 1.5]), toe_stds=np.array([0.05, 0.09, 0.03]), best=1.5,
    )  # fmt: skip
    budget = [share("north", 4.0, 5.0), share("tilt", 90.0, 90.0), share("depth", 1.0, 2.0), share("legs", 3.0, 1.0)]
    found = next_stop_advice(SimpleNamespace(next_stop=planned), budget)
    assert found is not None
    stays = 4.0 + 5.0 + 1.0 + 2.0 + 3.0 + 1.0
    values = list(values_of(found).values())
    assert values[:3] == pytest.approx(
        [math.degrees(1.5), math.sqrt((9.0 + stays) / 2.0), math.sqrt((81.0 + stays) / 2.0)]
    )
    assert next_stop_advice(SimpleNamespace(next_stop=None), budget) is None


def test_shares_of_one_item_are_those_of_its_kind_and_tube() -> None:
    item = setup_item(SetupKind.JOINT, "rad")
    items = [item, SetupItem(SetupKind.MOUNT, "3", (), 0.1, "rad", SetupSource.DEFAULT, "")]
    named = {"a": ("joint", "tube 3"), "b": ("drive", "tube 3"), "c": ("tilt", "tube 3"), "d": ("bias", "tube 3")}
    sizes = dict(zip("abcd", (1.0, 2.0, 4.0, 8.0), strict=True))
    shares = [SimpleNamespace(key=key, variances=np.array([x, 2.0 * x, 0.0])) for key, x in sizes.items()]
    examined: Any = SimpleNamespace(shares=shares, share_name=lambda one: named[one.key])
    found = [(name, variances[0]) for name, variances in costs_room._shares_by_item(examined, items)]
    assert found == [(item.name, 1.0), (item.name, 2.0), ("mount.3", 4.0)]


def test_what_one_item_costs_at_the_toe_is_the_sum_of_its_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    joint = setup_item(SetupKind.JOINT, "rad")
    tilt = SetupItem(SetupKind.MOUNT, "3", (), 0.1, "rad", SetupSource.DEFAULT, "")
    still = SetupItem(SetupKind.MOUNT_TURN, "3", (), 0.1, "rad", SetupSource.DEFAULT, "")
    of_path = SetupItem(SetupKind.PATH, "", (), 0.1, "m", SetupSource.DEFAULT, "")
    of_collar = SetupItem(SetupKind.COLLAR, "", (), 0.1, "rad", SetupSource.DEFAULT, "")
    named = {"a": ("joint", "tube 3"), "b": ("drive", "tube 3"), "c": ("tilt", "tube 3"), "e": ("collar", "")}
    named["d"] = ("path", "")
    sizes = {
        "a": (1.0, 3.0, 9.0),
        "b": (4.0, 1.0, 9.0),
        "c": (2.0, 7.0, 9.0),
        "d": (9.0, 1.0, 0.0),
        "e": (6.0, 2.0, 0.0),
    }
    shares = [SimpleNamespace(key=key, variances=np.array(x)) for key, x in sizes.items()]
    examined = SimpleNamespace(shares=shares, share_name=lambda one: named[one.key])
    nothing = np.zeros((1, 3, 3))
    drawn = SimpleNamespace(path_covs=np.diag([1.0, 0.5, 0.0])[None], tied_covs=nothing)
    monkeypatch.setattr(costs_room, "setup_priors", lambda *_: None)
    monkeypatch.setattr(costs_room, "toe_costs", lambda *_: {joint.name: 99.0, still.name: 98.0, "north": 0.25})
    hole = SimpleNamespace(examined=examined, is_adjusted=True, trajectory=drawn)
    model: Any = SimpleNamespace(hole=hole, setup=SimpleNamespace(version=1))
    course: Any = None
    found = dict(costs_room.setup_costs(model, [joint, tilt, still, of_path, of_collar], course))
    assert found.pop("north") == 0.25
    assert found == pytest.approx(
        {joint.name: math.sqrt(5.0), tilt.name: math.sqrt(7.0), still.name: 0.0, "path": math.sqrt(10.0)}
        | {of_collar.name: math.sqrt(6.0)}
    )
    drawn.tied_covs = -np.diag([8.0, 2.25, 0.0])[None]  # half of what both are to north is undone
    undone = costs_room.setup_costs(model, [joint, of_path, of_collar], course)
    assert (undone["path"], undone[of_collar.name]) == pytest.approx((math.sqrt(5.0), math.sqrt(3.0)))
    hole.is_adjusted = False
    assert costs_room.setup_costs(model, [joint, still], course)[joint.name] == 99.0


@answer_class
class TableRow:
    n: Annotated[int, "number"]


def test_an_answer_is_a_table_when_it_has_one_list_of_rows() -> None:
    one, plain = AnswerField("rows", "object", rank=1, shape=TableRow), AnswerField("depth", "number")
    assert table_of("a", (plain, one), {"depth": 1.0, "rows": [{"n": 1}, {"n": 2}]}) == "n\n1\n2\n"
    for fields in ((), (plain,), (one, dataclasses.replace(one, name="others"))):
        with pytest.raises(SelectorError, match="a: no table"):
            table_of("a", fields, {"rows": [], "others": [], "depth": 1.0})


def test_a_tube_as_all_surveys_show_it_is_in_thousandths_of_gravity(monkeypatch: pytest.MonkeyPatch) -> None:
    bias = SimpleNamespace(bias=np.array([0.01, 0.02, -0.03]), cov=np.diag([0.04, 0.09, 0.25]), looks=6)
    monkeypatch.setattr(adjustment_room, "bias_of_tube", lambda adjusted, place: bias)
    monkeypatch.setattr(adjustment_room, "unfound_across", lambda one: {1.0: 0.07, 2.0: math.inf}[one.smallest])
    step = SimpleNamespace(hypothesis=SimpleNamespace(kind=BlunderKind.BIAS_STEPPED, subject=(1,)), smallest=1.0)
    other = SimpleNamespace(hypothesis=SimpleNamespace(kind=BlunderKind.BIAS_STEPPED, subject=(0,)), smallest=2.0)
    examined: Any = SimpleNamespace(adjusted=None, tubes=[4, 6], reliabilities=[other, step])
    found = adjustment_room.adjusted_tubes(examined)[1]
    milli = 9.80665e-3
    assert (found.tube, found.looks, found.unfound_step_cm) == (6, 6, pytest.approx(7.0))
    assert found.bias_mg == pytest.approx([0.01 / milli, 0.02 / milli, -0.03 / milli])
    assert found.sigma_bias_mg == pytest.approx([0.2 / milli, 0.3 / milli, 0.5 / milli])
    assert found.smallest_step_mg == pytest.approx(1.0 / milli)
    other.smallest, examined.tubes = math.inf, [4]
    monkeypatch.setattr(adjustment_room, "unfound_across", lambda one: math.inf)
    none = adjustment_room.adjusted_tubes(examined)[0]
    assert (none.tube, none.smallest_step_mg, none.unfound_step_cm) == (4, None, None)


def test_evidence_of_what_is_wrong_is_in_decades_and_its_cost_in_centimetres(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("say_explanation", "advise_crew", "second_best"):
        monkeypatch.setattr(adjustment_room, name, lambda *_: "said")

    def explained(kind: BlunderKind, chance: float) -> Any:
        return SimpleNamespace(hypothesis=SimpleNamespace(kind=kind, stop=2), log_chance=math.log(chance))

    best, second = explained(BlunderKind.BIAS_STEPPED, 1e-7), explained(BlunderKind.MOUNT_TURNED, 1e-4)
    one: Any = SimpleNamespace(best=best, second=second, is_doubt=False, before=9.0, after=1.5)
    cost: Any = SimpleNamespace(moved=np.array([0.03, -0.04, 0.5]), variances=np.array([0.01, 0.04, 9.0]))
    examined: Any = SimpleNamespace(
        subject=lambda _: "tube 3", sentence=lambda _: "told", run=SimpleNamespace(md=[0.0, 5.0, 11.0]), tubes=[3]
    )
    row = adjustment_room.blunder_row(examined, one, cost)
    assert (row.evidence, row.second_evidence) == pytest.approx((7.0, 4.0))
    assert (row.moved_cm, row.sigma_cm, row.from_md_m) == pytest.approx((5.0, 20.0, 11.0))
    assert (row.kind, row.second_kind) == (BlunderKind.BIAS_STEPPED.value, BlunderKind.MOUNT_TURNED.value)
    assert (row.misfit_before, row.misfit_after) == (9.0, 1.5)
    one.second = None
    bare = adjustment_room.blunder_row(examined, one, None)
    assert [bare.second_kind, bare.second_evidence, bare.moved_cm, bare.sigma_cm] == [None] * 4


def test_a_setup_says_what_is_missing_then_what_costs_most_across_then_along(monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = (SetupKind.STICK_UP, SetupKind.JOINT, SetupKind.MOUNT, SetupKind.NORTH, SetupKind.COLLAR)
    items = [
        SetupItem(kind, "", (), 0.1, "rad", SetupSource.DEFAULT, "", is_needed=kind is SetupKind.NORTH)
        for kind in kinds
    ]
    costs = dict(zip((item.name for item in items), (0.9, 0.1, 0.2, 0.05, 0.15), strict=True))
    for name, value in (
        ("setup_items", (items)), ("setup_costs", costs), ("contradicted_kinds", []), ("designed_course", None),
        ("say_hold", ""), ("next_step", ""), ("say_worst", ""),
    ):  # fmt: skip
        monkeypatch.setattr(setup_room, name, lambda *_, value=value: value)
    course = SimpleNamespace(md=[0.0, 12.3456])
    monkeypatch.setattr(setup_room, "designed_course", lambda *_: course)
    hole = SimpleNamespace(trajectory=[0])
    config = SimpleNamespace(design=None, tube_length=1.0)
    model: Any = SimpleNamespace(config=config, setup=None, string=None, hole=hole)
    found = setup_room.answer_setup(model, Parameters())
    assert [row.kind for row in found.items] == ["north", "mount", "collar", "joint", "stick_up"]
    assert (found.worst, found.at_m, found.surveyed, found.ready) == (items[2].name, 12.346, False, True)
