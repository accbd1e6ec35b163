"""The parameter block in use and its successor: gather segments, check, wait for rest, store, report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from node.firmware.block_trial import Trial, TrialVerdict, refusal_reason, unfit_reason
from node.firmware.inputs import ImuReading
from node.firmware.tube import Tube
from node.process.block_store import BlockStore
from telemetry.errors import DecodeError
from telemetry.frozen import replace
from telemetry.messages import BlockSegment, BlockStatus, Scalar, Severity, UploadPhase
from telemetry.parameters import ParameterBlock, unpack_block
from telemetry.transport.authentication import is_authentic
from telemetry.transport.upload import Assembly

UNTRUSTED_EVERY = 60.0  # s between two events about segments of a wrong key, so that a forger fills no memory

Say = Callable[[Severity, str, dict[str, Scalar]], None]


class BlockUpdater:
    """Uploads of one node.

    Parameters
    ----------
    tube : the firmware that uses the block
    store : where blocks are kept
    keys : gives those of which one must fit a segment; without any no block is taken
    say : makes an event
    save : saves the node's state; it is called before a block goes to the disk
    """

    def __init__(
        self, tube: Tube, store: BlockStore, keys: Callable[[], list[bytes]], say: Say, save: Callable[[], None]
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._tube = tube
        self._store = store
        self._keys = keys
        self._say = say
        self._save = save
        self._sequence = 0
        self._refused = (b"", 0, "")  # hash, upload and reason of the last; another upload may try it again
        self._untrusted_at = float("-inf")
        self._trial: Trial | None = None
        self._assembly = self._restore()
        if self._assembly is not None and self._assembly.complete:
            self._check(self._assembly)

    def on_segment(self, segment: BlockSegment, now: float) -> BlockStatus:
        """Take a segment that came at ``now`` (s, own clock); returns the answer to it."""
        if reason := self._distrust(segment):
            self.counters["untrusted_segments"] += 1
            self._tell_untrusted(segment, reason, now)
            plain = self._status(segment.digest, UploadPhase.UNTRUSTED, reason)
            return replace(plain, sequence=segment.sequence, received=0)
        self._sequence = segment.sequence
        if segment.digest == self._tube.parameters.sha256():
            return self._status(segment.digest, UploadPhase.APPLIED)
        if (segment.digest, segment.sequence) == self._refused[:2]:
            return self._status(segment.digest, UploadPhase.REFUSED, self._refused[2])
        if reason := self._outdated(segment):
            return self._status(segment.digest, UploadPhase.REFUSED, reason)
        return self._gather(segment)

    @property
    def trying(self) -> bool:
        """Whether a block waits for readings at rest."""
        return self._trial is not None

    def on_cycle(self, reading: ImuReading) -> BlockStatus | None:
        """Try the waiting block on a cycle's raw reading; returns the status to send once it is decided."""
        if self._trial is None:
            return None
        tube = self._tube
        verdict = self._trial.judge_reading(
            reading.rate, reading.force, reading.temperature, standing=tube.standing, quiet=tube.quiet
        )
        if verdict is TrialVerdict.WAIT:
            return None
        block = self._trial.block
        if verdict is TrialVerdict.REFUSE:
            return self._refuse(block.sha256(), block.version, self._trial.reason)
        return self._apply(block)

    def _restore(self) -> Assembly | None:
        """Segments kept before the restart, unless their block was applied just then."""
        saved = self._store.upload()
        assembly = Assembly.restore(saved) if saved else None
        return assembly if assembly is not None and assembly.version > self._tube.parameters.version else None

    def _distrust(self, segment: BlockSegment) -> str:
        keys = self._keys()
        if not keys:
            return "the node has no key of the rig"
        if segment.index >= segment.count or not any(is_authentic(segment, key) for key in keys):
            return f"segment {segment.index}: the tag is not of the node's key"
        return ""

    def _outdated(self, segment: BlockSegment) -> str:
        """Why a segment is outdated, empty if it is not; a replayed old upload is refused here."""
        if segment.version <= self._tube.parameters.version:
            return f"version: expected newer than {self._tube.parameters.version}, got {segment.version}"
        if self._assembly is not None and segment.version < self._assembly.version:
            return f"version: {self._assembly.version} is being uploaded, got {segment.version}"
        return ""

    def _gather(self, segment: BlockSegment) -> BlockStatus:
        if self._assembly is None or not self._assembly.belongs(segment):
            self._assembly = Assembly(segment.version, segment.digest, segment.count)
            self._trial = None
        assembly = self._assembly
        if assembly.add_segment(segment):
            try:
                self._store.keep_upload(assembly.export())
            except OSError:
                self.counters["upload_not_kept"] += 1  # the ground station repeats it after a restart
            if assembly.complete and (refused := self._check(assembly)):
                return refused
        phase = UploadPhase.WAITING if self._trial is not None else UploadPhase.PARTIAL
        return self._status(segment.digest, phase)

    def _check(self, assembly: Assembly) -> BlockStatus | None:
        """Make a trial of a complete block, or refuse it."""
        data = assembly.block()
        if data is None:
            return self._refuse(assembly.digest, assembly.version, "the hash of the whole does not fit")
        try:
            block = unpack_block(data)
        except DecodeError as error:
            return self._refuse(assembly.digest, assembly.version, str(error))
        reason = refusal_reason(block, self._tube.settings.tube, self._tube.parameters)
        if block.version != assembly.version:
            reason = f"version: expected that of its segments, {assembly.version}, got {block.version}"
        if reason:
            return self._refuse(assembly.digest, assembly.version, reason)
        self._trial = Trial(block, float(self._tube.config["gravity"]))
        return None

    def _apply(self, block: ParameterBlock) -> BlockStatus:
        """Put a block on the disk and in use.

        What was learnt under the block before is forgotten and saved first: a cut after that leaves a node that
        learns its bias again under either block, and never one that corrects by the bias of another block.
        """
        before = self._tube.parameters.version
        self._tube.prepare(block)
        self._save()
        try:
            self._store.keep_block(block)
        except OSError as error:
            return self._refuse(block.sha256(), block.version, f"disk: {error.strerror or error}")
        self._tube.use(block)
        self._end()
        detail: dict[str, Scalar] = {"version": block.version, "before": before, "hash": block.sha256().hex()}
        self._say(Severity.INFO, "parameters_applied", detail)
        return self._status(block.sha256(), UploadPhase.APPLIED)

    def _refuse(self, digest: bytes, version: int, reason: str) -> BlockStatus:
        self._refused = (digest, self._sequence, reason)
        self._end()
        detail: dict[str, Scalar] = {"version": version, "reason": reason[:200]}
        self._say(Severity.ERROR, "parameters_refused", detail | {"in_use": self._tube.parameters.version})
        return self._status(digest, UploadPhase.REFUSED, reason)

    def _end(self) -> None:
        self._trial = self._assembly = None
        self._store.drop_upload()

    def _tell_untrusted(self, segment: BlockSegment, reason: str, now: float) -> None:
        if now >= self._untrusted_at + UNTRUSTED_EVERY:
            self._untrusted_at = now
            count = self.counters["untrusted_segments"]
            detail: dict[str, Scalar] = {"version": segment.version, "reason": reason, "segments": count}
            self._say(Severity.WARNING, "upload_untrusted", detail)

    def _status(self, digest: bytes, phase: UploadPhase, detail: str = "") -> BlockStatus:
        received = 0
        if self._assembly is not None and self._assembly.digest == digest:
            received = self._assembly.received
        in_use = self._tube.parameters
        return BlockStatus(
            tube=self._tube.settings.tube,
            sequence=self._sequence,
            digest=digest,
            phase=phase,
            received=received,
            version=in_use.version,
            in_use=in_use.sha256(),
            detail=detail[:200],
        )


def load_parameters(store: BlockStore, tube: int) -> ParameterBlock:
    """Block that a node starts with: the newest good one of its disk, or the identity."""
    return store.load(lambda block: unfit_reason(block, tube)) or ParameterBlock(tube, 0)
