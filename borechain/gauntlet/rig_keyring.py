"""The folder of a rig's keys under faults: certificates that end, persons, key files of a wrong generation."""

from __future__ import annotations

import atexit
import datetime
import random
import shutil
import tempfile
from functools import cache
from pathlib import Path

from borechain.pki.certificates import make_certificate
from borechain.pki.private_files import write_private
from borechain.pki.rig_keys import (
    add_person,
    add_tube,
    init_rig,
    read_secret,
    renew_certificate,
    retire_keys,
    revoke_person,
    rotate_keys,
)
from sim.gauntlet.fault import TUBES
from telemetry.transport.key_ring import key_file

RIG = "rig-1"
ROLE = "driller"
LASTS = datetime.timedelta(days=60)  # of a certificate that is let end, from its begin on


class RigKeyring:
    """Keys of one rig, and those of a wrong generation.

    Parameters
    ----------
    folder : that does not exist; is made, with keys for every process
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        own, self._wrong = made_folders()
        shutil.copytree(own, folder)

    def let_end(self, name: str, left: float) -> None:
        """Let a certificate end in ``left`` days."""
        begun = datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=left) - LASTS
        make_certificate(self.folder, name, begun, LASTS)

    def renew(self, name: str) -> None:
        """Renew a certificate."""
        renew_certificate(self.folder, name, datetime.datetime.now(datetime.UTC))

    def let_in(self, name: str) -> None:
        """Let in one more person."""
        if name not in self._persons():
            add_person(self.folder, name, ROLE, datetime.datetime.now(datetime.UTC))

    def shut_out(self, name: str) -> None:
        """Revoke a person that was let in."""
        if name in self._persons():
            revoke_person(self.folder, name)

    def misgive(self, address: int) -> None:
        """Give a process keys of a generation that no other has."""
        self._give(address, self._wrong)

    def give_back(self, address: int) -> None:
        """Give a process its own keys again."""
        self._give(address, made_folders()[0])

    def _give(self, address: int, source: Path) -> None:
        write_private(key_file(self.folder, address), key_file(source, address).read_text(encoding="utf-8"))

    def _persons(self) -> set[str]:
        return {one.name for one in read_secret(self.folder).persons if not one.is_revoked}


@cache
def made_folders() -> tuple[Path, Path]:
    """Folders with keys of a rig, and with the same of a later generation alone; made once a process."""
    place = Path(tempfile.mkdtemp(prefix="gauntlet-keys-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    now = datetime.datetime.now(datetime.UTC)
    own, wrong = place / "own", place / "wrong"
    init_rig(own, RIG, now, random.Random(1).randbytes)
    for tube in TUBES:
        add_tube(own, tube, now)
    shutil.copytree(own, wrong)
    rotate_keys(wrong, now)
    retire_keys(wrong)
    return own, wrong
