"""Who reads, asks, kills and is shut out while a ground station bears its load, by hand, each beside its clock."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from borechain.client import NoAnswerError
from borechain.load import day, killed, page, readers, shut_out
from groundstation.gateway.page.page_settings import PageSettings
from sim.errors import RigError


class Page(BaseHTTPRequestHandler):
    asked: list[str]

    def do_GET(self) -> None:
        self.asked.append(self.path)
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"{}")

    def log_message(self, *words: object) -> None:
        del words


def test_an_answer_of_the_page_is_asked_by_its_path() -> None:
    Page.asked = []
    with HTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        begun = time.monotonic()
        took = day.answer_seconds(PageSettings("127.0.0.1", server.server_port), "column?moment=3")
        assert 0.0 < took <= time.monotonic() - begun
        server.shutdown()
    assert Page.asked == ["/api/column?moment=3"]


@contextlib.contextmanager
def streaming(*lines: bytes) -> Iterator[tuple[PageSettings, list[bytes]]]:
    """A page whose stream says these lines and ends; with what it was asked."""
    asked: list[bytes] = []

    def serve() -> None:
        with door.accept()[0] as one:
            asked.append(one.recv(4096))
            for line in lines:
                one.sendall(line)

    with socket.create_server(("127.0.0.1", 0)) as door:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield PageSettings("127.0.0.1", door.getsockname()[1]), asked
        thread.join(10.0)


def answer(path: str, **view: Any) -> bytes:
    return b"data: " + json.dumps({"path": path, "answer": view}).encode() + b"\n"


def test_the_first_picture_is_there_with_the_history() -> None:
    with streaming(b"event: answer\n", answer("status"), b": data: x\n\n", answer("history"), b"data: wrong\n") as (
        at,
        asked,
    ):
        assert 0.0 < day.first_picture(at) < 30.0
    assert asked == [b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"]
    with (
        streaming(answer("status")) as (at, _),
        pytest.raises(RigError, match=r"^the page has not shown its history within 30 s$"),
    ):
        day.first_picture(at)


# readers


def test_lines_of_a_stream_are_whole_wherever_it_is_cut_and_end_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        for part in (b"one\ntw", b"o\n\nthr", b"ee\nrest"):
            theirs.sendall(part)
        theirs.shutdown(socket.SHUT_WR)
        assert list(readers.read_lines(ours, time.monotonic() + 30.0)) == [b"one", b"two", b"", b"three"]
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(b"one\n")
        assert list(readers.read_lines(ours, time.monotonic() - 1.0)) == []
        monkeypatch.setattr(readers, "time", SimpleNamespace(monotonic=lambda: 7.0))
        assert list(readers.read_lines(ours, 7.05)) == [b"one"]  # no more is said


def test_only_states_of_tubes_are_late() -> None:
    now = time.monotonic()
    (late,) = readers.state_lateness("nodes/3", {"at_s": now - 2.5})
    assert 2.5 <= late <= 2.5 + time.monotonic() - now
    assert readers.state_lateness("string", {"at_s": now}) == []


def test_a_browser_notes_the_lateness_of_states_and_that_it_has_heard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []
    monkeypatch.setattr(readers, "begin_process", names.append)  # which ends this process with its parent
    monkeypatch.setattr(readers, "time", SimpleNamespace(monotonic=lambda: 50.0))
    out = tmp_path / "browser-1.json"
    lines = (
        answer("verdict"),
        answer("nodes/2", at_s=49.0),
        b'data: {"hole": 1}\n',
        answer("nodes/1", at_s=46.0),
    )
    with streaming(*lines) as (at, _):
        readers.follow_page(at.host, at.port, 80.0, out)
    assert names == ["browser"]
    assert json.loads(out.read_text()) == [1.0, 4.0]
    (tmp_path / "browser-0.json").write_text("[9.0]")
    (tmp_path / "terminal-0.json").write_text("[7.0]")
    assert page.read_lateness(tmp_path, "browser") == [9.0, 1.0, 4.0]


def test_an_empty_answer_ends_its_query() -> None:
    said: list[Any] = []
    query: Any = SimpleNamespace(reply=lambda *given: said.append(given), finish=lambda: said.append("end"))
    readers.answer_empty(query)
    assert said == [("bench/bare", b"{}"), "end"]


def test_every_reader_is_a_process_with_a_file_of_its_own(tmp_path: Path) -> None:
    load = page.Load(7, browsers=2, terminals=1)
    found = page.readers_of(load, "tcp/h:1", PageSettings("h", 8), 99.0, tmp_path)
    assert {name: (spec.target, *spec.arguments) for name, spec in found.items()} == {
        "browser 0": (readers.follow_page, "h", 8, 99.0, tmp_path / "browser-0.json"),
        "browser 1": (readers.follow_page, "h", 8, 99.0, tmp_path / "browser-1.json"),
        "terminal 0": (readers.follow_keys, "tcp/h:1", "load", 99.0, tmp_path / "terminal-0.json"),
        "bare": (readers.answer_nothing, "tcp/h:1", 99.0),
    }
    assert (page.Load().tubes, page.Load().browsers, page.Load().terminals, page.Load().seconds) == (50, 3, 2, 150.0)


def test_readers_and_tubes_are_waited_for_until_all_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "ASK_EVERY_S", 0.0)
    usual = page.HEARD_WITHIN_S
    monkeypatch.setattr(page, "HEARD_WITHIN_S", 0.02)
    (tmp_path / "browser-0.json").touch()
    answers: list[Any] = []

    def get(key: str, _timeout: float) -> list[int]:
        answers.append(key)
        return [1] if len(answers) > 2 else []

    bus: Any = SimpleNamespace(get=get)
    with pytest.raises(RigError, match="browsers and terminals have not heard the ground station within 0 s"):
        page.wait_for_readers(bus, tmp_path, 2)
    assert answers == []  # one that has heard nothing is not asked past
    monkeypatch.setattr(page, "HEARD_WITHIN_S", usual)
    (tmp_path / "terminal-0.json").touch()
    page.wait_for_readers(bus, tmp_path, 2)
    assert answers == ["bench/bare"] * 3
    counts = iter((None, 0, 2, 3))

    def ask(path: str) -> Any:
        assert path == "string"
        if (count := next(counts)) is None:
            raise NoAnswerError("nothing yet")
        return {"tubes": [{}] * count}

    page.wait_for_all(SimpleNamespace(ask=ask), 3)  # type: ignore[arg-type]
    assert next(counts, "all asked") == "all asked"


def test_a_shift_of_questions_in_their_order_with_what_was_not_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by each question: every number of the row has its own."""
    clock = SimpleNamespace(now=100.0, slept=0)

    def sleep(seconds: float) -> None:
        clock.now += seconds
        clock.slept += 1

    monkeypatch.setattr(page, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep))
    monkeypatch.setattr(page, "running_pids", lambda _table: {"other": 1, "base": 77})
    monkeypatch.setattr(page, "memory_footprint", lambda pid: {"private_mb": pid + clock.now / 1000.0})
    monkeypatch.setattr(page, "cpu_seconds", lambda pid: pid / 77 * 0.25 * clock.now)
    asked: list[str] = []

    def ask(path: str) -> Any:
        asked.append(path)
        clock.now += 1.0 if path == "string" else 0.2
        if path == "alarms":
            raise NoAnswerError("none")
        return {"stations": [1] * len(asked)} if path == "stations" else {}

    def get(key: str, _patience: float) -> list[int]:
        assert key == "bench/bare"
        clock.now += 0.05
        return [] if len(asked) == 2 else [1]

    row = page.ask_until(SimpleNamespace(ask=ask), SimpleNamespace(get=get), None, 104.0)  # type: ignore[arg-type]
    names = ["verdict", "string", "stations", "trajectory", "column", "alarms", "nodes/1", "uncertainty"]
    assert asked == [*names, *names][: len(asked)]
    took = [1.0 if path == "string" else 0.2 for path in asked]
    assert clock.slept == len(asked) == 10
    assert row["answer_ms"] == {"count": 10, "p50": 200.0, "p99": 1000.0, "max": 1000.0}
    assert row["bare_ms"] == {"count": 9, "p50": 50.0, "p99": 50.0, "max": 50.0}
    assert (row["unanswered"], row["stations"], row["cpu_percent"]) == (1, 3, 25.0)
    spent = sum(took) + 10 * 0.1
    assert row["memory_s_mb"] == [(0.0, 77.1), (round(spent, 2), 77.1)]


# killed and shut out


class Counting:
    """A string of which every second thing that is handed over is receipted at the next look."""

    def __init__(self) -> None:
        self.handed = self._seen = 0
        self.endpoint = SimpleNamespace(mail=self)
        self.most = 0

    def hand_over(self) -> None:
        self.handed += 1
        self.most = max(self.most, self.outbox_size)

    @property
    def outbox_size(self) -> int:
        return self.handed - self._seen

    @property
    def receipted(self) -> int:
        return self._seen

    def look(self, true: Any) -> None:
        for _ in range(1000):
            if true():
                return
            self._seen = min(self._seen + 1, self.handed)
        raise AssertionError("never")


def test_receipts_are_awaited_with_eight_things_under_way_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    string: Any = Counting()
    monkeypatch.setattr(killed, "wait_until", string.look)
    before = time.monotonic()
    assert before <= killed.first_receipt(string, string.hand_over) <= time.monotonic()
    assert (string.handed, string.receipted) == (8, 1)
    killed.await_receipts(string, string.hand_over, 20)
    assert string.receipted == 21
    assert string.most == 8
    assert killed.KillOutcome(handed=3).is_whole
    assert not killed.KillOutcome(lost=1).is_whole
    assert not killed.KillOutcome(doubled=1).is_whole


def test_what_killed_is_waited_for_a_minute_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    looks = iter((False, False, True))
    killed.wait_until(lambda: next(looks))
    monkeypatch.setattr(killed, "PATIENCE_S", 0.02)
    with pytest.raises(RigError, match="the ground station was killed and has receipted nothing within 0 s"):
        killed.wait_until(lambda: False)
    assert (killed.AT_ONCE, killed.MOST_RECEIPTS) == (8, 40)


def test_one_who_is_shut_out_is_not_answered_while_the_other_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, float]] = []

    def answering(errors: list[Any]) -> Any:
        def get(key: str, patience: float) -> list[Any]:
            asked.append((key, patience))
            return [SimpleNamespace(error=error) for error in errors]

        return SimpleNamespace(get=get)

    assert [shut_out.is_answered(answering(one)) for one in ([], ["no"], [None], ["no", None])] == [
        False,
        False,
        True,
        True,
    ]
    assert set(asked) == {("borechain/shut-out/ground/status", 0.5)}
    order: list[Any] = []
    string: Any = Counting()

    def hand_over() -> None:
        order.append("handed")
        string.hand_over()

    string.one_more = hand_over
    hers, his = answering([None]), answering([None])
    monkeypatch.setattr(shut_out, "revoke_person", lambda *given: order.append(given))

    def wait(true: Any) -> None:
        """She is answered until he is the only one."""
        assert not true()
        his_old, his.get = his.get, answering([]).get
        hers.get = answering([]).get
        assert not true() or order[-1] == "handed"  # none is answered: the router is away
        his.get = his_old
        string.look(true)
        order.append("waited")

    monkeypatch.setattr(shut_out, "wait_until", wait)
    out, goes_on = shut_out.time_until_out(hers, his, tmp_path, "ann", string)
    assert 0.0 <= out <= goes_on
    assert order == [(tmp_path, "ann"), "waited", "handed", "waited"]
    assert string.receipted == string.handed == 1
