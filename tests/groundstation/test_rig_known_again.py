"""What a ground station begins anew, tries again or lets go: each at its bound, and each a second time."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hand_fed import Rig
from test_setup_seen_twice import joint

from groundstation.config import GroundConfig
from groundstation.errors import StoreError
from groundstation.service.alarms.watch import LOOK_EVERY, PLACED_WITHIN, Watch
from groundstation.service.hole import placement as placement_room
from groundstation.service.hole.history import KEPT, History
from groundstation.service.hole.placement import Placement
from groundstation.service.orders.recalibration.control import Recalibration
from groundstation.service.orders.recalibration.procedure import CLOCK_TOLERANCE as TOLERANCE
from groundstation.service.orders.recalibration.procedure import FieldProcedure, Request
from groundstation.service.orders.recalibration.recalibration_progress import RecalibrationStage, TubePhase
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_correction import corrected_yaw
from groundstation.service.setup.setup_items import JOINT_STD
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from groundstation.survey.wall.column_deviation import Deviations
from telemetry.messages import NodeFlag, Reply, StaticRecord

ZERO3 = ((0.0,) * 3,) * 3


# a calibration in the field


def record(command: int, begun: float, ended: float, moved: bool = False) -> StaticRecord:
    return StaticRecord(1, command, command, begun, ended, 60, (0.0,) * 3, ZERO3, (0.0, 0.0, -9.8), ZERO3, 20.0, moved)


def answered(number: int, version: int, digest: str) -> Reply:
    return Reply(1, number, True, "", {"version": version, "sha256": digest})


def test_an_answer_to_a_calibration_of_before_says_nothing_of_the_next() -> None:
    procedure = FieldProcedure(9.81)
    for turn in range(2):
        procedure.begin([1])
        procedure.on_sent(Request(1, "parameters", {}), 5 + turn)
    procedure.on_reply(answered(5, 3, "aa"), 100.0)
    assert procedure.progress.tubes[1].version_before is None
    procedure.on_reply(answered(6, 4, "bb"), 100.0)
    procedure.on_reply(answered(6, 9, "cc"), 100.0)  # an answer counts once
    assert (procedure.progress.tubes[1].version_before, procedure.progress.tubes[1].hash_before) == (4, "bb")


@pytest.mark.parametrize(
    ("begun", "ended", "counts"),
    [
        (100.0 - TOLERANCE, 150.0, True),
        (99.999 - TOLERANCE, 150.0, False),
        (120.0, 160.0, True),
        (120.0, 160.1, False),
        (160.0, 200.0, False),
    ],
)
def test_a_record_counts_where_the_tubes_lay_from_its_begin_to_its_end(
    begun: float, ended: float, counts: bool
) -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([1])
    procedure.attitude(0.1, 0.2, 30.0, 100.0)
    procedure.on_sent(Request(1, "static_record", {"seconds": 30.0}), 7)
    procedure.on_static_record(record(7, begun, ended))
    procedure.attitude(0.3, 0.4, 30.0, 160.0)
    assert procedure.count_records(procedure.progress.tubes[1]) == int(counts)
    procedure.on_static_record(record(7, begun, ended, moved=True))
    assert procedure.count_records(procedure.progress.tubes[1]) == 0


@pytest.mark.parametrize("phase", [TubePhase.UPLOADING, TubePhase.VERIFYING])
def test_a_tube_that_starts_again_gets_its_block_anew(phase: TubePhase) -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([1])
    procedure.progress.stage = RecalibrationStage.UPLOADING
    tube = procedure.progress.tubes[1]
    for _ in range(2):
        tube.phase, tube.restarted = phase, False
        for cycles in (1000, 2000, 1999, 5):
            procedure.on_state(SimpleNamespace(tube=1, cycles=cycles, parameters_hash=b"\x01" * 8))
        assert (tube.phase, tube.restarted) == (TubePhase.CONFIRMED, True)


def test_progress_that_the_disk_refused_is_kept_at_the_next_try() -> None:
    kept: list[str] = []

    class Disk:
        full = True

        def progress(self) -> str:
            return ""

        def blocks(self) -> list[Any]:
            return []

        def keep_progress(self, text: str) -> None:
            if self.full:
                raise StoreError("disk full")
            kept.append(text)

    disk: Any = Disk()
    control = Recalibration(FieldProcedure(9.81), disk, Path("none"), lambda _: None, lambda: None)
    control.procedure.begin([1])
    with pytest.raises(StoreError):
        control.keep_progress()
    disk.full = False
    assert [control.keep_progress() for _ in range(3)] == [True, False, False]
    assert len(kept) == 1


# the watch


def test_the_rig_is_looked_at_again_after_exactly_its_time() -> None:
    watch = Watch.__new__(Watch)
    watch._looked_at = 100.0
    late = (LOOK_EVERY - 1e-9, LOOK_EVERY, LOOK_EVERY + 1e-9)
    assert [watch.is_due(100.0 + after) for after in late] == [False, True, True]


@pytest.mark.parametrize(("late", "is_told"), [(-1e-3, False), (0.0, False), (1e-3, True)])
@pytest.mark.parametrize("epoch", [0, 3, 2])
def test_a_survey_without_a_depth_is_told_after_exactly_its_time(late: float, is_told: bool, epoch: int) -> None:
    waiting = [SimpleNamespace(message=SimpleNamespace(tube=4, sequence=9, epoch=epoch, station_at=100.0))]
    told: list[tuple[str, str, str]] = []
    watch = Watch.__new__(Watch)
    watch._placement = SimpleNamespace(waiting=waiting)
    watch._time = SimpleNamespace(epoch=3, rig_now=100.0 + PLACED_WITHIN + late)
    watch._alarms = SimpleNamespace(hold=lambda *words: told.append(words))
    watch._hole = SimpleNamespace(turned_back=[])
    watch._told_unplaced, watch._told_back = set(), set()
    for _ in range(2):
        watch._look_at_surveys()
    expected = "numbers 9" if is_told or epoch == 2 else ""
    assert told == [("survey_unplaced", "tube 4", expected)] * 2
    waiting.clear()
    watch._look_at_surveys()
    assert told[2:] == ([("survey_unplaced", "tube 4", "")] if expected else [])


# the hole


def test_of_more_moments_than_are_kept_every_second_of_the_older_half_goes() -> None:
    history = History()
    rows = Deviations(np.zeros(1), np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2, 2)), np.ones(1))
    for _ in range(KEPT):
        history.add(rows, None)
    assert [moment.number for moment in history.moments] == list(range(1, KEPT + 1))
    history.add(rows, None)
    half = KEPT // 2
    assert [moment.number for moment in history.moments] == [*range(1, half + 1, 2), *range(half + 1, KEPT + 2)]
    assert history.find(2) is None
    assert history.find(half + 1) is not None


def test_joints_that_were_told_to_their_nodes_keep_their_own_error_beside_one_that_is_told_here(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.joints = {(2, 1): joint("2-1", 0.3, 0.02)}
    for tube, hops in ((4, 1), (3, 2), (2, 3), (1, 4)):
        book.on_flags(tube, hops, NodeFlag.LOWER_UNTOLD if tube == 2 else NodeFlag.NONE)
    turn, var = corrected_yaw(UNKNOWN_YAW_VAR + 1e-4, [(2, 1), (3, 2), (4, 3), (0, 4)], book)
    assert turn == pytest.approx(0.3)
    assert var == pytest.approx(1e-4 + 3 * JOINT_STD**2 + 0.02**2, rel=1e-9)


def test_a_survey_that_waits_for_its_depth_waits_once_and_is_placed_once(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    rig.drill(1, 0.3)
    placement, string = rig.ground.model.placement, rig.ground.model.string
    one = SimpleNamespace(message=None, below=0.0, md=None)
    known: list[float | None] = [None, None, 3.0, 3.0]
    string.depth_of = lambda _message, _below: known.pop(0)
    placement.waiting = [one]
    found = [placement.take_placeable() for _ in range(4)]
    assert [len(taken) for taken in found] == [0, 0, 1, 0]
    assert placement.waiting == []
    assert found[2][0][1] == 3.0


@pytest.mark.parametrize(("above", "depth"), [(0.005, 0.0), (0.0099, 0.0), (0.0101, None), (-0.5, 0.5)])
def test_a_node_may_be_above_the_collar_by_a_rounding_and_is_then_at_it(
    tmp_path: Path, above: float, depth: float | None
) -> None:
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    rig.drill(1, 0.3)
    string = rig.ground.model.string
    string.depths.at = lambda _epoch, _time: 2.0 - above
    message: Any = SimpleNamespace(flags=NodeFlag.NONE, epoch=1, station_at=0.0, hops=2)
    found = string.depth_of(message, 2.0)
    assert found == (None if depth is None else pytest.approx(depth))
    assert math.copysign(1.0, found if found is not None else 1.0) == 1.0


def test_measurements_are_resolved_at_their_corrected_depths_and_none_above_the_collar(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flags = {1: NodeFlag.NONE, 2: NodeFlag.CLOCK_UNSYNCHRONISED, 3: NodeFlag.NONE, 4: NodeFlag.NONE}
    messages: list[Any] = [SimpleNamespace(tube=tube, hops=5 - tube, flags=one) for tube, one in flags.items()]
    asked: list[Any] = []

    def resolve(fused: list[Any], depths: list[float], above: list[Any], below: list[Any]) -> list[str]:
        asked.append(([one.tube for one in fused], depths, above, below))
        return [f"found {one.tube}" for one in fused]

    monkeypatch.setattr(placement_room, "corrected_measurement", lambda m, _chain, _setup: m)
    monkeypatch.setattr(placement_room, "depth_shift", lambda tube, _tubes, _length, _setup: -0.5 * tube)
    tally = SimpleNamespace(above=lambda tube, hops: ("above", tube, hops), below=lambda tube: ("below", tube))
    placement = Placement.__new__(Placement)
    placement._setup = SimpleNamespace(doubled=SimpleNamespace(places={}), moves_depths=True)
    placement._string, placement._tube_length = SimpleNamespace(tally=tally, tubes=[1, 2, 3, 4]), 3.0
    placement._resolver = SimpleNamespace(resolve_measurements=resolve)
    found = placement.resolve_measurements(messages, [9.0, 8.0, 1.2, 7.0])
    assert found == ["found 1", None, "found 3", "found 4"]
    above = [("above", 1, 4), ("above", 3, 2), ("above", 4, 1)]
    assert asked == [([1, 3, 4], [8.5, 0.0, 5.0], above, [("below", 1), ("below", 3), ("below", 4)])]
    placement._setup.moves_depths = False
    assert placement.resolve_measurements(messages[1:2], [8.0]) == [None]
    assert len(asked) == 1
    placement.resolve_measurements(messages[2:], [1.2, 7.0])
    assert asked[1][:2] == ([3, 4], [1.2, 7.0])
