"""Defects that once were in the product, planted one by one: each is found, by seeds of the gauntlet or by a check of
its own that the product as it is passes."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from borechain.gauntlet import gauntlet_rig
from borechain.gauntlet.gauntlet_run import run_seed, shrink_outcome
from groundstation.errors import StoreError
from groundstation.service.answers import adjustment_views
from groundstation.service.disk import database
from groundstation.service.disk.keeper import StringKeeper
from groundstation.service.hole import placement as placement_module
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.learner import Learner
from groundstation.service.string import known_string as string_module
from groundstation.service.string.depth import DepthLog
from groundstation.service.string.stored import Stored
from groundstation.survey.fusion.trust_level import Trust
from node.firmware.tube_settings import TubeSettings
from node.process import counter as counter_module
from node.process.command_handlers import CommandHandlers
from node.process.tube_process import TubeProcess
from sim.gauntlet.faulty_disk import FaultyDisk
from telemetry.application.clock import ClockFilter
from telemetry.application.end_to_end import EndToEndDelivery
from telemetry.application.order_answers import KEPT, Answers
from telemetry.application.outbox import LIMIT, Outbox, Parcel
from telemetry.messages import BASE, ENCODER, Command, Hello, NodeMode, Receipt, Reply, Side, TimeReply
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.runtime.disk import Disk
from telemetry.transport import hop as hop_module
from telemetry.transport.hop import HopLink

Plant = Callable[[pytest.MonkeyPatch], None]
Found = Callable[[Path], str]


def seeds(*kinds: str, first: int = 1, count: int = 12) -> Found:
    """Found by the first of some seeds of these kinds, shrunk to the fewest; what it says."""

    def find(_folder: Path) -> str:
        for seed in range(first, first + count):
            outcome = run_seed(seed, kinds=kinds)
            if outcome.violations:
                worst = shrink_outcome(outcome)
                assert worst.schedule
                return worst.violations[0]
        return ""

    return find


# plants


def no_depth_bracket(patch: pytest.MonkeyPatch) -> None:
    def last_before(log: DepthLog, epoch: int, time: float) -> float | None:
        track = log._tracks.get(epoch)
        before = [md for at, md in zip(track.at, track.md, strict=True) if at <= time] if track is not None else []
        return before[-1] if before else None

    patch.setattr(DepthLog, "at", last_before)


def flags_ignored(patch: pytest.MonkeyPatch) -> None:
    for module in (placement_module, string_module):
        patch.setattr(module, "trust_of", lambda flags: max(Trust.FULL, Trust.UNDATED * bool(flags & 32)))


def receipt_before_the_store(patch: pytest.MonkeyPatch) -> None:
    plain = GroundProcess._keep_arrived

    def keep_arrived(process: GroundProcess) -> None:
        for one in process._learner._arrived:
            process.endpoint.mail.acknowledge(one.message)
        plain(process)

    patch.setattr(GroundProcess, "_keep_arrived", keep_arrived)


def refused_and_receipted(patch: pytest.MonkeyPatch) -> None:
    plain = Learner.store_arrived

    def store_arrived(learner: Learner, arrived: list[Stored]) -> list[bool]:
        try:
            return plain(learner, arrived)
        except StoreError:
            return [False] * len(arrived)

    patch.setattr(Learner, "store_arrived", store_arrived)


def synchronous_below_full(patch: pytest.MonkeyPatch) -> None:
    plain = database._make_durable

    def not_durable(connection: object, record: object) -> None:
        plain(connection, record)  # type: ignore[arg-type]
        connection.execute("PRAGMA synchronous=NORMAL")  # type: ignore[attr-defined]

    patch.setattr(database, "_make_durable", not_durable)


def boots_not_forced(patch: pytest.MonkeyPatch) -> None:
    def write(disk: Disk, path: Path, data: bytes) -> None:
        fresh = path.with_name(f"{path.name}.new")
        if disk.identity(fresh):
            disk.remove(fresh)
        disk.write(fresh, data)
        disk.rename(fresh, path)

    patch.setattr(counter_module, "replace_file", write)


def order_of_string_not_kept(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(StringKeeper, "keep_tally", lambda keeper: None)


def receipt_by_number(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(EndToEndDelivery, "_settle", lambda mail, receipt: mail._outbox.settle(receipt.sequence))


def order_not_saved(patch: pytest.MonkeyPatch) -> None:
    plain = TubeProcess.on_frame

    def on_frame(process: TubeProcess, *arguments: object) -> None:
        with pytest.MonkeyPatch.context() as inner:
            inner.setattr(TubeProcess, "_save", lambda _process: None)
            plain(process, *arguments)  # type: ignore[arg-type]

    patch.setattr(TubeProcess, "on_frame", on_frame)


def newest_dropped(patch: pytest.MonkeyPatch) -> None:
    def keep_payload(box: Outbox, sequence: int, payload: bytes, now: float, *, needed: bool = True) -> None:
        if len(box) < LIMIT:
            box._parcels[sequence] = Parcel(payload, now, needed=needed)

    patch.setattr(Outbox, "keep_payload", keep_payload)


def newest_answer_forgotten(patch: pytest.MonkeyPatch) -> None:
    plain = Answers.keep

    def keep(answers: Answers, sequence: int, payload: bytes) -> None:
        if len(answers.contents()) < KEPT:
            plain(answers, sequence, payload)

    patch.setattr(Answers, "keep", keep)


def clock_variance_of_one_hop(patch: pytest.MonkeyPatch) -> None:
    plain = ClockFilter.variance
    patch.setattr(
        ClockFilter, "variance", lambda clock, now: plain(clock, now) - (clock._told.clock_var if clock._told else 0.0)
    )


def unbounded_queue(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(hop_module, "QUEUE_LIMIT", 10**9)


# checks of their own


def tube(folder: Path, disk: FaultyDisk | None = None) -> TubeProcess:
    return TubeProcess(TubeSettings(1), folder, disk=disk or FaultyDisk(np.random.default_rng(1)))


def order(process: TubeProcess, number: int) -> None:
    """Order a tube something from a neighbour above."""
    link = HopLink(ENCODER, 1)
    link.last_heard = math.inf
    link.send_best_effort(encode_message(Hello(ENCODER, 1, 0, NodeMode.BOOT, 1.0)), "hello")
    link.send_best_effort(encode_message(Command(1, number, "parameters", {})), "command")
    for frame in link.take_frames(0.0):
        process.on_frame(Side.UPPER, frame.payload, 0.0)


def obeyed(patch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of the orders that are obeyed from now on."""
    numbers: list[int] = []
    plain = CommandHandlers.obey

    def obey(handlers: CommandHandlers, command: Command) -> Reply:
        numbers.append(command.sequence)
        return plain(handlers, command)

    patch.setattr(CommandHandlers, "obey", obey)
    return numbers


def an_order_is_obeyed_once_over_a_cut(folder: Path) -> str:
    disk = FaultyDisk(np.random.default_rng(1))
    with pytest.MonkeyPatch.context() as patch:
        numbers = obeyed(patch)
        order(tube(folder, disk), 7)
        disk.cut()
        order(tube(folder, disk), 7)
    return "" if numbers == [7] else f"obeyed {numbers}"


def the_last_of_many_orders_is_obeyed_once(folder: Path) -> str:
    process = tube(folder)
    with pytest.MonkeyPatch.context() as patch:
        numbers = obeyed(patch)
        for number in (*range(1, 71), 70):
            order(process, number)
    return "" if numbers == list(range(1, 71)) else f"obeyed {numbers[-3:]}"


def the_newest_survey_finds_a_place(folder: Path) -> str:
    del folder
    box = Outbox()
    for number in range(LIMIT + 5):
        box.keep_payload(number, b"survey", 0.0)
    return "" if box.payload(LIMIT + 4) else "the newest was dropped"


def a_receipt_of_other_content_settles_nothing(folder: Path) -> str:
    process = tube(folder)
    endpoint = process.endpoint
    process._send_event(1, "overrun", {"missed": 1, "overruns": 1})  # type: ignore[arg-type]
    link = HopLink(ENCODER, 1)
    link.last_heard = math.inf
    for number in range(1, 10):
        link.send_best_effort(encode_message(Receipt(1, number, b"\1" * 16)), number)
    before = endpoint.mail.outbox_size
    for frame in link.take_frames(0.0):
        process.on_frame(Side.UPPER, frame.payload, 0.0)
    return "" if endpoint.mail.outbox_size == before > 0 else "a message is forgotten"


def the_order_of_the_string_outlives_the_ground_station(folder: Path) -> str:
    gauntlet_rig.started_world.cache_clear()  # what the disks hold at the start was made by the product as it was
    rig = gauntlet_rig.new_rig("minute", 1, folder)
    gauntlet_rig.started_world.cache_clear()
    rig.scheduler.advance(rig.world.begin + gauntlet_rig.RESTED + 10.0)
    assert rig.ground is not None
    before = list(rig.ground.model.string.tally.tubes)
    rig.disk(BASE).cut()
    rig.cut(BASE)
    rig.start(BASE)
    after = rig.ground.model.string.tally.tubes
    rig.close()
    return "" if after == before == [2, 1] else f"{before} before, {after} after"


def the_variance_of_rig_time_is_that_of_all_hops(folder: Path) -> str:
    del folder
    clock = ClockFilter(is_root=False, epoch=0)
    clock.exchange(TimeReply(10.0, 10.0, 10.0, 10.0, 1.0, 0.25, 1), 10.001)
    return "" if clock.variance(10.0) >= 0.25 else f"{clock.variance(10.0):.2g} s^2, the neighbour states 0.25"


def a_link_without_a_neighbour_is_bounded(folder: Path) -> str:
    del folder
    link = HopLink(1, 1)
    for number in range(3000):
        link.send_reliable(number.to_bytes(4))
    return "" if link.waiting <= 600 else f"{link.waiting} wait"


def more_is_said_to_be_found(patch: pytest.MonkeyPatch) -> None:
    """The smallest blunder that is found is stated a hundred times too small."""
    patch.setattr(adjustment_views, "MILLI_G", 100.0 * adjustment_views.MILLI_G)


PLANTED: dict[str, tuple[Plant, Found]] = {
    "more is said to be found": (more_is_said_to_be_found, seeds("force-step", count=6)),
    "no depth bracket": (no_depth_bracket, seeds("depth-lost", count=20)),
    "flags ignored": (flags_ignored, seeds("gyro-stuck")),
    "receipt sent before the store has it": (receipt_before_the_store, seeds("ground-disk-refuses")),
    "refused and receipted all the same": (refused_and_receipted, seeds("ground-disk-refuses")),
    "synchronous below full": (synchronous_below_full, seeds("loss", count=2)),
    "boot counter not forced": (boots_not_forced, seeds("cut-again-and-again")),
    "order of the string not kept": (
        order_of_string_not_kept,
        the_order_of_the_string_outlives_the_ground_station,
    ),
    "receipt by number only": (receipt_by_number, a_receipt_of_other_content_settles_nothing),
    "obeyed order not saved": (order_not_saved, an_order_is_obeyed_once_over_a_cut),
    "full queue drops the newest": (newest_dropped, the_newest_survey_finds_a_place),
    "newest answer forgotten": (newest_answer_forgotten, the_last_of_many_orders_is_obeyed_once),
    "clock variance of one hop": (clock_variance_of_one_hop, the_variance_of_rig_time_is_that_of_all_hops),
    "unbounded queue": (unbounded_queue, a_link_without_a_neighbour_is_bounded),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_defect_is_found(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    plant, find = PLANTED[name]
    for folder in ("sound", "planted"):
        (tmp_path / folder).mkdir()
    if find.__name__ != "find":  # that seeds find nothing in the product as it is shows the gauntlet itself
        assert find(tmp_path / "sound") == ""
    else:  # strings before a seed begins are worked out once a process, so without the defect
        for plan in gauntlet_rig.PLANS:
            gauntlet_rig.make_ready(plan, range(gauntlet_rig.WORLDS))
    plant(monkeypatch)
    found = find(tmp_path / "planted")
    print(f"{name}: {found}")
    assert found != ""
