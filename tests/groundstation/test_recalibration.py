"""Ground station, encoder node and tubes as processes over joints with troubles: records, uploads, what is in use."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from memory_rig import NOISELESS, Rig

from groundstation.calibration.attitudes import fit_attitudes
from groundstation.calibration.block import Calibration, Provenance
from groundstation.config import GroundConfig
from groundstation.errors import ConfigurationError
from groundstation.service.orders.blocks import block_of
from groundstation.service.orders.order_book import OrderState
from groundstation.service.process.ground_process import GroundProcess
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG
from node.process.block_store import BlockStore
from node.process.tube_process import TubeProcess
from telemetry import frozen
from telemetry.messages import BASE, ENCODER, BlockSegment, StaticRecord, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.runtime import disk as disk_room
from telemetry.transport.authentication import new_key, read_key

MATRIX = np.array([[1.01, 0.004, -0.003], [0.002, 0.99, 0.005], [-0.001, 0.003, 1.005]])
BIAS = np.array([0.05, -0.03, 0.08])


def block(version: int = 1, tube: int = 1, bias: float = 1e-3) -> ParameterBlock:
    return ParameterBlock(tube, version, SensorParameters(bias=(bias, 0.0, 0.0)))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    it = Rig(tmp_path, [2, 1])
    it.run(12.0)
    return it


def test_a_block_is_uploaded_applied_at_rest_and_told(rig: Rig) -> None:
    status = rig.upload(block())
    assert (status.phase, status.version, status.in_use) == (UploadPhase.APPLIED, 1, block().sha256())
    assert rig.sent == [0, 1, 2, 3, 4]
    assert rig.tube(1).tube.parameters == block()
    assert rig.tube(2).tube.parameters.version == 0
    rig.run(5.0)
    assert "parameters_applied" in rig.codes(1)
    state = rig.ground.model.string.states.newest[1]
    assert (state.parameters_version, state.parameters_hash) == (1, block().sha256()[:8])
    assert rig.order(1, "parameters").values == {"version": 1, "sha256": block().sha256().hex()}
    rig.start(1)
    assert rig.tube(1).tube.parameters == block()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_block_arrives_through_loss_repetition_disorder_and_damage(tmp_path: Path, seed: int) -> None:
    rig = Rig(tmp_path, [3, 2, 1], seed, loss=0.3, duplicate=0.3, corrupt=0.05, jitter_ms=50.0)
    rig.run(12.0)
    for version in (1, 2):
        assert rig.upload(block(version, bias=1e-3 * version)).phase is UploadPhase.APPLIED
    rig.run(30.0)
    assert rig.codes(1).count("parameters_applied") == 2
    assert rig.tube(1).tube.parameters == block(2, bias=2e-3)


@pytest.mark.slow
def test_a_turning_node_waits_with_the_block_until_it_stands(rig: Rig) -> None:
    rig.rate[1] = np.array([0.0, 0.0, 1.2])
    order = rig.ground.operator.upload(block())
    rig.run(40.0)
    assert rig.said[-1].phase is UploadPhase.WAITING
    assert rig.tube(1).tube.parameters.version == 0
    rig.start(1)  # it waits over a restart too
    rig.run(25.0)
    assert rig.said[-1].phase is UploadPhase.WAITING
    rig.rate[1] = np.zeros(3)
    rig.run(20.0, lambda: order.ended)
    assert order.state is OrderState.DONE


def lose(rig: Rig, keep: Callable[[BlockSegment], bool]) -> None:
    """Have the segments that are not kept disappear with a relay, until ``watch`` is called again."""
    send = rig.ground.endpoint.mail.send_segment
    rig.ground.endpoint.mail.send_segment = lambda s: send(s) if keep(s) else None  # type: ignore[method-assign]


def test_a_node_killed_in_the_middle_keeps_its_block_and_resumes(rig: Rig) -> None:
    assert rig.upload(block(1)).phase is UploadPhase.APPLIED
    rig.sent.clear()
    plain = rig.ground.endpoint.mail.send_segment
    lose(rig, lambda s: s.index < 2)
    order = rig.ground.operator.upload(block(2, bias=2e-3))
    rig.run(3.0)
    assert rig.said[-1].received == 0b00011
    rig.ground.endpoint.mail.send_segment = plain  # type: ignore[method-assign]
    rig.start(1)
    assert rig.tube(1).tube.parameters == block(1)
    rig.run(60.0, lambda: order.ended)
    assert order.state is OrderState.DONE
    assert rig.sent == [0, 1, 2, 3, 4]  # what had come before the cut was not sent again
    assert rig.tube(1).tube.parameters == block(2, bias=2e-3)


@pytest.mark.slow
def test_a_ground_station_that_restarts_goes_on_where_the_node_is(rig: Rig) -> None:
    lose(rig, lambda s: s.index < 3)
    rig.ground.operator.upload(block())
    rig.run(3.0)
    rig.start(BASE)
    rig.run(3.0)
    assert rig.upload(block()).phase is UploadPhase.APPLIED


def test_a_segment_changed_on_its_way_is_refused_told_and_repeated(rig: Rig) -> None:
    send, changed = rig.ground.endpoint.mail.send_segment, []

    def tamper(segment: BlockSegment) -> None:
        if segment.index == 1 and not changed:
            changed.append(segment)
            segment = frozen.replace(segment, data=bytes(len(segment.data)))
        send(segment)

    rig.ground.endpoint.mail.send_segment = tamper  # type: ignore[method-assign]
    assert rig.upload(block()).phase is UploadPhase.APPLIED
    rig.run(5.0)
    assert rig.tube(1).tube.parameters == block()
    assert rig.codes(1).count("upload_untrusted") == 1


def test_a_wrong_key_is_refused_with_one_event(rig: Rig) -> None:
    rig.key_file = new_key(rig.folder / "other.key")
    rig.start(BASE)
    rig.run(3.0)
    status = rig.upload(block())
    assert (status.phase, status.version) == (UploadPhase.UNTRUSTED, 0)
    rig.run(5.0)
    assert rig.codes(1).count("upload_untrusted") == 1
    assert not (rig.folder / "1" / "upload").exists()


def test_a_node_without_a_key_takes_no_block_and_a_ground_station_without_one_sends_none(rig: Rig) -> None:
    rig.processes[1] = TubeProcess(TubeSettings(1, limits=NOISELESS), rig.folder / "1")
    rig.run(3.0)
    status = rig.upload(block())
    assert status.phase is UploadPhase.UNTRUSTED
    assert "no key" in status.detail
    ground = GroundProcess(GroundConfig(folder=rig.folder / "keyless"))
    with pytest.raises(ConfigurationError, match="key_file"):
        ground.operator.upload(block())
    ground.store.close()


def test_what_was_recorded_of_an_old_upload_changes_nothing(rig: Rig) -> None:
    recorded: list[BlockSegment] = []
    send = rig.ground.endpoint.mail.send_segment
    rig.ground.endpoint.mail.send_segment = lambda s: (recorded.append(s), send(s))[1]  # type: ignore[func-returns-value, method-assign]
    rig.upload(block(1))
    rig.upload(block(2, bias=2e-3))
    rig.said.clear()
    for segment in recorded[:5]:
        send(segment)
    rig.run(5.0)
    assert {status.phase for status in rig.said} == {UploadPhase.REFUSED}
    assert "newer than 2" in rig.said[-1].detail
    assert rig.tube(1).tube.parameters == block(2, bias=2e-3)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (replace(block(), gyroscope=SensorParameters(matrix=((1, 0, 0), (1, 0, 0), (0, 0, 1)))), "condition"),
        (replace(block(), gyroscope=SensorParameters(bias=(3.0 * DEG, 0.0, 0.0))), "at rest"),
        (replace(block(), accelerometer=SensorParameters(bias=(0.0, 0.0, 1.9))), "at rest"),
        (replace(block(), gyroscope=SensorParameters(bias=(float("nan"), 0.0, 0.0))), "finite"),
    ],
)
@pytest.mark.slow
def test_a_block_that_fails_its_checks_leaves_the_one_before(rig: Rig, wrong: ParameterBlock, reason: str) -> None:
    rig.run(50.0)
    assert rig.upload(block(1, bias=1e-4)).phase is UploadPhase.APPLIED
    rig.run(60.0)
    status = rig.upload(replace(wrong, version=2))
    assert (status.phase, status.version) == (UploadPhase.REFUSED, 1)
    assert reason in status.detail
    rig.run(5.0)
    assert "parameters_refused" in rig.codes(1)
    assert rig.upload(block(2, bias=2e-4)).phase is UploadPhase.APPLIED  # the refused version may come again, mended


def test_a_disk_that_refuses_the_block_leaves_the_one_before(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(BlockStore, "keep_block", full)
        status = rig.upload(block())
    assert status.phase is UploadPhase.REFUSED
    assert "No space" in status.detail
    assert rig.tube(1).tube.parameters.version == 0
    assert rig.upload(block()).phase is UploadPhase.APPLIED


def test_a_power_cut_at_any_step_of_the_change_leaves_one_block_whole(rig: Rig) -> None:
    """Copies of the node's folder at each write of the change are each a node that a cut left behind."""
    assert rig.upload(block(1)).phase is UploadPhase.APPLIED
    rig.run(70.0)
    home, cuts = rig.folder / "1", []
    process = rig.tube(1)
    plain_fsync = disk_room.os.fsync

    def fsync(descriptor: int) -> None:
        cuts.append(rig.folder / f"cut-{len(cuts)}")
        shutil.copytree(home, cuts[-1])
        plain_fsync(descriptor)

    order = rig.ground.operator.upload(block(2, bias=2e-3))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(disk_room.os, "fsync", fsync)
        rig.run(60.0, lambda: order.ended)
    assert process.tube.parameters.version == 2
    versions = []
    for cut in cuts:
        again = TubeProcess(TubeSettings(1, limits=NOISELESS), cut, key=read_key(rig.folder / "rig.key"))
        versions.append(again.tube.parameters.version)
        assert again.tube.parameters == {1: block(1), 2: block(2, bias=2e-3)}[versions[-1]]
        assert again._fallback == ""
        learnt = again.state[0]["static_bias"][0]
        assert learnt == 0.0 or (versions[-1] == 1 and learnt == pytest.approx(-1e-3))  # never that of the other block
    assert len(cuts) >= 14  # two a segment, the state before, the slot and its folder, the state after
    assert versions == sorted(versions)
    assert set(versions) == {1, 2}


def test_a_damaged_block_falls_back_and_says_so(rig: Rig) -> None:
    rig.upload(block(1))
    rig.upload(block(2, bias=2e-3))
    slot = max((rig.folder / "1").glob("parameters-*"), key=lambda path: path.stat().st_mtime_ns)
    slot.write_bytes(slot.read_bytes()[:-1])
    rig.start(1)
    rig.run(15.0)
    assert rig.tube(1).tube.parameters == block(1)
    (event,) = [e for e in rig.ground.model.string.events if e.code == "parameters_fallback"]
    assert event.arguments["in_use"] == 1
    assert event.arguments["hash"] == block(1).sha256().hex()
    assert rig.ground.model.string.states.newest[1].parameters_hash == block(1).sha256()[:8]
    assert rig.upload(block(2, bias=2e-3)).phase is UploadPhase.APPLIED


@pytest.mark.slow
def test_a_static_record_is_taken_stored_and_still_known_after_a_restart(rig: Rig) -> None:
    order = rig.order(1, "static_record", seconds=20.0)
    assert (order.state, order.done, order.values) == (OrderState.ACKNOWLEDGED, True, {"seconds": 20.0})
    rig.part(BASE, ENCODER)  # the surface end is cut off when the record is ready
    rig.run(30.0)
    assert not rig.ground.model.string.static_records
    rig.join(BASE, ENCODER)
    rig.run(40.0)
    assert order.state is OrderState.DONE
    (record,) = rig.ground.model.string.static_records
    assert (record.tube, record.command, record.moved) == (1, order.number, False)
    assert record.temperature == pytest.approx(30.0)
    assert rig.tube(1).endpoint.mail.outbox_size == 0
    rig.start(BASE)
    assert list(rig.ground.model.string.static_records) == [record]


def test_a_turning_node_takes_no_static_record(rig: Rig) -> None:
    rig.rate[2] = np.array([0.0, 0.0, 1.2])
    rig.run(3.0)
    reply = rig.order(2, "static_record", seconds=20.0)
    assert reply.state is OrderState.FAILED
    assert "turning" in reply.detail


ATTITUDES = 9.81 * np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0.6, 0.8, 0], [0, 0.6, -0.8]]
)


@pytest.mark.slow
def test_an_accelerometer_is_calibrated_from_the_surface_end_to_end(rig: Rig) -> None:
    readings: list[StaticRecord] = []
    for attitude in ATTITUDES:
        rig.force[1] = MATRIX @ attitude + BIAS
        rig.rate[1] = np.array([0.5, 0.0, 0.0])  # carried to the next attitude
        rig.run(2.0)
        rig.rate[1] = np.array([0.0, 2.0 * DEG, 0.0])  # a gyroscope never calibrated
        rig.run(4.0)
        assert rig.order(1, "static_record", seconds=5.0).done
        rig.run(12.0, lambda: len(rig.ground.model.string.static_records) > len(readings))
        readings.append(rig.ground.model.string.static_records[-1])
    assert not any(record.moved for record in readings)
    solved = fit_attitudes(ATTITUDES, np.array([record.force for record in readings]))
    zeros = np.zeros((0, 3, 3)), np.zeros((0, 3))
    day = Provenance(
        "0" * 64, "2024-05-31", "8 attitudes", solved.residual_rms(), np.zeros((3, 3)), np.zeros(3), *zeros
    )
    accelerometer = Calibration("accelerometer", solved.matrix, solved.bias, *zeros, 25.0, day)
    rate_bias = np.mean([record.rate for record in readings], axis=0)
    gyroscope = Calibration("gyroscope", np.eye(3), rate_bias, *zeros, 25.0, day)
    made = block_of(1, 1, gyroscope, accelerometer)
    assert rig.upload(made).phase is UploadPhase.APPLIED
    assert rig.order(1, "parameters").values["sha256"] == made.sha256().hex()
    rig.run(70.0)
    state = rig.tube(1).state[0]
    np.testing.assert_allclose(state["ring_force"][(int(state["cycles"]) - 1) % 64], ATTITUDES[-1], atol=1e-9)
    assert rig.tube(1).tube.quiet
    assert state["mode"] != 1  # its bias is known, which it could not be before
