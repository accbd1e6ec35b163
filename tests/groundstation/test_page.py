"""The page's addresses on a real ground station: the keys over HTTP, orders by role, and what is refused."""

import asyncio
import contextlib
import csv
import json
import re
import select
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import pytest
from hand_fed import Rig
from page_client import PASSWORD, PATIENCE, PageClient, free_port
from served import Served, serving

from groundstation.gateway.page.application import FILES
from groundstation.gateway.page.openapi import openapi_document
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import hash_of
from groundstation.gateway.page.server import SERVER_TASK
from groundstation.gateway.page.sessions import Sessions
from groundstation.service.answers.answer_table import PATTERNS
from telemetry.application.commands import COMMANDS

pytestmark = pytest.mark.slow
OPERATOR_PASSWORD = "another long word"
HOUR = 3600.0  # s


@pytest.fixture(scope="module")
def passwords() -> dict[str, str]:
    return {"driller": hash_of(PASSWORD), "operator": hash_of(OPERATOR_PASSWORD)}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, passwords: dict[str, str]) -> Iterator[tuple[Served, int]]:
    """A hole of 20 m whose end is out of half its tolerance, with one alarm."""
    rig = Rig(tmp_path_factory.mktemp("ground"), target=20.0)
    rig.run(5.0)
    for stop, inclination_deg in ((1, 0.3), (2, 0.3), (3, 2.2)):
        rig.drill(stop, inclination_deg)
    port = free_port()
    with serving(rig, PageSettings("127.0.0.1", port, passwords=passwords)) as served:
        yield served, port


@pytest.fixture
def page(served: tuple[Served, int]) -> PageClient:
    return PageClient(served[1])


def test_every_key_is_answered_over_http_by_the_schema_of_the_bus(page: PageClient) -> None:
    described = page.get("/api/openapi.json").content
    schemas = page.get("/api/schema").content["schemas"]
    numbers = {"nodes/{tube}": "1", "stations/{n}": "2", "stations/{n}/measurements": "2"}
    assert page.sign_in().status == 200
    order = page.post("/api/cmd/accept_joints", {"action": "confirm"}).content["order"]
    for pattern in PATTERNS:
        number = numbers.get(pattern, str(order))
        answer = page.get("/api/" + re.sub(r"\{[a-z]+\}", number, pattern))
        assert answer.status == 200, (pattern, answer.content)
        jsonschema.validate(answer.content, schemas[pattern])
        operation = described["paths"][f"/api/{pattern}"]["get"]
        assert operation["responses"]["200"]["content"]["application/json"]["schema"] == schemas[pattern]


def test_parameters_are_those_of_the_keys(page: PageClient) -> None:
    assert [row["md_m"] for row in page.get("/api/stations?md=3..5").content["stations"]] == [4.0]
    refused = page.get("/api/stations?depth=3")
    assert (refused.status, refused.content["error"]) == (400, "parameter depth: expected one of md")
    assert "expected a number or a range" in page.get("/api/stations?md=deep").content["error"]
    unknown = page.get("/api/stations/99")
    assert (unknown.status, unknown.content["error"].endswith("there are 1, 2, 3")) == (404, True)
    assert "no such path; expected one of status, verdict" in page.get("/api/nonsense").content["error"]
    assert page.get("/nonsense").status == 404
    assert page.post("/api/status", {}).status == 405


def test_an_answer_with_rows_is_had_as_a_table(page: PageClient) -> None:
    stations = page.get("/api/stations?md=3..7").content["stations"]
    table = page.get("/api/tables/stations.csv?md=3..7")
    assert table.headers["content-type"] == "text/csv; charset=utf-8"
    assert table.headers["content-disposition"] == 'attachment; filename="rig-1-stations.csv"'
    rows = list(csv.DictReader(table.body.decode().splitlines()))
    assert [{name: float(value) for name, value in row.items()} for row in rows] == stations
    surveys = list(csv.DictReader(page.get("/api/tables/measurements.csv").body.decode().splitlines()))
    assert [row["tube"] for row in surveys] == ["1", "1", "1"]
    assert {"flags", "trust", "yaw_deg"} <= surveys[0].keys()
    nested = list(csv.DictReader(page.get("/api/tables/uncertainty.csv").body.decode().splitlines()))
    assert float(nested[-1]["plan_ellipse.major_m"]) > 0.0
    assert "no table" in page.get("/api/tables/status.csv").content["error"]
    assert page.get("/api/tables/nonsense.csv").status == 404
    assert page.get("/api/tables/stations.csv?depth=3").status == 400


def test_a_page_that_was_open_for_a_day_is_asked_for_its_role_again() -> None:
    """Sessions are looked up by the time of now, which a test gives: twelve hours are a shift, a day is two."""
    sessions = Sessions()
    session = sessions.begin("driller", "anna", 0.0)
    assert sessions.find(session.token, 8 * HOUR) == session
    assert sessions.find(session.token, 24 * HOUR) is None
    assert sessions.begin("driller", "anna", 24 * HOUR).token != session.token


def test_the_document_describes_every_command_with_its_ranges() -> None:
    paths = openapi_document("1")["paths"]
    for spec in COMMANDS:
        schema = paths[f"/api/cmd/{spec.name}"]["post"]["requestBody"]["content"]["application/json"]["schema"]
        schemas = schema.get("oneOf", [schema])
        (own,) = [one for one in schemas if one["properties"].get("action", {}).get("const", "") == spec.action]
        assert len(own["properties"]) == len(spec.arguments) + 1
    for operations in paths.values():
        for operation in operations.values():
            for response in operation["responses"].values():
                for content in response["content"].values():
                    jsonschema.Draft202012Validator.check_schema(content["schema"])
    names = [operation["operationId"] for operations in paths.values() for operation in operations.values()]
    assert len(names) == len(set(names))


def test_reading_is_open_here_and_ordering_is_not(page: PageClient) -> None:
    assert page.get("/api/session").content | {"csrf": None} == {
        "role": None, "name": None, "csrf": None, "reads": True, "orders": False, "roles": ["driller", "operator"],
    }  # fmt: skip
    refused = page.post("/api/cmd/take_survey", {"tube": 1})
    assert (refused.status, refused.content["error"]) == (401, "sign in to order: reading alone needs no role here")
    assert page.sign_in("operator", OPERATOR_PASSWORD).status == 200
    refused = page.post("/api/cmd/take_survey", {"tube": 1})
    assert (refused.status, "the role operator reads" in refused.content["error"]) == (403, True)
    refused = page.post("/api/cmd/north", {"action": "tell", "angle_deg": 90, "sigma_deg": 1})
    assert (refused.status, "the role operator reads" in refused.content["error"]) == (403, True)
    north = next(row for row in page.get("/api/setup").content["items"] if row["item"] == "north")
    assert (north["value"], north["detail"]) == ([0.0], "configuration")


def test_a_driller_orders_and_the_course_is_on_the_key(page: PageClient) -> None:
    signed = page.sign_in()
    assert re.fullmatch(r"borechain=[\w-]{43}; HttpOnly; Path=/; SameSite=strict", signed.headers["set-cookie"])
    alarm = page.get("/api/alarms").content["open"][0]
    done = page.post("/api/cmd/alarm?wait=true", {"action": "acknowledge", "number": alarm["number"], "by": "eve"})
    assert (done.status, done.content["state"], done.content["by"]) == (200, "done", "anna")
    assert page.get("/api/alarms").content["open"][0]["acknowledged_by"] == "anna"
    sent = page.post("/api/cmd/take_survey", {"tube": 1})
    assert (sent.status, sent.content["state"]) == (202, "sent")
    assert page.get(f"/api/orders/{sent.content['order']}").content["command"] == "take_survey"
    refused = page.post("/api/cmd/take_survey", {"tube": 99})
    assert (refused.status, refused.content["error"]) == (400, "tube 99: not in the string; expected one of 3, 2, 1")
    assert page.post("/api/cmd/take_survey", {"tube": [1]}).content["error"] == "tube: expected a text or a number"
    assert page.ask("DELETE", "/api/session").content["role"] is None
    assert page.post("/api/cmd/take_survey", {"tube": 1}).status == 401


def test_an_order_of_another_page_is_refused(page: PageClient) -> None:
    assert page.sign_in().status == 200
    own = f"http://127.0.0.1:{page.port}"
    order = ("/api/cmd/accept_joints", {"action": "confirm"})
    assert page.post(*order, origin=own).status == 200
    assert page.post(*order, origin="http://evil.example").status == 403
    assert page.post(*order, **{"sec-fetch-site": "cross-site"}).status == 403
    assert page.post(*order, **{"x-csrf-token": "guessed"}).status == 403
    assert page.post(*order, **{"content-type": "text/plain"}).status == 415
    assert page.get("/api/status", host="evil.example").status == 400  # a name that was led to this address
    assert page.post("/api/session", {}, origin="http://evil.example").status == 403


def sign_in_request(password: str) -> bytes:
    body = json.dumps({"role": "driller", "name": "anna", "password": password})
    kind = f"Content-Type: application/json\r\nContent-Length: {len(body)}"
    return f"POST /api/session HTTP/1.1\r\nHost: 127.0.0.1\r\n{kind}\r\n\r\n{body}".encode()


def test_a_wrong_password_is_told_counted_and_slow(served: tuple[Served, int], page: PageClient) -> None:
    """The right one comes in one write with the wrong one, so that no time passes between the two."""
    counters = served[0].rig.ground.endpoint.counters
    before = counters["wrong_passwords"]
    with socket.create_connection(("127.0.0.1", page.port), PATIENCE) as connection:
        connection.sendall(sign_in_request("not the password") + sign_in_request(PASSWORD))
        data = read_until(connection, b"wait 1 s")
    assert re.findall(rb"HTTP/1.1 (\d+)", data) == [b"401", b"429"]
    assert b"wrong password or role; the next try is looked at in 1 s" in data
    assert b"retry-after: 1\r\n" in data
    assert b"too soon after a wrong password; wait 1 s" in data
    assert counters["wrong_passwords"] == before + 1
    (told,) = [row for row in page.get("/api/alarms").content["rig"] if row["code"] == "wrong_password"]
    assert (told["level"], told["count"]) == ("notice", before + 1)
    assert told["detail"] == f"{before + 1} since the ground station started, the last from 127.0.0.1"
    deadline = time.monotonic() + PATIENCE
    while page.sign_in().status == 429:
        assert time.monotonic() < deadline
    assert page.get("/api/session").content["orders"]


def test_bodies_that_are_too_long_or_no_object_are_refused_in_a_line(page: PageClient) -> None:
    page.sign_in()
    assert page.post("/api/session", b"x" * 100_000).status == 413
    for body in (b"", b"[]", b"{", b"[" * 10_000, b"\xff\xfe"):
        refused = page.post("/api/session", body)
        assert (refused.status, refused.content["error"]) == (400, "expected an object in JSON"), body
    assert "role: expected a text" in page.post("/api/session", {"role": 7}).content["error"]
    unprintable = {"role": "driller", "name": "an\nna", "password": PASSWORD}
    assert "name: expected a name of" in page.post("/api/session", unprintable).content["error"]


def test_every_answer_keeps_other_pages_out(page: PageClient) -> None:
    for address in ("/", "/api/status", "/api/nonsense", "/static/js/main.js"):
        headers = page.get(address).headers
        assert "default-src 'none'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cache-control"] in ("no-store", "no-cache")
        assert "server" not in headers


def events_of(data: bytes) -> list[tuple[str, dict[str, object]]]:
    found = re.findall(r"event: (\w+)\ndata: (.+)\n\n", data.decode())
    return [(kind, json.loads(content)) for kind, content in found]


@contextlib.contextmanager
def stream(port: int) -> Iterator[socket.socket]:
    with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
        connection.sendall(b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        yield connection


def read_until(connection: socket.socket, wanted: bytes) -> bytes:
    data = b""
    while wanted not in data:
        part = connection.recv(65_536)
        assert part, data
        data += part
    return data


def test_a_stream_begins_with_the_whole_picture_and_goes_on_with_what_changes(served: tuple[Served, int]) -> None:
    with stream(served[1]) as connection:
        served[0].do(lambda rig: rig.run(1.0))
        data = read_until(connection, b'"path":"verdict"')
        kinds = events_of(data)
        assert kinds[0][0] == "hello"
        paths = {str(content["path"]) for kind, content in kinds if kind == "answer"}
        assert {"status", "string", "column", "alarms", "orders", "nodes/1", "nodes/3"} <= paths
        served[0].do(lambda rig: rig.tell(1, 3))
        served[0].do(lambda rig: rig.run(1.0))
        assert b'"mode"' in read_until(connection, b'"path":"nodes/1"')


def half_open(port: int) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", port), PATIENCE)
    connection.sendall(b"GET /api/session HTTP/1.1\r\nHost: 127")
    return connection


def unread(port: int) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", port), PATIENCE)
    connection.sendall(b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    return connection


def test_who_is_signed_in_is_answered_however_many_stand_in_the_door(served: tuple[Served, int]) -> None:
    """Half-open connections, unread streams and wrong passwords, all of the crew's own address."""
    crew, counters = PageClient(served[1]), served[0].rig.ground.endpoint.counters
    deadline = time.monotonic() + PATIENCE
    while crew.sign_in().status != 200:
        assert time.monotonic() < deadline
    before = counters["wrong_passwords"]
    with contextlib.ExitStack() as held:
        for number in range(400):
            held.enter_context(half_open(served[1]))
            if number % 6 == 0:
                held.enter_context(unread(served[1]))
            if number % 8 == 0:
                assert crew.get("/api/session").content["name"] == "anna"
        for _ in range(150):
            connection = held.enter_context(socket.create_connection(("127.0.0.1", served[1]), PATIENCE))
            connection.sendall(sign_in_request("not the password"))
        for _ in range(20):
            assert crew.get("/api/session").content["name"] == "anna"
        with socket.create_connection(("127.0.0.1", served[1]), PATIENCE) as mine:
            cookie = crew.headers["cookie"].encode()
            mine.sendall(b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: " + cookie + b"\r\n\r\n")
            read_until(mine, b"event: hello")
        served[0].do(lambda rig: [rig.run(1.0) for _ in range(5)] and None)
        assert served[0].rig.ask("verdict")["bit_md_m"] == 6.0
    assert counters["wrong_passwords"] - before < 8  # each that is looked at holds the others
    assert PageClient(served[1]).get("/api/status").status == 200


def test_a_connection_that_never_asks_is_ended(served: tuple[Served, int]) -> None:
    with socket.create_connection(("127.0.0.1", served[1]), PATIENCE) as idle:
        idle.sendall(b"GET / HTTP/1.1\r\nHost: 127")
        readable, _, _ = select.select([idle], [], [], PATIENCE)
        assert readable
        with contextlib.suppress(ConnectionResetError):
            assert idle.recv(1) == b""


def test_a_web_server_that_fails_is_told_and_follows_anew(tmp_path: Path) -> None:
    port = free_port()
    with serving(Rig(tmp_path), PageSettings("127.0.0.1", port)) as served:
        page = PageClient(port)
        assert page.get("/alive").status == 200
        with stream(port) as reader:
            read_until(reader, b"event: hello")
            served.do(lambda _rig: end_server())
            with contextlib.suppress(ConnectionResetError):
                while reader.recv(65_536):
                    pass
        deadline = time.monotonic() + PATIENCE
        while not answers(port):
            assert time.monotonic() < deadline
        (told,) = page.get("/api/alarms").content["rig"]
        assert (told["code"], told["count"], told["detail"]) == ("page_restarted", 1, "it was ended")


def end_server() -> None:
    """Have the web server fail; on its own loop."""
    (serving,) = [task for task in asyncio.all_tasks() if task.get_name() == SERVER_TASK]
    serving.cancel()


def answers(port: int) -> bool:
    try:
        return bool(PageClient(port).get("/alive").status == 200)
    except OSError:
        return False


def test_the_files_of_the_page_are_small_and_name_no_other_host() -> None:
    files = [path for path in FILES.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 700_000
    for path in files:
        hosts = re.findall(r"(?:https?:)?//[a-z0-9.-]+\.[a-z]{2,}", path.read_text())
        assert set(hosts) <= {"http://www.w3.org"}, path
