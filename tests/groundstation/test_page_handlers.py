"""What the page lets whom do, asked of its handlers themselves: every door open for one and closed for the next."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hand_fed import Rig
from starlette.requests import Request
from starlette.responses import Response

from groundstation.gateway.page import answer_hub
from groundstation.gateway.page.answer_hub import READERS, UNSIGNED_OF_ONE, Hub, Reader
from groundstation.gateway.page.connections import (
    CONNECTIONS,
    OF_ONE_ADDRESS,
    BoundedProtocol,
    SignedPeers,
    protocol_with,
    those_to_end,
)
from groundstation.gateway.page.page_handlers import PageHandlers, parameter_text
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import hash_of, text_of
from groundstation.gateway.page.request_guard import RequestError

WORDS = {"driller": "a driller's word", "operator": "an operator's word", "driller/anna": "anna's own word"}


@pytest.fixture(scope="module")
def hashes() -> dict[str, str]:
    return {holder: hash_of(word) for holder, word in WORDS.items()}


class Page:
    """Handlers of a rig's page, asked without a server."""

    def __init__(self, folder: Path, hashes: dict[str, str], host: str = "127.0.0.1") -> None:
        self.rig = Rig(folder / "ground")
        self.file = folder / "passwords"
        self.file.touch(0o600)
        self.file.write_text(text_of(hashes))
        settings = PageSettings(host, 80, passwords=hashes, password_file=self.file)
        self.hub, self.signed = Hub(self.rig.ground), SignedPeers()
        self.handlers = PageHandlers(self.rig.ground, settings, self.hub, self.signed, "b", "1")

    def ask(
        self, handler: str, body: Any = None, headers: dict[str, str] | None = None, query: str = "", **path: str
    ) -> tuple[int, Any, str]:
        """Status, content, and the cookie that is set."""
        content = b"" if body is None else json.dumps(body).encode()

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": content, "more_body": False}

        sent = {"host": "h", "content-type": "application/json"} | (headers or {})
        scope = {
            "type": "http", "method": "POST", "path": "/", "query_string": query.encode(), "scheme": "http",
            "server": ("h", 80), "client": ("10.0.0.7", 1234), "path_params": path,
            "headers": [(key.encode(), value.encode()) for key, value in sent.items()],
        }  # fmt: skip

        async def answered() -> Response:
            found: Response = await getattr(self.handlers, handler)(Request(scope, receive))
            return found

        try:
            response = asyncio.run(answered())
        except RequestError as error:
            return error.status, error.line, ""
        return response.status_code, json.loads(bytes(response.body)), response.headers.get("set-cookie", "")

    def sign_in(self, role: str, name: str, word: str) -> tuple[int, dict[str, str], str]:
        """Status, headers of the session, and its cookie."""
        status, content, cookie = self.ask("sign_in", {"role": role, "name": name, "password": word})
        self.handlers._wrong.__init__()  # type: ignore[misc]
        if status != 200:
            return status, {}, str(content)
        return status, {"cookie": cookie.partition(";")[0], "x-csrf-token": content["csrf"]}, cookie


@pytest.fixture
def page(tmp_path: Path, hashes: dict[str, str]) -> Iterator[Page]:
    made = Page(tmp_path, hashes)
    yield made
    made.rig.ground.close()


@pytest.mark.parametrize(
    ("role", "name", "word", "status"),
    [
        ("driller", "ben", "driller", 200), ("driller", "ben", "operator", 401), ("operator", "ben", "operator", 200),
        ("driller", "anna", "driller/anna", 200), ("driller", "anna", "driller", 401),
        # anna has a word of her own as a driller: as an operator there is none for her, least of all another's
        ("operator", "anna", "operator", 401), ("operator", "anna", "driller/anna", 401),
        ("chief", "ben", "driller", 401),
    ],
)  # fmt: skip
def test_a_word_opens_its_own_role_and_name_alone(page: Page, role: str, name: str, word: str, status: int) -> None:
    found, headers, cookie = page.sign_in(role, name, WORDS[word])
    assert found == status
    if status == 200:
        parts = {part.strip().lower() for part in cookie.split(";")[1:]}
        assert {"httponly", "samesite=strict", "path=/"} <= parts
        assert "secure" not in parts
        _, told, _ = page.ask("session", headers=headers)
        assert (told["role"], told["name"], told["orders"]) == (role, name, role == "driller")


def test_only_a_driller_orders_by_the_token_of_the_session_and_in_its_own_name(page: Page) -> None:
    _, driller, _ = page.sign_in("driller", "ben", WORDS["driller"])
    _, operator, _ = page.sign_in("operator", "cora", WORDS["operator"])
    told = {"action": "tell", "angle_deg": 12.3456789, "sigma_deg": 1.5, "by": "a stranger"}
    for headers, status in (
        ({}, 401), (operator, 403), (driller | {"x-csrf-token": "x"}, 403), ({"cookie": driller["cookie"]}, 403),
        (driller | {"x-csrf-token": operator["x-csrf-token"]}, 403), (driller | {"origin": "http://other"}, 403),
        ({"cookie": "borechain=x", "x-csrf-token": driller["x-csrf-token"]}, 401), (driller, 200),
    ):  # fmt: skip
        found, answer, _ = page.ask("order", told, headers, name="north")
        assert found == status, answer
    order = answer
    assert (order["by"], order["command"], order["state"]) == ("ben", "north", "done")
    assert page.rig.ground.model.setup.entries[-1].values[0] == pytest.approx(0.2154727, abs=1e-5)
    assert len(page.rig.ground.model.setup.entries) == 1


def test_an_order_that_waits_for_its_tube_is_accepted_and_not_yet_done(page: Page) -> None:
    _, driller, _ = page.sign_in("driller", "ben", WORDS["driller"])
    page.rig.speak(1)
    found, order, _ = page.ask("order", {"tube": 1}, driller, name="take_survey")
    assert (found, order["state"]) == (202, "sent")
    assert page.ask("order", {"tube": 99}, driller, name="nothing")[0] == 400


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_over_a_network_who_reads_has_a_session_that_stands(tmp_path: Path, hashes: dict[str, str], host: str) -> None:
    page = Page(tmp_path, hashes, host)
    local = host == "127.0.0.1"
    _, headers, _ = page.sign_in("operator", "ben", WORDS["operator"])
    for cookie, status in (
        ({}, 200 if local else 401), ({"cookie": "borechain=made-up"}, 200 if local else 401), (headers, 200),
    ):  # fmt: skip
        assert page.ask("answer", headers=cookie, path="status")[0] == status
    assert page.ask("session", headers={})[1]["reads"] == local
    assert page.ask("sign_out", headers=headers)[0] == 200
    assert page.ask("answer", headers=headers, path="status")[0] == (200 if local else 401)
    page.rig.ground.close()


def test_a_session_ends_with_its_password_for_good(page: Page, hashes: dict[str, str]) -> None:
    _, headers, _ = page.sign_in("driller", "ben", WORDS["driller"])
    assert page.ask("session", headers=headers)[1]["orders"]
    assert len(page.signed) == 1
    for kept in ({"operator": hashes["operator"]}, hashes):  # and the old one comes back
        page.file.write_text(text_of(kept))
        assert page.ask("session", headers=headers)[1]["role"] is None
    assert page.ask("order", {}, headers, name="north")[0] == 401
    page.file.write_text("nonsense")
    assert page.ask("sign_in", {"role": "driller", "name": "ben", "password": WORDS["driller"]})[0] == 403


@pytest.mark.parametrize(
    ("value", "text"),
    [("a", "a"), (3, "3"), (1.5, "1.5"), (0.000123, "0.000123"), (1e-9, "1e-09"), (123456.0, "123456")],
)
def test_a_number_of_a_body_is_written_with_all_that_it_has(value: Any, text: str) -> None:
    assert parameter_text("x", value) == text
    for wrong in (True, None, [1], {}):
        with pytest.raises(RequestError, match="expected a text or a number"):
            parameter_text("x", wrong)


# who follows


def events(packet: bytes) -> dict[str, Any]:
    """Answers of a packet by their path."""
    found = {}
    for part in packet.decode().split("\n\n"):
        if part.startswith("event: answer"):
            content = json.loads(part.partition("data: ")[2])
            found[content["path"]] = content["answer"]
    return found


def test_a_reader_is_given_the_whole_picture_first_and_then_each_change_as_it_is(page: Page) -> None:
    reader = page.hub.join()
    assert reader is not None
    whole = events(page.hub.packet(reader.take()))
    on_page = {path for path, one in answer_hub.answered_paths(page.rig.ground.model).items() if one.answer.on_page}
    assert set(whole) == on_page - {"verdict"}  # no verdict of before
    assert reader.take() == []
    for times in (1, 2):
        page.rig.speak(1)
        page.rig.run(2.0)
        changed = reader.take()
        assert len(changed) == len(set(changed))
        assert {"string", "verdict", "nodes/1"} <= set(changed)
        new, now = events(page.hub.packet(changed)), {"utc": ""}
        for path in changed:
            assert new[path] | now == json.loads(page.rig.ground.operator.ask_json(path)) | now, (times, path)
        assert new["string"]["revision"] > whole["string"]["revision"]
        assert reader.take() == []


async def test_a_reader_waits_for_a_change_and_is_not_woken_by_one_that_it_has() -> None:
    reader = Reader(["a"])
    assert reader.take() == ["a"]
    assert await reader.changes(0.01) == []
    for path in ("b", "c"):
        reader.note(path)
        reader.note(path)
        assert await reader.changes(10.0) == [path]
        assert await reader.changes(0.01) == []
        assert not reader._woken.is_set()  # or it would look again and again
    many = [f"nodes/{k}" for k in range(300)]
    assert Reader(many).take() == many


def test_places_are_given_up_by_the_oldest_stranger_first(page: Page) -> None:
    strangers = [page.hub.join(f"10.0.{k}.1") for k in range(READERS)]
    assert page.hub.join("10.9.9.9") is None
    for place in range(3):
        assert page.hub.join("10.9.9.9", is_signed=True) is not None
        assert [one.is_closed for one in strangers[:4] if one is not None] == [k <= place for k in range(4)]
    own = Hub(page.rig.ground)
    there = [own.join("10.0.0.7") for _ in range(UNSIGNED_OF_ONE + 1)]
    assert [one is not None for one in there] == [True] * UNSIGNED_OF_ONE + [False]


def peers(counts: dict[str, int], busy: range = range(0)) -> list[Any]:
    made = []
    for host, count in counts.items():
        for _ in range(count):
            number = len(made)
            made.append(SimpleNamespace(client=(host, number), is_busy=number in busy, opened=number))
    return made


@pytest.mark.parametrize(
    ("counts", "gone"),
    [
        ({"a": OF_ONE_ADDRESS - 1, "b": 3}, []), ({"a": OF_ONE_ADDRESS, "b": 3}, [0]),
        ({"a": OF_ONE_ADDRESS + 2, "b": 3}, [0, 1, 2]),
        ({f"h{k}": 40 for k in range(4)} | {"b": CONNECTIONS - 161}, []),
        ({f"h{k}": 40 for k in range(4)} | {"b": CONNECTIONS - 160}, [0]),
        ({f"h{k}": 40 for k in range(4)} | {"b": CONNECTIONS - 159}, [0, 1]),
    ],
)  # fmt: skip
def test_connections_give_way_from_exactly_their_number_on_the_oldest_first(
    counts: dict[str, int], gone: list[int]
) -> None:
    others = peers(counts)
    fresh = SimpleNamespace(client=("a", 9999), is_busy=False, opened=10**6)
    found = those_to_end([*others, fresh], fresh, SignedPeers())  # type: ignore[list-item, arg-type]
    assert [one.opened for one in found] == gone
    signed = SignedPeers()
    for number in gone:
        signed.add(SimpleNamespace(host=others[number].client[0], port=others[number].client[1]))  # type: ignore[arg-type]
    after = those_to_end([*others, fresh], fresh, signed)  # type: ignore[list-item, arg-type]
    assert not {one.opened for one in after} & set(gone)


def test_a_connection_that_has_ended_is_signed_in_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another one may come from the same port."""
    signed = SignedPeers()
    for _ in range(2):
        signed.add(SimpleNamespace(host="10.0.0.7", port=5))  # type: ignore[arg-type]
        assert ("10.0.0.7", 5) in signed
        ended: Any = protocol_with(signed).__new__(protocol_with(signed))
        ended.client = ("10.0.0.7", 5)
        monkeypatch.setattr(BoundedProtocol.__mro__[1], "connection_lost", lambda _self, _error: None)
        ended.connection_lost(None)
        assert ("10.0.0.7", 5) not in signed
    assert len(signed) == 0
