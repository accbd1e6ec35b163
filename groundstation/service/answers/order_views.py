"""Views of the orders, as an operator reads them."""

from __future__ import annotations

from groundstation.errors import SelectorError
from groundstation.service.answers.answer_texts import finite_or_none
from groundstation.service.answers.answer_views import member_view_of, view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.order_shapes import Order, OrdersAnswer
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.orders.order_book import SentOrder
from telemetry.application.arguments import shown_values


@view_of(OrdersAnswer)
def answer_orders(k: RigModel, _p: Parameters) -> OrdersAnswer:
    """The newest orders, the oldest of them first."""
    return OrdersAnswer([order_row(known) for known in k.orders])


@member_view_of(Order, lambda k: [known.number for known in k.orders])
def answer_order(k: RigModel, number: int) -> Order:
    """One order."""
    found = k.orders.get(number)
    if found is None:
        raise SelectorError(f"orders/{number}: no such order")
    return order_row(found)


def order_row(order: SentOrder) -> Order:
    """One order; ``values`` are what the table of commands promises."""
    return Order(
        order=order.number,
        at_s=finite_or_none(order.at),
        ordered_utc=order.utc,
        by=order.by,
        tube=order.tube,
        command=order.spec.name,
        action=order.spec.action,
        arguments=shown_values([argument.quantity for argument in order.spec.arguments], order.arguments),
        state=order.state.value,
        done=order.done,
        detail=order.detail,
        values=shown_values(order.spec.reply, order.values),
    )
