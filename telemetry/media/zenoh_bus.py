"""zenoh as our bus: explicit endpoints, no scouting, bytes in and out. The only module that imports zenoh.

Callbacks arrive on zenoh's own threads; a callback must only put into a queue or take a lock, see ``ZenohBus.hear``.
"""

from __future__ import annotations

import ctypes
import json
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import zenoh

from telemetry.errors import MediumError
from telemetry.media.credentials import Credentials

MSGPACK = "application/msgpack"
JSON = "application/json"
LINE = 16  # batches that wait for a line, the most that zenoh allows; made when they are needed
ONE_POOL = (
    "(app: (worker_threads: 1), acc: (handover: app), tx: (handover: app), rx: (handover: app), net: (handover: app))"
)
# a router waits for room in a line on the thread that receives, so that another one has to empty the line
TWO_POOLS = "(rx: (worker_threads: 1), app: (handover: rx), acc: (handover: rx), net: (handover: rx))"


@dataclass(frozen=True, slots=True)
class QueryReply:
    """One answer to a query: a payload on a key, or an error text."""

    key: str
    payload: bytes
    error: str | None = None


class Publisher:
    """Publisher of one key: reliable, in order, sent at once."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher
        self._heard: dict[str, bool] = {}  # what was told of it last, once it is watched

    def watch(self) -> None:
        """Watch from now on whether there are subscribers: asking takes longer than the put before which it is done."""

        def note(status: Any) -> None:
            self._heard["now"] = bool(status.matching)

        self._publisher.declare_matching_listener(zenoh.handlers.Callback(note, indirect=False))
        status: Any = self._publisher.matching_status
        self._heard.setdefault("now", bool(status.matching))  # what was told meanwhile is newer

    def put(self, payload: bytes) -> None:
        """Send one payload.

        Raises
        ------
        MediumError
            When the session is closed.
        """
        try:
            self._publisher.put(payload)
        except zenoh.ZError as error:
            raise MediumError(f"zenoh put on {self._publisher.key_expr}: {error}") from error

    @property
    def is_heard(self) -> bool:
        """Whether anybody subscribes to the key."""
        if self._heard:
            return self._heard["now"]
        status: Any = self._publisher.matching_status
        return bool(status.matching)

    def close(self) -> None:
        """Stop publishing."""
        end_declaration(self._publisher)


class Subscription:
    """A subscription that can be closed."""

    def __init__(self, subscriber: Any) -> None:
        self._subscriber = subscriber

    def close(self) -> None:
        """Stop the subscription."""
        end_declaration(self._subscriber)


class Query:
    """An incoming query: selector, parameters and its replies."""

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query
        self.selector_key = str(query.key_expr)
        self.parameters: dict[str, str] = dict(_parameters(str(query.parameters)))

    def intersects(self, key: str) -> bool:
        """Whether the query covers ``key``."""
        return bool(self._query.key_expr.intersects(key))

    def reply(self, key: str, payload: bytes, encoding: str = JSON) -> None:
        """Answer on one key."""
        self._query.reply(key, payload, encoding=encoding)

    def finish(self) -> None:
        """End the query: no more answers come; for queries of ``queryable_kept``."""
        self._query.drop()  # type: ignore[no-untyped-call]

    def reply_error(self, text: str) -> None:
        """Answer with an error."""
        self._query.reply_err(text.encode(), encoding="text/plain")


class ZenohBus:
    """One zenoh session. Open it after a fork, never before: an inherited session hangs."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._declared: list[Any] = []

    def publisher(self, key: str, encoding: str = MSGPACK, *, droppable: bool = False) -> Publisher:
        """Publisher of ``key``, its encoding declared.

        When a line is full a put waits, unless it is ``droppable``: then a slow listener misses some samples.
        """
        control = zenoh.CongestionControl.DROP if droppable else zenoh.CongestionControl.BLOCK
        declared = self._session.declare_publisher(key, encoding=encoding, congestion_control=control, express=True)
        self._declared.append(declared)
        return Publisher(declared)

    def subscribe(self, pattern: str, callback: Callable[[str, bytes], object]) -> None:
        """Call ``callback(key, payload)`` on a foreign thread for each sample."""
        self._declared.append(
            self._session.declare_subscriber(pattern, lambda s: callback(str(s.key_expr), s.payload.to_bytes()))
        )

    def subscribe_at_once(self, pattern: str, callback: Callable[[str, bytes], object]) -> Subscription:
        """Call ``callback`` on the receiving thread itself, so it must only put into a queue."""

        def take(sample: Any) -> None:
            stay_known()
            callback(str(sample.key_expr), sample.payload.to_bytes())

        direct: Any = zenoh.handlers.Callback(take, indirect=False)
        return Subscription(self._session.declare_subscriber(pattern, direct))

    def hear(self, key: str, callback: Callable[[bytes], object]) -> Subscription:
        """Call ``callback(payload)`` on the receiving thread itself.

        It may put, but what is ``droppable`` alone: that thread may be the one which empties the line.
        """

        def take(sample: Any) -> None:
            stay_known()
            callback(sample.payload.to_bytes())

        direct: Any = zenoh.handlers.Callback(take, indirect=False)
        return Subscription(self._session.declare_subscriber(key, direct))

    def queryable_kept(self, pattern: str, handler: Callable[[Query], object]) -> None:
        """Hand queries that intersect ``pattern`` to ``handler`` on a foreign thread; ``Query.finish`` ends each."""
        self._declared.append(self._session.declare_queryable(pattern, lambda q: handler(Query(q)), complete=True))

    def get(self, selector: str, timeout: float) -> list[QueryReply]:
        """Return all answers to ``selector`` within ``timeout`` wall seconds.

        Raises
        ------
        MediumError
            When the selector is not a valid key expression.
        """
        try:
            replies = self._session.get(selector, timeout=timeout, consolidation=zenoh.ConsolidationMode.NONE)
        except zenoh.ZError as error:
            raise MediumError(f"selector {selector}: {error}") from error
        return [_reply(reply) for reply in replies]

    def liveliness_token(self, key: str) -> Callable[[], None]:
        """Declare a liveliness token on ``key`` until the session or the process ends; returns what takes it back."""
        declared = self._session.liveliness().declare_token(key)
        self._declared.append(declared)

        def take_back() -> None:
            self._declared.remove(declared)
            end_declaration(declared)

        return take_back

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Keys of the liveliness tokens that are there now, asked for ``timeout`` wall seconds at most.

        One of this session comes twice where a router knows it: the session answers for itself.
        """
        replies = self._session.liveliness().get(pattern, timeout=timeout)
        return sorted(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)

    def liveliness_subscribe(self, pattern: str, callback: Callable[[str, bool], None]) -> None:
        """Call ``callback(key, alive)`` on a foreign thread for each token that comes, goes or is already there."""
        self._declared.append(
            self._session.liveliness().declare_subscriber(
                pattern, lambda s: callback(str(s.key_expr), s.kind == zenoh.SampleKind.PUT), history=True
            )
        )

    def close(self) -> None:
        """Close the session; every declaration ends with it.

        An end that lives and does not read keeps a session waiting for its farewell, some seconds; it goes without.
        """
        self._declared.clear()
        with suppress(zenoh.ZError):
            self._session.close()  # type: ignore[no-untyped-call]


class KnownThread(threading.local):
    """Whether the interpreter keeps the state of this thread."""

    here = False


known_thread = KnownThread()


def stay_known() -> None:
    """Make the interpreter keep its state of this foreign thread, from within its first callback on.

    It makes a state for each callback of a thread that it did not start and drops it at the end: memory of the system's
    for the frames of its functions, taken and given back each time. One claim that is never given back keeps the state
    for as long as the process lives; zenoh's threads are few and live as long.
    """
    if not known_thread.here:
        known_thread.here = True
        ctypes.pythonapi.PyGILState_Ensure()


def use_few_threads(*, routes: bool = False) -> None:
    """Share one thread pool among the sessions of this process: for boards, and many processes on one machine.

    Where one of them ``routes`` for others, what is sent has a pool of its own. Call it before the first session is
    opened; an existing environment setting wins.
    """
    os.environ.setdefault("ZENOH_RUNTIME", TWO_POOLS if routes else ONE_POOL)


@contextmanager
def open_router(
    endpoint: str,
    credentials: Credentials | None = None,
    access: dict[str, Any] | None = None,
    *,
    beyond: str | None = None,
) -> Iterator[ZenohBus]:
    """Session in router mode that listens on ``endpoint`` and serves the others; no router program is needed.

    With ``credentials`` it asks every client for its certificate; ``access`` is zenoh's access control. It joins the
    router at ``beyond``, where there is one: who is at either is heard at both.

    Raises
    ------
    MediumError
        When the endpoint cannot be listened on.
    """
    settings: dict[str, Any] = {"listen/endpoints": [endpoint], "listen/exit_on_failure": True}
    if beyond is not None:
        settings |= {"connect/endpoints": [beyond]}
    if credentials is not None:
        settings |= tls_of_router(credentials)
    if access is not None:
        settings["access_control"] = access
    try:
        session = zenoh.open(_config("router", settings))
    except zenoh.ZError as error:
        raise MediumError(f"cannot listen on {endpoint}: is it taken, is it tcp/HOST:PORT? see --endpoint") from error
    yield from _held(session)


@contextmanager
def open_client(endpoint: str, timeout: float, credentials: Credentials | None = None) -> Iterator[ZenohBus]:
    """Session that joins the router at ``endpoint``, tried for ``timeout`` wall seconds.

    Raises
    ------
    MediumError
        When no router answers there.
    """
    settings: dict[str, Any] = {
        "listen/endpoints": [],
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": int(timeout * 1000),
        "connect/exit_on_failure": True,
        "transport/link/tx/queue/size/data": LINE,
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 1.5},
    }
    if credentials is not None:
        settings |= tls_of_client(credentials)
    try:
        session = zenoh.open(_config("client", settings))
    except zenoh.ZError as error:
        raise MediumError(f"no router at {endpoint} within {timeout:g} s: is the rig running there?") from error
    yield from _held(session)


def tls_of_router(credentials: Credentials) -> dict[str, Any]:
    """Settings of a router that lets in whom the rig's authority knows."""
    link = {
        "root_ca_certificate": str(credentials.authority),
        "listen_certificate": str(credentials.certificate),
        "listen_private_key": str(credentials.key),
        "enable_mtls": True,
    }
    return {"transport/link/tls": link}


def tls_of_client(credentials: Credentials) -> dict[str, Any]:
    """Settings of a client; the router proves that it is the rig's by the use of its certificate, not by its host."""
    link = {
        "root_ca_certificate": str(credentials.authority),
        "connect_certificate": str(credentials.certificate),
        "connect_private_key": str(credentials.key),
        "enable_mtls": True,
        "verify_name_on_connect": False,
    }
    return {"transport/link/tls": link}


def end_declaration(declared: Any) -> None:
    """End a declaration; with its session it has ended already."""
    with suppress(zenoh.ZError):
        declared.undeclare()


def keys_intersect(selector_key: str, key: str) -> bool:
    """Whether two key expressions have a key in common; False for an invalid key expression."""
    try:
        return bool(zenoh.KeyExpr(selector_key).intersects(zenoh.KeyExpr(key)))
    except zenoh.ZError:
        return False


def _held(session: zenoh.Session) -> Iterator[ZenohBus]:
    bus = ZenohBus(session)
    try:
        yield bus
    finally:
        bus.close()


def _config(mode: str, settings: dict[str, Any]) -> zenoh.Config:
    """Session settings, without any scouting on the network.

    Nor does any payload go by shared memory, which zenoh would set aside at the first above 3 KiB, 16 MiB a process:
    the states of a long string are longer, its frames are not so many.
    """
    config = zenoh.Config()
    never = ("scouting/multicast/enabled", "scouting/gossip/enabled", "transport/shared_memory/enabled")
    for key, value in ({"mode": mode} | dict.fromkeys(never, False) | settings).items():
        config.insert_json5(key, json.dumps(value))
    return config


def _reply(reply: zenoh.Reply) -> QueryReply:
    if reply.ok is not None:
        return QueryReply(str(reply.ok.key_expr), reply.ok.payload.to_bytes())
    error = reply.err
    return QueryReply("", b"", error.payload.to_string() if error is not None else "an empty reply")


def _parameters(text: str) -> Iterator[tuple[str, str]]:
    for part in text.split(";"):
        name, _, value = part.partition("=")
        if name:
            yield name, value
