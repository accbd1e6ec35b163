import pickle

import pytest
from messages_of_schema import MESSAGES

from telemetry.frozen import Frozen, field, replace
from telemetry.messages import Event, Severity


class Reading(Frozen):
    a: int
    b: float = 2.0
    c: list[int] = field(default_factory=list)


def test_what_is_frozen_takes_its_fields_in_order_or_by_name_and_is_never_assigned_again() -> None:
    assert Reading(1) == Reading(a=1, b=2.0, c=[]) != Reading(2)
    assert repr(Reading(1, 3.0)) == "Reading(a=1, b=3.0, c=[])"
    assert Reading(1).c is not Reading(1).c
    with pytest.raises(AttributeError, match="immutable"):
        Reading(1).a = 2  # type: ignore[misc]


@pytest.mark.parametrize(("arguments", "said"), [((), "required argument 'a'"), ((1, 2.0, [], 4), "Extra positional")])
def test_wrong_arguments_are_refused(arguments: tuple[object, ...], said: str) -> None:
    with pytest.raises(TypeError, match=said):
        Reading(*arguments)  # type: ignore[arg-type]


def test_every_message_can_be_copied_changed_and_pickled() -> None:
    event = Event(1, 2, 3.0, Severity.INFO, "booted")
    assert replace(event, epoch=4).epoch == 4
    assert pickle.loads(pickle.dumps(event)) == event
    assert all(issubclass(message, Frozen) for message in MESSAGES)
