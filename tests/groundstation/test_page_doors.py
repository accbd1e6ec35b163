"""Who comes in at the page: passwords and sessions, ports and addresses, and what a network asks of them."""

import contextlib
import datetime
import re
import socket
import ssl
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
from hand_fed import Rig
from hypothesis import given
from hypothesis import strategies as st
from page_client import PASSWORD, PageClient, free_port
from sealed_string import make_folder
from served import serving
from starlette.datastructures import Address

from groundstation.errors import ConfigurationError, PageError
from groundstation.gateway.page.connections import CONNECTIONS, OF_ONE_ADDRESS, SignedPeers, those_to_end
from groundstation.gateway.page.page_settings import PageSettings, check_certificate, open_page_socket, parse_address
from groundstation.gateway.page.passwords import drawn_password, hash_of, is_right, read_passwords, text_of
from groundstation.gateway.page.sessions import LONGEST_HOLD_S, SESSIONS, VALID_S, Sessions, WrongPasswords, is_from
from telemetry.errors import KeyFileError

pytestmark = pytest.mark.slow
OPERATOR_PASSWORD = "another long word"
HOUR = 3600.0  # s


@pytest.fixture(scope="module")
def passwords() -> dict[str, str]:
    return {"driller": hash_of(PASSWORD), "operator": hash_of(OPERATOR_PASSWORD)}


@given(st.lists(st.tuples(st.sampled_from("abc"), st.floats(0.0, 60.0)), max_size=40))
def test_each_wrong_password_in_a_row_holds_twice_as_long(tries: list[tuple[str, float]]) -> None:
    wrong, now = WrongPasswords(), 1000.0
    held: dict[str, list[float]] = {}
    for address, wait in tries:
        now += wait
        if wrong.hold_of(address, now) == 0.0:
            row, hold = wrong.add(address, now)
            held.setdefault(address, []).append(hold)
            assert row == len(held[address])
            assert wrong.hold_of(address, now) == pytest.approx(hold)
    for holds in held.values():
        assert all(later == min(2.0 * earlier, LONGEST_HOLD_S) for earlier, later in pairwise(holds))
    assert wrong.total == sum(map(len, held.values()))


def test_sessions_end_after_a_shift_and_are_bounded() -> None:
    sessions = Sessions()
    first = sessions.begin("driller", "anna", 0.0)
    assert sessions.find(first.token, VALID_S - 1.0) == first
    assert sessions.find(first.token, VALID_S) is None
    assert sessions.find(None, 0.0) is None
    made = [sessions.begin("driller", "anna", 0.0) for _ in range(SESSIONS + 1)]
    assert sessions.find(made[0].token, 0.0) is None
    assert sessions.find(made[1].token, 0.0) == made[1]
    assert is_from(made[1], made[1].csrf)
    assert not is_from(made[1], made[2].csrf)
    assert not is_from(made[1], None)


def test_passwords_are_kept_as_hashes_in_a_private_file(tmp_path: Path, passwords: dict[str, str]) -> None:
    drawn = drawn_password()
    assert re.fullmatch(r"([a-z2-9]{4}-){3}[a-z2-9]{4}", drawn)
    assert not is_right(drawn, passwords["driller"])
    assert is_right(PASSWORD, passwords["driller"])
    file = tmp_path / "passwords"
    file.touch(0o600)
    file.write_text(text_of(passwords))
    assert read_passwords(file) == passwords
    assert PASSWORD not in file.read_text()
    file.write_text("driller plain\n")
    with pytest.raises(ConfigurationError, match="line 1: expected what borechain pki password wrote"):
        read_passwords(file)
    file.chmod(0o644)
    with pytest.raises(KeyFileError):
        read_passwords(file)
    with pytest.raises(ConfigurationError, match="8 to 256 characters, got 5"):
        hash_of("short")


def test_a_port_that_is_taken_is_told_with_the_remedy() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = PageSettings("127.0.0.1", other.getsockname()[1])
        with pytest.raises(PageError, match=r"Address already in use; choose another with --page 127\.0\.0\.1:PORT"):
            open_page_socket(taken)


@pytest.mark.parametrize("wrong", ["", "8080", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:99999", "127.0.0.1:http"])
def test_an_address_that_is_none_is_refused(wrong: str) -> None:
    with pytest.raises(ConfigurationError, match="page: expected HOST:PORT"):
        parse_address(wrong)


def test_addresses_know_whether_they_are_of_this_machine_alone() -> None:
    assert parse_address("[::1]:8080") == ("::1", 8080)
    assert PageSettings("::1", 8080).url == "http://[::1]:8080"
    assert [PageSettings(host, 80).is_local for host in ("127.0.0.1", "localhost", "::1", "0.0.0.0", "10.0.0.7")] == [
        True, True, True, False, False,
    ]  # fmt: skip


def test_over_a_network_reading_needs_a_session_too(tmp_path: Path, passwords: dict[str, str]) -> None:
    rig, port = Rig(tmp_path, target=20.0), free_port()
    with serving(rig, PageSettings("0.0.0.0", port, passwords=passwords)):
        page = PageClient(port)
        for address in ("/api/status", "/api/stream"):
            assert page.get(address).status == 401
        assert page.get("/").status == 200
        assert page.sign_in("operator", OPERATOR_PASSWORD).status == 200
        assert page.get("/api/status").status == 200


def test_over_https_the_cookie_goes_nowhere_else(tmp_path: Path, passwords: dict[str, str]) -> None:
    stick, port = make_folder(tmp_path / "stick", now=datetime.datetime.now(datetime.UTC)), free_port()
    certificate, key = stick / "router.pem", stick / "router.key"
    check_certificate(certificate, key)
    with pytest.raises(ConfigurationError, match="page-tls: expected a certificate and its key"):
        check_certificate(key, certificate)
    context = ssl.create_default_context(cafile=stick / "ca.pem")
    context.check_hostname = False
    page = PageSettings("127.0.0.1", port, certificate, key, passwords)
    assert page.url == f"https://127.0.0.1:{port}"
    with serving(Rig(tmp_path / "ground", target=20.0), page):
        client = PageClient(port, context=context)
        answer = client.sign_in()
        assert "; Secure" in answer.headers["set-cookie"]
        assert answer.headers["strict-transport-security"].startswith("max-age=")
        assert client.get("/api/session").content["orders"]


def test_a_person_signs_in_with_a_password_of_its_own_and_is_out_when_it_is_taken_away(tmp_path: Path) -> None:
    hers, shared = "the word of anna", OPERATOR_PASSWORD
    book = {"driller/anna": hash_of(hers), "driller": hash_of(PASSWORD), "operator": hash_of(shared)}
    file, port = tmp_path / "passwords", free_port()
    file.touch(0o600)
    file.write_text(text_of(book))
    page = PageSettings("127.0.0.1", port, passwords=read_passwords(file), password_file=file)
    with serving(Rig(tmp_path, target=20.0), page):
        anna, ben = PageClient(port), PageClient(port)
        assert anna.sign_in("driller", hers, "anna").status == 200
        assert ben.sign_in("driller", PASSWORD, "ben").status == 200
        assert anna.get("/api/session").content["roles"] == ["driller", "operator"]
        for role, word in (("driller", PASSWORD), ("operator", shared)):  # another's word under her name
            imposter = PageClient(port)
            deadline = time.monotonic() + 60.0
            while (refused := imposter.sign_in(role, word, "anna").status) == 429:
                assert time.monotonic() < deadline
            assert refused == 401
        with following(port, anna) as stream:
            del book["driller/anna"]
            file.write_text(text_of(book))
            assert anna.get("/api/session").content["role"] is None
            assert anna.post("/api/cmd/take_survey", {"tube": 1}).status == 401
            while stream.recv(65_536):  # it ends
                pass
        assert ben.get("/api/session").content["name"] == "ben"
        file.write_text("driller plain\n")
        assert ben.get("/api/session").content["role"] is None
        told = ben.post("/api/session", {"role": "driller", "name": "ben", "password": PASSWORD})
        assert (told.status, "line 1: expected what borechain pki password wrote" in told.content["error"]) == (
            403,
            True,
        )


@contextlib.contextmanager
def following(port: int, client: PageClient) -> Iterator[socket.socket]:
    """A stream with a client's session."""
    with socket.create_connection(("127.0.0.1", port), 60.0) as connection:
        lines = f"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: {client.headers['cookie']}\r\n\r\n"
        connection.sendall(lines.encode())
        assert connection.recv(65_536)
        yield connection


@pytest.mark.parametrize("names", [["a"] * 20, ["a", "b"] * 10])
def test_a_name_is_held_from_every_address_but_where_it_has_signed_in(names: list[str]) -> None:
    wrong, now = WrongPasswords(), 1000.0
    wrong.forgive("crew", "a")
    for number, name in enumerate(names):
        wrong.add(f"stranger {number}", now, name)
    assert wrong.hold_of("another", now, "a") > 10.0
    assert wrong.hold_of("crew", now, "a") == 0.0
    assert wrong.hold_of("another", now, "c") == 0.0
    assert wrong.hold_of("stranger 3", now, "c") == 1.0


@dataclass
class Connected:
    """What a protocol is to those who make room."""

    client: tuple[str, int]
    opened: int
    is_busy: bool = False


@given(
    st.lists(st.tuples(st.sampled_from("abcdef"), st.booleans(), st.booleans()), max_size=400),
)
def test_one_more_connection_finds_a_place_and_nobody_who_is_signed_in_gives_way(
    rows: list[tuple[str, bool, bool]],
) -> None:
    signed, there = SignedPeers(), []
    for number, (of, is_busy, has_session) in enumerate(rows):
        fresh = Connected((of, number), number, is_busy)
        if has_session and len(signed) < 100:
            signed.add(Address(of, number))
        there.append(fresh)
        gone = those_to_end(there, fresh, signed)  # type: ignore[arg-type, type-var]
        assert fresh not in gone
        assert not any(one.client in signed for one in gone)
        for one in gone:  # one that stays at its address has a request, or came later
            assert all(
                (one.is_busy, one.opened) < (other.is_busy, other.opened)
                for other in there
                if other not in gone
                and other is not fresh
                and other.client not in signed
                and other.client[0] == one.client[0]
            )
        there = [one for one in there if one not in gone]
        assert len(there) <= CONNECTIONS
        assert sum(one.client[0] == of and one.client not in signed for one in there) <= OF_ONE_ADDRESS
