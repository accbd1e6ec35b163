"""Parts of a surveyed hole by hand: where an adjustment goes on, whose variance a joint has, what is kept of an end."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from groundstation.service.hole.adjusted_stations import AdjustedStations, learnt_wander
from groundstation.service.hole.beginnings import grown_start
from groundstation.service.hole.movement import Moved, Movement, PlacedStop
from groundstation.service.hole.packed_end import LEAST_WEIGHT, packed_end
from groundstation.service.hole.resolving import force_vars
from groundstation.service.hole.string_prior import (
    Hanging,
    errors_of_make_up,
    errors_of_mount,
    joint_variances,
    name_cause,
)
from groundstation.survey.adjustment.looks import StartingPoint
from groundstation.survey.adjustment.next_stop import NextStop, _gains
from groundstation.survey.adjustment.screen import late_tests
from groundstation.survey.fusion import fusion as fusion_room
from groundstation.survey.fusion.fusion import DEPARTED, Weighting
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd


def test_more_stations_and_tubes_go_on_from_those_that_are_known() -> None:
    """The collar and stations 2 and 3 of five were adjusted, of two tubes and one make-up of three and two."""
    start = StartingPoint(
        tangents=np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 0.99], [0.2, 0.0, 0.98]]),
        curvatures=np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
        tubes=np.arange(12.0).reshape(2, 6), make_ups=np.array([0.7]), gravity=9.8, play_var=1e-4, curvature_var=4e-6,
        leg_vars=np.array([8e-6, 9e-6]),
    )  # fmt: skip
    string: Any = SimpleNamespace(count=3, turn=np.array([0.1, 0.2, 0.3, 0.4, 0.5]))
    for _ in range(2):
        grown = grown_start(start, np.array([0, 2, 3]), 6, string)
        assert grown.tangents[:, 0].tolist() == [0.0, 0.0, 0.1, 0.2, 0.2, 0.2]
        assert grown.curvatures.tolist() == [[1.0, 2.0], [0.0, 0.0], [3.0, 4.0], [5.0, 6.0], [0.0, 0.0], [0.0, 0.0]]
        assert grown.leg_vars.tolist() == [4e-6, 8e-6, 9e-6, 4e-6, 4e-6]
        assert grown.tubes[:2].tolist() == start.tubes.tolist()
        assert grown.tubes[2].tolist() == [0.0] * 5 + [0.3]
        assert (grown.make_ups.tolist(), grown.is_learnt) == ([0.7, 0.5], True)
        assert (grown.gravity, grown.play_var, grown.curvature_var) == (9.8, 1e-4, 4e-6)
        assert string.turn.tolist() == [0.1, 0.2, 0.3, 0.4, 0.5]  # nothing that was told is overwritten


def test_each_joint_has_what_a_tube_has_more_than_the_one_above_it() -> None:
    totals = {(1, (2, 3, 4)): 10.0, (3, (4,)): 4.0, (4, ()): 1.5}
    assert joint_variances((1, (2, 3, 4)), totals) == {(1, 2): 3.0, (2, 3): 3.0, (3, 4): 2.5, (4, 0): 1.5}
    totals[(2, (3, 4))] = 9.0
    assert joint_variances((1, (2, 3, 4)), totals) == {(1, 2): 1.0, (2, 3): 5.0, (3, 4): 2.5, (4, 0): 1.5}
    totals[(3, (4,))] = 12.0  # less below than above is nothing between
    assert joint_variances((1, (2, 3, 4)), totals)[2, 3] == 0.0
    assert joint_variances((7, None), {(7, None): 2.0}) == {(7, 0, 0): 2.0}


def test_a_turn_is_of_its_mount_and_of_the_joints_that_turn_it() -> None:
    """1 hangs below 2 and 2 below 3: of the make-up all joints down to the lowest, of a mount those with a sign."""
    hanging = Hanging()
    assert [hanging.add_chain(chain) for chain in ((1, (2, 3)), (2, (3,)), (3, ()), (1, (2, 3)))] == [
        (0, 0), (1, 0), (2, 0), (0, 0),
    ]  # fmt: skip
    assert errors_of_mount(hanging, (0, 1)) == [((0, 1), 1.0)]
    assert errors_of_mount(hanging, (0, 3)) == [((0, 3), 1.0), ((0, 2, 3), -1.0), ((0, 1, 2), -1.0)]
    assert errors_of_make_up(hanging, (0, 3)) == [((0, 3, 0), 1.0), ((0, 2, 3), 1.0), ((0, 1, 2), 1.0)]
    assert errors_of_make_up(hanging, (0, -7)) == [((0, 7, 0, 0), 1.0)]
    kinds = [name_cause(hanging, name) for name in ((0, 3), (0, 2, 3), (0, 3, 0), (0, 9, 0, 0))]
    assert [kind for kind, _ in kinds] == ["mount", "joint", "drive", "drive"]
    assert [place for _, place in kinds] == [2, 1, 2, -1]
    hanging.add_chain((2, (1, 3)))  # hung otherwise: all begins anew
    assert hanging.tubes[1, 2] == 3
    assert hanging.joints_below((1, 3)) == [(1, 1), (1, 2)]


def test_imus_of_a_tube_weigh_by_their_own_variances() -> None:
    covs = np.array([[np.diag([1.0, 2.0, 6.0]), np.diag([1.0, 1.0, 1.0])], [np.eye(3), np.zeros((3, 3))]])
    assert force_vars(covs).tolist() == pytest.approx([1.0 / (1.0 / 3.0 + 1.0), 0.0])
    assert force_vars(covs[:, :1]).tolist() == pytest.approx([3.0, 1.0])


def test_an_end_is_kept_with_every_part_that_matters() -> None:
    ends = Deviation(20.0, 19.0, np.array([0.3, -0.1]), np.array([[4e-3, 1e-3], [1e-3, 9e-3]]), 0.5)
    weights = np.array([0.6, 0.4 - 0.5 * LEAST_WEIGHT, 0.5 * LEAST_WEIGHT])
    means = np.array([[0.25, -0.125], [0.5, 0.0], [9.0, 9.0]])
    covs = np.array([[[1e-3, 2e-4], [2e-4, 4e-3]], [[5e-3, -1e-3], [-1e-3, 6e-3]], np.eye(2)])
    measured = np.array([[1e-4, 3e-5], [3e-5, 2e-4]])
    for reached, comes in ((True, False), (False, True)):
        found = packed_end(ProjectedEnd(ends, NormalMixture(weights, means, covs), measured, reached, comes)).unpacked()
        assert (found.ends.md, found.ends.along, found.limit, found.is_reached, found.comes_there) == (
            20.0, 19.0, 0.5, reached, comes,
        )  # fmt: skip
        assert found.ends.offset == pytest.approx(ends.offset)
        assert found.ends.cov == pytest.approx(ends.cov)
        assert found.measured == pytest.approx(measured)
        assert found.foreseen.weights == pytest.approx(weights[:2] / weights[:2].sum(), rel=1e-6)
        assert found.foreseen.means == pytest.approx(means[:2], rel=1e-6)
        assert found.foreseen.covs == pytest.approx(covs[:2], rel=1e-6)


def test_a_leg_is_driven_by_the_sharper_of_itself_and_the_one_below(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.service.hole.adjusted_stations.collar_ties", lambda _: ())
    now = SimpleNamespace(leg_vars=np.array([1.0, 4.0, 2.0, 8.0, 3.0]) * 1e-6, curvature_var=2e-6)
    wander, driven, _ = learnt_wander(SimpleNamespace(now=now), 15.0)
    assert driven.tolist() == pytest.approx([2.0, 2.0, 4.0, 4.0, 1.5])
    assert now.leg_vars.tolist() == pytest.approx([1e-6, 4e-6, 2e-6, 8e-6, 3e-6])
    assert (wander.std, wander.length) == (pytest.approx(math.sqrt(2e-6)), 15.0)


@pytest.mark.parametrize(("bend_deg", "is_back"), [(119.0, False), (121.0, True)])
def test_a_survey_points_back_where_one_leg_would_bend_beyond_two_thirds_of_a_half_turn(
    monkeypatch: pytest.MonkeyPatch, bend_deg: float, is_back: bool
) -> None:
    room = "groundstation.service.hole.adjusted_stations."
    monkeypatch.setattr(room + "fused_alone", lambda station: station.way)
    monkeypatch.setattr(room + "tangents_of", np.array)
    down, bent = (0.0, 0.0, 1.0), (math.sin(math.radians(bend_deg)), 0.0, math.cos(math.radians(bend_deg)))
    below: Any = [
        SimpleNamespace(md=md, way=way, lacks_newest=False) for md, way in ((2.0, down), (4.0, bent), (6.0, bent))
    ]
    collar: Any = bent  # as it was adjusted; as it was told it goes down
    told: Any = down
    assert AdjustedStations(collar, told=told, below=below).turned_back() == ([4.0] if is_back else [])
    assert AdjustedStations(told, below=below).turned_back() == ([4.0] if is_back else [])


# what is judged anew, and how far back


def test_a_stop_that_is_judged_anew_forgets_what_moved_from_its_begin_on(monkeypatch: pytest.MonkeyPatch) -> None:
    stops: Any = None
    movement = Movement(stops, [])
    station: Any = SimpleNamespace(md=7.0, drops=[0, 1, 2])
    other: Any = SimpleNamespace(md=9.0, drops=[])
    nothing: Any = None
    movement.moved = [Moved(7.0, at, 1, nothing) for at in (1.0, 2.9, 3.0, 3.5, 6.0)]
    judged = [[PlacedStop(3.0, 7.0, 1, 0, station)], [PlacedStop(8.0, 9.0, 0, 1, other)]]
    asked: list[float] = []
    monkeypatch.setattr(Movement, "_stops_since", lambda self, since: asked.append(since) or judged)
    monkeypatch.setattr(Movement, "_judge_stop", lambda self, one: [other] if one is judged[1] else [])
    assert movement.judge_since(5.0) == {7.0: station, 9.0: other}
    assert ([one.at for one in movement.moved], station.drops, asked) == ([1.0, 2.9], [0, 2], [5.0])


@pytest.mark.parametrize(
    ("size", "weighting"),
    [
        (0.0, Weighting.LINEAR), (DEPARTED, Weighting.LINEAR), (DEPARTED + 1e-9, Weighting.QUADRATIC),
        (4.0, Weighting.QUADRATIC), (4.0 + 1e-9, Weighting.CUBIC),
    ],
)  # fmt: skip
def test_a_reading_weighs_by_how_far_it_departs(
    monkeypatch: pytest.MonkeyPatch, size: float, weighting: Weighting
) -> None:
    monkeypatch.setattr(fusion_room, "newest_departure", lambda _: (np.zeros(2), size))
    assert fusion_room.adaptive_weighting([]) is weighting


def test_a_long_hole_is_screened_in_its_sixteen_latest_stops() -> None:
    stop = np.repeat(np.arange(40), 2)
    left = np.random.default_rng(1).standard_normal((80, 3))
    weights = np.repeat(np.diag([1.0, 2.0, 5.0])[None], 80, axis=0)
    found: Any = SimpleNamespace(
        looks=SimpleNamespace(stop=stop, tube=np.tile([1, 0], 40)),
        linear=SimpleNamespace(weights=weights),
        left_of=left.__getitem__,
    )
    (each, told), (since, _) = late_tests(found)
    assert told.tolist() == [3] * 32
    assert each == pytest.approx(np.sum(left[48:] ** 2 * [1.0, 2.0, 5.0], axis=1))
    expected = []
    for tube in (0, 1):
        own = left[48:][np.tile([1, 0], 16) == tube][::-1]
        pulled = np.cumsum(own * [1.0, 2.0, 5.0], axis=0)
        expected += (np.sum(pulled**2 / [1.0, 2.0, 5.0], axis=1) / np.arange(1, 17)).tolist()
    assert since == pytest.approx(np.array(expected))


def test_what_looks_to_come_gain_is_what_a_dense_update_takes_off() -> None:
    random = np.random.default_rng(3)
    count, many, wide = 2, 3, 9
    root = random.standard_normal((count * wide + 3, count * wide + 3))
    whole = root @ root.T + np.eye(len(root))
    cov, of_toe = whole[:-3, :-3], whole[:-3, -3:]
    jacobians = random.standard_normal((many, count, 3, wide))
    noise = np.repeat(np.diag([0.5, 1.0, 2.0])[None, None], many, axis=0).repeat(count, axis=1)
    noise[:, 1] *= 3.0
    gains = _gains(jacobians, noise, cov.reshape(count, wide, count, wide), of_toe.reshape(count, wide, 3))
    for one in range(many):
        design = np.zeros((3 * count, count * wide))
        spread = np.zeros((3 * count, 3 * count))
        for place in range(count):
            design[3 * place : 3 * place + 3, wide * place : wide * place + wide] = jacobians[one, place]
            spread[3 * place : 3 * place + 3, 3 * place : 3 * place + 3] = noise[one, place]
        gain = np.linalg.solve(design @ cov @ design.T + spread, design @ of_toe)
        assert gains[one] == pytest.approx(float(np.trace((design @ of_toe).T @ gain)))


def test_a_next_stop_is_worth_what_it_has_over_one_without_a_turn() -> None:
    planned = NextStop(np.array([0.0, 1.0, 2.0]), np.array([0.30, 0.18, 0.55]))
    assert (planned.best, planned.worth) == (1.0, pytest.approx(0.12))
