"""What a ground station takes in and keeps: a lease in doubt, counted starts, damaged moments, merges and series."""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_kept_as_told import moment
from test_store import survey, url

from groundstation.config import GroundConfig
from groundstation.errors import StoreError
from groundstation.gateway.leased_process import LeasedProcess
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import StringKeeper
from groundstation.service.disk.merged_database import merge_databases
from groundstation.service.disk.moment_keeper import MomentKeeper
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.string.known_string import KnownString
from groundstation.service.string.message_numbers import SERIES_KEPT, MessageNumbers
from groundstation.survey.fusion.joint_angles import JointAngle


class Ground:
    """Notes what is handed to it."""

    def __init__(self) -> None:
        self.did: list[str] = []
        self.endpoint = None

    def take_frames(self, now: float) -> list[str]:
        del now
        return ["receipt"]

    def bar(self, trouble: str, now: float) -> None:
        del now
        self.did.append(f"bar {trouble}".strip())

    def on_timer(self, now: float) -> None:
        del now
        self.did.append("timer")

    def next_wake(self, now: float) -> float:
        return now + 7.0


def test_while_a_lease_is_in_doubt_no_frame_leaves_and_nothing_is_taken_in() -> None:
    ground, lease = Ground(), SimpleNamespace(is_deaf=False, is_lost=False, trouble="")
    leased = LeasedProcess(ground, lease)  # type: ignore[arg-type]
    for trouble, frames, did, wake in (
        ("", ["receipt"], ["timer"], 17.0),
        ("the router is away", [], ["bar the router is away"], 10.5),
        ("the router is away for 7 s", [], [], 10.5),
        ("", ["receipt"], ["bar", "timer"], 17.0),
        ("the router is away", [], ["bar the router is away"], 10.5),
    ):
        lease.trouble, ground.did = trouble, []
        leased.on_timer(10.0)
        assert ground.did == did
        assert leased.take_frames(10.0) == frames
        assert leased.next_wake(10.0) == wake


def test_a_database_in_the_place_of_ours_takes_nothing(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.add_message(survey(1, 1), 1.0)
        other = tmp_path / "other"
        other.mkdir()
        Store(url(other)).close()
        (other / "ground.sqlite").replace(tmp_path / "ground.sqlite")
        with pytest.raises(StoreError, match="was removed or replaced"):
            store.add_message(survey(1, 2), 1.0)


def test_every_start_is_counted_from_one_on(tmp_path: Path) -> None:
    for boots in (1, 2, 3):
        with contextlib.closing(Store(url(tmp_path))) as store:
            assert store.boots == boots
    with sqlite3.connect(tmp_path / "ground.sqlite") as database:
        assert database.execute("select value from meta where name = 'boots'").fetchone() == ("3",)
    database.close()


def test_a_damaged_moment_is_passed_over_and_those_behind_it_are_not(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.keep_moments("b", [moment(k) for k in (1, 2, 3)])
    with sqlite3.connect(tmp_path / "ground.sqlite") as database:
        database.execute("update moments set content = x'00' where number = 2")
    database.close()
    with contextlib.closing(Store(url(tmp_path))) as store:
        assert [one.number for one in store.moments("b")] == [1, 3]
        assert store.moment_numbers() == [1, 2, 3]


def test_moments_rest_on_what_is_assumed_of_the_rig_but_for_what_no_deviation_rests_on(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:

        def basis(**settings: Any) -> str:
            config = GroundConfig(folder=tmp_path, **settings)
            return MomentKeeper(store, config, SetupBook(config), SimpleNamespace(is_adjusted=True)).basis  # type: ignore[arg-type]

        usual = basis()
        others = [
            basis(gravity=9.79), basis(tube_length=2.5), basis(target=21.0), basis(mount_std_deg=0.123),
            basis(curvature_std_deg_per_m=0.123),
        ]  # fmt: skip
        assert len({usual, *others}) == 6
        assert basis(rig="rig-9") == basis(stale_after=12.5) == usual


def test_angles_of_joints_are_kept_each_time_one_is_known_first(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        string = KnownString(GroundConfig(folder=tmp_path))
        keeper = StringKeeper(store, string)
        known: dict[tuple[int, int], JointAngle] = {}
        for pair in ((4, 3), (3, 2), (2, 1)):
            known[pair] = string.joints.known[pair] = JointAngle(0.1 * pair[0], 1e-6)
            keeper.keep_joints()
            assert store.joints() == known
        del string.joints.known[3, 2]
        keeper.keep_joints()
        assert set(store.joints()) == {(4, 3), (2, 1)}


@pytest.mark.parametrize(("first", "second", "merged"), [(3, 5, 5), (5, 3, 5), (0, 4, 4), (4, 0, 4)])
def test_a_merge_has_the_later_epoch_and_the_depths_of_the_first_where_it_knows_them(
    tmp_path: Path, first: int, second: int, merged: int
) -> None:
    depths = {1: (1.0, 9.0, 1.0), 2: (None, 2.5, 2.5), 3: (3.0, None, 3.0), 4: (None, None, None)}
    for name, epoch, place in (("a", first, 0), ("b", second, 1)):
        (tmp_path / name).mkdir()
        with contextlib.closing(Store(url(tmp_path / name))) as store:
            for number, mds in depths.items():
                store.add_message(survey(1, number), mds[place])
            store.keep_epoch(epoch)
    done = merge_databases(tmp_path / "a", tmp_path / "b", tmp_path / "c")
    assert (done.shared, done.first_alone, done.second_alone) == (4, 0, 0)
    with contextlib.closing(Store(url(tmp_path / "c"))) as store:
        assert store.epoch() == merged
        assert {one.message.sequence: one.md for one in store.messages()} == {k: v[2] for k, v in depths.items()}


def test_of_too_many_series_of_a_tube_the_newest_are_remembered() -> None:
    numbers = MessageNumbers()
    for start in range(SERIES_KEPT + 3):
        numbers.add_number(1, (start << 24) + 1)
        numbers.add_number(1, (start << 24) + 3)
    first = 3 << 24
    assert numbers.gap(1) == (first + 2, first + 2)
    numbers.give_up(1, (first + 2, first + 2))
    assert numbers.gap(1) == ((4 << 24) + 2, (4 << 24) + 2)


@pytest.mark.parametrize(
    ("told", "gap", "left"),
    [(5, (3, 5), None), (7, (3, 5), (6, 7)), (9, (4, 6), (3, 3)), (9, (3, 3), (4, 9)), (9, (5, 9), (3, 4))],
)
def test_numbers_that_are_given_up_are_those_of_the_range_and_no_other(
    told: int, gap: tuple[int, int], left: tuple[int, int] | None
) -> None:
    numbers = MessageNumbers()
    for number in (1, 2):
        numbers.add_number(1, number)
    assert not numbers.on_told(1, told)
    numbers.give_up(1, gap)
    assert numbers.gap(1) == left


@pytest.mark.parametrize(("newest", "is_anew"), [(4, True), (5, False), (6, False), ((1 << 24) + 1, True), (0, False)])
def test_a_tube_counts_anew_where_its_newest_number_is_below_what_was_known(newest: int, is_anew: bool) -> None:
    numbers = MessageNumbers()
    for number in range(1, 6):
        numbers.add_number(1, number)
    assert numbers.on_told(1, newest) == is_anew
