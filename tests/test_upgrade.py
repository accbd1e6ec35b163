"""What an earlier release has written is opened, run and drilled on: it made its folder of ``data/releases`` itself."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import Rig
from sealed_string import NOW

from borechain.pki.rig_keys import add_tube, read_secret, revoke_tube, rotate_keys
from groundstation.errors import StoreError
from groundstation.recording.ground_replay import replay_summary
from groundstation.recording.recording_file import Recording
from groundstation.service.disk.ground_store import Store
from node.firmware.saved_layouts import CarriedState, carry_over, described_dtype, known_layouts
from node.firmware.saved_state import CHECKSUM, HEADER, layout_name, unpack_state_slot
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.journal import Journal
from node.process.tube_process import TubeProcess
from telemetry.application.seals import Keys, Seals
from telemetry.messages import BASE, ENCODER, Side, SurveyMeasurement
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.transport.key_ring import key_file, read_ring

RELEASES = sorted((Path(__file__).parent / "data" / "releases").iterdir())


@pytest.fixture(params=RELEASES, ids=lambda path: path.name)
def release(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A copy of what a release has written; key files for their owner alone, which a repository does not keep."""
    folder = tmp_path / "release"
    shutil.copytree(request.param, folder)
    for path in (folder / "keys").iterdir():
        path.chmod(0o600)
    return folder


@pytest.fixture
def told(release: Path) -> dict[str, Any]:
    return dict(json.loads((release / "answers.json").read_text()))


def test_a_tube_goes_on_with_what_it_had_learnt(release: Path, told: dict[str, Any]) -> None:
    journal = Journal(release / "tube-1")
    found = journal.load()
    assert found is not None
    learnt, kept = told["learnt"], found[0][0]
    for name in ("static_bias", "static_bias_var", "bias", "yaw", "scale", "yaw_known", "P"):
        assert np.array_equal(kept["filter"][name], learnt[name]), name
    for name, value in learnt.items():
        room, _, field = name.partition("_")
        if room in ("mount", "twist"):
            assert np.array_equal(kept[room][field], value), name
    assert (kept["joints"]["offset"], kept["joints"]["var"]) == (learnt["joint_offset"], learnt["joint_var"])
    assert journal.carried is not None
    assert journal.carried.fields > 100


def test_a_tube_runs_on_and_tells_that_its_state_was_carried_over(release: Path, told: dict[str, Any]) -> None:
    boots = int((release / "tube-1" / "boots").read_text())
    process = TubeProcess(TubeSettings(1), release / "tube-1")
    said: list[tuple[str, dict[str, Any]]] = []
    process._send_event = lambda _severity, code, arguments: said.append((code, arguments))  # type: ignore[method-assign]
    process._announce(5.0, 5.0)
    assert process.boots == boots + 1
    ((code, arguments),) = said
    assert (code, arguments["layout"]) == ("saved_state_carried", "12-a7c2d05f")
    lot, now = np.random.default_rng(1), 1000.0
    for _ in range(20):
        now += PERIOD
        noise = lot.normal(0.0, 1e-4, 6)
        process.on_cycle([now - PERIOD, *noise[:3], *noise[3:5], noise[5] - 9.8], now)
    assert np.array_equal(process.state[0]["static_bias_var"] > 0.0, np.array(told["learnt"]["static_bias_var"]) > 0.0)
    process.close()
    again = Journal(release / "tube-1")
    assert again.load() is not None
    assert again.carried is None  # written anew in the present layout
    log = process._log.payloads(1, 1 << 40)
    assert any(isinstance(decode_message(payload), SurveyMeasurement) for _, payload in log)


def test_a_database_is_opened_gives_its_hole_and_is_drilled_on(release: Path, told: dict[str, Any]) -> None:
    rig = Rig(release)
    (station,) = rig.ask("stations")["stations"]
    wanted = told["station"]
    assert station["measurements"] == wanted["measurements"]
    assert station["inclination_deg"] == pytest.approx(wanted["inclination_deg"], abs=0.01)
    before = rig.ask("measurements")["measurements"]
    with sqlite3.connect(release / "ground.sqlite") as database:
        kept = [bytes(payload) for (payload,) in database.execute("select payload from messages order by id")]
    rig.now = 5000.0
    rig.drill(2, 0.1)
    rig.ground.close()
    with sqlite3.connect(release / "ground.sqlite") as database:
        after = [bytes(payload) for (payload,) in database.execute("select payload from messages order by id")]
    assert after[: len(kept)] == kept
    assert len(after) > len(kept)
    again = Rig(release)
    measured = again.ask("measurements")["measurements"]
    assert len(measured) == len(before) + 1
    again.ground.close()


def test_a_database_of_a_later_version_is_one_line_and_left_alone(release: Path) -> None:
    with sqlite3.connect(release / "ground.sqlite") as database:
        database.execute("update meta set value = '99' where name = 'schema'")
    database.close()
    before = (release / "ground.sqlite").read_bytes()
    with pytest.raises(
        StoreError, match=r"expected schema 2 or 3 or 4 or 5, got 99; one of a later version"
    ) as refused:
        Store(f"sqlite:///{release / 'ground.sqlite'}")
    assert "\n" not in str(refused.value)
    assert (release / "ground.sqlite").read_bytes() == before


def test_a_recording_gives_the_same_hole(release: Path, told: dict[str, Any], tmp_path: Path) -> None:
    shown = replay_summary(Recording(release / "run.mcap"), tmp_path / "replayed")
    assert (shown["whole"], shown["events"], shown["missing"]) == (True, told["events"], 0)
    (station,) = shown["stations"]
    assert station["inclination_deg"] == pytest.approx(told["station"]["inclination_deg"], abs=0.01)
    assert station["measurements"] == told["station"]["measurements"]


def test_keys_are_read_and_a_tube_with_an_old_file_is_believed(release: Path) -> None:
    folder = release / "keys"
    ring = read_ring(folder / "tube-1.keys", 1)
    assert ring.warnings == ()
    secret = read_secret(folder)
    assert {person.name for person in secret.persons} == {"operator", "driller"}
    fresh = read_ring(add_tube(folder, 2, NOW), 2)
    assert fresh.generations[0].keys["joint", 1] == ring.generations[0].keys["joint", 2]
    old = (folder / "tube-1.keys").read_bytes()
    rotate_keys(folder, NOW)
    base = Seals(Keys(key_file(folder, BASE), BASE), BASE, [Side.LOWER])
    (folder / "old").mkdir()
    (folder / "old" / "tube-1.keys").write_bytes(old)
    (folder / "old" / "tube-1.keys").chmod(0o600)
    before = read_ring(folder / "old" / "tube-1.keys", 1).generations[0]
    assert any(
        one.keys["end", 1] == before.keys["end", 1] for one in base.ring.generations
    )  # valid beside the new ones
    revoke_tube(folder, 1, NOW)
    revoked = read_ring(key_file(folder, ENCODER), ENCODER)
    assert ("joint", 1) not in revoked.generations[-1].keys


def fields_of(message: object, wanted: object) -> Iterator[tuple[object, object]]:
    """Each value that the earlier release knew, and what it is now."""
    if isinstance(wanted, dict) and set(wanted) == {"hex"}:
        yield message, bytes.fromhex(wanted["hex"])
    elif isinstance(wanted, dict):
        for name, value in wanted.items():
            yield from fields_of(message[name] if isinstance(message, dict) else getattr(message, name), value)
    elif isinstance(wanted, list):
        assert len(message) == len(wanted)  # type: ignore[arg-type]
        for one, value in zip(message, wanted, strict=True):  # type: ignore[call-overload]
            yield from fields_of(one, value)
    else:
        yield message, wanted


def test_every_message_means_what_it_meant(told: dict[str, Any]) -> None:
    assert len(told["frames"]) >= 14
    for kind, row in told["frames"].items():
        message = decode_message(bytes.fromhex(row["payload"]))
        assert type(message).__name__ == row["class"]
        pairs = list(fields_of(message, row["fields"]))
        assert pairs
        assert [now == then or now is then for now, then in pairs] == [True] * len(pairs), kind


def test_the_present_layout_names_its_fields_for_the_next_release() -> None:
    assert layout_name() in known_layouts(), "run python docs/make_layouts.py"
    assert {name.partition("-")[0] for name in known_layouts()} >= set(map(str, range(5, 15)))


@pytest.mark.parametrize("name", sorted(set(known_layouts()) - {layout_name()}))
def test_of_every_earlier_layout_what_both_know_is_carried_over_and_nothing_else(name: str) -> None:
    """Each field of the earlier record has numbers of its own; a slot is made as that version made it."""
    import zlib

    source, lot = known_layouts()[name], np.random.default_rng(5)
    record = np.zeros(1, source)
    fill(record, lot)
    version, fields = name.split("-")
    head = HEADER.pack(b"BCSS", int(version), 1, int(fields, 16), 7, source.itemsize, 4, 12.5)
    body = record.tobytes() + b"blob"
    slot = head + CHECKSUM.pack(zlib.crc32(body, zlib.crc32(head))) + body
    found = unpack_state_slot(slot)
    assert (found.blob, found.generation, found.saved_at) == (b"blob", 7, 12.5)
    assert isinstance(found.carried, CarriedState)
    there, here = leaves(record), leaves(found.nodes[["filter", "mount", "guard", "twist", "joints"]])
    shared = [path for path in here if path in there and here[path].shape == there[path].shape]
    assert found.carried == CarriedState(name, len(shared), len(here) - len(shared))
    for path in shared:
        assert np.array_equal(here[path], there[path]), path
    torn = bytearray(slot)
    torn[HEADER.size + CHECKSUM.size + source.itemsize // 2] ^= 4
    with pytest.raises(Exception, match="checksum does not fit"):
        unpack_state_slot(bytes(torn))


def fill(record: np.ndarray, lot: np.random.Generator) -> None:
    for name in record.dtype.names or ():
        if record[name].dtype.names:
            fill(record[name], lot)
        else:
            record[name] = lot.integers(1, 1 << 30, record[name].shape)


def leaves(record: np.ndarray, above: str = "") -> dict[str, np.ndarray]:
    found = {}
    for name in record.dtype.names or ():
        inner = record[name]
        found |= leaves(inner, f"{above}{name}.") if inner.dtype.names else {above + name: inner}
    return found


def test_a_field_of_another_type_or_shape_starts_as_new() -> None:
    old = described_dtype("{a@0:<f8,b@8:<i8,c@16:<f8[2],d@32:{x@0:<f8}8}40")
    new = described_dtype("{c@0:<f8[3],d@24:{y@0:<f8,x@8:<f8}16,b@40:<f8,a@48:<f8}56")
    source, target = np.ones(1, old), np.zeros(1, new)
    assert carry_over(source, target) == (2, 3)
    assert (target["a"][0], target["d"]["x"][0]) == (1.0, 1.0)
    assert not target["b"].any()
    assert not target["c"].any()
    assert not target["d"]["y"].any()
    for wrong in ("{a@0:<f8}8x", "{a@0:8}8", "{a@0:<f8}"):
        with pytest.raises(ValueError, match="description of a record"):
            described_dtype(wrong)
