import pickle
from dataclasses import FrozenInstanceError, dataclass, field, replace

import pytest
from messages_of_schema import MESSAGES

from telemetry.frozen import quickly_made
from telemetry.messages import Event, Severity


@dataclass(frozen=True, slots=True)
class Usual:
    a: int
    b: float = 2.0
    c: list[int] = field(default_factory=list)


@quickly_made
@dataclass(frozen=True, slots=True)
class Quick:
    a: int
    b: float = 2.0
    c: list[int] = field(default_factory=list)


def test_what_is_made_quickly_takes_the_arguments_of_the_usual_and_is_as_frozen() -> None:
    for arguments, names in [((1,), {}), ((1, 3.0), {}), ((1,), {"c": [4]}), ((), {"a": 5, "b": 6.0, "c": [7]})]:
        quick, usual = Quick(*arguments, **names), Usual(*arguments, **names)  # type: ignore[arg-type]
        assert repr(quick) == repr(usual).replace("Usual", "Quick")
        assert type(quick) is Quick
    assert Quick(1) == Quick(1) != Quick(2)
    assert Quick(1).c is not Quick(1).c
    with pytest.raises(FrozenInstanceError):
        Quick(1).a = 2  # type: ignore[misc]


@pytest.mark.parametrize(("arguments", "said"), [((), "missing 1 required"), ((1, 2.0, [], 4), "takes from 2 to 4")])
def test_wrong_arguments_are_refused_by_name(arguments: tuple[object, ...], said: str) -> None:
    with pytest.raises(TypeError, match=rf"Quick.__init__\(\) {said}"):
        Quick(*arguments)  # type: ignore[arg-type]


def test_every_message_can_be_copied_changed_and_pickled() -> None:
    event = Event(1, 2, 3.0, Severity.INFO, "booted")
    assert replace(event, epoch=4).epoch == 4
    assert pickle.loads(pickle.dumps(event)) == event
    assert all(message.__init__.__annotations__ for message in MESSAGES)
