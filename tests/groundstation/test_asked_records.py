"""Records of a calibration in the field belong to the command that asked for them."""

import math

from groundstation.service.orders.recalibration.procedure import FieldProcedure, Request
from node.kernels.arithmetic.formats import DEG
from telemetry.messages import Reply, StaticRecord
from telemetry.parameters import ParameterBlock


def record(command: int, ended_at: float) -> StaticRecord:
    cov = ((1e-5, 0.0, 0.0), (0.0, 1e-5, 0.0), (0.0, 0.0, 1e-5))
    force = (0.0, 0.0, -9.81)
    return StaticRecord(1, 1, command, ended_at - 8.0, ended_at, 15, (0.0, 0.0, 0.0), cov, force, cov, 25.0, False)


def test_records_are_matched_by_the_command_that_asked_for_them() -> None:
    procedure = FieldProcedure(9.81)
    procedure.begin([1])
    (question,) = procedure.due_requests(0.0)
    assert question == Request(1, "parameters", {})
    procedure.on_sent(question, 41)
    procedure.on_reply(Reply(1, 41, True, "", {"version": 0, "sha256": ParameterBlock(1, 0).sha256().hex()}), 1.0)
    procedure.attitude(0.0, 90.0 * DEG, 8.0, 100.0)
    (ask,) = procedure.due_requests(1.0)
    assert (ask.name, ask.arguments) == ("static_record", {"seconds": 8.0})
    procedure.on_sent(ask, 42)
    assert procedure.due_requests(10.0) == []
    procedure.on_static_record(record(7, 110.0))  # an operator's own
    assert procedure.count_records(procedure.progress.tubes[1]) == 0
    assert [a.name for a in procedure.due_requests(1.0 + 8.0 + 15.0)] == ["static_record"]  # nothing came: once more
    procedure.on_static_record(record(42, 90.0))  # of a tube that does not know rig time yet
    assert procedure.count_records(procedure.progress.tubes[1]) == 0
    procedure.on_static_record(record(42, 110.0))
    assert procedure.count_records(procedure.progress.tubes[1]) == 1
    assert procedure.due_requests(math.inf) == []
