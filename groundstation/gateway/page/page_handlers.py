"""The page's addresses: answers, their stream, orders, and who is signed in."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import Receive, Scope, Send

from groundstation.errors import GroundError, SelectorError
from groundstation.gateway.page.answer_hub import Hub, server_sent_event
from groundstation.gateway.page.connections import SignedPeers
from groundstation.gateway.page.exports import live_export
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import (
    DRILLER,
    LONGEST,
    NEVER,
    PasswordBook,
    find_holder,
    holder_of,
    is_right,
    roles_of,
)
from groundstation.gateway.page.reports import ReportTypesetter
from groundstation.gateway.page.request_guard import RequestError, check_origin, json_body, text_of
from groundstation.gateway.page.sessions import OperatorSession, Sessions, WrongPasswords, is_from
from groundstation.service.answers.csv_tables import table_of
from groundstation.service.answers.paths import check_parameters, find_path
from groundstation.service.orders.order_book import SentOrder
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.operator_access import check_name
from telemetry.errors import TelemetryError

SILENCE_S = 5.0  # after which a stream without news sends a comment, so that its reader knows that it is there
SLOW_S = 10.0  # for which a packet may wait for its reader
ANSWERED_WITHIN_S = 30.0  # longest wait of a request for the end of its order
COOKIE = "borechain"
CSRF = "x-csrf-token"

Handler = Callable[[Request], Awaitable[Response]]


class PageHandlers:
    """Handlers of the page's addresses, all on the loop that drives the ground station.

    Parameters
    ----------
    process : the ground station
    page : who may order, and whether everybody may read
    hub : where its answers are followed
    signed : connections of who is signed in, for those who keep the connections
    build : name of what is served, by which a page that is older than the program knows it
    version : of the program
    """

    def __init__(
        self, process: GroundProcess, page: PageSettings, hub: Hub, signed: SignedPeers, build: str, version: str
    ) -> None:
        self._process, self._page, self._hub, self._signed, self._build = process, page, hub, signed, build
        self._passwords = PasswordBook(page.passwords, page.password_file)
        self._sessions = Sessions()
        self._wrong = WrongPasswords()
        self._reporter = ReportTypesetter(process.model, version)
        self._one_at_a_time = asyncio.Lock()  # hashes cost memory and a core

    async def answer(self, request: Request) -> Response:
        """``GET /api/PATH``: what the key ``ground/PATH`` answers."""
        self._check_reader(request)
        path = request.path_params["path"]
        parameters = dict(request.query_params)
        try:
            found = find_path(self._process.model, path)
            check_parameters([found], parameters)
            return Response(found.json(self._process.model, parameters), media_type="application/json")
        except SelectorError as error:
            raise RequestError(400 if is_known(self._process, path) else 404, str(error)) from error

    async def table(self, request: Request) -> Response:
        """``GET /api/tables/PATH.csv``: the list of an answer as a file of CSV."""
        self._check_reader(request)
        path, model = request.path_params["path"], self._process.model
        parameters = dict(request.query_params)
        try:
            found = find_path(model, path)
            check_parameters([found], parameters)
            text = table_of(path, found.fields, found.show(model, parameters))
        except SelectorError as error:
            raise RequestError(400 if is_known(self._process, path) else 404, str(error)) from error
        name = f"{self._process.config.rig}-{path.replace('/', '-')}.csv"
        return Response(text, media_type="text/csv", headers=saved_as(name))

    async def report(self, request: Request) -> Response:
        """``GET /api/reports/wall.pdf`` and ``hole.pdf``: a report to be signed."""
        self._check_reader(request)
        name, made = await self._reporter.pdf(request.path_params["subject"], dict(request.query_params))
        return Response(made, media_type="application/pdf", headers=saved_as(name))

    async def export(self, request: Request) -> Response:
        """``GET /api/exports/hole.FORMAT`` and ``wall.FORMAT``: a file of another program."""
        self._check_reader(request)
        what, form = request.path_params["what"], request.path_params["form"]
        name, media, made = await live_export(self._process.model, what, form, dict(request.query_params))
        return Response(made, media_type=media, headers=saved_as(name))

    async def order(self, request: Request) -> Response:
        """``POST /api/cmd/NAME``: order something; ``?wait=true`` answers when the tube has."""
        session = self._check_driller(request)
        content = await json_body(request)
        parameters = {name: parameter_text(name, value) for name, value in content.items()}
        parameters.pop("by", None)
        try:
            order = self._process.operator.order(request.path_params["name"], parameters, session.name)
        except (GroundError, TelemetryError) as error:
            raise RequestError(400, str(error)) from error
        if request.query_params.get("wait") == "true":
            await await_answer(order)
        status = 200 if order.answered else 202
        return JSONResponse(self._process.operator.ask(f"orders/{order.number}"), status)

    async def sign_in(self, request: Request) -> Response:
        """``POST /api/session``: a role, a name for the record, and the role's password."""
        check_origin(request)
        content = await json_body(request)
        role, name = text_of(content, "role", 32), text_of(content, "name")
        password = text_of(content, "password", LONGEST)
        try:
            check_name(name)
        except SelectorError as error:
            raise RequestError(400, str(error).replace("by:", "name:")) from error
        if not self._passwords.current():
            off = self._passwords.fault or "the ground station was started without --page-passwords"
            raise RequestError(403, f"sign-in is off: {off}")
        holder, hashed = await self._check_password(role, name.strip(), password, request)
        session = self._sessions.begin(role, name.strip(), time.monotonic(), holder, hashed)
        response = JSONResponse(self._shown(session))
        response.set_cookie(
            COOKIE, session.token, httponly=True, samesite="strict", secure=self._page.certificate is not None, path="/"
        )
        return response

    async def session(self, request: Request) -> Response:
        """``GET /api/session``: who is signed in here, and what that is good for."""
        return JSONResponse(self._shown(self._session_of(request)))

    async def sign_out(self, request: Request) -> Response:
        """``DELETE /api/session``."""
        session = self._check_signed(request)
        self._sessions.end(session)
        response = JSONResponse(self._shown(None))
        response.delete_cookie(COOKIE, path="/")
        return response

    async def stream(self, scope: Scope, receive: Receive, send: Send) -> None:
        """``GET /api/stream``: every answer of the page, and then what changes, as server-sent events."""
        request = Request(scope)
        self._check_reader(request)
        session = self._session_of(request)
        reader = self._hub.join(address_of(request), is_signed=session is not None)
        if reader is None:
            raise RequestError(503, "as many browsers follow this rig as may; sign in, or close one", retry_after=10.0)
        gone = asyncio.create_task(gone_reader(receive, reader.close))
        try:
            headers = [(b"content-type", b"text/event-stream"), (b"cache-control", b"no-store")]
            await send({"type": "http.response.start", "status": 200, "headers": headers})
            await send_chunk(
                send, b"retry: 1000\n\n" + server_sent_event("hello", self._hello()) + self._hub.packet(reader.take())
            )
            while not reader.is_closed:
                changed = await reader.changes(SILENCE_S)
                if session is not None and self._session_of(request) is None:
                    break  # the page comes again by itself, as who it is now
                await send_chunk(send, self._hub.packet(changed) or b": nothing new\n\n")
            await send({"type": "http.response.body", "body": b"", "more_body": False})
        except TimeoutError:
            self._process.endpoint.counters["slow_readers"] += 1  # its connection is ended by who keeps them
        finally:
            gone.cancel()
            self._hub.leave(reader)

    def _hello(self) -> dict[str, Any]:
        config, start = self._process.config, self._process.start_number
        names = {"rig": config.rig, "hole": config.hole, "replay": self._page.replay}
        return names | {"start": start, "build": self._build}

    def _shown(self, session: OperatorSession | None) -> dict[str, Any]:
        return {
            "role": None if session is None else session.role,
            "name": None if session is None else session.name,
            "csrf": None if session is None else session.csrf,
            "reads": session is not None or self._page.is_local,
            "orders": session is not None and session.role == DRILLER,
            "roles": roles_of(self._passwords.current()),
        }

    async def _check_password(self, role: str, name: str, password: str, request: Request) -> tuple[str, str]:
        """Under what a right password is kept, and its hash.

        Raises
        ------
        RequestError
            When it is wrong, or comes too soon after a wrong one.
        """
        address, who = address_of(request), holder_of(role, name)
        async with self._one_at_a_time:  # those who wait here see what the one before them has brought about
            if hold := self._wrong.hold_of(address, time.monotonic(), who):
                raise RequestError(429, f"too soon after a wrong password; wait {math.ceil(hold)} s", retry_after=hold)
            if await request.is_disconnected():
                raise RequestError(408, "the connection ended before the answer")
            known = self._passwords.current()
            holder = find_holder(known, role, name)
            hashed = known[holder] if holder is not None else next(iter(known.values()), NEVER)  # takes as long
            right = await asyncio.to_thread(is_right, password, hashed)
            if right and holder is not None:
                self._wrong.forgive(address, who)
                return holder, hashed
            row, hold = self._wrong.add(address, time.monotonic(), who)
        self._process.endpoint.counters["wrong_passwords"] += 1
        told = f"{self._wrong.total} since the ground station started, the last from {address}"
        self._process.model.rig_alarms.alert("wrong_password", "page", told)
        times = "" if row == 1 else f", {row} in a row"
        raise RequestError(401, f"wrong password or role{times}; the next try is looked at in {hold:.0f} s")

    def _session_of(self, request: Request) -> OperatorSession | None:
        session = self._sessions.find(request.cookies.get(COOKIE), time.monotonic())
        if session is not None and session.holder and self._passwords.current().get(session.holder) != session.hashed:
            self._sessions.end(session)  # its password is another one now, or none
            return None
        if session is not None and request.client is not None:
            self._signed.add(request.client)
        return session

    def _check_reader(self, request: Request) -> None:
        if not self._page.is_local and self._session_of(request) is None:
            raise RequestError(401, "sign in to read: this page can be reached over a network")

    def _check_signed(self, request: Request) -> OperatorSession:
        check_origin(request)
        session = self._session_of(request)
        if session is None:
            raise RequestError(401, "sign in to order: reading alone needs no role here")
        if not is_from(session, request.headers.get(CSRF)):
            raise RequestError(403, f"expected the header {CSRF} of this session")
        return session

    def _check_driller(self, request: Request) -> OperatorSession:
        session = self._check_signed(request)
        if session.role != DRILLER:
            raise RequestError(403, f"the role {session.role} reads; expected a session of the role {DRILLER}")
        return session


async def gone_reader(receive: Receive, close: Callable[[], None]) -> None:
    """Call ``close`` when the other end has gone."""
    while (await receive())["type"] != "http.disconnect":
        pass
    close()


async def send_chunk(send: Send, packet: bytes) -> None:
    """Send a part of a stream; TimeoutError where the reader does not take it."""
    async with asyncio.timeout(SLOW_S):
        await send({"type": "http.response.body", "body": packet, "more_body": True})


async def await_answer(order: SentOrder) -> None:
    """Wait until an order is answered, for a time."""
    done = asyncio.Event()
    order.when_answered(done.set)
    try:
        async with asyncio.timeout(ANSWERED_WITHIN_S):
            await done.wait()
    except TimeoutError:
        return


def parameter_text(name: str, value: object) -> str:
    """A parameter as an operator writes it.

    Raises
    ------
    RequestError
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise RequestError(400, f"{name[:40]}: expected a text or a number")
    return value if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def address_of(request: Request) -> str:
    """Address of the asking host, for counting."""
    return request.client.host if request.client is not None else ""


def is_known(process: GroundProcess, path: str) -> bool:
    """Whether there is an answer of this path, so that its parameters are what is wrong."""
    try:
        find_path(process.model, path)
    except SelectorError:
        return False
    return True


def saved_as(name: str) -> dict[str, str]:
    """Headers of an answer that a browser saves as a file of this name."""
    return {"content-disposition": f'attachment; filename="{name}"'}
