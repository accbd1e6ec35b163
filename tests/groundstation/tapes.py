"""Recordings of ground stations that are fed by hand."""

from __future__ import annotations

import json
from pathlib import Path

from groundstation.recording.recording_file import RecordedSample, RecordingWriter
from groundstation.service.answers.answer_table import schemas_by_path
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.intake_tape import BEGIN, Intake, pack_intake

KEY = "borechain/rig-1/ground/"
INTAKE = "borechain/rig-1/intake"


def shown() -> dict[str, bytes]:
    return {pattern: json.dumps(schema).encode() for pattern, schema in schemas_by_path().items()}


def begin_of(ground: GroundProcess) -> Intake:
    settings = ground.config.model_dump(mode="json", exclude={"folder", "key_file", "database_url"})
    return Intake(0, BEGIN, 0.0, 0.0, 0, {"settings": settings, "start": ground.start_number})


def write(path: Path, ground: GroundProcess) -> None:
    """A recording of all that is on the tape, and of some answers."""
    with RecordingWriter(path, "rig-1", shown()) as writer:
        for k, event in enumerate([begin_of(ground), *ground.tape.events]):
            writer.write(RecordedSample(INTAKE, 1_000 + k, pack_intake(event)))
        for path_of in ("status", "verdict", "nodes/1", "stations/1"):
            writer.write(RecordedSample(KEY + path_of, 9_000, json.dumps(ground.operator.ask(path_of)).encode()))
