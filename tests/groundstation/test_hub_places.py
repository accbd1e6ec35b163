"""Places of who follows the page: a share for those at one address, and always one for who is signed in."""

from __future__ import annotations

from pathlib import Path

from hand_fed import Rig

from groundstation.gateway.page.answer_hub import READERS, UNSIGNED_OF_ONE, Hub


def test_readers_of_one_address_have_a_share_and_leave_it_again(tmp_path: Path) -> None:
    hub = Hub(Rig(tmp_path).ground)
    there = [hub.join("10.0.0.7") for _ in range(UNSIGNED_OF_ONE)]
    assert all(there)
    assert UNSIGNED_OF_ONE < READERS
    assert hub.join("10.0.0.7") is None
    assert hub.join("10.0.0.8") is not None
    assert there[0] is not None
    hub.leave(there[0])
    assert hub.join("10.0.0.7") is not None
    assert hub.join("10.0.0.7") is None


def test_who_is_signed_in_has_a_place_of_the_oldest_who_is_not(tmp_path: Path) -> None:
    hub = Hub(Rig(tmp_path).ground)
    strangers = [hub.join(f"10.0.0.{number}") for number in range(READERS - 1)]
    first = hub.join("10.0.1.1", is_signed=True)
    assert hub.join("10.0.0.200") is None
    assert first is not None
    crew = [hub.join("10.0.1.1", is_signed=True) for _ in range(READERS - 1)]
    assert all(crew)
    assert all(one is not None and one.is_closed for one in strangers)
    assert not any(one is None or one.is_closed for one in [first, *crew])
    assert len(hub) == READERS
    assert hub.join("10.0.1.1", is_signed=True) is None  # none of the crew gives way to the crew
    assert not first.is_closed
