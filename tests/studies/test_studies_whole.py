"""Studies of whole rigs part by part: what is drawn, what a blunder changes, how a hole is judged, what a table holds.

Sigmas are all unlike, sums are made a second time, and what is only words or places is compared with a file that was
read. Written anew by `python tests/studies/test_studies_whole.py`.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from small_hole import COV, HOLE, PLACES

from borechain.gauntlet.seams import SEAMS, drawn_seams, opened_seams
from borechain.studies.blunders.answer_given import AnswerGiven, answer_of, is_of_start
from borechain.studies.blunders.kinds import KINDS
from borechain.studies.blunders.run import BlunderRun, blunder_row, count_steps, honest_row, outcome_of, verdict_lines
from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, tables_of
from borechain.studies.judged_hole import (
    JudgedHole,
    drift_of,
    judge_hole_of,
    true_depth,
    unfound_of,
)
from borechain.studies.rig_study_table import all_studies
from borechain.studies.set_up.run import sketch_cases
from sim.studies.study import Study
from sim.world.path_section import HOLE_KINDS

DATA = Path(__file__).parents[1] / "data" / "studies"
KNOWN = KnownSetUp(2.0, 0.3, 0.07, 0.11, 0.13, 0.17, 0.019, 0.0023, 2.9e-4, 0.031, 0.0037)
DRAW = RigDraw(KNOWN, 7, "straight" if "straight" in HOLE_KINDS else HOLE_KINDS[0], True, 3.0, 41.0)


def flat(tables: Any, path: str = "") -> dict[str, Any]:
    if not isinstance(tables, dict):
        return {path: tables}
    return {key: value for name, one in tables.items() for key, value in flat(one, f"{path}.{name}".strip(".")).items()}


def added(before: Any, after: Any) -> Any:
    """What was added to a number, or to each of some; what stands there where nothing did."""
    if isinstance(before, tuple) and isinstance(after, tuple) and len(before) == len(after) == 10:
        return tuple(round(b - a, 9) for a, b in zip(before, after, strict=True))
    return f"+{after - before:.9g}" if isinstance(before, float) and isinstance(after, float) else after


def blunder_lines() -> Iterator[str]:
    base = flat(tables_of(DRAW))
    for kind in KINDS:
        named = ", ".join(map(str, kind.named))
        yield f"# {kind.name}; {kind.unit or 'no unit'}; named {named or '-'}; {kind.seen_by or '-'}"
        for size in kind.sizes:
            found = flat(kind.change(tables_of(DRAW), size))
            assert base.keys() <= found.keys()
            changes = [f"{key} {added(base.get(key), new)}" for key, new in found.items() if new != base.get(key)]
            yield f"{size:g}: {'; '.join(changes)}"


def study_lines(study: Study) -> Iterator[str]:
    for field in fields(study):
        value = getattr(study, field.name)
        if field.name == "fixed":
            value = dict(value)
        yield from (
            [f"{field.name}: {value!r}"]
            if field.name not in ("tables", "takes")
            else [f"{field.name}: {one!r}" for one in value]
        )
    yield ""


def seam_lines() -> Iterator[str]:
    yield from (f"{seam.key} of {seam.module}: {seam.values}; {seam.meaning}" for seam in SEAMS)


FILES: dict[str, Callable[[], Iterable[str]]] = {
    "blunders.txt": blunder_lines,
    "studies.txt": lambda: (line for study in all_studies().values() for line in study_lines(study)),
    "seams.txt": seam_lines,
    "sketch.txt": lambda: map(repr, sketch_cases()),
}


@pytest.mark.parametrize("name", FILES)
def test_tables_are_as_they_were_read(name: str) -> None:
    assert list(FILES[name]()) == (DATA / name).read_text("utf-8").splitlines()


def test_squares_are_in_the_sigmas_of_their_own_axis() -> None:
    np.testing.assert_allclose(HOLE.direction_squares, [1.0 + 4.0, 0.25 + 1.0])
    np.testing.assert_allclose(HOLE.ellipsoid_squares, [1.0 + 1.0 + 4.0, 1.0 + 4.0 + 1.0])
    np.testing.assert_allclose(HOLE.axis_squares, [[1.0, 1.0, 4.0], [1.0, 4.0, 1.0]])


def test_the_worst_is_of_its_freedom_and_less_what_is_told_to_be_unfound() -> None:
    direction, worst = HOLE.worst_sigmas()
    assert [direction, worst] == pytest.approx([math.sqrt(2.5), math.sqrt(2.5)])
    flat_first = replace(HOLE, lean_error=np.array([[0.2, 0.3], [0.5, 4.0]]), error=HOLE.error * [[0.1], [1.0]])
    assert flat_first.worst_sigmas() == pytest.approx((math.sqrt(1.25 / 2.0), math.sqrt(2.0)))
    off, toe = math.hypot(0.5, 4.0), math.sqrt(93.0)
    told = replace(flat_first, unfound=(0.25 * off, 0.5 * toe))
    less = 0.75 * math.sqrt(0.625)
    assert told.worst_sigmas() == pytest.approx((less, max(less, 0.5 * math.sqrt(2.0))))
    all_told = replace(flat_first, unfound=(2.0 * off, 2.0 * toe))
    first = math.sqrt((0.01 + 0.01) / 2.0)
    assert all_told.worst_sigmas() == pytest.approx((first, max(first, math.sqrt(0.02))))
    exact = replace(flat_first, lean_error=np.array([[0.2, 0.3], [0.0, 0.0]]))
    assert exact.worst_sigmas()[0] == pytest.approx(first)
    empty = JudgedHole(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert empty.worst_sigmas() == (0.0, 0.0)


@pytest.mark.parametrize(("size", "part"), [(0.25, 0.25), (-0.75, -0.75), (1.0, 1.0), (1.5, 1.0), (-3.0, -1.0)])
def test_of_a_drift_that_is_told_to_be_unfound_no_more_is_taken_off_than_all(size: float, part: float) -> None:
    lean_drift, drift = np.array([[0.2, -0.1], [0.4, 0.3]]), np.array([[1.0, 2.0, 0.0], [3.0, 5.0, 0.5]])
    across = np.array([[0.1, 0.2], [0.0, 0.0]])  # of no part of the drift where both axes are known alike
    alike = np.repeat(0.01 * np.eye(2)[None], 2, axis=0)
    slipped = JudgedHole(
        HOLE.md, size * lean_drift + across, alike, size * drift, HOLE.cov, (0.0, 0.0), lean_drift, drift
    )
    left = slipped.without_drift()
    np.testing.assert_allclose(left.lean_error, (size - part) * lean_drift + across, atol=1e-12)
    np.testing.assert_allclose(left.error, (size - part) * drift, atol=1e-12)
    assert replace(slipped, drift=None).without_drift().error is slipped.error
    none = replace(slipped, lean_drift=0.0 * lean_drift).without_drift()
    np.testing.assert_array_equal(none.error, slipped.error)


DRIFT = SimpleNamespace(
    tangents=np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]), positions=np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
)


class Told(dict[str, Any]):
    def column(self, name: str) -> Any:
        return np.array(self[name])


def station(md: float, tube: list[int], at: list[float], told: list[float]) -> Any:
    return SimpleNamespace(md=md, stops=Told(tube=tube, at=at, md=told))


WORLD = SimpleNamespace(bit_depth=lambda at: 10.0 * at, below=lambda tube: 2.0 * tube + 0.5)


def test_a_true_depth_is_the_told_one_less_the_mean_of_what_it_was_told_off() -> None:
    # bit at 10 and 20 m, nodes 2.5 and 6.5 m above it: 7.5 and 13.5 m; told 0.3 m and 0.1 m more
    assert true_depth(WORLD, station(7.8, [1, 3], [1.0, 2.0], [7.8, 13.6])) == pytest.approx(7.8 - 0.2)  # type: ignore[arg-type]


def test_a_hole_is_judged_without_its_collar_and_against_what_moved() -> None:
    stations = [station(0.0, [1], [1.0], [0.0]), station(7.8, [1, 3], [1.0, 2.0], [7.8, 13.6])]

    def truth(lean: float) -> Any:
        return SimpleNamespace(
            tangent=lambda md: (np.column_stack([lean * md, 2.0 * lean * md, np.ones_like(md)]), None),
            position=lambda md: np.array([md, 2.0 * md, 3.0 * md]),
        )

    directions = {7.8: SimpleNamespace(lean=np.array([0.8, 1.9]), total_cov=COV[0])}
    hole = SimpleNamespace(
        stations=stations,
        direction_of=lambda one: directions[one.md],
        place_of=lambda _: 2,
        trajectory=SimpleNamespace(
            positions=np.array([[0.0] * 3, [1.0] * 3, [8.0, 15.0, 23.0]]), covs=np.array([*PLACES, 7 * PLACES[0]])
        ),
        is_adjusted=False,
        examined=SimpleNamespace(last_look=SimpleNamespace(direction=0.1, toe=0.2), unseen_drift=DRIFT),
    )  # fmt: skip
    world = SimpleNamespace(**vars(WORLD), scenario=SimpleNamespace(hole=truth(0.1)), moved_hole=None)
    judged = judge_hole_of(world, hole)  # type: ignore[arg-type]
    np.testing.assert_allclose(judged.md, [7.8])
    np.testing.assert_allclose(judged.lean_error, [[0.8 - 0.76, 1.9 - 1.52]], atol=1e-12)
    np.testing.assert_allclose(judged.lean_cov, [COV[0]])
    np.testing.assert_allclose(judged.error, [[0.4, -0.2, 0.2]], atol=1e-12)
    np.testing.assert_allclose(judged.cov, [7 * PLACES[0]])
    assert judged.unfound == (0.0, 0.0)
    assert judged.lean_drift is judged.drift is None
    hole.is_adjusted = True
    assert unfound_of(hole) == (0.1, 0.2)  # type: ignore[arg-type]
    drifting = judge_hole_of(world, hole)  # type: ignore[arg-type]
    assert drifting.lean_drift is not None
    assert drifting.drift is not None
    np.testing.assert_allclose(drifting.lean_drift, [[0.4, 0.5]])
    np.testing.assert_allclose(drifting.drift, [[4.0, 5.0, 6.0]])
    hole.examined = SimpleNamespace(last_look=None, unseen_drift=None)
    assert unfound_of(hole) == (0.0, 0.0)  # type: ignore[arg-type]
    assert drift_of(hole) == (None, None)  # type: ignore[arg-type]
    world.moved_hole = SimpleNamespace(hole=truth(0.2))
    np.testing.assert_allclose(judge_hole_of(world, hole).lean_error, [[0.8 - 1.52, 1.9 - 3.04]], atol=1e-12)  # type: ignore[arg-type]


def alarm(code: str, detail: str = "x", count: int = 1) -> dict[str, Any]:
    return {"code": code, "detail": detail, "count": count}


def test_an_answer_leaves_out_alarms_of_every_rig_and_parts_doubts_from_causes() -> None:
    start = alarm("reference", "tubes 1 at 3 s")
    answers = {
        "verdict": {"verdict": "watch", "doubts": ["old"]},
        "alarms": {
            "rig": [alarm("clock"), alarm("deviation"), start],
            "rig_cleared": [alarm("aiding"), alarm("clock")],
        },
        "adjustment": {"blunders": [{"kind": "play", "is_doubt": True}, {"kind": "north", "is_doubt": False}]},
    }
    ground = SimpleNamespace(operator=SimpleNamespace(ask=answers.__getitem__))
    assert answer_of(ground) == AnswerGiven("watch", ("old", "left_open"), ("aiding", "clock"), ("north",))  # type: ignore[arg-type]
    answers["adjustment"] = {"blunders": [{"kind": "north", "is_doubt": False}]}
    assert answer_of(ground).doubts == ("old",)  # type: ignore[arg-type]
    assert is_of_start(start)
    assert is_of_start(alarm("tube_sensor", "yaw_untrusted of tube 3"))
    for other in (
        start | {"count": 2},
        alarm("reference", "two tubes 1 at 3 s"),
        alarm("tube_sensor", "tubes 1 at"),
        alarm("clock", "tubes 1 at"),
    ):
        assert not is_of_start(other)
    for name in ("doubts", "alarms", "causes"):
        change: dict[str, Any] = {name: ("one",)}
        assert replace(AnswerGiven("x", (), (), ()), **change).is_doubted
    assert not AnswerGiven("out", (), (), ()).is_doubted


def run(worst: float, direction: float, toe: float, word: str, *causes: str, doubt: bool = False) -> BlunderRun:
    return BlunderRun(worst, direction, toe, AnswerGiven(word, ("old",) if doubt else (), (), causes))


def test_a_row_counts_each_outcome_once() -> None:
    kind = replace(KINDS[3], named=("a", "b"), seen_by="")
    runs = [
        run(9.0, 1.0, 10.0, "on_target", "a"),
        run(5.0, 2.0, 30.0, "watch", "c"),
        run(3.0, 3.0, math.nan, "on_target"),
        run(math.nextafter(3.0, 4.0), 4.0, 50.0, "on_target"),
        run(1.0, 7.0, 70.0, "out", "c", "b"),
    ]
    row = blunder_row(kind, 1, runs)
    assert row == {
        "case": kind.name, "size": "3 mg", "rigs": 5, "named": 2, "doubted": 1, "below": 1, "unseen": 0, "missed": 1,
        "beyond_on_target": 2, "worst_sigmas": pytest.approx(3.0), "direction_sigmas": 3.0, "toe_mm": 40.0,
        "causes": row["causes"], "seen_by": row["seen_by"],
    }  # fmt: skip
    assert row["causes"] == "c 2, a 1, b 1"
    assert outcome_of(runs[3], (), "the next stop") == "unseen"
    assert blunder_row(replace(kind, sizes=(0.0,)), 0, runs)["size"] == ""
    assert [honest_row(runs)[name] for name in ("case", "rigs")] == ["honest", 5]
    assert count_steps(3, 11, 99) == 11 + 3 * sum(len(one.sizes) for one in KINDS)


def test_the_verdict_over_blunders_word_by_word() -> None:
    def row(case: str, missed: int, on_target: int, unseen: int, seen_by: str = "") -> dict[str, Any]:
        return {
            "case": case,
            "missed": missed,
            "beyond_on_target": on_target,
            "unseen": unseen,
            "seen_by": seen_by,
            "rigs": 7,
        }

    rows = [
        row("honest", 50, 60, 70),
        row("a", 1, 2, 0),
        row("a", 0, 3, 0),
        row("b", 4, 5, 6, "stop"),
        row("c", 0, 9, 0, "x"),
    ]
    result = {"cases": rows, "blamed": 4, "honest": 4000}
    assert verdict_lines(result) == [
        "3 kinds: 5 of 28 rigs beyond 3 standard deviations without a word, 5 of them or others ON TARGET; 0 expected",
        "6 more are in no reading, and are seen by stop",
        "honest holes: 4 of 4000 blamed; one in a thousand holds",
    ]
    assert verdict_lines(result | {"blamed": 5})[2] == "honest holes: 5 of 4000 blamed; one in a thousand is missed"
    few = "honest holes: 0 of 2999 blamed; one in a thousand takes 3000 to tell"
    assert verdict_lines(result | {"blamed": 0, "honest": 2999})[2] == few
    assert verdict_lines(result | {"blamed": 0, "honest": 3000})[2].endswith("holds")
    assert verdict_lines(result | {"cases": rows[:3]})[1] == "0 more are in no reading, and are seen by nothing else"


def test_seams_are_opened_with_their_own_type_and_closed_whatever_happens() -> None:
    import importlib

    def now() -> dict[str, Any]:
        return {seam.key: getattr(importlib.import_module(seam.module), seam.name) for seam in SEAMS}

    usual = now()
    values = {seam.key: seam.values[0] for seam in SEAMS[::3]}
    with opened_seams(values):
        assert now() == usual | values
        assert all(type(value) is type(usual[key]) for key, value in now().items())
    assert now() == usual
    with pytest.raises(KeyError), opened_seams(values):
        raise KeyError
    assert now() == usual
    counts = []
    for seed in range(400):
        drawn = drawn_seams(seed)
        assert drawn
        assert all(value in {seam.key: seam.values for seam in SEAMS}[key] for key, value in drawn.items())
        counts.append(len(drawn))
    assert drawn_seams(3) == drawn_seams(3)
    # four of them on the average, and one where none was drawn: (1 - 4/n)^n of all
    spread = math.sqrt(4.0 * (1.0 - 4.0 / len(SEAMS)) / 400.0)
    assert abs(np.mean(counts) - 4.0 - (1.0 - 4.0 / len(SEAMS)) ** len(SEAMS)) < 4.0 * spread


def test_a_row_of_honest_rigs() -> None:
    runs = [
        run(9.0, 1.0, 10.0, "on_target", "a"), run(5.0, 2.0, 30.0, "watch", doubt=True),
        run(3.0, 3.0, math.nan, "on_target"), run(math.nextafter(3.0, 4.0), 4.0, 50.0, "on_target"),
        run(1.0, 7.0, 70.0, "out", "a", "b"), run(0.5, 9.0, math.nan, "out"),
    ]  # fmt: skip
    assert honest_row(runs) == {
        "case": "honest", "size": "", "rigs": 6, "named": 2, "doubted": 3, "below": 3, "unseen": 0, "missed": 1,
        "beyond_on_target": 2, "worst_sigmas": pytest.approx(3.0), "direction_sigmas": 3.5, "toe_mm": 40.0,
        "causes": "a 2, b 1", "seen_by": "",
    }  # fmt: skip
    assert honest_row([run(1.0, 1.0, math.nan, "watch")])["toe_mm"] is None


if __name__ == "__main__":
    for one, lines in FILES.items():
        (DATA / one).write_text("\n".join(lines()) + "\n", "utf-8")
