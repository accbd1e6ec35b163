"""What is kept on a disk or handed out is exactly what was told: order, identity, bounds, and who may read it."""

from __future__ import annotations

import contextlib
import datetime
import os
import sqlite3
import stat
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cryptography import x509
from test_store import survey, url

from borechain.pki.certificates import make_authority, make_certificate
from borechain.pki.private_files import write_file, write_private
from groundstation.config import GroundConfig
from groundstation.errors import StoreError
from groundstation.gateway.lease import VALID, RigLease
from groundstation.gateway.page.sessions import FORGOTTEN_S, LONGEST_HOLD_S, WrongPasswords
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import StringKeeper, refusing_disk
from groundstation.service.disk.moment_keeper import MomentKeeper
from groundstation.service.disk.moment_record import DamagedMomentError, moment_of_bytes, moment_to_bytes
from groundstation.service.hole.history import Moment
from groundstation.service.hole.packed_end import PackedEnd
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.told_value import SetupKind, ToldValue
from groundstation.service.string.depth import DepthDoubt
from groundstation.service.string.known_string import KnownString
from telemetry.errors import MediumError
from telemetry.messages import DepthReading, Stand
from telemetry.transport.key_ring import Generation, KeyRing, keys_of, pack_ring, read_ring

NOW = datetime.datetime(2026, 5, 4, 6, tzinfo=datetime.UTC)


def test_messages_come_back_in_the_order_in_which_they_came(tmp_path: Path) -> None:
    came = [survey(tube, sequence) for tube, sequence in ((2, 9), (1, 3), (2, 8), (1, 40), (3, 1))]
    with contextlib.closing(Store(url(tmp_path))) as store:
        for message in came:
            store.add_message(message, 1.0)
    with contextlib.closing(Store(url(tmp_path))) as store:
        assert [one.message for one in store.messages()] == came


def test_a_depth_is_given_to_the_message_of_its_content_and_to_no_other_of_its_number(tmp_path: Path) -> None:
    """A tube that counts anew says another thing under the same number."""
    first, second = survey(1, 7, yaw=1.0), survey(1, 7, yaw=2.0)
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.add_messages([])
        for message in (first, second):
            store.add_message(message, None)
        for message, md in ((second, 4.0), (first, 2.0), (second, None)):
            store.place_messages([(message, md)])
        assert {one.message.yaw: one.md for one in store.messages()} == {1.0: 2.0, 2.0: None}


def test_every_commit_is_forced_to_the_disk(tmp_path: Path) -> None:
    """As SQLite's own words have it: a log of writes, and 2 is FULL. Of every connection, also of a later one."""
    store = Store(url(tmp_path))
    for _ in range(2):
        with store._engine.connect() as connection:
            assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
            assert connection.exec_driver_sql("PRAGMA synchronous").scalar() == 2
        store._engine.dispose()
    store.close()


def test_another_who_writes_for_a_moment_is_waited_for(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        other = sqlite3.connect(tmp_path / "ground.sqlite", isolation_level=None, check_same_thread=False)
        other.execute("BEGIN IMMEDIATE")
        ends = threading.Timer(0.05, other.rollback)
        ends.start()
        assert store.add_message(survey(1, 1), 1.0)
        ends.join()
        other.close()


class RefusingStore(Store):
    """Refuses some calls."""

    refusals = 0

    def _refuse(self) -> None:
        if self.refusals:
            self.refusals -= 1
            raise StoreError("full")

    def keep_tally(self, tubes: list[int]) -> None:
        self._refuse()
        super().keep_tally(tubes)

    def keep_depth_doubt(self, doubt: object) -> None:
        self._refuse()
        super().keep_depth_doubt(doubt)  # type: ignore[arg-type]

    def keep_stand(self, stand: Stand) -> None:
        self._refuse()
        super().keep_stand(stand)

    def keep_moments(self, basis: str, moments: object, dropped: object = ()) -> None:
        self._refuse()
        super().keep_moments(basis, moments, dropped)  # type: ignore[arg-type]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RefusingStore]:
    with contextlib.closing(RefusingStore(url(tmp_path))) as made:
        yield made


def reading(sequence: int, at: float, md: float) -> DepthReading:
    return DepthReading(sequence, at, md, ())


@pytest.mark.parametrize("refusals", [1, 2])
@pytest.mark.parametrize("what", ["tally", "depth_doubt", "stands"])
def test_what_a_disk_refused_is_kept_as_soon_as_it_takes(
    store: RefusingStore, tmp_path: Path, what: str, refusals: int
) -> None:
    string = KnownString(GroundConfig(folder=tmp_path))
    keeper = StringKeeper(store, string)
    string.tally.on_hops(7, 1)
    string.depths.recall(DepthDoubt(None, (1, 90.0), (Stand(1, 80.0, 85.0, 3.0),)))
    string.depths.stands = [Stand(1, 100.0, 110.0, 4.0)]
    keep, wanted = {
        "tally": (keeper.keep_tally, [7]),
        "depth_doubt": (keeper.keep_depth_doubt, string.depths.doubt),
        "stands": (lambda: keeper.keep_stand(reading(1, 200.0, 5.0)), string.depths.stands),
    }[what]
    store.refusals = refusals
    for _ in range(refusals):
        with refusing_disk():
            keep()
        assert getattr(store, what)() != wanted
    keep()
    assert getattr(store, what)() == wanted


def test_a_stand_that_another_follows_at_once_is_kept_with_its_end(store: RefusingStore, tmp_path: Path) -> None:
    string = KnownString(GroundConfig(folder=tmp_path))
    keeper = StringKeeper(store, string)
    string.depths.stands = [Stand(1, 100.0, 110.0, 4.0)]
    keeper.keep_stand(reading(1, 110.0, 4.0))
    string.depths.stands = [Stand(1, 100.0, 150.0, 4.0)]  # it lasts: nothing to keep until it has ended
    keeper.keep_stand(reading(2, 150.0, 4.0))
    assert store.stands() == [Stand(1, 100.0, 110.0, 4.0)]
    string.depths.stands = [Stand(1, 100.0, 150.0, 4.0), Stand(1, 160.0, 165.0, 5.0)]
    keeper.keep_stand(reading(3, 165.0, 5.0))
    assert store.stands() == string.depths.stands


def moment(number: int, *, is_known: bool = True) -> Moment:
    random = np.random.default_rng(number)
    where, found = random.uniform(1.0, 2.0, (3, 2)), random.uniform(0.0, 1.0, (3, 6)).astype(np.float32)
    end = PackedEnd(random.uniform(size=13), random.uniform(size=(2, 6)).astype(np.float32))
    return Moment(number, 100.0 * number, where, found, end if is_known else None)


@pytest.mark.parametrize("is_known", [True, False])
def test_a_moment_is_all_of_its_bytes_and_none_more(is_known: bool) -> None:
    whole = moment_to_bytes(moment(5, is_known=is_known))
    again = moment_of_bytes(5, whole)
    assert moment_to_bytes(again) == whole
    assert (again.number, again.at, again.end is not None) == (5, 500.0, is_known)
    for wrong in (*(whole[:size] for size in range(len(whole))), whole + b"\0", whole + bytes(24)):
        with pytest.raises(DamagedMomentError):
            moment_of_bytes(5, wrong)


def told(number: int, value: float) -> ToldValue:
    return ToldValue(number, SetupKind.NORTH, "", (value,), 0.01, "anna", "2026-05-04T06:00:00Z")


def test_moments_rest_on_everything_that_was_told_and_go_with_their_stops(store: RefusingStore, tmp_path: Path) -> None:
    config = GroundConfig(folder=tmp_path)
    book = SetupBook(config)
    hole = SimpleNamespace(is_adjusted=True, history=SimpleNamespace(moments=[moment(1), moment(2), moment(3)]))
    keeper = MomentKeeper(store, config, book, hole)  # type: ignore[arg-type]
    bases = [keeper.basis]
    keeper.keep()
    assert store.moment_numbers() == [1, 2, 3]
    for refusals in (0, 1):
        hole.history.moments = hole.history.moments[1:]
        store.refusals = refusals
        for _ in range(1 + refusals):
            keeper.keep()
        assert store.moment_numbers() == [one.number for one in hole.history.moments]
    for entries in ([told(1, 0.1)], [told(2, 0.2)], [told(3, 0.2)]):
        book.add(entries)
        bases.append(keeper.basis)
    other = SetupBook(config)
    other.add([replace(told(1, 0.3), by="anna"), told(2, 0.2), told(3, 0.2)])  # another first entry alone
    bases.append(MomentKeeper(store, config, other, hole).basis)  # type: ignore[arg-type]
    assert len(set(bases)) == len(bases)
    assert [one.number for one in store.moments(bases[0])] == [3]
    assert store.moments(bases[1]) == []


class MadeBus:
    """A router that answers as a test says."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.own: list[str] = []
        self.others: list[str] = []
        self.is_known = True
        self.is_away = False

    def liveliness_token(self, key: str) -> Callable[[], None]:
        self.own = [key]
        return self.own.clear

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        del pattern, timeout
        return [*self.own, *(self.own if self.is_known else []), *(self.others if self.is_known else [])]

    @contextlib.contextmanager
    def reach(self) -> Iterator[SimpleNamespace]:
        if self.is_away:
            raise MediumError("no router")
        yield SimpleNamespace(tokens=lambda pattern, timeout: [*self.own, *self.others])

    def lease(self) -> RigLease:
        return RigLease(self, "rig-1", self.reach, lambda: self.now)  # type: ignore[arg-type]


def beside(bus: MadeBus, by: int) -> str:
    """A token that was taken earlier (less than zero) or later than the own one."""
    stem, _, name = bus.own[0].rpartition("/")
    at, _, rest = name.partition("_")
    return f"{stem}/{int(at) + by:020d}_{rest}"


def test_a_lapse_is_looked_into_from_exactly_its_time_on_and_what_followed_keeps_the_rig() -> None:
    bus = MadeBus()
    lease = bus.lease()
    bus.is_known, bus.others = False, [beside(bus, 5)]
    for silent, is_lost in ((0.5, False), (VALID, False), (VALID + 0.01, True)):
        bus.now = 1000.0 + silent
        lease.confirm()
        assert lease.is_lost == is_lost
    assert bus.own == []


@pytest.mark.parametrize(("by", "is_contested"), [(-5, True), (5, False)])
@pytest.mark.parametrize("times", [1, 2])
def test_an_older_token_beside_contests_a_lease_and_a_younger_one_does_not(
    by: int, is_contested: bool, times: int
) -> None:
    bus = MadeBus()
    lease = bus.lease()
    for _ in range(times):  # one that is there for a moment, and begins to count anew each time
        bus.others = [beside(bus, by)]
        for _ in range(8):
            bus.now += 0.5
            lease.confirm()
            assert bool(lease.trouble) == is_contested
            assert not lease.is_lost
        bus.others = []
        bus.now += 0.5
        lease.confirm()
        assert lease.trouble == ""
    bus.others = [beside(bus, by)]
    for _ in range(12):
        bus.now += 0.5
        lease.confirm()
    assert lease.is_lost == is_contested


@pytest.mark.parametrize(("later", "row"), [(0.0, 4), (FORGOTTEN_S, 4), (FORGOTTEN_S + 1e-6, 1)])
def test_wrong_passwords_are_forgotten_after_exactly_their_time(later: float, row: int) -> None:
    wrong, now = WrongPasswords(), 1000.0
    for _ in range(3):
        _, hold = wrong.add("a", now)
        now += hold
    assert wrong.add("a", now + later)[0] == row
    assert wrong.hold_of("a", now + later) == (1.0 if row == 1 else 8.0)
    assert LONGEST_HOLD_S > 8.0


@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_files_have_the_rights_that_they_are_to_have_whatever_was_there(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        for write, rights in ((write_private, 0o600), (write_file, 0o644)):
            for name in ("new", "known", "cut"):
                path = tmp_path / f"{name}-{rights:o}"
                if name == "known":
                    path.write_text("longer than what comes")
                    path.chmod(0o666)
                if name == "cut":  # the power went in the middle of an earlier one
                    path.with_name(f".{path.name}.new").write_text("x" * 100)
                    path.with_name(f".{path.name}.new").chmod(0o666)
                write(path, "text")
                assert path.read_text() == "text"
                assert stat.S_IMODE(path.stat().st_mode) == rights
        assert not list(tmp_path.glob(".*"))
    finally:
        os.umask(before)


def test_certificates_are_good_for_a_board_whose_clock_is_a_day_late_and_for_thirty_years(tmp_path: Path) -> None:
    make_authority(tmp_path, "rig-1", NOW)
    make_certificate(tmp_path, "tube-1", NOW)
    for name in ("ca.pem", "tube-1.pem"):
        found = x509.load_pem_x509_certificate((tmp_path / name).read_bytes())
        assert found.not_valid_before_utc == NOW - datetime.timedelta(days=1)
        assert found.not_valid_after_utc == NOW + datetime.timedelta(days=30 * 365)


@pytest.mark.parametrize(("late", "warned"), [(-1, 0), (0, 1), (1, 1)])
def test_keys_of_before_are_warned_of_from_exactly_their_time_on(tmp_path: Path, late: int, warned: int) -> None:
    made = [Generation(n, keys_of(bytes([n]) * 32, 1), NOW) for n in (1, 2)]
    made[0].retires_at = NOW
    write_private(tmp_path / "tube-1.keys", pack_ring(KeyRing("rig-1", 1, tuple(made))))
    at = NOW + datetime.timedelta(microseconds=late)
    assert len(read_ring(tmp_path / "tube-1.keys", 1, at).warnings) == warned
