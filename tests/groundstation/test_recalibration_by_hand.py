"""A calibration in the field step by step: who is asked what and when again, what counts, and when it is done."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from typing import Any

import pytest
from sealed_string import state

from groundstation.errors import SelectorError
from groundstation.service.orders.recalibration.procedure import (
    CLOCK_TOLERANCE,
    OVERTAKEN,
    REFUSED_AGAIN,
    SILENT_AGAIN,
    FieldProcedure,
    Request,
)
from groundstation.service.orders.recalibration.recalibration_progress import (
    Attitude,
    Found,
    RecalibrationProgress,
    RecalibrationStage,
    TubePhase,
    TubeProgress,
)
from telemetry.frozen import replace
from telemetry.messages import BlockStatus, Reply, StaticRecord, UploadPhase
from telemetry.parameters import ParameterBlock


def unequal() -> RecalibrationProgress:
    """Every field with a value of its own, none of them the default."""
    found = Found(0.1, (0.2, 0.3, 0.4), 0.5, 6.0, 0.7, 0.8)
    tube = TubeProgress(
        4, TubePhase.VERIFYING, "d", 5, "before", {11: 0, 12: 1}, "0a", found, "{}", 2, True, "after", "end"
    )
    attitudes = [Attitude(0.1, 0.2, 8.0, 100.0, 110.0), Attitude(0.3, 0.4, 9.0, 120.0)]
    return RecalibrationProgress(RecalibrationStage.UPLOADING, attitudes, {4: tube, 7: TubeProgress(7)}, "p", [3, 9])


def test_progress_comes_back_from_its_text_field_by_field() -> None:
    whole = unequal()
    for one, plain in ((whole.tubes[4], TubeProgress(0)), (whole, RecalibrationProgress()), (whole.attitudes[0], None)):
        same = [f.name for f in fields(one) if plain is not None and getattr(one, f.name) == getattr(plain, f.name)]
        assert same == []  # each field has a value of its own
    again = RecalibrationProgress.from_json(whole.to_json())
    assert again == whole
    assert isinstance(again.tubes[4].found.bias_std, tuple)  # type: ignore[union-attr]
    assert isinstance(again.tubes[4].phase, TubePhase)
    assert (again.tubes[7].found, list(again.tubes[4].orders)) == (None, [11, 12])
    text = json.loads(whole.to_json())
    del text["mixed"]  # of a version that knew of none
    assert RecalibrationProgress.from_json(json.dumps(text)).mixed == []
    assert json.loads(RecalibrationProgress().to_json()) == asdict(RecalibrationProgress())
    assert RecalibrationProgress.from_json(RecalibrationProgress().to_json()) == RecalibrationProgress()


def record(tube: int, command: int, begun: float, ended: float, *, moved: bool = False) -> StaticRecord:
    zero = ((0.0,) * 3,) * 3
    return StaticRecord(
        tube, command, command, begun, ended, 60, (0.0,) * 3, zero, (0.0, 0.0, -9.8), zero, 20.0, moved
    )  # fmt: skip


def stage_of(procedure: FieldProcedure) -> RecalibrationStage:
    return procedure.progress.stage


def block_of(tube: int, version: int) -> ParameterBlock:
    return ParameterBlock(tube, version)


def asked(procedure: FieldProcedure, now: float) -> list[tuple[int, str]]:
    return [(one.tube, one.name) for one in procedure.due_requests(now)]


def answer(procedure: FieldProcedure, tube: int, now: float, number: int, block: ParameterBlock) -> None:
    """A tube tells the block that it uses."""
    procedure.on_sent(Request(tube, "parameters", {}), number)
    values: dict[str, Any] = {"version": block.version, "sha256": block.sha256().hex()}
    procedure.on_reply(Reply(tube, number, True, "", values), now)


def test_who_is_asked_what_and_when_again() -> None:
    procedure = FieldProcedure(9.81)
    assert asked(procedure, 0.0) == []
    with pytest.raises(SelectorError, match="no tube is known"):
        procedure.begin([])
    procedure.begin([7, 4, 7])
    assert list(procedure.progress.tubes) == [4, 7]
    assert asked(procedure, 10.0) == [(4, "parameters"), (7, "parameters")]
    assert asked(procedure, 10.0 + SILENT_AGAIN - 0.001) == []
    assert asked(procedure, 10.0 + SILENT_AGAIN) == [(4, "parameters"), (7, "parameters")]
    answer(procedure, 4, 30.0, 100, block_of(4, 0))
    procedure.on_sent(Request(7, "parameters", {}), 101)
    procedure.on_reply(Reply(4, 101, True, ""), 30.0)  # of another tube than was asked: it is no answer
    assert procedure.progress.tubes[7].version_before is None
    procedure.on_sent(Request(7, "parameters", {}), 102)
    procedure.on_reply(Reply(7, 102, False, "busy"), 30.0)
    assert procedure.progress.tubes[7].detail == "expected version and sha256 of the block in use, got busy"
    assert asked(procedure, 30.0 + REFUSED_AGAIN - 0.001) == []
    assert asked(procedure, 30.0 + REFUSED_AGAIN) == [(7, "parameters")]
    answer(procedure, 7, 40.0, 103, block_of(7, 3))
    tubes = procedure.progress.tubes.values()
    assert [(tube.version_before, tube.hash_before) for tube in tubes] == [
        (0, block_of(4, 0).sha256().hex()), (3, block_of(7, 3).sha256().hex())
    ]  # fmt: skip
    assert asked(procedure, 50.0) == []  # no attitude yet
    procedure.attitude(0.25, 0.5, 8.0, 500.0)
    with pytest.raises(SelectorError, match="a calibration of tubes 4, 7 is collecting; expected action=cancel before"):
        procedure.begin([4])
    requests = procedure.due_requests(50.0)
    assert [(one.tube, one.name, one.arguments) for one in requests] == [
        (4, "static_record", {"seconds": 8.0}), (7, "static_record", {"seconds": 8.0})
    ]  # fmt: skip
    assert asked(procedure, 50.0 + SILENT_AGAIN + 8.0 - 0.001) == []
    assert asked(procedure, 50.0 + SILENT_AGAIN + 8.0) == [(4, "static_record"), (7, "static_record")]


def test_a_record_that_moved_is_asked_for_again_and_the_newest_good_one_counts() -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([4])
    answer(procedure, 4, 0.0, 1, block_of(4, 0))
    tube = procedure.progress.tubes[4]
    for place in range(2):
        procedure.attitude(0.25 + place, 0.5, 8.0, 500.0 + 100.0 * place)
        for turn in range(2):
            assert asked(procedure, 100.0 * place + turn) == [(4, "static_record")]
            number = 10 + 10 * place + turn
            procedure.on_sent(Request(4, "static_record", {"seconds": 8.0}), number)
            procedure.on_static_record(record(4, 999, 510.0, 518.0))  # of an order that was not given
            begun = 510.0 + 100.0 * place
            procedure.on_static_record(record(4, number, begun, begun + 8.0, moved=not turn))
            assert tube.detail == ("" if turn else "a record moved")
            assert procedure.count_records(tube) == place + turn
        assert asked(procedure, 100.0 * place + 50.0) == []
    assert [(one.pitch, one.roll, one.record.command) for one in procedure._rests(tube)] == [
        (0.25, 0.5, 11), (1.25, 0.5, 21)
    ]  # fmt: skip
    procedure.on_static_record(record(4, 11, 500.0 - CLOCK_TOLERANCE - 0.001, 518.0))
    assert procedure.count_records(tube) == 1
    procedure.on_sent(Request(4, "static_record", {}), 30)
    procedure.on_reply(Reply(4, 30, False, "it turns"), 60.0)
    assert (tube.detail, asked(procedure, 62.9), asked(procedure, 63.0)) == ("it turns", [], [])


def uploading(*tubes: int) -> FieldProcedure:
    """A procedure whose blocks are on their way."""
    procedure = FieldProcedure(9.81)
    procedure.begin(list(tubes))
    for tube in procedure.progress.tubes.values():
        answer(procedure, tube.tube, 0.0, tube.tube, block_of(tube.tube, 0))
        tube.proposed, tube.phase, tube.calibration = block_of(tube.tube, 1).canonical().hex(), TubePhase.PROPOSED, "{}"
    procedure.confirm()
    assert stage_of(procedure) is RecalibrationStage.COLLECTING  # nothing is proposed yet
    procedure.progress.stage, procedure.progress.proposal = RecalibrationStage.SOLVED, "p"
    assert not procedure.uploads_to(tubes[0])
    procedure.confirm()
    assert procedure.proposed("p") == []  # it is under way
    assert set(procedure.blocks) == {block_of(tube, 1).sha256().hex() for tube in tubes}
    assert [procedure.uploads_to(tube) for tube in (*tubes, 99)] == [True] * len(tubes) + [False]
    requests = procedure.due_requests(1.0)
    assert [(one.tube, one.name, one.block) for one in requests] == [
        (tube, "upload_parameters", block_of(tube, 1)) for tube in sorted(tubes)
    ]  # fmt: skip
    return procedure


def status(tube: int, phase: UploadPhase, version: int = 1) -> BlockStatus:
    digest = block_of(tube, version).sha256()
    return BlockStatus(tube, 1, digest, phase, 1, version, digest, "too old")


def test_it_is_done_when_the_last_tube_tells_its_hash_or_has_refused() -> None:
    procedure = uploading(4, 7)
    phases = procedure.progress.tubes
    procedure.on_block_status(status(4, UploadPhase.REFUSED, version=2))  # of another block
    assert phases[4].phase is TubePhase.UPLOADING
    procedure.on_block_status(status(4, UploadPhase.REFUSED))
    assert (phases[4].phase, phases[4].detail) == (TubePhase.REFUSED, "upload refused: too old")
    assert stage_of(procedure) is RecalibrationStage.UPLOADING
    procedure.on_block_status(status(7, UploadPhase.APPLIED), has_surveyed=True)
    procedure.on_block_status(status(7, UploadPhase.APPLIED), has_surveyed=True)
    assert (phases[7].phase, procedure.progress.mixed) == (TubePhase.VERIFYING, [7])
    assert asked(procedure, 2.0) == [(7, "parameters")]
    answer(procedure, 7, 3.0, 50, block_of(7, 1))
    assert (phases[7].phase, phases[7].hash) == (TubePhase.DONE, block_of(7, 1).sha256().hex())
    assert stage_of(procedure) is RecalibrationStage.DONE
    assert asked(procedure, 100.0) == []
    both = uploading(4, 7)
    for tube in (4, 7):
        assert stage_of(both) is RecalibrationStage.UPLOADING
        both.on_block_status(status(tube, UploadPhase.UNTRUSTED))
    assert stage_of(both) is RecalibrationStage.DONE
    other = uploading(4)
    other.on_block_status(status(4, UploadPhase.APPLIED))
    answer(other, 4, 3.0, 50, block_of(4, 9))
    assert other.progress.tubes[4].phase is TubePhase.REFUSED
    assert other.progress.tubes[4].detail == f"it uses version 9 {block_of(4, 9).sha256().hex()}"
    assert (other.progress.mixed, other.progress.stage) == ([], RecalibrationStage.DONE)


@pytest.mark.parametrize(
    ("cycles", "restarted"), [(1000, False), (1000 - OVERTAKEN, False), (1000 - OVERTAKEN - 1, True), (1001, False)]
)
def test_a_tube_that_counts_anew_has_started_again_and_is_sent_its_block_anew(cycles: int, restarted: bool) -> None:
    for used in (0, 1):
        procedure = uploading(4, 7)
        tube = procedure.progress.tubes[4]
        procedure.on_state(state(1000, 4))
        procedure.on_state(replace(state(cycles, 4), parameters_hash=block_of(4, used).sha256()[:8]))
        assert (tube.phase is TubePhase.CONFIRMED, tube.restarted) == (restarted, restarted)
        assert tube.hash_after_restart == (block_of(4, used).sha256().hex() if restarted else "")
        assert procedure.progress.tubes[7].phase is TubePhase.UPLOADING
        assert asked(procedure, 2.0) == ([(4, "upload_parameters")] if restarted else [])
        assert tube.uploads == 1 + restarted


def test_a_start_of_the_ground_station_asks_again_for_what_was_under_way_and_a_cancel_ends_it() -> None:
    procedure = uploading(4, 7)
    procedure.on_block_status(status(7, UploadPhase.APPLIED))
    again = FieldProcedure(9.81)
    again.restore(RecalibrationProgress.from_json(procedure.progress.to_json()), [block_of(4, 1), block_of(7, 1)])
    assert [tube.phase for tube in again.progress.tubes.values()] == [TubePhase.CONFIRMED] * 2
    assert set(again.blocks) == set(procedure.blocks)
    assert asked(again, 0.0) == [(4, "upload_parameters"), (7, "upload_parameters")]
    again.cancel()
    assert (asked(again, 500.0), again.progress.stage) == ([], RecalibrationStage.IDLE)
    assert not again.uploads_to(4)
    for order in (again.cancel, lambda: again.attitude(0.0, 0.0, 8.0, 1.0), lambda: again.solve("day", 1.0)):
        with pytest.raises(SelectorError, match=r"expected a calibration that is .*, it is idle"):
            order()


def test_an_attitude_ends_the_one_before_and_drops_what_was_solved() -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([4])
    tube = procedure.progress.tubes[4]
    for turn, at in enumerate((100.0, 150.0)):
        procedure.progress.stage, procedure.progress.proposal = RecalibrationStage.SOLVED, "p"
        tube.phase, tube.proposed, tube.detail, tube.calibration = TubePhase.REFUSED, "00", "why", "{}"
        tube.found = Found(0.1, (0.2, 0.3, 0.4), 0.5, 6.0, 0.7, 0.8)
        procedure.attitude(0.1, 0.2, 8.0, at)
        assert (procedure.progress.stage, procedure.progress.proposal) == (RecalibrationStage.COLLECTING, "")
        told: tuple[Any, ...] = (tube.phase, tube.proposed, tube.found, tube.calibration, tube.detail)
        assert told == (TubePhase.COLLECTING, "", None, "", "")
        assert [one.left for one in procedure.progress.attitudes] == [150.0, None][1 - turn :]
    with pytest.raises(SelectorError, match="tube 4: block in use: expected one that this ground station has sent"):
        procedure.solve("2026-01-01", 180.0)
    assert [one.left for one in procedure.progress.attitudes] == [150.0, 180.0]
    assert (tube.phase, procedure.progress.stage) == (TubePhase.REFUSED, RecalibrationStage.COLLECTING)


def test_a_block_of_the_same_version_and_another_content_is_not_the_one_that_was_sent() -> None:
    procedure = uploading(4)
    procedure.on_block_status(status(4, UploadPhase.APPLIED))
    procedure.on_sent(Request(4, "parameters", {}), 50)
    procedure.on_reply(Reply(4, 50, True, "", {"version": 1, "sha256": "ab" * 32}), 3.0)
    assert procedure.progress.tubes[4].phase is TubePhase.REFUSED
