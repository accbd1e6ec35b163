"""A ground station asked, followed and ordered from Python.

    from borechain.client import connect_to_ground

    with connect_to_ground("tcp/127.0.0.1:7447", "rig-1") as ground:
        print(ground.verdict().line)
        for row in ground.stream("measurements"):
            print(row["md_m"], row["inclination_deg"])

Everything that docs/keys.md names can be asked with ``ask``; what most programs need comes in the class that the ground
station makes of it.

Errors::

    ClientError
    ├── NoAnswerError(TimeoutError)   no answer in time: is the ground station running, is the rig's name right?
    ├── RefusedError(ValueError)      the ground station said what is wrong with the question or the order
    └── AnswerError(ValueError)       the answer lacks something that this version knows: the two do not fit
"""

from __future__ import annotations

import contextlib
import json
import queue
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from borechain.rig_search import live_rigs, who_is_there
from groundstation.service.answers.answer_table import ANSWERS
from groundstation.service.answers.shapes.alarm_shapes import Alarm
from groundstation.service.answers.shapes.answer_fields import AnswerField, answer_class, fields_of_answer
from groundstation.service.answers.shapes.column_shapes import Off, Steer, Verdict
from groundstation.service.answers.shapes.hole_shapes import Station
from groundstation.service.answers.shapes.order_shapes import Order
from groundstation.service.answers.shapes.string_shapes import AnswerHeader
from telemetry import keys
from telemetry.errors import BorechainError
from telemetry.media.credentials import credentials_for
from telemetry.media.zenoh_bus import ZenohBus, open_client

__all__ = [
    "Alarm",
    "AnswerError",
    "AnsweredVerdict",
    "ClientError",
    "Ground",
    "NoAnswerError",
    "Off",
    "Order",
    "RefusedError",
    "Station",
    "Steer",
    "Verdict",
    "connect_to_ground",
    "live_rigs",
    "shape_answer",
]
PATIENCE, ORDER_PATIENCE = 5.0, 40.0  # wall s; the ground station itself waits 30 s for a tube
TIMEOUT = "Timeout"  # zenoh's text for an answer that did not come
STREAMS = sorted(path for path, one in ANSWERS.items() if one.is_stream)
View = dict[str, Any]
Shape = TypeVar("Shape")


class ClientError(BorechainError):
    """Root of the errors of a client."""


class NoAnswerError(ClientError, TimeoutError):
    """No answer came in time."""


class RefusedError(ClientError, ValueError):
    """The ground station refused; the message is its own."""


class AnswerError(ClientError, ValueError):
    """The answer is not one of this version."""


@answer_class
class AnsweredVerdict(Verdict, AnswerHeader):
    """A verdict behind the header of its answer, which says of when it is."""


class Ground:
    """The ground station of one rig, on a bus.

    Parameters
    ----------
    bus : open session
    rig : its name
    patience : wall s to wait for an answer
    """

    def __init__(self, bus: ZenohBus, rig: str = keys.DEFAULT_RIG, patience: float = PATIENCE) -> None:
        self._bus = bus
        self._rig = rig
        self._patience = patience

    def ask(self, path: str, **parameters: object) -> View:
        """Answer of the path below ``ground/``.

        Raises
        ------
        NoAnswerError, RefusedError
        """
        return self._get(keys.GROUND.format(rig=self._rig, path=path), parameters, self._patience)

    def verdict(self) -> AnsweredVerdict:
        """The verdict of now; errors as ``ask``, and AnswerError."""
        return shape_answer(AnsweredVerdict, self.ask("verdict"))

    def alarms(self) -> list[Alarm]:
        """Open alarms, the worst first; errors as ``verdict``."""
        return [shape_answer(Alarm, row) for row in self.ask("alarms")["open"]]

    def stations(self) -> list[Station]:
        """Stations from the collar down; errors as ``verdict``."""
        return [shape_answer(Station, row) for row in self.ask("stations")["stations"]]

    def order(self, name: str, by: str, **parameters: object) -> Order:
        """Order something and wait for its outcome; ``by`` says who.

        Raises
        ------
        NoAnswerError, RefusedError, AnswerError
        """
        selector = keys.COMMAND.format(rig=self._rig, name=name)
        return shape_answer(Order, self._get(selector, parameters | {"by": by}, ORDER_PATIENCE))

    def follow(self, path: str, call: Callable[[str, View], object]) -> None:
        """Call ``call(path, answer)`` on a foreign thread with each answer published below ``path``."""
        before = keys.GROUND.format(rig=self._rig, path="")
        self._bus.subscribe(
            before + path, lambda key, payload: call(key.removeprefix(before), dict(json.loads(payload)))
        )

    def stream(self, path: str, since: int = 0, timeout: float | None = None) -> Iterator[View]:
        """Rows of a stream after the number ``since``, each once and in order, as they come.

        Ends when nothing has come for ``timeout`` wall seconds. What a slow listener missed is asked for; after a
        restart of the ground station its rows begin anew.
        """
        if path not in STREAMS:
            raise RefusedError(f"{path}: no stream; expected one of {', '.join(STREAMS)}")
        arrived: queue.SimpleQueue[View] = queue.SimpleQueue()
        self.follow(path, lambda _path, view: arrived.put(view))
        view = self.ask(path, since=since)
        while True:
            if view["newest"] < since:
                since = 0
            rows = view[path]
            if not rows or rows[0]["seq"] > since + 1:
                rows = self.ask(path, since=since)[path]
            for row in rows:
                if row["seq"] > since:
                    since = row["seq"]
                    yield row
            try:
                view = arrived.get(timeout=timeout)
            except queue.Empty:
                return

    def _get(self, key: str, parameters: View, patience: float) -> View:
        given = ";".join(f"{name}={value}" for name, value in parameters.items())
        selector = f"{key}?{given}" if given else key
        replies = self._bus.get(selector, patience)
        for reply in replies:
            if reply.error is None:
                return dict(json.loads(reply.payload))
        refusals = [reply.error for reply in replies if reply.error not in (None, TIMEOUT)]
        if refusals:
            raise RefusedError(str(refusals[0]).removeprefix(f"{key}: "))
        raise NoAnswerError(f"{selector}: no answer within {patience:g} s; {who_is_there(self._bus)}")


@contextlib.contextmanager
def connect_to_ground(
    endpoint: str = keys.DEFAULT_ENDPOINT,
    rig: str = keys.DEFAULT_RIG,
    timeout: float = PATIENCE,
    *,
    keys_place: Path | None = None,
    role: str = "operator",
) -> Iterator[Ground]:
    """The ground station of a rig whose router is at ``endpoint``, tried for ``timeout`` wall seconds.

    Over TLS the certificate of ``role`` is shown, which lies in the folder ``keys_place``; only a driller may order.

    Raises
    ------
    MediumError
        When no router answers there, or there is no such certificate.
    """
    with open_client(endpoint, timeout, credentials_for(endpoint, keys_place, role)) as bus:
        yield Ground(bus, rig)


def shape_answer(shape: type[Shape], view: View) -> Shape:
    """An answer, or a part of one, in its class; what a later version has more is left out.

    Raises
    ------
    AnswerError
        Naming what is missing.
    """
    fields = fields_of_answer(shape)
    missing = [field.name for field in fields if field.name not in view]
    if missing:
        raise AnswerError(f"{shape.__name__}: the answer lacks {', '.join(missing)}; is the ground station older?")
    return shape(**{field.name: shape_value(field, view[field.name]) for field in fields})


def shape_value(field: AnswerField, value: Any) -> Any:
    """Value of one field, answers within it in their classes; errors as ``shape_answer``."""
    if value is None or field.shape is None:
        return value
    if field.kind == "map":
        return {name: shape_answer(field.shape, one) for name, one in value.items()}
    return [shape_answer(field.shape, one) for one in value] if field.rank else shape_answer(field.shape, value)
