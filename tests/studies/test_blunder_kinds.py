"""Kinds of blunders: each is a scenario of its own in all sizes, and outcomes are told apart."""

import pytest

from borechain.studies.blunders.answer_given import AnswerGiven
from borechain.studies.blunders.kinds import KINDS, PlantedBlunder
from borechain.studies.blunders.run import BlunderJob, BlunderRun, outcome_of, run_rig, tables_with
from borechain.studies.drawn_rigs import KnownSetUp, drawn_rigs, tables_of
from sim.world.path_section import HOLE_KINDS
from sim.world.scenario import scenario_of

HONEST = AnswerGiven("on_target", (), (), ())


def test_there_are_enough_kinds_in_three_sizes() -> None:
    assert sum(len(kind.sizes) == 3 for kind in KINDS) >= 25
    assert {kind.name for kind in KINDS if len(kind.sizes) != 3} == {"joints untold", "north untold", "collar untold"}
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    assert all(kind.sizes == tuple(sorted(kind.sizes)) for kind in KINDS)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_kind_changes_the_scenario_of_a_rig(kind: PlantedBlunder) -> None:
    draw = drawn_rigs(KnownSetUp(), 1)[0]
    honest = scenario_of(dict(tables_of(draw))).file
    for size in range(len(kind.sizes)):
        file = scenario_of(dict(tables_with(BlunderJob(draw, KINDS.index(kind), size)))).file
        assert file != honest


def test_rigs_are_drawn_by_their_number_and_have_every_kind_of_hole() -> None:
    rigs = drawn_rigs(KnownSetUp(), 14)
    assert {rig.kind for rig in rigs} == set(HOLE_KINDS)
    assert tables_of(rigs[0]) == tables_of(drawn_rigs(KnownSetUp(), 2)[0])
    assert tables_of(rigs[0])["told"] != tables_of(rigs[1])["told"]


@pytest.mark.parametrize(
    ("worst", "answer", "outcome"),
    [
        (9.0, AnswerGiven("on_target", (), (), ("mount",)), "named"),
        (9.0, AnswerGiven("dont_know", ("setup",), (), ()), "doubted"),
        (9.0, AnswerGiven("on_target", (), ("joint",), ()), "doubted"),
        (9.0, AnswerGiven("on_target", (), (), ("depth",)), "doubted"),
        (2.0, HONEST, "below"),
        (9.0, HONEST, "missed"),
    ],
)
def test_an_outcome_is_what_the_crew_is_told(worst: float, answer: AnswerGiven, outcome: str) -> None:
    assert outcome_of(BlunderRun(worst, 1.0, 1.0, answer), ("mount",)) == outcome


def test_what_is_in_no_reading_is_counted_by_itself_where_nothing_was_said() -> None:
    seen_by = "a second bearing"
    assert outcome_of(BlunderRun(9.0, 1.0, 1.0, HONEST), (), seen_by) == "unseen"
    assert outcome_of(BlunderRun(2.0, 1.0, 1.0, HONEST), (), seen_by) == "below"
    assert outcome_of(BlunderRun(9.0, 1.0, 1.0, AnswerGiven("out", (), ("depth",), ())), (), seen_by) == "doubted"


@pytest.mark.slow
def test_a_depth_that_stood_still_is_a_doubt_and_a_wrong_collar_is_named() -> None:
    draw = drawn_rigs(KnownSetUp(), 1)[0]
    places = {kind.name: place for place, kind in enumerate(KINDS)}
    stuck = run_rig(BlunderJob(draw, places["depth stuck"], 0)).answer
    assert stuck.word == "dont_know"
    assert "depth_contradicts" in stuck.alarms
    collar = run_rig(BlunderJob(draw, places["collar wrong"], 2)).answer
    assert collar.causes == ("collar_wrong",)


@pytest.mark.slow
def test_depths_that_scatter_by_five_centimetres_leave_no_direction_beyond_what_is_stated() -> None:
    place = next(place for place, kind in enumerate(KINDS) if kind.name == "depth errs at every stop")
    first, _, third = drawn_rigs(KnownSetUp(), 3)
    for draw in (first, third):  # those that were beyond it while depths were taken for exact
        assert run_rig(BlunderJob(draw, place, 1)).direction < 3.0
