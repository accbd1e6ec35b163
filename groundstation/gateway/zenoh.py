"""The ground station's keys on the bus: one queryable for all of them, and publications when they change."""

from __future__ import annotations

import json
import threading
from typing import Any

import msgpack

from groundstation.errors import SelectorError
from groundstation.service.model import RigModel
from groundstation.service.views import PATTERNS, Parameters, Path, paths
from telemetry import keys
from telemetry.media.zenoh_bus import JSON, MSGPACK, Publisher, Query, ZenohBus

COMMON_PARAMETERS = ("accept",)
ENCODINGS = {"json": JSON, "msgpack": MSGPACK}


class Queries:
    """Answers selectors and publishes changes.

    Parameters
    ----------
    bus : where
    model : what
    lock : held by whoever changes the model; questions come on the bus's own threads
    """

    def __init__(self, bus: ZenohBus, model: RigModel, lock: threading.Lock) -> None:
        self._bus = bus
        self._model = model
        self._lock = lock
        self._publishers: dict[str, Publisher] = {}
        bus.queryable(self._key("**"), self._answer)

    def publish(self, changed: list[str]) -> None:
        """Put the present value of each path; the lock must be held."""
        known = paths(self._model)
        for path in changed:
            if path in known:
                if path not in self._publishers:
                    self._publishers[path] = self._bus.publisher(self._key(path), JSON, droppable=True)
                self._publishers[path].put(pack(known[path].show(self._model, {}), "json"))

    def _key(self, path: str) -> str:
        return keys.GROUND.format(rig=self._model.config.rig, path=path)

    def _answer(self, query: Query) -> None:
        try:
            with self._lock:
                replies = self._replies(query)
        except SelectorError as error:
            query.reply_error(str(error))
            return
        encoding = ENCODINGS[query.parameters.get("accept", "json")]
        for key, payload in replies:
            query.reply(key, payload, encoding)

    def _replies(self, query: Query) -> list[tuple[str, bytes]]:
        found = {path: view for path, view in paths(self._model).items() if query.intersects(self._key(path))}
        if not found:
            raise SelectorError(
                f"{query.selector_key}: no such key; expected below {self._key('')}: {', '.join(PATTERNS)}"
            )
        accept = query.parameters.get("accept", "json")
        if accept not in ENCODINGS:
            raise SelectorError(f"parameter accept: expected json or msgpack, got {accept!r}")
        parameters = {name: value for name, value in query.parameters.items() if name not in COMMON_PARAMETERS}
        check_parameters(found, parameters)
        return [(self._key(path), pack(view.show(self._model, parameters), accept)) for path, view in found.items()]


def check_parameters(found: dict[str, Path], parameters: Parameters) -> None:
    """Refuse a parameter that none of the paths asked for takes.

    Raises
    ------
    SelectorError
        Naming those that are taken.
    """
    known = sorted({name for view in found.values() for name in view.parameters} | set(COMMON_PARAMETERS))
    for name in parameters:
        if name not in known:
            raise SelectorError(f"parameter {name}: expected one of {', '.join(known)}")


def pack(view: dict[str, Any], accept: str) -> bytes:
    """A view on the wire."""
    return bytes(msgpack.packb(view)) if accept == "msgpack" else json.dumps(view).encode()
