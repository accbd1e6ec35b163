"""The store on a real file, killed in the middle of its work."""

import math
import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from groundstation.errors import StoreError
from groundstation.service.disk.ground_store import Store
from groundstation.service.string.depth import DepthDoubt
from telemetry.messages import Event, ImuMean, NodeFlag, Severity, Stand, SurveyMeasurement

COV = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))

WRITER = """
import sys
from groundstation.service.disk.ground_store import Store
from telemetry.messages import Event, Severity
store = Store(sys.argv[1])
for sequence in range(1, 100_000):
    store.add_message(Event(1, sequence, 1.0, Severity.INFO, "stopped"), None)
    print(sequence, flush=True)
"""


HOARDER = """
import os, sys
from borechain.load.crowd import survey_of
from groundstation.service.disk.ground_store import Store, Stored
from sim.rig.realtime_run import memory_footprint
store = Store(sys.argv[1])
def fill(stops):
    for stop in stops:
        store.add_messages([Stored(survey_of(tube, stop, 1.0, tube), 1.0, 1.0) for tube in range(1, 51)])
    return memory_footprint(os.getpid())["private_mb"]
print(-fill(range(1, 11)) + fill(range(11, 51)))
"""


OPENER = """
import os, sys
from groundstation.errors import StoreError
from groundstation.service.disk.ground_store import Store
Store("sqlite://").close()  # everything is imported before the rights are given up
if os.geteuid() == 0:
    os.setuid(65534)
try:
    Store(sys.argv[1])
except StoreError as error:
    print(error)
"""


def survey(tube: int, sequence: int, yaw: float = 1.0) -> SurveyMeasurement:
    imus = (ImuMean((0.1, 0.2, -9.8), COV),)
    return SurveyMeasurement(tube, sequence, 1000.0, 1, imus, yaw, 1e-6, 1e-6, 32, 20.0, NodeFlag.NONE)


def url(folder: Path) -> str:
    return f"sqlite:///{folder / 'ground.sqlite'}"


def test_what_was_added_is_there_after_a_restart_once(tmp_path: Path) -> None:
    store = Store(url(tmp_path))
    assert store.add_message(survey(1, 1), 2.0)
    assert not store.add_message(survey(1, 1), 2.0)
    assert store.add_message(Event(1, 2, 5.0, Severity.WARNING, "yaw_reset", {"yaw_deg": 3.0}), None)
    store.keep_stand(Stand(1, 900.0, 950.0, 2.0))
    store.close()
    with closing(Store(url(tmp_path))) as again:
        assert [(s.message.sequence, s.md) for s in again.messages()] == [(1, 2.0), (2, None)]
        assert not again.add_message(survey(1, 1), 2.0)
        assert again.stands() == [Stand(1, 900.0, 950.0, 2.0)]
        assert again.boots == store.boots + 1


def test_a_tube_that_counts_anew_is_not_taken_for_a_repetition(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        assert store.add_message(survey(1, 1), 2.0)
        assert store.add_message(survey(1, 1, yaw=2.0), 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("acknowledged", [3, 40, 150])
def test_killed_at_any_moment_nothing_acknowledged_is_lost_or_doubled(tmp_path: Path, acknowledged: int) -> None:
    writer = subprocess.Popen([sys.executable, "-c", WRITER, url(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    last = 0
    for line in writer.stdout:
        last = int(line)
        if last >= acknowledged:
            os.kill(writer.pid, signal.SIGKILL)
            break
    rest = writer.stdout.read().split()
    writer.stdout.close()
    writer.wait()
    last = int(rest[-1]) if rest else last
    with closing(Store(url(tmp_path))) as store:
        stored = [s.message.sequence for s in store.messages()]
    assert stored[:last] == list(range(1, last + 1))
    assert len(stored) <= last + 1


@pytest.fixture
def read_only_folder() -> Iterator[Path]:
    """A folder whose parents anybody may pass, unlike those of ``tmp_path``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o555)
        yield folder
        folder.chmod(0o755)


def test_a_read_only_folder_is_named_with_a_remedy(read_only_folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", OPENER, url(read_only_folder)], capture_output=True, text=True, check=True
    )
    assert str(read_only_folder) in done.stdout
    assert "writable --folder" in done.stdout
    assert list(read_only_folder.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    with pytest.raises(StoreError, match="file"):
        Store(url(blocked))


def test_a_file_that_is_no_database_is_named_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "ground.sqlite").write_text("this is a letter, not a database, and it is long enough to be read")
    with pytest.raises(StoreError, match="not a database"):
        Store(url(tmp_path))
    assert (tmp_path / "ground.sqlite").read_text().startswith("this is a letter")


def test_a_database_of_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "ground.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("create table invoices (amount real)")
    before = path.read_bytes()
    with pytest.raises(StoreError, match="got tables invoices"):
        Store(url(tmp_path))
    assert path.read_bytes() == before


@pytest.mark.parametrize("wrong", ["nonsense", "nosuch://somewhere/db", "postgresql+nosuch://me:secret@somewhere/db"])
def test_a_url_that_is_none_is_refused_without_telling_a_password(wrong: str) -> None:
    with pytest.raises(StoreError, match="database URL") as refused:
        Store(wrong)
    assert "secret" not in str(refused.value)


def test_a_disk_that_refuses_is_an_error_of_the_store(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        with closing(sqlite3.connect(tmp_path / "ground.sqlite")) as connection:
            connection.execute("drop table stands")
        for use in (lambda: store.keep_stand(Stand(1, 1.0, 2.0, 2.0)), store.stands):
            with pytest.raises(StoreError, match=r"ground\.sqlite"):
                use()


def test_a_damaged_message_is_passed_over_counted_and_taken_again(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        store.add_message(survey(1, 1), 2.0)
        store.add_message(survey(1, 2), 2.0)
    with closing(sqlite3.connect(tmp_path / "ground.sqlite")) as connection:
        connection.execute("update messages set payload = x'c1' where sequence = 1")
        connection.commit()
    with closing(Store(url(tmp_path))) as again:
        assert [s.message.sequence for s in again.messages()] == [2]
        assert again.damaged == 1
        assert again.add_message(survey(1, 1), 2.0)
        assert sorted(s.message.sequence for s in again.messages()) == [1, 2]


def test_a_database_that_was_removed_takes_nothing_and_says_why(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        store.add_message(survey(1, 1), 2.0)
        for file in tmp_path.glob("ground.sqlite*"):
            file.unlink()
        with pytest.raises(StoreError, match="removed"):
            store.add_message(survey(1, 2), 2.0)
        assert "removed" in store.refusal


def test_a_database_that_cannot_be_written_is_read(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        store.add_message(survey(1, 1), 2.0)
        with closing(sqlite3.connect(tmp_path / "ground.sqlite", isolation_level=None)) as holder:
            holder.execute("begin immediate")  # locks out other writers
            with pytest.raises(StoreError, match="locked"):
                store.add_message(survey(1, 2), 2.0)
            assert store.refusal
            assert [s.message.sequence for s in store.messages()] == [1]
        assert store.add_message(survey(1, 2), 2.0)
        assert store.refusal == ""


def test_the_order_of_the_string_is_kept(tmp_path: Path) -> None:
    with closing(Store(url(tmp_path))) as store:
        assert store.tally() == []
        store.keep_tally([1])
        store.keep_tally([3, 2, 1])
    with closing(Store(url(tmp_path))) as again:
        assert again.tally() == [3, 2, 1]


def test_another_schema_is_refused(tmp_path: Path) -> None:
    Store(url(tmp_path)).close()
    with sqlite3.connect(tmp_path / "ground.sqlite") as connection:
        connection.execute("update meta set value = '99' where name = 'schema'")
    connection.close()
    with pytest.raises(
        StoreError, match="schema 2 or 3 or 4 or 5, got 99; one of a later version is read by that version"
    ):
        Store(url(tmp_path))


def test_what_is_doubtful_of_the_depth_is_kept(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'ground.sqlite'}"
    times = (Stand(1, 0.1, math.inf, 1 / 3), Stand(2, -math.inf, 1e9 + 0.1, 3.25))
    for doubt in (
        DepthDoubt(),
        DepthDoubt((1, 1e9 + 0.1, 3.25)),
        DepthDoubt((2, 0.1, 1 / 3), (1, 2.5)),
        DepthDoubt(None, (2, 1 / 3), times),
        DepthDoubt(None, (2, 1 / 3)),
    ):
        with closing(Store(url)) as store:
            store.keep_depth_doubt(doubt)
        with closing(Store(url)) as store:
            assert store.depth_doubt() == doubt


@pytest.mark.parametrize("name", ["trusted", "doubted"])
@pytest.mark.parametrize("text", ["", "1 2", "1 2 x", "a 2.0 3.0", "1 2.0 3.0 4.0; 5"])
def test_a_doubt_that_cannot_be_read_from_the_database_is_one_plain_error(tmp_path: Path, name: str, text: str) -> None:
    url = f"sqlite:///{tmp_path / 'ground.sqlite'}"
    with closing(Store(url)) as store:
        store.keep_depth_doubt(DepthDoubt((1, 2.0, 3.0), times=(Stand(1, 2.0, 3.0, 4.0),)))
    with closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database, database:
        database.execute("update meta set value = ? where name = ?", (text, f"depth_{name}"))
    with closing(Store(url)) as store, pytest.raises(StoreError, match="expected numbers of the depth"):
        store.depth_doubt()


def test_what_is_stored_takes_no_memory(tmp_path: Path) -> None:
    """The usual cache of SQLite would keep every page that is written, up to 2 MB."""
    run = [sys.executable, "-c", HOARDER, f"sqlite:///{tmp_path / 'base.db'}"]
    grown_mb = float(subprocess.run(run, check=True, capture_output=True, text=True).stdout)
    assert grown_mb < 0.5
