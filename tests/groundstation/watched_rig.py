"""A watch beside a string, a hole and places that are plain values, and the alarms that it raises."""

from types import SimpleNamespace
from typing import Any

from groundstation.service.alarms.watch import Watch
from groundstation.service.string.depth import CONTRADICTION
from telemetry.messages import Event, NodeFlag, NodeMode, Severity


class Alarms:
    """Takes down what is told, in order."""

    def __init__(self) -> None:
        self.told: list[tuple[str, ...]] = []
        self.standing: set[tuple[str, str]] = set()

    def advance(self, now: float, rig_now: float) -> None:
        self.told.append(("advance", f"{now:g}", f"{rig_now:g}"))

    def hold(self, kind: str, subject: str, detail: str) -> None:
        if detail:
            self.told.append(("hold", kind, subject, detail))
            self.standing.add((kind, subject))
        elif (kind, subject) in self.standing:
            self.clear(kind, subject)

    def alert(self, kind: str, subject: str, detail: str) -> None:
        self.told.append(("alert", kind, subject, detail))
        self.standing.add((kind, subject))

    def clear(self, kind: str, subject: str) -> None:
        if (kind, subject) in self.standing:
            self.told.append(("clear", kind, subject))
            self.standing.discard((kind, subject))

    def stands(self, kind: str, subject: str) -> bool:
        return (kind, subject) in self.standing

    def new(self) -> list[tuple[str, ...]]:
        """What was told since the last time, but for the time."""
        told, self.told = [one for one in self.told if one[0] != "advance"], []
        return told


class Numbers:
    """Gaps by hand."""

    def __init__(self) -> None:
        self.gaps: dict[int, tuple[int, int]] = {}
        self.tubes = [1, 2]
        self.given_up: list[tuple[int, tuple[int, int]]] = []
        self.anew: set[int] = set()

    def gap(self, tube: int) -> tuple[int, int] | None:
        return self.gaps.get(tube)

    def newest(self, tube: int) -> int:
        return 100 * tube

    def give_up(self, tube: int, numbers: tuple[int, int]) -> None:
        self.given_up.append((tube, numbers))

    def on_told(self, tube: int, newest: int) -> bool:
        return newest in self.anew


class Doubled(set[int]):
    def __init__(self) -> None:
        super().__init__()
        self.untold: list[int] = []

    def newest(self, tube: int) -> Any:
        return SimpleNamespace(upper=3, lower=7)

    def upper_of(self, tube: int) -> int:
        return 1000 + tube


class Rig:
    """What a watch looks at, nothing wrong with it, and the watch."""

    def __init__(self) -> None:
        self.ages = {1: 0.5, 2: 0.7}
        self.stale: set[int] = set()
        self.doubled = Doubled()
        self.numbers = Numbers()
        self.time = SimpleNamespace(epoch=4, rig_now=100.0)
        self.states = SimpleNamespace(
            newest={}, age=lambda tube: self.ages[tube], is_stale=lambda tube: tube in self.stale
        )
        self.joints = SimpleNamespace(on_motion=self._on_motion, on_yaw=self._on_yaw)
        self.moved: list[int] = []
        self.yaws: list[Any] = []
        self.change: Any = None
        self.depths = SimpleNamespace(
            jumped="", refusals={CONTRADICTION: 0}, accepted_at=lambda epoch: ("accepted", epoch)
        )
        self.stops = Stops()
        self.misfit, self.by_surveys = "", ""
        self.string = SimpleNamespace(
            time=self.time, states=self.states, numbers=self.numbers, joints=self.joints, depths=self.depths,
            tubes=[1, 2], doubled=self.doubled, heard=[1, 2], knows_tubes=True, depth_heard_at=9.0, bit=5.0,
            stops=self.stops,
            tally=SimpleNamespace(misfit=lambda bit, heard: self.misfit and f"{self.misfit} {bit:g} {heard}"),
        )  # fmt: skip
        self.untrusted: set[int] = set()
        self.hole = SimpleNamespace(
            is_adjusted=True, is_unsolved=False, examined=SimpleNamespace(by_subject={}), turned_back=[],
            has_untrusted=lambda tube: tube in self.untrusted,
            depth_misfit=lambda at: self.by_surveys and f"{self.by_surveys} {at}",
        )  # fmt: skip
        self.placement = SimpleNamespace(waiting=[])
        self.alarms = Alarms()
        self.watch = Watch(self.string, self.hole, self.placement, self.alarms, 4.5)  # type: ignore[arg-type]

    def _on_motion(self, tube: int) -> None:
        self.moved.append(tube)

    def _on_yaw(self, tubes: list[int], yaw: Any) -> Any:
        self.yaws.append((list(tubes), yaw.tube, yaw.at, yaw.yaw, yaw.var))
        return self.change

    def look(self, now: float = 10.0) -> list[tuple[str, ...]]:
        self.watch.look(now)
        return self.alarms.new()


class Stops(list[Any]):
    def judge(self, epoch: int, rig_now: float) -> None:
        self.judged = (epoch, rig_now)


def event(code: str, tube: int = 3, sequence: int = 5, **arguments: Any) -> Event:
    return Event(tube, sequence, 90.0, Severity.WARNING, code, arguments)


def state(**change: Any) -> Any:
    """A node at rest with nothing wrong."""
    usual: dict[str, Any] = {
        "tube": 2, "at": 99.0, "yaw": 1.5, "yaw_var": 0.25, "systematic_var": 0.0, "mode": NodeMode.STILL,
        "flags": NodeFlag.NONE, "epoch": 4, "numbered": 8, "scale_factor": 0.0,
    }  # fmt: skip
    return SimpleNamespace(**{**usual, **change})
