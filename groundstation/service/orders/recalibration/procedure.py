"""Calibration in the field as a state machine: enter attitudes, gather records, solve, show, confirm, upload, verify.

No clock, no bus, no disk: the process asks for the requests that are due, hands in what tubes answer and keeps
``progress`` in the database, so that a break or a restart costs a repetition at most. A record belongs to an attitude
by the number of the order that asked for it, and counts when the tubes rested there until it ended.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from groundstation.calibration.field_calibration import Rest
from groundstation.errors import SelectorError
from groundstation.service.orders.recalibration.recalibration_progress import (
    Attitude,
    RecalibrationProgress,
    RecalibrationStage,
    TubePhase,
    TubeProgress,
)
from groundstation.service.orders.recalibration.solution import Proposal, propose_bias, propose_block
from groundstation.survey.fusion.force_biases import SurveyedBiases
from telemetry.errors import CalibrationError
from telemetry.messages import BlockStatus, NodeState, Reply, Scalar, StaticRecord, UploadPhase
from telemetry.parameters import SHORT_HASH, ParameterBlock

REFUSED_AGAIN = 3.0  # s after which a tube that could not is asked again
SILENT_AGAIN = 15.0  # s, beyond the length of a record, after which one that did not answer is
CLOCK_TOLERANCE = 1.0  # s, by which rig time as known here may be ahead
OVERTAKEN = 10  # cycles by which a state may be overtaken on its way
BEFORE_UPLOAD, IN_UPLOAD = (
    (RecalibrationStage.COLLECTING, RecalibrationStage.SOLVED),
    (TubePhase.UPLOADING, TubePhase.VERIFYING),
)


@dataclass(frozen=True, slots=True)
class Request:
    """Something to send to a tube: a command, or a block."""

    tube: int
    name: str
    arguments: dict[str, Scalar]
    block: ParameterBlock | None = None


class FieldProcedure:
    """At most one calibration in the field at a time.

    Parameters
    ----------
    gravity : m/s^2, of the site
    """

    def __init__(self, gravity: float) -> None:
        self.progress = RecalibrationProgress()
        self.blocks: dict[str, ParameterBlock] = {}  # that this ground station has sent, by their hash
        self._gravity = gravity
        self._records: dict[int, StaticRecord] = {}  # by the command that asked for them
        self._again: dict[int, float] = {}  # s, when a tube may be asked again
        self._questions: dict[int, int] = {}  # command for the block in use: tube
        self._cycles: dict[int, int] = {}

    def restore(self, progress: RecalibrationProgress, blocks: Iterable[ParameterBlock]) -> None:
        """Go on after a restart; what was on its way is asked for again."""
        self.progress = progress
        self.blocks = {block.sha256().hex(): block for block in blocks}
        for tube in progress.tubes.values():
            if tube.phase in IN_UPLOAD:
                tube.phase = TubePhase.CONFIRMED

    def begin(self, tubes: list[int]) -> None:
        """Start with these tubes.

        Raises
        ------
        SelectorError
            When there is no tube, or another calibration has not ended.
        """
        p = self.progress
        if p.stage in (*BEFORE_UPLOAD, RecalibrationStage.UPLOADING) and p.attitudes:
            raise SelectorError(
                f"a calibration of tubes {_list_tubes(p.tubes)} is {p.stage}; expected action=cancel before"
            )
        if not tubes:
            raise SelectorError("tubes: expected those of the string, no tube is known")
        begun = {tube: TubeProgress(tube) for tube in sorted(set(tubes))}
        self.progress = RecalibrationProgress(RecalibrationStage.COLLECTING, [], begun, mixed=p.mixed)
        self._records.clear()
        self._again.clear()
        self._questions.clear()

    def attitude(self, pitch: float, roll: float, seconds: float, rig_now: float) -> None:
        """The tubes now rest at ``pitch`` and ``roll`` (rad); what was solved before is dropped.

        Raises
        ------
        SelectorError
            When no calibration is collecting.
        """
        self._expect(*BEFORE_UPLOAD)
        p = self.progress
        p.stage, p.proposal = RecalibrationStage.COLLECTING, ""
        self._leave(rig_now)
        p.attitudes.append(Attitude(pitch, roll, seconds, rig_now))
        for tube in p.tubes.values():
            tube.phase, tube.proposed, tube.found, tube.calibration, tube.detail = (
                TubePhase.COLLECTING,
                "",
                None,
                "",
                "",
            )
            self._again.pop(tube.tube, None)

    def solve(self, day: str, rig_now: float) -> None:
        """Solve each tube from what has come by ``rig_now`` (s) and propose blocks.

        Raises
        ------
        SelectorError
            When no calibration is collecting, or no tube can be solved; the message has the reason of each.
        """
        self._expect(*BEFORE_UPLOAD)
        self._leave(rig_now)
        self._propose_all(lambda tube, before: propose_block(self._rests(tube), before, self._gravity, day))

    def propose_biases(self, surveyed: SurveyedBiases, day: str) -> None:
        """Propose blocks with the accelerometer biases that the surveys of the hole show.

        Raises
        ------
        SelectorError
            When no calibration has begun, attitudes were entered, or no tube has a bias; the message has the reason
            of each.
        """
        self._expect(*BEFORE_UPLOAD)
        if self.progress.attitudes:
            raise SelectorError("expected no attitudes beside surveys; expected action=begin before")

        def made(tube: TubeProgress, before: ParameterBlock) -> Proposal:
            bias = surveyed.found.get(tube.tube)
            if bias is None:
                raise CalibrationError(surveyed.refused.get(tube.tube, "expected surveys below the collar, got none"))
            return propose_bias(bias, before, self._gravity, day)

        self._propose_all(made)

    def _propose_all(self, made: Callable[[TubeProgress, ParameterBlock], Proposal]) -> None:
        p = self.progress
        for tube in p.tubes.values():
            try:
                self._propose(tube, made)
            except CalibrationError as error:
                tube.phase, tube.detail, tube.proposed, tube.found = TubePhase.REFUSED, str(error), "", None
        hashes = [block.sha256() for tube in p.tubes.values() if (block := tube.block) is not None]
        if not hashes:
            p.stage = RecalibrationStage.COLLECTING
            raise SelectorError("; ".join(f"tube {t.tube}: {t.detail}" for t in p.tubes.values()))
        p.stage, p.proposal = RecalibrationStage.SOLVED, hashlib.sha256(b"".join(hashes)).hexdigest()

    def proposed(self, proposal: str) -> list[tuple[ParameterBlock, str]]:
        """Blocks that ``proposal`` names, each with the text of its calibration; empty when they are under way.

        Raises
        ------
        SelectorError
            When nothing is proposed, or something else than what the operator saw.
        """
        p = self.progress
        if p.stage is RecalibrationStage.UPLOADING and proposal == p.proposal:
            return []
        self._expect(RecalibrationStage.SOLVED)
        if proposal != p.proposal:
            raise SelectorError(f"proposal: expected {p.proposal}, got {proposal!r:.80}; nothing is uploaded")
        return [(block, tube.calibration) for tube in p.tubes.values() if (block := tube.block) is not None]

    def confirm(self) -> None:
        """Upload what was proposed, unless that is under way."""
        if self.progress.stage is not RecalibrationStage.SOLVED:
            return
        self.progress.stage = RecalibrationStage.UPLOADING
        for tube in self.progress.tubes.values():
            if (block := tube.block) is not None:
                tube.phase = TubePhase.CONFIRMED
                self.blocks[block.sha256().hex()] = block

    def cancel(self) -> None:
        """End it; what a tube has it keeps.

        Raises
        ------
        SelectorError
            When there is nothing to end.
        """
        self._expect(*BEFORE_UPLOAD, RecalibrationStage.UPLOADING)
        self.progress.stage = RecalibrationStage.IDLE

    def uploads_to(self, tube: int) -> bool:
        """Whether a tube is to get its block, or to confirm that it has it."""
        progress = self.progress.tubes.get(tube)
        phases = (TubePhase.CONFIRMED, *IN_UPLOAD)
        return progress is not None and self.progress.stage is RecalibrationStage.UPLOADING and progress.phase in phases

    def due_requests(self, now: float) -> list[Request]:
        """What to send at ``now`` (s, own clock)."""
        p = self.progress
        requests = []
        for tube in p.tubes.values() if p.stage in (*BEFORE_UPLOAD, RecalibrationStage.UPLOADING) else ():
            if now >= self._again.get(tube.tube, -math.inf) and (request := self._next_request(tube)) is not None:
                seconds = request.arguments.get("seconds", 0.0)
                self._again[tube.tube] = now + SILENT_AGAIN + float(seconds or 0.0)
                requests.append(request)
        return requests

    def on_sent(self, request: Request, number: int) -> None:
        """Remember the number that a request got as an order."""
        if request.name == "static_record":
            self.progress.tubes[request.tube].orders[number] = len(self.progress.attitudes) - 1
        elif request.block is None:
            self._questions[number] = request.tube

    def on_reply(self, reply: Reply, now: float) -> None:
        """Handle a tube's answer to a command; that to a foreign one changes nothing."""
        tube = self.progress.tubes.get(reply.tube)
        if tube is None:
            return
        if reply.sequence in tube.orders and not reply.done:
            tube.detail = reply.detail
            self._again[tube.tube] = now + REFUSED_AGAIN
        elif self._questions.pop(reply.sequence, None) == reply.tube:
            self._again[tube.tube] = now + REFUSED_AGAIN
            self._on_block_in_use(tube, reply)

    def on_static_record(self, record: StaticRecord) -> None:
        """Handle a record; one that moved is asked for again while the tubes are still there."""
        tube = self.progress.tubes.get(record.tube)
        if tube is not None and record.command in tube.orders:
            self._records[record.command] = record
            self._again.pop(record.tube, None)
            tube.detail = "a record moved" if record.moved else ""

    def on_state(self, state: NodeState) -> None:
        """Notice a tube that started again: its record is lost, and its upload begins anew."""
        tube, before = self.progress.tubes.get(state.tube), self._cycles.get(state.tube, 0)
        if before - OVERTAKEN <= state.cycles <= before:
            return
        self._cycles[state.tube] = state.cycles
        if tube is None or state.cycles > before:
            return
        self._again.pop(state.tube, None)
        if tube.phase in IN_UPLOAD and self.progress.stage is RecalibrationStage.UPLOADING:
            tube.phase, tube.restarted = TubePhase.CONFIRMED, True
            tube.hash_after_restart = self._whole_hash(tube, state.parameters_hash.hex())

    def on_block_status(self, status: BlockStatus, *, has_surveyed: bool = False) -> None:
        """Handle the last word on an upload to a tube that has surveyed the hole before or has not."""
        if status.phase is UploadPhase.APPLIED and has_surveyed and status.tube not in self.progress.mixed:
            self.progress.mixed.append(status.tube)
        tube = self.progress.tubes.get(status.tube)
        if tube is None or tube.phase is not TubePhase.UPLOADING or (block := tube.block) is None:
            return
        if status.digest != block.sha256():
            return
        self._again.pop(status.tube, None)
        if status.phase is UploadPhase.APPLIED:
            tube.phase = TubePhase.VERIFYING
        else:
            tube.phase, tube.detail = TubePhase.REFUSED, f"upload {status.phase.name.lower()}: {status.detail}"
            self._end_if_all_ended()

    def count_records(self, tube: TubeProgress) -> int:
        """Records of a tube at rest so far, the newest of each attitude."""
        return len(self._rests(tube))

    def _next_request(self, tube: TubeProgress) -> Request | None:
        p = self.progress
        if tube.version_before is None or tube.phase is TubePhase.VERIFYING:
            return Request(tube.tube, "parameters", {})
        if p.stage is RecalibrationStage.COLLECTING and p.attitudes and p.attitudes[-1].left is None:
            place = len(p.attitudes) - 1
            if place not in self._good(tube):
                return Request(tube.tube, "static_record", {"seconds": p.attitudes[place].seconds})
        if p.stage is RecalibrationStage.UPLOADING and tube.phase is TubePhase.CONFIRMED:
            tube.phase = TubePhase.UPLOADING
            tube.uploads += 1
            return Request(tube.tube, "upload_parameters", {}, tube.block)
        return None

    def _good(self, tube: TubeProgress) -> dict[int, StaticRecord]:
        """Records that count, the newest of each attitude, by the attitude's place."""
        good = {}
        for sequence, place in sorted(tube.orders.items()):
            record = self._records.get(sequence)
            if record is not None and not record.moved and _lies_in(record, self.progress.attitudes[place]):
                good[place] = record
        return good

    def _rests(self, tube: TubeProgress) -> list[Rest]:
        attitudes = self.progress.attitudes
        return [Rest(attitudes[k].pitch, attitudes[k].roll, r) for k, r in sorted(self._good(tube).items())]

    def _propose(self, tube: TubeProgress, made: Callable[[TubeProgress, ParameterBlock], Proposal]) -> None:
        before = self.block_before(tube)
        if before is None:
            raise CalibrationError(
                f"block in use: expected one that this ground station has sent, got {tube.hash_before or 'no answer'}"
            )
        found = made(tube, before)
        tube.proposed, tube.found, tube.calibration = found.block.canonical().hex(), found.found, found.calibration
        tube.phase, tube.detail = TubePhase.PROPOSED, ""

    def block_before(self, tube: TubeProgress) -> ParameterBlock | None:
        """Block that the tube used at the beginning, if it is known here."""
        identity = ParameterBlock(tube.tube, 0)
        return identity if tube.hash_before == identity.sha256().hex() else self.blocks.get(tube.hash_before)

    def _on_block_in_use(self, tube: TubeProgress, reply: Reply) -> None:
        version, digest = reply.values.get("version"), reply.values.get("sha256")
        if not isinstance(version, int) or not isinstance(digest, str):
            tube.detail = f"expected version and sha256 of the block in use, got {reply.detail or 'neither'}"
            return
        self._again.pop(tube.tube, None)
        if tube.version_before is None:
            tube.version_before, tube.hash_before = version, digest
        elif tube.phase is TubePhase.VERIFYING and (block := tube.block) is not None:
            tube.hash = digest
            same = digest == block.sha256().hex()
            tube.phase, tube.detail = (
                (TubePhase.DONE, "") if same else (TubePhase.REFUSED, f"it uses version {version} {digest}")
            )
            self._end_if_all_ended()

    def _whole_hash(self, tube: TubeProgress, short: str) -> str:
        known = [tube.hash_before] + ([tube.block.sha256().hex()] if tube.block else [])
        return next((digest for digest in known if digest[: 2 * SHORT_HASH] == short), short)

    def _leave(self, rig_now: float) -> None:
        if self.progress.attitudes and self.progress.attitudes[-1].left is None:
            self.progress.attitudes[-1].left = rig_now

    def _end_if_all_ended(self) -> None:
        if all(tube.phase in (TubePhase.DONE, TubePhase.REFUSED) for tube in self.progress.tubes.values()):
            self.progress.stage = RecalibrationStage.DONE

    def _expect(self, *stages: RecalibrationStage) -> None:
        stage = self.progress.stage
        if stage not in stages:
            raise SelectorError(f"expected a calibration that is {' or '.join(stages)}, it is {stage}")


def _lies_in(record: StaticRecord, attitude: Attitude) -> bool:
    """Whether a record was taken while the tubes rested there; one of a tube without rig time yet was not."""
    left = math.inf if attitude.left is None else attitude.left
    return attitude.at - CLOCK_TOLERANCE <= record.begun_at and record.ended_at <= left


def _list_tubes(tubes: Iterable[int]) -> str:
    return ", ".join(str(tube) for tube in tubes)
