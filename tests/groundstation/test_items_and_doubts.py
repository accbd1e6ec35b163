"""Items of a setup and doubts of a verdict one by one: what each is of, how well it is known, and when it is one."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_setup_seen_twice import joint

from groundstation.config import GroundConfig
from groundstation.service.alarms import verdict_doubts as room
from groundstation.service.alarms.verdict_words import VerdictDoubt
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_items import SetupItem, SetupSource, setup_items, shown_marks
from groundstation.service.setup.told_value import SetupKind, ToldValue
from telemetry.messages import NodeFlag

DEG = math.pi / 180.0
ANY_YAW = math.pi / math.sqrt(3.0)


def string_of(*tubes: int, **states: Any) -> Any:
    newest = {int(name[1:]): state for name, state in states.items()}
    return SimpleNamespace(tubes=list(tubes), states=SimpleNamespace(newest=newest))


def state(std: float = 0.0, version: int = 0) -> Any:
    return SimpleNamespace(alignment=(0.1, -0.2, std), parameters_version=version)


def items_of(folder: Path, string: Any, book: SetupBook | None = None, **settings: Any) -> dict[str, SetupItem]:
    config = GroundConfig(folder=folder, **settings)
    return {item.name: item for item in setup_items(config, book or SetupBook(config), string)}


def test_items_of_a_rig_of_which_nothing_was_told(tmp_path: Path) -> None:
    found = items_of(
        tmp_path, string_of(), gravity=9.8, play_std_deg=0.2, curvature_std_deg_per_m=0.3, depth_scale_std=0.004
    )
    assert {
        name: (item.values, item.sigma, item.unit, item.source.value, item.is_missing) for name, item in found.items()
    } == {
        "north": ((), pytest.approx(ANY_YAW), "rad", "default", True),
        "collar": ((0.0, 0.0), pytest.approx(DEG), "rad", "design", False),
        "stick_up": ((0.0,), 0.1, "m", "default", False),
        "depth_scale": ((1.0,), 0.004, "1", "default", False),
        "play": ((0.0,), pytest.approx(0.2 * DEG), "rad", "default", False),
        "path": ((0.0,), pytest.approx(0.3 * DEG), "rad/m", "default", False),
        "gravity": ((9.8,), 2e-3, "m/s^2", "default", False),
    }
    wide = items_of(tmp_path, string_of(), depth_offset_std=7.0)
    assert wide["stick_up"].sigma == 7.0


def test_items_of_a_tube_by_what_its_node_says(tmp_path: Path) -> None:
    settings = {"accelerometer_bias_std_deg": 0.3, "mount_std_deg": 0.4, "mount_tilt_std_deg": 0.5, "tube_length": 2.5}
    found = items_of(
        tmp_path, string_of(3, 2, t3=state(0.02, 7), t2=state()), gravity=9.8, tube_length_std=0.01, **settings
    )
    assert [name for name in found if name.endswith(".3")] == [
        "length.3",
        "mount.3",
        "mount_turn.3",
        "accelerometer.3",
        "gyroscope.3",
    ]
    length, mount = found["length.3"], found["mount.3"]
    assert (length.values, length.sigma, length.source) == ((2.5,), 0.01, SetupSource.DESIGN)
    assert (mount.values, mount.sigma, mount.source) == ((0.1, -0.2), 0.02, SetupSource.MEASURED)
    other = found["mount.2"]
    assert (other.values, other.sigma, other.source) == ((0.0, 0.0), pytest.approx(0.5 * DEG), SetupSource.TOLD)
    assert found["mount_turn.2"].sigma == pytest.approx(0.4 * DEG)
    for tube, source in ((3, SetupSource.MEASURED), (2, SetupSource.TOLD)):
        item = found[f"accelerometer.{tube}"]
        assert (item.sigma, item.source) == (pytest.approx(0.3 * DEG * 9.8), source)
    assert [found[f"gyroscope.{tube}"].source.value for tube in (3, 2)] == ["measured", "design"]
    assert found["accelerometer.3"].detail == "block 7"
    bare = items_of(tmp_path, string_of(2, t2=state()))
    assert bare["accelerometer.2"].source is SetupSource.DESIGN
    assert bare["mount.2"].source is SetupSource.DESIGN


def test_a_joint_is_told_here_or_to_its_node_or_may_be_any(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.add([joint("4-3", 0.25, 0.02)])
    for tube, hops in ((4, 1), (3, 2), (2, 3)):
        book.on_flags(tube, hops, NodeFlag.LOWER_UNTOLD if tube == 3 else NodeFlag.NONE)
    found = items_of(tmp_path, string_of(4, 3, 2, 1), book)
    here, untold, node = found["joint.4-3"], found["joint.3-2"], found["joint.2-1"]
    assert (here.values, here.is_missing, here.detail) == ((0.25,), False, "by anna")
    assert (untold.values, untold.sigma, untold.is_missing) == ((), pytest.approx(ANY_YAW), True)
    assert untold.detail == "the node of tube 3 was not told: the yaw below may be any"
    assert (node.values, node.is_told, node.detail) == ((), True, "to the node of tube 2, which keeps the angle")


def test_what_is_shown_of_a_setup_is_another_once_any_part_of_it_is(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    strings = (
        string_of(3, 2, t3=state(), t2=state()),
        string_of(2, 3, t3=state(), t2=state()),
        string_of(3, 2, t3=state(0.1), t2=state()),
        string_of(3, 2, t3=state(), t2=state(0.0, 1)),
        string_of(3, 2, t3=state()),
    )
    marks = [shown_marks(book, string) for string in strings]
    book.add([ToldValue(1, SetupKind.LENGTH, "3", (2.0,), 0.01, "anna", "")])
    marks.append(shown_marks(book, string_of(3, 2, t3=state(), t2=state())))
    assert len(set(marks)) == len(marks)
    assert marks[-1] == shown_marks(book, string_of(3, 2, t3=state(), t2=state()))


# doubts


def known(bit: float | None = 10.0, age: float = 0.0, silent: tuple[int, ...] = (), **more: Any) -> Any:
    return SimpleNamespace(
        **{"time": SimpleNamespace(is_known=True), "bit": bit, "depth_age": age, "silent": list(silent),
           "tubes": [2, 1]}
        | more
    )  # fmt: skip


class Raised:
    """Alarms of a rig."""

    def __init__(self, *alarms: tuple[str, str, str]) -> None:
        self._alarms = alarms

    def __iter__(self) -> Any:
        for code, subject, detail in self._alarms:
            yield SimpleNamespace(kind=SimpleNamespace(code=code), subject=subject, detail=detail)

    def stands(self, code: str, subject: str) -> bool:
        return any((code, subject) == alarm[:2] for alarm in self._alarms)


def test_silence_is_doubted_by_what_is_silent() -> None:
    def doubts(string: Any, *alarms: tuple[str, str, str]) -> list[Any]:
        raised: Any = Raised(*alarms)
        return [(doubt.value, why) for doubt, why in room._doubts_of_time(string, raised, 5.0)]

    assert doubts(known(age=5.0)) == []
    assert doubts(known(age=5.1)) == [("stale", "no reading of the depth comes")]
    assert doubts(known(age=5.1), ("depth_silent", "depth", "")) == []  # it is told as an alarm already
    assert doubts(known(None)) == [("depth", "no depth of the bit is known")]
    assert doubts(known(silent=(2,))) == [("stale", "silent: tube 2")]
    assert doubts(known(silent=(2, 1))) == [("stale", "silent: tubes 2, 1")]
    assert doubts(known(tubes=[])) == [("stale", "no tube has been heard")]
    assert doubts(known(time=SimpleNamespace(is_known=False))) == [
        ("clock", "rig time is not known: the encoder is not heard")
    ]


def hole(*stations: tuple[float, bool], **more: Any) -> Any:
    made = [SimpleNamespace(md=md, is_trusted=trusted) for md, trusted in ((0.0, True), *stations)]
    return SimpleNamespace(
        **{"stations": made, "turned_back": [], "is_adjusted": True, "is_unsolved": False, "examined": None} | more
    )


def test_surveys_are_doubted_where_they_are_behind_turned_or_untrusted() -> None:
    def doubts(bit: float | None, hole: Any, *alarms: tuple[str, str, str]) -> list[Any]:
        raised: Any = Raised(*alarms)
        return [(doubt.value, why) for doubt, why in room._doubts_of_surveys(known(bit), hole, raised, 3.0)]

    assert doubts(99.0, hole()) == []  # nothing was surveyed: that is another doubt
    assert doubts(7.0, hole((2.0, False), (4.0, True))) == []
    assert doubts(None, hole((4.0, True))) == []
    assert doubts(7.01, hole((4.0, True))) == [("stale", "the bit is at 7.0 m, the deepest survey at 4.0 m")]
    assert doubts(4.0, hole((2.0, True), (4.0, False))) == [("yaw", "the yaw of the survey at 4.0 m is untrusted")]
    assert doubts(4.0, hole((4.0, True), turned_back=[2.0])) == [("yaw", "the survey at 2.0 m points back up the hole")]
    codes = ("depth_refused", "depth_contradicts", "depth_silent", "clock", "lease", "same_number", "disk")
    found = doubts(4.0, hole((4.0, True)), *((code, "a", "b") for code in codes))
    assert found == [(doubt, "a: b") for doubt in ("depth", "depth", "stale", "clock", "stale", "setup")]


def test_what_contradicts_itself_is_doubted_in_an_adjusted_hole() -> None:
    examined = SimpleNamespace(doubts=["one thing or another"], last_look=SimpleNamespace(toe=0.25))
    assert list(room._contradictions(hole(examined=examined))) == [(VerdictDoubt.CONTRADICTION, "one thing or another")]
    assert len(list(room._contradictions(hole(examined=examined, is_unsolved=True)))) == 2
    assert list(room._contradictions(hole(examined=examined, is_adjusted=False))) == []
    assert room._unfound_by_look(hole(examined=examined)) == 0.25
    assert room._unfound_by_look(hole(examined=examined, is_adjusted=False)) == 0.0
    assert room._unfound_by_look(hole(examined=SimpleNamespace(last_look=None))) == 0.0
    slipping = SimpleNamespace(unseen_drift=SimpleNamespace(toe=0.375))
    assert room._unfound_by_drift(hole(examined=slipping)) == 0.375
    assert room._unfound_by_drift(hole(examined=slipping, is_adjusted=False)) == 0.0
    assert room._unfound_by_drift(hole(examined=SimpleNamespace(unseen_drift=None))) == 0.0
