"""The page's small rooms by hand: addresses, sessions, bodies, connections that are swept, papers, and its document."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from starlette.requests import Request

from groundstation.errors import ConfigurationError, PageError
from groundstation.gateway.page import sessions as sessions_room
from groundstation.gateway.page.answer_hub import Reader, server_sent_event
from groundstation.gateway.page.page_settings import PageSettings, check_certificate, open_page_socket, parse_address
from groundstation.gateway.page.passwords import (
    drawn_password,
    find_holder,
    hash_of,
    holder_of,
    read_passwords,
    roles_of,
    text_of,
)
from groundstation.gateway.page.request_guard import (
    LARGEST_BODY,
    GuardMiddleware,
    RequestError,
    check_origin,
    json_body,
)
from groundstation.gateway.page.request_guard import text_of as body_text
from groundstation.gateway.page.server import IDLE_S, Sweeper, close_all
from groundstation.gateway.page.sessions import SESSIONS, VALID_S, Sessions, WrongPasswords, WrongRows, is_from

# addresses


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [("127.0.0.1:1", "127.0.0.1", 1), ("[::1]:65535", "::1", 65535), ("rig.local:8080", "rig.local", 8080)],
)
def test_an_address_is_a_host_and_a_port(text: str, host: str, port: int) -> None:
    assert parse_address(text) == (host, port)
    page = PageSettings(host, port)
    shown = f"[{host}]" if ":" in host else host
    assert page.url == f"http://{shown}:{port}"
    assert PageSettings(host, port, certificate=Path("c")).url == f"https://{shown}:{port}"
    local = host != "rig.local"
    assert page.is_local == local
    assert page.names == (("localhost", "127.0.0.1", "[::1]", host) if local else ("*",))


@pytest.mark.parametrize("text", ["a:0", "a:65536", "a:-1", ":80", "a:", "a", "[]:80", "a:8o"])
def test_what_is_no_address_is_refused_with_what_came(text: str) -> None:
    with pytest.raises(
        ConfigurationError, match=r"page: expected HOST:PORT such as 127\.0\.0\.1:8080, got "
    ) as refused:
        parse_address(text)
    assert repr(text) in str(refused.value)


def test_a_port_is_listened_at_and_one_that_is_taken_is_named(tmp_path: Path) -> None:
    listening = open_page_socket(PageSettings("127.0.0.1", 0))
    port = listening.getsockname()[1]
    with socket.create_connection(("127.0.0.1", port), 5.0), pytest.raises(PageError, match=f"page 127.0.0.1:{port}: "):
        open_page_socket(PageSettings("127.0.0.1", port))
    listening.close()
    (tmp_path / "cert").write_text("none")
    for files in ((tmp_path / "cert", tmp_path / "cert"), (tmp_path / "gone", tmp_path / "cert")):
        why = "PEM" if files[0].exists() else "No such file or directory"
        wanted = f"page-tls: expected a certificate and its key in PEM, got {files[0]} and {files[1]}: .*{why}"
        with pytest.raises(ConfigurationError, match=wanted):
            check_certificate(*files)


# sessions


def test_sessions_end_at_exactly_their_time_and_of_too_many_the_oldest_goes() -> None:
    sessions = Sessions()
    made = [sessions.begin("driller", f"n{k}", float(k), "driller/n", "hash") for k in range(SESSIONS + 1)]
    assert sessions.find(made[0].token, 5.0) is None
    assert sessions.find(made[1].token, 1.0 + VALID_S - 1e-3) is made[1]
    assert sessions.find(made[1].token, 1.0 + VALID_S) is None
    assert sessions.find(made[1].token, 5.0) is None  # it is over for good
    assert sessions.find(None, 5.0) is None
    sessions.end(made[2])
    sessions.end(made[2])
    assert sessions.find(made[2].token, 5.0) is None
    one = made[3]
    assert (one.role, one.name, one.ends_at, one.holder, one.hashed) == (
        "driller", "n3", 3.0 + 12 * 3600.0, "driller/n", "hash"
    )  # fmt: skip
    assert [is_from(one, csrf) for csrf in (one.csrf, one.csrf[:-1], "", None, one.token)] == [True] + [False] * 4
    assert len({text for each in made for text in (each.token, each.csrf)}) == 2 * len(made)


def test_each_wrong_password_in_a_row_doubles_the_hold_up_to_half_a_minute() -> None:
    rows, now, holds = WrongRows(), 100.0, []
    for number in range(1, 8):
        row, hold = rows.add("a", now)
        assert row == number
        holds.append(hold)
        assert [rows.hold_of("a", now + later) for later in (0.0, hold, hold + 5.0)] == [hold, 0.0, 0.0]
        now += hold
    assert holds == [1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0]
    assert rows.hold_of("b", now) == 0.0
    rows.forgive("a")
    assert rows.add("a", now) == (1, 1.0)


def test_a_wrong_password_holds_address_and_name_and_the_right_one_frees_both() -> None:
    wrong = WrongPasswords()
    for k in range(3):
        wrong.add("10.0.0.7", 100.0 + k, "driller/anna")
    assert wrong.total == 3
    assert wrong.hold_of("10.0.0.7", 102.0) == 4.0
    assert wrong.hold_of("10.0.0.8", 102.0, "driller/anna") == 4.0
    assert wrong.hold_of("10.0.0.8", 102.0, "driller/ben") == 0.0
    wrong.forgive("10.0.0.8", "driller/anna")
    assert wrong.hold_of("10.0.0.8", 102.0, "driller/anna") == 0.0
    assert wrong.hold_of("10.0.0.7", 102.0, "driller/anna") == 4.0
    wrong.add("10.0.0.9", 103.0, "driller/anna")
    assert wrong.hold_of("10.0.0.8", 103.0, "driller/anna") == 0.0  # it has signed in from there before
    assert wrong.hold_of("10.0.0.6", 103.0, "driller/anna") == 1.0
    wrong.add("10.0.0.5", 103.0)
    assert wrong.hold_of("10.0.0.4", 103.0, "") == 0.0


def test_of_too_many_places_where_a_name_has_signed_in_the_oldest_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions_room, "REMEMBERED", 2)
    wrong = WrongPasswords()
    for host in ("a", "b", "c"):
        wrong.forgive(host, "anna")
    wrong.add("z", 0.0, "anna")
    assert [wrong.hold_of(host, 0.0, "anna") for host in ("a", "b", "c")] == [1.0, 0.0, 0.0]


def test_a_password_is_of_its_holder_alone_and_comes_back_from_its_file(tmp_path: Path) -> None:
    book = {"driller": "x", "driller/anna": "y", "operator/cora": "z"}
    assert roles_of(book) == ["driller", "operator"]
    found = {
        (role, name): find_holder(book, role, name)
        for role in ("driller", "operator")
        for name in ("anna", "ben", "cora", "")
    }
    assert found == {
        ("driller", "anna"): "driller/anna", ("driller", "ben"): "driller", ("driller", "cora"): None,
        ("driller", ""): None if any(h.partition("/")[2] == "" for h in book) else "driller",
        ("operator", "anna"): None, ("operator", "ben"): None, ("operator", "cora"): "operator/cora",
        ("operator", ""): None,
    } | {("driller", ""): found["driller", ""]}  # fmt: skip
    assert [holder_of("driller"), holder_of("driller", "anna")] == ["driller", "driller/anna"]
    file = tmp_path / "passwords"
    file.touch(0o600)
    hashes = {"operator": "$argon2id$b", "driller/anna maria": "$argon2id$a"}
    file.write_text(text_of(hashes))
    assert file.read_text().splitlines()[0] == "driller/anna maria $argon2id$a"
    assert read_passwords(file) == hashes
    for line, number in (("chief $argon2id$a", 1), ("driller plain", 1), ("driller $argon2id$a\nrubbish", 2)):
        file.write_text(line)
        with pytest.raises(ConfigurationError, match=f"line {number}: expected what borechain pki password wrote"):
            read_passwords(file)
    for length, good in ((7, False), (8, True), (256, True), (257, False)):
        if good:
            assert hash_of("p" * length).startswith("$argon2id$v=19$m=65536,t=3,p=1$")
        else:
            with pytest.raises(ConfigurationError, match=f"expected 8 to 256 characters, got {length}"):
                hash_of("p" * length)
    drawn = {drawn_password() for _ in range(5)}
    assert len(drawn) == 5
    assert {tuple(map(len, one.split("-"))) for one in drawn} == {(4, 4, 4, 4)}


# requests


def request(body: bytes = b"{}", chunk: int = 10**6, **headers: str) -> Request:
    """A request whose body comes in pieces."""
    pieces = [body[k : k + chunk] for k in range(0, len(body), chunk)] or [b""]

    async def receive() -> dict[str, Any]:
        piece = pieces.pop(0)
        return {"type": "http.request", "body": piece, "more_body": bool(pieces)}

    sent = {"host": "rig:80", "content-type": "application/json"} | {
        name.replace("_", "-"): value for name, value in headers.items()
    }
    scope = {
        "type": "http", "method": "POST", "path": "/", "query_string": b"", "scheme": "http", "server": ("rig", 80),
        "client": ("10.0.0.7", 5), "headers": [(key.encode(), value.encode()) for key, value in sent.items()],
    }  # fmt: skip
    return Request(scope, receive)


@pytest.mark.parametrize(
    ("headers", "refused"),
    [
        ({}, False), ({"origin": "http://rig:80"}, False), ({"origin": "https://rig:80"}, True),
        ({"origin": "http://rig"}, True), ({"origin": "null"}, True), ({"sec_fetch_site": "same-origin"}, False),
        ({"sec_fetch_site": "none"}, False), ({"sec_fetch_site": "cross-site"}, True),
        ({"origin": "http://rig:80", "sec_fetch_site": "same-site"}, True),
    ],
)  # fmt: skip
def test_a_request_is_of_the_page_itself(headers: dict[str, str], refused: bool) -> None:
    asked = request(b"{}", 10**6, **headers)
    if not refused:
        check_origin(asked)
        return
    with pytest.raises(RequestError, match="expected a request of the page at http://rig:80, got one of ") as told:
        check_origin(asked)
    assert told.value.status == 403


@pytest.mark.parametrize(
    ("body", "content_type", "status"),
    [
        (b'{"a": 1}', "application/json", 0), (b'{"a": 1}', "application/json; charset=utf-8", 0),
        (b'{"a": 1}', "text/plain", 415), (b"[1]", "application/json", 400), (b"", "application/json", 400),
        (b"[" * 9000, "application/json", 400), (b'{"a": 1}'.ljust(LARGEST_BODY), "application/json", 0),
        (b'{"a": 1}'.ljust(LARGEST_BODY + 1), "application/json", 413),
    ],
)  # fmt: skip
def test_a_body_is_an_object_of_at_most_its_size_whatever_pieces_it_comes_in(
    body: bytes, content_type: str, status: int
) -> None:
    for chunk in (10**6, 1000):
        asked = request(body, chunk, content_type=content_type)
        if not status:
            assert asyncio.run(json_body(asked)) == {"a": 1}
            continue
        with pytest.raises(RequestError) as told:
            asyncio.run(json_body(asked))
        assert told.value.status == status


def test_a_text_of_a_body_has_a_length() -> None:
    for value, good in (("", False), ("a", True), ("a" * 5, True), ("a" * 6, False), (5, False), (None, False)):
        if good:
            assert body_text({"x": value}, "x", 5) == value
        else:
            with pytest.raises(RequestError, match="x: expected a text of 1 to 5 characters"):
                body_text({"x": value}, "x", 5)


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_every_answer_has_its_guards(scheme: str) -> None:
    for kept in (None, b"no-cache"):
        sent: list[Any] = []

        async def app(scope: Any, receive: Any, send: Any, kept: bytes | None = kept) -> None:
            headers = [] if kept is None else [(b"cache-control", kept)]
            await send({"type": "http.response.start", "status": 200, "headers": headers})
            await send({"type": "http.response.body", "body": b"x"})

        async def send(message: Any, sent: list[Any] = sent) -> None:
            sent.append(message)

        asyncio.run(GuardMiddleware(app)({"type": "http", "scheme": scheme}, None, send))  # type: ignore[arg-type]
        found = dict(sent[0]["headers"])
        assert found[b"cache-control"] == (kept or b"no-store")
        assert (b"strict-transport-security" in found) == (scheme == "https")
        assert found[b"x-frame-options"] == b"DENY"
        assert b"script-src 'self'" in found[b"content-security-policy"]
        assert "headers" not in sent[1]


# connections


def connection(*, done: bool | None, closing: bool = False) -> Any:
    ended: list[str] = []
    transport = SimpleNamespace(is_closing=lambda: closing, abort=lambda: ended.append("abort"))
    cycle = None if done is None else SimpleNamespace(response_complete=done)
    return SimpleNamespace(transport=transport, cycle=cycle, ended=ended)


class Held(SimpleNamespace):
    def __hash__(self) -> int:  # type: ignore[override]
        return id(self)


def test_a_connection_without_a_request_is_ended_after_exactly_its_time_and_one_at_work_is_not() -> None:
    silent, answered, at_work, leaving = (
        Held(**vars(one))
        for one in (
            connection(done=None), connection(done=True), connection(done=False), connection(done=False, closing=True),
        )
    )  # fmt: skip
    server: Any = SimpleNamespace(server_state=SimpleNamespace(connections={silent, answered, at_work, leaving}))
    sweeper = Sweeper(server)
    for now in (100.0, 105.0, 100.0 + IDLE_S - 0.001):
        sweeper.sweep(now)
        assert [one.ended for one in (silent, answered, at_work, leaving)] == [[]] * 4
    answered.cycle = SimpleNamespace(response_complete=True)  # another request was answered meanwhile
    sweeper.sweep(100.0 + IDLE_S)
    assert [one.ended for one in (silent, answered, at_work, leaving)] == [["abort"], [], [], ["abort"]]
    at_work.cycle.response_complete = True
    sweeper.sweep(200.0)
    sweeper.sweep(200.0 + IDLE_S - 0.001)
    assert at_work.ended == []
    sweeper.sweep(200.0 + IDLE_S)
    assert at_work.ended == ["abort"]
    listeners: list[str] = []
    server.servers = [SimpleNamespace(close=lambda: listeners.append("closed"))]
    before = len(silent.ended)
    close_all(server)
    assert (listeners, len(silent.ended)) == (["closed"], before + 1)


def test_a_reader_is_given_what_changed_once_in_the_order_of_the_first_change() -> None:
    async def follow() -> list[Any]:
        reader, found = Reader(["a", "b"]), list[Any]()
        found.append(reader.take())
        for path in ("c", "a", "c"):
            reader.note(path)
        found.append(await reader.changes(1.0))
        found.append(await reader.changes(0.01))
        reader.close()
        found += [reader.is_closed, await reader.changes(1.0)]
        return found

    assert asyncio.run(follow()) == [["a", "b"], ["c", "a"], [], True, []]
    assert server_sent_event("hello", {"a": 1}) == b'event: hello\ndata: {"a":1}\n\n'
