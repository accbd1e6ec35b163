"""Every step of a fault is done to a rig that only notes it: what is begun is ended, and is what the name says."""

from __future__ import annotations

import contextlib
import errno
import math
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sim.gauntlet.fault import Step, draw_interval
from sim.gauntlet.fault_kinds import KIND_OF
from sim.gauntlet.faulty_channel import FaultyChannel
from sim.gauntlet.faulty_disk import KEPT_BACKUPS, FaultyDisk, PowerCutError
from sim.gauntlet.faulty_world import MINUTE, FaultyWorld
from telemetry.messages import BASE, ENCODER, Side

BEGIN, END = 40.0, 100.0  # s
SEEDS = range(12)


class NotingRig:
    """A rig that notes what is asked of it; world, channel and disks are those of the gauntlet."""

    def __init__(self) -> None:
        self.world = FaultyWorld.of_tables(MINUTE, 1)
        self.channel = FaultyChannel(1, 0.01, 0.0, 0.0, 0.0)
        self.disks: dict[int, FaultyDisk] = defaultdict(lambda: FaultyDisk(np.random.default_rng(1)))
        self.noted: list[tuple[Any, ...]] = []
        self.now = 0.0

    def cut(self, address: int) -> None:
        self.noted.append(("cut", address))

    def start(self, address: int, tube: int | None = None) -> None:
        self.noted.append(("start", address) if tube is None else ("start", address, tube))

    def freeze(self, address: int) -> None:
        self.noted.append(("freeze", address))

    def thaw(self, address: int) -> None:
        self.noted.append(("thaw", address))

    def disk(self, address: int) -> FaultyDisk:
        return self.disks[address]

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        self.noted.append(("inject", address, side, len(frame) > 0))

    def send_depth(self, payload: bytes) -> None:
        self.noted.append(("depth", len(payload) > 0))

    def order(self, name: str, parameters: dict[str, str]) -> bool:
        self.noted.append(("order", name, parameters))
        return True


def drawn(kind: str, seed: int) -> list[Step]:
    steps = KIND_OF[kind].draw(np.random.default_rng(seed), BEGIN, END)
    assert all(BEGIN - 1e-9 <= step.at <= END + 1e-9 for step in steps) or kind == "ground-off-across-stop"
    return sorted(steps, key=lambda step: step.at)


def do(kind: str, seed: int, rig: NotingRig | None = None) -> NotingRig:
    rig = NotingRig() if rig is None else rig
    for step in drawn(kind, seed):
        rig.now = step.at
        step.act(rig)
    return rig


@pytest.fixture(scope="module")
def world() -> FaultyWorld:
    return FaultyWorld.of_tables(MINUTE, 1)


@pytest.mark.parametrize(
    ("kind", "addresses"),
    [
        ("node-cut", {1, 2}),
        ("encoder-cut", {ENCODER}),
        ("encoder-from-zero", {ENCODER}),
        ("ground-cut", {BASE}),
        ("ground-off-across-stop", {BASE}),
        ("node-memory-lost", {1, 2}),
        ("database-old", {BASE}),
        ("cut-while-saving", {BASE, 1, 2}),
    ],
)
def test_who_loses_the_power_gets_it_back(kind: str, addresses: set[int]) -> None:
    met = set()
    for seed in SEEDS:
        noted = do(kind, seed).noted
        assert [word for word, _ in noted] == (["start"] if kind == "cut-while-saving" else ["cut", "start"])
        assert len({address for _, address in noted}) == 1
        met.add(noted[0][1])
    assert met == addresses


def test_power_comes_and_goes_four_times_and_everybody_s_at_once() -> None:
    noted = do("cut-again-and-again", 3).noted
    assert Counter(word for word, _ in noted) == {"cut": 4, "start": 4}
    assert len({address for _, address in noted}) == 1
    steps = drawn("all-cut", 3)
    rig = do("all-cut", 3)
    assert [word for word, _ in rig.noted] == ["cut"] * 4 + ["start"] * 4
    assert (
        {address for _, address in rig.noted[:4]} == {address for _, address in rig.noted[4:]} == {BASE, ENCODER, 1, 2}
    )
    assert len({step.at for step in steps[:4]}) == 1
    assert len({step.at for step in steps[4:]}) == 4
    assert steps[-1].at - steps[4].at <= 3.0


def test_a_process_that_froze_goes_on_within_half_a_minute() -> None:
    for seed in SEEDS:
        (first, second), steps = do("frozen", seed).noted, drawn("frozen", seed)
        assert (first[0], second[0], first[1]) == ("freeze", "thaw", second[1])
        assert 0.0 < steps[1].at - steps[0].at <= 30.0


def test_a_tube_s_place_is_taken_by_its_neighbour_s_number_for_a_while() -> None:
    met = set()
    for seed in SEEDS:
        noted = do("same-number", seed).noted
        tube, number = noted[1][1:]
        met.add((tube, number))
        assert noted == [
            ("cut", tube), ("start", tube, number), ("cut", tube), ("start", tube),
            ("order", "same_number", {"tube": str(number), "which": {1: "upper", 2: "lower"}[tube]}),
        ]  # fmt: skip
    assert met == {(1, 2), (2, 1)}


def filled(rig: NotingRig) -> NotingRig:
    for address in (BASE, ENCODER, 1, 2):
        for name, data in (("slot-1", b"abcd"), ("boots", b"12"), ("surveys", b"log"), ("ground.sqlite", b"page")):
            rig.disk(address).replace(name, data + bytes([address]))
        rig.disk(address).backups = [b"old"]
    return rig


@pytest.mark.parametrize(
    ("kind", "left"),
    [
        ("node-memory-lost", {"boots", "surveys", "ground.sqlite"}),
        ("surveys-lost", {"slot-1", "boots", "ground.sqlite"}),
        ("encoder-boots-lost", {"slot-1", "surveys", "ground.sqlite"}),
        ("database-deleted", {"slot-1", "boots", "surveys"}),
    ],
)
def test_the_files_that_are_lost_are_those_of_the_name(kind: str, left: set[str]) -> None:
    rig = do(kind, 5, filled(NotingRig()))
    hit = rig.noted[0][1]
    assert set(rig.disk(hit).files) == left
    assert all(len(rig.disk(address).files) == 4 for address in (BASE, ENCODER, 1, 2) if address != hit)


def test_damaged_files_keep_their_first_half() -> None:
    rig = do("node-memory-rots", 5, filled(NotingRig()))
    hit = rig.noted[0][1]
    assert rig.disk(hit).held("*") == {
        "boots": b"12" + bytes([hit]),
        "ground.sqlite": b"page" + bytes([hit]),
        "slot-1": b"ab\xa5\xa5\xa5",
        "surveys": b"log" + bytes([hit]),
    }
    rig = do("boots-damaged", 5, filled(NotingRig()))
    assert rig.disk(rig.noted[0][1]).held("boots", "slot-*") == {
        "boots": b"1\xa5\xa5",
        "slot-1": b"abcd" + bytes([rig.noted[0][1]]),
    }
    rig = do("bytes-rot", 5, filled(NotingRig()))
    rotten, sound = rig.disk(rig.noted[0][1]), filled(NotingRig()).disk(rig.noted[0][1])
    flips = {
        name: sum((a ^ b).bit_count() for a, b in zip(data, sound.held(name)[name], strict=True))
        for name, data in rotten.held("*").items()
    }
    assert all(0 <= count <= 3 for count in flips.values())
    assert sum(flips.values()) > 4
    rig = do("database-old", 5, filled(NotingRig()))
    assert rig.disk(BASE).held("ground.sqlite") == {"ground.sqlite": b"old"}


def test_swapped_folders_are_each_other_s() -> None:
    rig = do("folders-swapped", 5, filled(NotingRig()))
    assert rig.noted == [("cut", 1), ("cut", 2), ("start", 1), ("start", 2)]
    assert {tube: rig.disk(tube).held("slot-1")["slot-1"][-1] for tube in (1, 2)} == {1: 2, 2: 1}
    assert all(len(rig.disk(tube).files) == 4 for tube in (1, 2))


def test_a_disk_refuses_for_a_while_and_its_process_may_start_meanwhile() -> None:
    met, restarts = set(), 0
    for seed in range(24):
        rig, steps = NotingRig(), drawn("node-disk-refuses", seed)
        refused = []
        for step in steps:
            step.act(rig)
            refused.append([disk.refusal for disk in rig.disks.values()])
        (address,) = rig.disks
        assert refused[-1] == [0]
        met.add((address, refused[0][0]))
        if len(steps) == 4:
            restarts += 1
            assert rig.noted == [("cut", address), ("start", address)]
        assert 0.0 < steps[-1].at - steps[0].at <= 60.0
    assert met == {(tube, number) for tube in (1, 2) for number in (errno.ENOSPC, errno.EROFS)}
    assert 4 < restarts < 20


CHANGES: dict[str, tuple[str, Any]] = {
    "loss": ("loss", 0.3), "bursts": ("burst", 0.02), "duplicates": ("duplicate", 0.5),
    "reordering": ("reordering", 0.3), "corruption": ("corrupt", 0.2),
    "joint-severed": ("severed", {(ENCODER, Side.LOWER), (1, Side.UPPER), (2, Side.UPPER)}),
    "joint-deaf": ("severed", {(ENCODER, Side.LOWER)}),
}  # fmt: skip


@pytest.mark.parametrize("kind", CHANGES)
def test_frames_are_disturbed_for_a_while_and_then_no_more(kind: str) -> None:
    name, during = CHANGES[kind]
    rig = NotingRig()
    before = dict(vars(rig.channel)) | {"severed": set(rig.channel.severed)}
    first, last = drawn(kind, 4)
    first.act(rig)
    assert {key for key, value in vars(rig.channel).items() if value != before[key]} == {name}
    assert getattr(rig.channel, name) == during
    last.act(rig)
    assert vars(rig.channel) == before


@pytest.mark.parametrize(
    ("kind", "name", "low", "high"), [("asymmetric", "port_loss", 0.6, 0.98), ("slow", "port_delay", 0.1, 1.5)]
)
def test_ports_are_bad_for_a_while(kind: str, name: str, low: float, high: float) -> None:
    met: set[Any] = set()
    for seed in range(40):
        rig = NotingRig()
        first, last = drawn(kind, seed)
        first.act(rig)
        ports = getattr(rig.channel, name)
        met |= ports.keys() if kind == "asymmetric" else {frozenset(ports)}
        assert all(low <= value <= high for value in ports.values())
        last.act(rig)
        assert not getattr(rig.channel, name)
    upper, lower = Side.UPPER, Side.LOWER
    ports = {(BASE, lower), (ENCODER, upper), (ENCODER, lower), (2, upper), (2, lower), (1, upper)}
    by_process = {frozenset(port for port in ports if port[0] == address) for address in (BASE, ENCODER, 1, 2)}
    assert met == (ports if kind == "asymmetric" else by_process)


READING = [0.5, 0.6, 0.7, 3.0, 4.0, -8.0, 21.0, 0]
SPOILED: dict[str, list[Any]] = {
    "gyro-stuck": [0.1, 0.1, 0.1, 3.0, 4.0, -8.0, 21.0, 0],
    "gyro-saturated": [0.5, 0.6, 8.7266, 3.0, 4.0, -8.0, 21.0, 0],  # 500 deg/s
    "gyro-saturated-below": [0.5, 0.6, -8.7266, 3.0, 4.0, -8.0, 21.0, 0],
    "gyro-step": [0.5, 0.6, 0.7 + math.radians(3.0), 3.0, 4.0, -8.0, 21.0, 0],
    "gyro-scale": [0.5, 0.6, 0.77, 3.0, 4.0, -8.0, 21.0, 0],
    "force-stuck": [0.5, 0.6, 0.7, 1.0, 2.0, -9.0, 21.0, 0],
    "force-saturated": [0.5, 0.6, 0.7, -8 * 9.81, 4.0, -8.0, 21.0, 0],
    "not-finite": [math.nan, 0.6, 0.7, 3.0, 4.0, -8.0, 21.0, 0],
}


@pytest.mark.parametrize("kind", SPOILED)
def test_a_sensor_reads_for_a_while_what_the_name_says(kind: str) -> None:
    met = set()
    for seed in SEEDS:
        rig = NotingRig()
        first, last = drawn(kind, seed)
        first.act(rig)
        ((tube, spoil),) = rig.world.spoilers.items()
        met.add(tube)
        assert spoil(list(READING)) == pytest.approx(
            SPOILED[kind], abs=0.03 if "saturated" in kind else 5e-4, nan_ok=True
        )
        last.act(rig)
        assert not rig.world.spoilers
        assert 0.0 < last.at - first.at <= 60.0
    assert met == {1, 2}


def test_encoder_and_depth_fail_and_mend_as_their_names_say() -> None:
    rig = NotingRig()
    first, last = drawn("encoder-dead", 2)
    rig.now = first.at
    first.act(rig)
    assert rig.world.stuck_at == first.at
    last.act(rig)
    assert rig.world.stuck_at is None
    slips = [do("encoder-slips", seed).world.slipped for seed in range(30)]
    assert {slip > 0 for slip in slips} == {True, False}
    assert all(0.05 * 4096 - 1 <= abs(slip) <= 0.45 * 4096 for slip in slips)
    for kind, metres in (("depth-jumps-up", -1.5), ("depth-jumps-down", 0.8)):
        first, last = drawn(kind, 2)
        first.act(rig)
        assert rig.world.depth_error == metres
        last.act(rig)
        assert rig.world.depth_error == 0.0
    hidden = [do("depth-lost", seed).world.depth_hidden for seed in range(30)]
    assert 3 <= sum(hidden) <= 16  # of 30 with a probability of 0.3
    back, errors = drawn("depth-backwards", 2), []
    for step in back:
        step.act(rig)
        errors.append(rig.world.depth_error)
    assert errors[-1] == 0.0
    assert errors[:-1] == pytest.approx([-0.6 * (step.at - back[0].at) for step in back[:-1]])
    assert 6 <= len(back) <= 18
    from_zero = do("encoder-from-zero", 2)
    assert from_zero.world.zero == drawn("encoder-from-zero", 2)[0].at


def test_clocks_jump_ahead_and_drift_either_way() -> None:
    jumps = [do("clock-jumps", seed).world.jumps for seed in range(30)]
    assert {address for jump in jumps for address in jump} == {BASE, ENCODER, 1, 2}
    assert all(0.2 <= by <= 20.0 for jump in jumps for by in jump.values())
    twice = do("clock-jumps", 1, do("clock-jumps", 1)).world.jumps
    assert sum(twice.values()) == pytest.approx(2.0 * sum(jumps[1].values()))
    rates = [rate for seed in range(30) for _, rate in do("clock-drifts", seed).world.drifts.values()]
    assert min(rates) < -5e-4
    assert max(rates) > 5e-4
    assert max(map(abs, rates)) <= 1e-3


@pytest.mark.parametrize("address", [ENCODER, 1, BASE])
def test_a_clock_is_read_back_whatever_was_done_to_it(address: int, world: FaultyWorld) -> None:
    rig = world.healthy()
    plain = rig.local_clock(address, 70.0)
    rig.zero, rig.jumps = 30.0, {address: 2.5}
    rig.let_drift(address, 50.0, 1e-3)
    off = 2.5 + 1e-3 * 20.0 - (30.0 if address == ENCODER else 0.0)
    assert rig.local_clock(address, 70.0) - plain == pytest.approx(off)
    for t in (40.0, 50.0, 70.0, 99.0):
        assert rig.true_time(address, rig.local_clock(address, t)) == pytest.approx(t, abs=1e-5)
    rig.let_drift(address, 70.0, -1e-3)  # what was gained is kept
    assert rig.local_clock(address, 80.0) - world.local_clock(address, 80.0) == pytest.approx(off - 0.01, abs=1e-4)


def test_an_interval_is_over_by_the_end() -> None:
    random = np.random.default_rng(3)
    drawn_ones = [draw_interval(random, 10.0, 20.0, 2.0, 5.0) for _ in range(2000)]
    assert all(10.0 <= a < b <= 20.0 and a <= 19.0 and b - a <= 5.0 for a, b in drawn_ones)
    assert all(b - a >= 2.0 or b == 20.0 for a, b in drawn_ones)
    assert max(a for a, _ in drawn_ones) > 18.9


def test_a_cut_disk_has_what_was_forced_and_no_name_that_was_not() -> None:
    folder, outcomes = Path("x"), Counter[tuple[bool, bool]]()
    for seed in range(200):
        disk = FaultyDisk(np.random.default_rng(seed))
        disk.write(folder / "a", b"old" * 400)
        disk.force(folder / "a")
        disk.force_names(folder)
        disk.write(folder / "b", b"new")
        disk.write(folder / "a", b"NEW" * 400)
        disk.rename(folder / "b", folder / "c")
        disk.cut()
        outcomes["b" in disk.files, "c" in disk.files] += 1
        seen = disk.read(folder / "a")
        assert len(seen) == 1200
        for begin in range(0, 1200, 512):
            assert seen[begin : begin + 512] in {(word * 400)[begin : begin + 512] for word in (b"old", b"NEW")}
        disk.cut()
        assert disk.read(folder / "a") == seen
    assert set(outcomes) == {(False, False), (True, False), (False, True)}  # a rename is one step
    assert min(outcomes.values()) > 40


def test_the_power_goes_at_the_change_that_was_said_and_once() -> None:
    for left in range(4):
        disk, done = FaultyDisk(np.random.default_rng(left), writes_left=left), 0
        with contextlib.suppress(PowerCutError):
            for k in range(9):
                disk.write(Path("f"), bytes([65 + k]), k)
                done += 1
        assert done == left
        assert bytes(disk.read(Path("f")))[:left] == b"ABCD"[:left]
        disk.cut()
        assert disk.writes_left == -1
        disk.write(Path("g"), b"xyz")
        assert disk.read(Path("g"), 1, 1) == b"y"


def test_the_newest_backups_are_kept_in_order_and_a_copy_shares_nothing() -> None:
    disk = FaultyDisk(np.random.default_rng(1))
    disk.make_empty("db")
    for k in range(KEPT_BACKUPS + 4):
        disk.keep_image("db", b"%d" % k)
    assert disk.backups == [b"%d" % k for k in range(3, KEPT_BACKUPS + 3)]
    assert disk.kept("db") == b"%d" % (KEPT_BACKUPS + 3)
    disk.replace("zz", b"1")
    disk.replace("aa", b"2")
    assert list(disk.held("*")) == ["aa", "db", "zz"]
    assert disk.handled == 2
    copy = disk.copied(np.random.default_rng(2))
    copy.write(Path("aa"), b"9")
    assert (disk.read(Path("aa")), copy.handled, copy.refusal) == (b"2", 0, 0)
    disk.refusal = errno.ENOSPC
    with pytest.raises(OSError, match="No space left"):
        disk.force(Path("aa"))
