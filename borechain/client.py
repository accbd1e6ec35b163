"""A ground station asked, followed and ordered from Python.

    from borechain.client import connect

    with connect("tcp/127.0.0.1:7447", "rig-1") as ground:
        print(ground.verdict().line)
        for row in ground.stream("measurements"):
            print(row["md_m"], row["inclination_deg"])

Everything that docs/keys.md names can be asked with ``ask``; what most programs need has a type.

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
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from telemetry import keys
from telemetry.errors import BorechainError
from telemetry.media.credentials import credentials_for
from telemetry.media.zenoh_bus import ZenohBus, open_client

PATIENCE, ORDER_PATIENCE = 5.0, 40.0  # wall s; the ground station itself waits 30 s for a tube
TIMEOUT = "Timeout"  # zenoh's text for an answer that did not come
STREAMS = ("events", "measurements", "static_records")
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


@dataclass(frozen=True, slots=True)
class Off:
    """How far off the hole is, at which measured depth, and towards which azimuth."""

    md_m: float
    deviation_cm: float
    sigma_cm: float
    limit_cm: float
    used_percent: float | None
    azimuth_deg: float
    wind: str


@dataclass(frozen=True, slots=True)
class Steer:
    """Where to steer to, and the last depth from which it helps."""

    azimuth_deg: float
    wind: str
    before_md_m: float | None
    left_m: float | None


@dataclass(frozen=True, slots=True)
class Verdict:
    """on_target, watch, steer, out or dont_know, with its reasons; good for ``good_for_s`` after its arrival."""

    verdict: str
    by_surveys: str
    line: str
    why: list[str]
    doubts: list[str]
    good_for_s: float
    bit_md_m: float | None
    target_m: float
    what: str | None
    off: Off | None
    steer: Steer | None
    utc: str
    rig_time_s: float | None


@dataclass(frozen=True, slots=True)
class Alarm:
    """One open alarm."""

    number: int
    state: str
    code: str
    level: str
    subject: str
    detail: str
    threshold: str
    md_m: float | None
    azimuth_deg: float | None
    wind: str | None
    since_s: float | None
    since_utc: str | None
    acknowledged_by: str | None
    shelved_by: str | None


@dataclass(frozen=True, slots=True)
class Station:
    """One station of the hole, fused."""

    station: int
    md_m: float
    inclination_deg: float
    azimuth_deg: float
    sigma_inclination_deg: float
    sigma_azimuth_deg: float
    measurements: int
    north_m: float
    east_m: float
    tvd_m: float
    sigma_north_m: float
    sigma_east_m: float
    sigma_tvd_m: float


@dataclass(frozen=True, slots=True)
class Order:
    """An order and what became of it."""

    order: int
    command: str
    tube: int | None
    by: str
    state: str
    done: bool | None
    detail: str
    values: View


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

    def verdict(self) -> Verdict:
        """The verdict of now; errors as ``ask``, and AnswerError."""
        view = self.ask("verdict")
        off, steer = view.get("off"), view.get("steer")
        return shaped(Verdict, view | {"off": off and shaped(Off, off), "steer": steer and shaped(Steer, steer)})

    def alarms(self) -> list[Alarm]:
        """Open alarms, the worst first; errors as ``verdict``."""
        return [shaped(Alarm, row) for row in self.ask("alarms")["open"]]

    def stations(self) -> list[Station]:
        """Stations from the collar down; errors as ``verdict``."""
        return [shaped(Station, row) for row in self.ask("stations")["stations"]]

    def order(self, name: str, by: str, **parameters: object) -> Order:
        """Order something and wait for its outcome; ``by`` says who.

        Raises
        ------
        NoAnswerError, RefusedError, AnswerError
        """
        selector = keys.COMMAND.format(rig=self._rig, name=name)
        return shaped(Order, self._get(selector, parameters | {"by": by}, ORDER_PATIENCE))

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
def connect(
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


def live_rigs(bus: ZenohBus, timeout: float = 1.0) -> list[str]:
    """Names of the rigs that have a ground station now."""
    tokens = bus.tokens(keys.LEASE.format(rig="*", holder="*"), timeout)
    return sorted({token.split("/")[1] for token in tokens})


def who_is_there(bus: ZenohBus) -> str:
    """Line that lists the rigs with a ground station, for the error on an unknown rig."""
    rigs = live_rigs(bus)
    return f"rigs with a ground station: {', '.join(rigs)}" if rigs else "no rig has a ground station here"


def shaped(shape: type[Shape], view: View) -> Shape:
    """A part of an answer in its type; what a later version has more is left out.

    Raises
    ------
    AnswerError
        Naming what is missing.
    """
    names = [field.name for field in fields(shape)]  # type: ignore[arg-type]
    missing = [name for name in names if name not in view]
    if missing:
        raise AnswerError(f"{shape.__name__}: the answer lacks {', '.join(missing)}; is the ground station older?")
    return shape(**{name: view[name] for name in names})
