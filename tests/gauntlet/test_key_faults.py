"""Keys that fail in a rig that drills: told, made good, and no survey lost; and each fault does what it says."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from borechain.gauntlet.gauntlet_rig import new_rig
from borechain.gauntlet.gauntlet_run import run_seed
from borechain.gauntlet.rig_keyring import RigKeyring
from borechain.pki.rig_keys import read_secret
from sim.gauntlet.fault import TUBES
from sim.gauntlet.fault_kinds import SEALED
from sim.gauntlet.faulty_channel import TAG, FaultyChannel
from telemetry.messages import BASE, ENCODER, Side
from telemetry.transport.certificate_dates import certificate_troubles
from telemetry.transport.key_ring import key_file, read_ring

TOLD = {
    "certificate-ends": {"certificate"},
    "person-revoked": set(),
    "wrong-generation": {"seal_refused", "tube_silent"},
    "tags-flipped": {"seal_refused"},
}


def test_each_kind_of_a_sealed_rig_is_looked_at() -> None:
    assert TOLD.keys() == SEALED


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted(TOLD))
def test_a_key_that_fails_is_told_and_nothing_is_lost(kind: str) -> None:
    done = run_seed(9302, kinds=(kind,), plan="calmed")
    assert done.violations == []
    assert done.measurements == 2 * len(TUBES)
    own = {"certificate", "seal_refused"} | ({"tube_silent"} if kind == "wrong-generation" else set())
    assert done.told.keys() & own == TOLD[kind]
    assert "certificate" not in done.alarms  # it was renewed


def test_a_certificate_ends_when_it_is_said_to_and_is_renewed(tmp_path: Path) -> None:
    keys = RigKeyring(tmp_path / "keys")
    now = datetime.datetime.now(datetime.UTC)
    assert certificate_troubles(keys.folder, now) == {}
    keys.let_end("driller", 12.5)
    keys.let_end("base", -1.0)
    told = certificate_troubles(keys.folder, now)
    assert told.keys() == {"driller", "base"}
    assert "ends in 12 days" in told["driller"]
    assert "has ended" in told["base"]
    for name in told:
        keys.renew(name)
    assert certificate_troubles(keys.folder, now) == {}


def test_a_person_is_let_in_and_shut_out_and_no_key_of_a_process_changes(tmp_path: Path) -> None:
    keys = RigKeyring(tmp_path / "keys")
    files = [key_file(keys.folder, address) for address in (BASE, ENCODER, *TUBES)]
    before = [path.read_bytes() for path in files]
    for _ in range(2):
        keys.let_in("guest")
        assert {"guest": False}.items() <= {p.name: p.is_revoked for p in read_secret(keys.folder).persons}.items()
        keys.shut_out("guest")
        assert {"guest": True}.items() <= {p.name: p.is_revoked for p in read_secret(keys.folder).persons}.items()
    assert [path.read_bytes() for path in files] == before


def test_a_wrong_generation_is_one_that_no_other_process_has(tmp_path: Path) -> None:
    keys = RigKeyring(tmp_path / "keys")

    def generations(address: int) -> list[int]:
        return [one.number for one in read_ring(key_file(keys.folder, address), address).generations]

    keys.misgive(2)
    assert {address: generations(address) for address in (BASE, ENCODER, 1, 2)} == {
        BASE: [1],
        ENCODER: [1],
        1: [1],
        2: [2],
    }
    keys.give_back(2)
    assert generations(2) == [1]


def test_one_bit_of_the_last_bytes_of_some_frames_is_changed() -> None:
    channel = FaultyChannel(5, 0.001, 0.0, 0.0, 0.0)
    frame = bytes(range(64))
    assert [one for _, one in channel.deliveries(ENCODER, Side.LOWER, frame)] == [frame]
    channel.flipped = 0.25
    changed = []
    for _ in range(2000):
        ((_, arrived),) = channel.deliveries(ENCODER, Side.LOWER, frame)
        if bytes(arrived) != frame:
            changed.append(int.from_bytes(bytes(arrived), "big") ^ int.from_bytes(frame, "big"))
    assert 400 < len(changed) < 600
    assert {bits.bit_count() for bits in changed} == {1}
    assert {int(np.log2(float(bits))) for bits in changed} == set(range(8 * TAG))
    channel.flipped = 0.0
    assert [one for _, one in channel.deliveries(ENCODER, Side.LOWER, frame)] == [frame]


def test_a_rig_without_keys_has_none_to_fail(tmp_path: Path) -> None:
    rig = new_rig("minute", 0, tmp_path)
    with pytest.raises(TypeError, match="expected a sealed rig"):
        rig.keys.renew("driller")
    rig.close()
