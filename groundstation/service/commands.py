"""What an operator may order, as the parameters of a selector, and how its outcome is shown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from groundstation.errors import SelectorError
from telemetry.messages import MAX_TUBE, BlockStatus, Reply, Scalar
from telemetry.parameters import MAX_VERSION

Parameters = Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Order:
    """One order: the parameters it takes beside ``tube`` and those of them that it needs."""

    takes: Mapping[str, Callable[[str], Scalar]]
    needs: tuple[str, ...] = ()


def _number(text: str) -> float:
    return float(text)


def _version(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= MAX_VERSION:
        raise ValueError(text)
    return int(text)


ORDERS: dict[str, Order] = {
    "take_survey": Order({}),
    "static_record": Order({"seconds": _number}, ("seconds",)),
    "parameters": Order({}),
    "align": Order({"method": str, "turns": _number}),
    "alignment": Order({}),
    "timing": Order({}),
    "upload_parameters": Order(
        {"gyroscope": str, "accelerometer": str, "version": _version}, ("gyroscope", "accelerometer")
    ),
}


def parse(name: str, parameters: Parameters) -> tuple[int, dict[str, Scalar]]:
    """Tube and arguments of an order.

    Raises
    ------
    SelectorError
        When the order is none, its tube is none or a parameter is missing, unknown or no value; it says what is.
    """
    order = ORDERS.get(name)
    tube = parameters.get("tube", "")
    if order is None or not tube.isdigit() or not 1 <= int(tube) <= MAX_TUBE:
        raise SelectorError(f"expected cmd/{'|'.join(ORDERS)}?tube=N with N of 1..{MAX_TUBE}")
    given = {key: text for key, text in parameters.items() if key != "tube"}
    missing = [key for key in order.needs if key not in given]
    unknown = [key for key in given if key not in order.takes]
    if missing or unknown:
        expected = "".join(f";{key}=.." for key in order.takes)
        raise SelectorError(f"expected cmd/{name}?tube=N{expected}, got {', '.join(given) or 'none'}")
    arguments: dict[str, Scalar] = {}
    for key, text in given.items():
        try:
            arguments[key] = order.takes[key](text)
        except ValueError:
            raise SelectorError(f"parameter {key}: expected a number, got {text!r:.40}") from None
    return int(tube), arguments


def reply_view(name: str, reply: Reply) -> dict[str, Any]:
    """Outcome of a command that a node obeys; ``order`` is the number that a static record names."""
    return {
        "tube": reply.tube,
        "command": name,
        "done": reply.done,
        "detail": reply.detail,
        "order": reply.sequence,
    }


def status_view(name: str, status: BlockStatus) -> dict[str, Any]:
    """Outcome of an upload."""
    return {
        "tube": status.tube,
        "command": name,
        "done": status.phase.name == "APPLIED",
        "detail": status.detail,
        "phase": status.phase.name.lower(),
        "version": status.version,
        "sha256": status.in_use.hex(),
    }
