"""The ground station's keys on the bus: what is asked and ordered comes in, what changes is published.

The bus's own threads only put queries into a bounded inbox; everything else happens on the loop of the ground station.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

import msgpack
import orjson

from groundstation.errors import GroundError, SelectorError
from groundstation.service.answers.answer_table import ANSWERS, LONGEST_NUMBER, PATTERNS, find_answer
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import AnsweredPath, answered_paths, check_parameters, find_path
from groundstation.service.answers.revisions import BEATS
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.orders.order_book import SentOrder
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.intake_tape import BEGIN, Intake, pack_intake
from telemetry import keys
from telemetry.errors import TelemetryError
from telemetry.media.zenoh_bus import JSON, MSGPACK, Publisher, Query, ZenohBus
from telemetry.runtime.inbox import Inbox

WAITING = 256  # queries that may wait to be answered, and orders that may be awaited
ORDER_TIMEOUT = 30.0  # wall s, for which who ordered is kept waiting
BUSY = f"the ground station has {WAITING} questions to answer; ask again later"
COMMON_PARAMETERS = ("accept",)
ENCODINGS = {"json": JSON, "msgpack": MSGPACK}
INTAKE_AT_ONCE = 500  # events of one answer
WHEN_HEARD = (*BEATS, "adjustment")  # put if there is a listener: the former are frequent, the latter is dear
PRIVATE = ("folder", "key_file", "keys", "database_url", "wall", "hole")  # settings that are not published
WHO = "zenoh"  # ordered, where the order does not say

Handler = Callable[[Query], None]


class ZenohGateway:
    """Gateway to the operator's doors; made on the running loop.

    Parameters
    ----------
    bus : where the keys are
    process : whose keys
    """

    def __init__(self, bus: ZenohBus, process: GroundProcess) -> None:
        self._bus = bus
        self._loop = asyncio.get_running_loop()
        self._rig = process.config.rig
        self._process = process
        self._operator = process.operator
        self._inbox: Inbox[tuple[Handler, Query]] = Inbox(WAITING)
        self._awaited: set[asyncio.Task[None]] = set()
        self._publishers: dict[str, Publisher] = {}
        self._late: dict[str, None] = {}  # paths of the hole that are to be put
        self._intake = bus.publisher(keys.INTAKE.format(rig=self._rig), MSGPACK, droppable=True)
        self._taped: int | None = None  # newest event of the intake that was published, None without a listener
        self._told = {
            one.path: process.model.newest_row(one.path) for one in ANSWERS.values() if one.is_stream
        }  # newest row of each stream that was published, or there before
        process.listeners.append(self._publish)
        bus.queryable_kept(self._key("**"), partial(self._arrive, self._answer))
        bus.queryable_kept(keys.INTAKE.format(rig=self._rig), partial(self._arrive, self._answer_intake))
        bus.queryable_kept(keys.COMMAND.format(rig=self._rig, name="*"), partial(self._arrive, self._take_order))

    async def serve(self) -> None:
        """Answer until ``close``."""
        try:
            while (arrived := await self._inbox.get()) is not None:
                handle, query = arrived
                self._handle(handle, query)
        finally:
            for task in self._awaited:
                task.cancel()

    def _handle(self, handle: Handler, query: Query) -> None:
        """Answer one query; an internal error is counted and reported in the answer, and the next query is answered."""
        try:
            handle(query)
        except Exception as error:
            self._process.endpoint.counters["failed_queries"] += 1
            refuse_query(query, f"{query.selector_key}: the ground station failed: {type(error).__name__}")

    def close(self) -> None:
        """Publish what is left and answer nothing more; from the loop or a signal handler of it."""
        while self._late:
            self._publish_next()
        self._process.listeners.remove(self._publish)
        self._inbox.close()

    def _arrive(self, handle: Handler, query: Query) -> None:
        """Queue a query, on a thread of the bus."""
        if not self._inbox.put((handle, query)):
            refuse_query(query, BUSY)

    def _key(self, path: str) -> str:
        return keys.GROUND.format(rig=self._rig, path=path)

    def _publish(self, changed: list[str]) -> None:
        """Put the present value of each path, and before it what it came from.

        What shows the whole hole is put one path a turn of the loop: a query meanwhile waits for one of them at most.
        """
        self._publish_intake()
        late = dict.fromkeys(path for path in changed if find_answer(path).of_the_hole)
        for path in changed:
            if path not in late:
                self._put(path)
        if late and not self._late:
            self._loop.call_soon(self._publish_in_turn)
        self._late |= late

    def _publish_in_turn(self) -> None:
        if len(self._late) > 1:
            self._loop.call_soon(self._publish_in_turn)
        if self._late:
            self._publish_next()

    def _publish_next(self) -> None:
        """Put the value of the path that has waited longest."""
        path = next(iter(self._late))
        del self._late[path]
        self._put(path)

    def _put(self, path: str) -> None:
        if path not in self._publishers:
            self._publishers[path] = self._bus.publisher(self._key(path), JSON, droppable=True)
        if path not in WHEN_HEARD or self._publishers[path].is_heard:
            self._publishers[path].put(self._news(path))

    def _publish_intake(self) -> None:
        """Put what was taken in since the last time; a new listener gets all that is kept first."""
        tape, process = self._process.tape, self._process
        if not self._intake.is_heard:
            self._taped = None
            return
        if self._taped is None:
            settings = process.config.model_dump(mode="json", exclude=set(PRIVATE))
            begin = Intake(0, BEGIN, 0.0, 0.0, 0, {"settings": settings, "start": process.start_number})
            self._intake.put(pack_intake(begin))
            self._taped = 0
        for event in tape.after(self._taped):
            self._intake.put(pack_intake(event))
        self._taped = tape.newest

    def _answer_intake(self, query: Query) -> None:
        """Answer a recorder with the kept events after number ``since``."""
        since = query.parameters.get("since", "0")
        if not since.isdecimal() or len(since) > LONGEST_NUMBER:
            refuse_query(query, f"parameter since: expected a whole number, got {since!r:.40}")
            return
        events = list(self._process.tape.after(min(int(since), self._process.tape.newest)))[:INTAKE_AT_ONCE]
        query.reply(query.selector_key, bytes(msgpack.packb([pack_intake(event) for event in events])), MSGPACK)
        query.finish()

    def _news(self, path: str) -> bytes:
        """Answer to publish: of a stream the rows that have come since the last one."""
        model, found = self._process.model, find_path(self._process.model, path)
        if not found.is_stream:
            return found.json(model, {})
        since, self._told[path] = self._told.get(path, 0), model.newest_row(path)
        return found.json(model, {"since": str(since)})

    def _answer(self, query: Query) -> None:
        try:
            replies = self._replies(query)
        except SelectorError as error:
            refuse_query(query, str(error))
            return
        encoding = ENCODINGS[query.parameters.get("accept", "json")]
        for key, payload in replies:
            query.reply(key, payload, encoding)
        query.finish()

    def _replies(self, query: Query) -> list[tuple[str, bytes]]:
        model = self._process.model
        found = {path: one for path, one in answered_paths(model).items() if query.intersects(self._key(path))}
        path = query.selector_key.partition("/ground/")[2]
        if not found and path and "*" not in path:
            find_path(model, path)  # which says what there is in its place
        if not found:
            raise SelectorError(
                f"{query.selector_key}: no such key; expected below {self._key('')}: {', '.join(PATTERNS)}"
            )
        accept = query.parameters.get("accept", "json")
        if accept not in ENCODINGS:
            raise SelectorError(f"parameter accept: expected json or msgpack, got {accept!r}")
        parameters = {name: value for name, value in query.parameters.items() if name not in COMMON_PARAMETERS}
        check_parameters(found.values(), parameters, COMMON_PARAMETERS)
        pack = msgpack_of if accept == "msgpack" else AnsweredPath.json
        return [(self._key(path), pack(one, model, parameters)) for path, one in found.items()]

    def _take_order(self, query: Query) -> None:
        """Accept an order; its answer is awaited beside all other work."""
        if len(self._awaited) >= WAITING:
            refuse_query(query, BUSY)
            return
        if not keys.is_order(query.selector_key):
            query.finish()  # a question that covers every key orders nothing
            return
        if "*" in query.selector_key:
            own = keys.COMMAND.format(rig=self._rig, name="NAME")
            refuse_query(query, f"{query.selector_key}: expected one rig and one order, {own}; none was obeyed")
            return
        name = query.selector_key.rsplit("/", 1)[1]
        try:
            order = self._operator.order(name, query.parameters, query.parameters.get("by", WHO))
        except (GroundError, TelemetryError) as error:
            refuse_query(query, f"{query.selector_key}: {error}")
            return
        task = asyncio.create_task(self._reply_when_answered(query, order))
        self._awaited.add(task)
        task.add_done_callback(self._awaited.discard)

    async def _reply_when_answered(self, query: Query, order: SentOrder) -> None:
        answered = asyncio.Event()
        order.when_answered(answered.set)
        name = order.spec.name
        try:
            async with asyncio.timeout(ORDER_TIMEOUT):
                await answered.wait()
        except TimeoutError:
            refuse_query(
                query,
                f"order {order.number}: tube {order.tube} has not answered {name} within {ORDER_TIMEOUT:.0f} s; "
                f"it is still being asked, see {self._key(f'orders/{order.number}')}",
            )
        else:
            key = keys.COMMAND.format(rig=self._rig, name=name)
            query.reply(key, orjson.dumps(self._operator.reply_of(order)))
            query.finish()


def refuse_query(query: Query, reason: str) -> None:
    """End a query with what is wrong with it."""
    query.reply_error(reason)
    query.finish()


def msgpack_of(path: AnsweredPath, model: RigModel, parameters: Parameters) -> bytes:
    """The answer of a path in msgpack."""
    return bytes(msgpack.packb(path.show(model, parameters)))
