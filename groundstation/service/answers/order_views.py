"""What the keys of orders hold, as an operator reads them."""

from __future__ import annotations

import math
from typing import Any

from groundstation.errors import SelectorError
from groundstation.service.answers.model import RigModel
from groundstation.service.orders.order_book import SentOrder
from telemetry.application.arguments import shown_values

View = dict[str, Any]


def orders(k: RigModel, _p: dict[str, str]) -> View:
    """The newest orders, the oldest of them first."""
    return {"orders": [order_view(o) for o in k.orders]}


def order(k: RigModel, number: int) -> View:
    """One order."""
    found = k.orders.get(number)
    if found is None:
        raise SelectorError(f"orders/{number}: no such order")
    return order_view(found)


def order_view(order: SentOrder) -> View:
    """One order; ``values`` are what the table of commands promises."""
    return {
        "order": order.number,
        "at_s": order.at if math.isfinite(order.at) else None,
        "ordered_utc": order.utc,
        "by": order.by,
        "tube": order.tube,
        "command": order.spec.name,
        "action": order.spec.action,
        "arguments": shown_values([argument.quantity for argument in order.spec.arguments], order.arguments),
        "state": order.state.value,
        "done": order.done,
        "detail": order.detail,
        "values": shown_values(order.spec.reply, order.values),
    }
