"""Who is revoked in mid-drill is out, and certificates are made anew, while the rig loses nothing: real processes."""

from __future__ import annotations

import contextlib
import datetime
import json
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs import free_endpoint

from borechain.drilling.router_host import run_router
from borechain.load.crowd import Crowd, crowd_in_thread
from borechain.load.killed import PRELOAD, first_receipt, run_own_clock_ground, wait_until
from borechain.pki.certificates import make_certificate
from borechain.pki.rig_keys import add_person, init_rig, renew_certificate, revoke_person
from groundstation.config import checked_config
from groundstation.service.disk.ground_store import Store
from sim.rig.processes import ProcessTable, Spec
from telemetry import keys
from telemetry.application.seals import seals_of
from telemetry.media.credentials import CA_FILE, credentials_of
from telemetry.media.zenoh_bus import ZenohBus, open_client
from telemetry.messages import ENCODER, Side
from telemetry.runtime.hosting import Place

pytestmark = pytest.mark.process
RIG = "guarded"
WAIT = 20.0  # s to join a router
NOW = datetime.datetime.now(datetime.UTC)


class Drilling:
    """A rig under keys and TLS, and what was handed to its ground station."""

    def __init__(self, folder: Path, endpoint: str) -> None:
        self.folder, self.endpoint = folder, endpoint
        self.handed = 0

    @contextlib.contextmanager
    def going_on(self) -> Iterator[None]:
        """A string that lives, from its first receipt on."""
        with open_client(self.endpoint, WAIT, credentials_of(self.folder, "encoder")) as bus:
            self.crowd = Crowd(1, bus, RIG, seals=seals_of(self.folder, ENCODER, [Side.UPPER]))
            with crowd_in_thread(self.crowd, bus, RIG) as loop:
                self.loop = loop
                first_receipt(self.crowd, self.hand_over)
                yield
                wait_until(lambda: self.crowd.endpoint.mail.outbox_size == 0)

    def hand_over(self) -> None:
        """One more event that must not be lost."""
        self.loop.call(lambda _process, now: self.crowd.happen(now))
        self.handed += 1

    def drill(self) -> None:
        """Go on until something new was receipted."""
        before = self.crowd.receipted
        self.hand_over()
        wait_until(lambda: self.crowd.receipted > before)


@pytest.fixture
def drilling(tmp_path: Path) -> Iterator[Drilling]:
    folder, endpoint = tmp_path / "stick", free_endpoint().replace("tcp/", "tls/")
    init_rig(folder, RIG, NOW)
    for name in ("anna", "ben"):
        add_person(folder, name, "driller", NOW)
    place = Place(RIG, endpoint, tmp_path / "ground", keys=folder)
    specs = {
        "router": Spec(run_router, (endpoint, folder)),
        "base": Spec(run_own_clock_ground, (place, {})),
    }
    table = ProcessTable(specs, [PRELOAD])
    rig = Drilling(folder, endpoint)
    try:
        table.warm()
        for name in specs:
            table.start(name)
        yield rig
    finally:
        table.stop()
    assert kept(tmp_path / "ground") == Counter(range(1, rig.handed + 1))


def kept(folder: Path) -> Counter[int]:
    """Numbers of the encoder's events in the database."""
    with contextlib.closing(Store(checked_config(rig=RIG, folder=folder).url)) as store:
        return Counter(one.message.sequence for one in store.messages() if one.message.tube == ENCODER)


def asked(bus: ZenohBus, path: str = "status") -> dict[str, object] | None:
    """What the ground station answers to who is let in."""
    replies = [reply for reply in bus.get(keys.GROUND.format(rig=RIG, path=path), 2.0) if reply.error is None]
    return dict(json.loads(replies[0].payload)) if replies else None


def certificate_alarms(bus: ZenohBus) -> list[str]:
    """Certificates that the crew is told of."""
    found = asked(bus, "alarms") or {"rig": []}
    rows = found["rig"]
    assert isinstance(rows, list)
    return [row["subject"] for row in rows if row["code"] == "certificate"]


def test_a_person_who_is_revoked_is_out_and_the_string_goes_on(drilling: Drilling, tmp_path: Path) -> None:
    stolen = tmp_path / "laptop"
    stolen.mkdir()
    for name in (CA_FILE, "anna.pem", "anna.key"):
        shutil.copy(drilling.folder / name, stolen / name)
    with (
        drilling.going_on(),
        open_client(drilling.endpoint, WAIT, credentials_of(stolen, "anna")) as hers,
        open_client(drilling.endpoint, WAIT, credentials_of(drilling.folder, "ben")) as his,
    ):
        wait_until(lambda: asked(hers) is not None)
        revoke_person(drilling.folder, "anna")
        drilling.hand_over()
        wait_until(lambda: asked(his) is not None and asked(hers) is None)
        drilling.drill()
        with open_client(drilling.endpoint, WAIT, credentials_of(stolen, "anna")) as again:
            assert asked(again) is None
        add_person(drilling.folder, "anna", "driller", NOW)  # with another laptop
        with open_client(drilling.endpoint, WAIT, credentials_of(drilling.folder, "anna")) as hers_now:
            wait_until(lambda: asked(hers_now) is not None)
        wait_until(lambda: asked(his) is not None)
        assert asked(hers) is None
        drilling.drill()


def test_certificates_are_made_anew_while_the_rig_drills(drilling: Drilling) -> None:
    folder = drilling.folder
    with (
        drilling.going_on(),
        open_client(drilling.endpoint, WAIT, credentials_of(folder, "operator")) as bus,
    ):
        wait_until(lambda: asked(bus) is not None)
        assert certificate_alarms(bus) == []
        make_certificate(folder, "base", NOW, datetime.timedelta(days=20))
        wait_until(lambda: certificate_alarms(bus) == ["base"])
        for name in ("router", "base", "encoder"):
            renew_certificate(folder, name, NOW)
            drilling.hand_over()
        wait_until(lambda: asked(bus) is not None and certificate_alarms(bus) == [])
        drilling.drill()
