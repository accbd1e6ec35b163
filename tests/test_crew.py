"""The crew's screen: its parts as text, and its tasks in textual's own driver on a real ground station."""

import asyncio
import html
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from full_stops import survey_stop
from hand_fed import Rig
from served import Served, serving

from borechain.client import Ground, connect_to_ground
from borechain.crew import screen_panels
from borechain.crew.app import CrewApp
from borechain.crew.picture import Picture, View
from borechain.crew.setup_panel import parse_order
from node.firmware.tube_settings import TubeSettings
from node.process.tube_process import TubeProcess

pytestmark = pytest.mark.slow

SIZE = (80, 24)
PATIENCE = 60.0  # s


class Clock:
    """Time of a screen, moved on by hand."""

    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A hole of 20 m that is on target after three stops."""
    rig = Rig(tmp_path_factory.mktemp("ground"), target=20.0)
    rig.run(5.0)
    for stop in range(1, 4):
        rig.drill(stop, 0.3)
    with serving(rig) as served:
        yield served


def shown(app: CrewApp) -> list[str]:
    """The lines on the screen as a reader sees them, cut where the screen is."""
    rows: dict[float, str] = {}
    for y, text in re.findall(r'<text[^>]* y="([0-9.]+)"[^>]*clip-path[^>]*>(.*?)</text>', app.export_screenshot()):
        rows[float(y)] = rows.get(float(y), "") + html.unescape(text).replace("\xa0", " ")
    return [rows[y] for y in sorted(rows)]


def stands(_rig: Rig) -> None:
    """The time of the rig does not go on."""


def speaks(rig: Rig) -> None:
    """Its tubes speak as they do all the time: on a busy machine the bus drops answers, and others follow them."""
    rig.speak(5)


async def until(
    app: CrewApp, served: Served, probe: Callable[[str], bool], meanwhile: Callable[[Rig], None] = stands
) -> str:
    """The screen once it shows something; the answers come over a real bus."""
    deadline = time.monotonic() + PATIENCE
    while True:
        app.paint()
        text = "\n".join(shown(app))
        if probe(text):
            return text
        assert time.monotonic() < deadline, text
        await asyncio.to_thread(served.do, meanwhile)


def drift(rig: Rig) -> None:
    rig.drill(4, 1.0)
    rig.drill(5, 1.9)


async def test_from_the_alarm_to_the_right_answers_with_one_key(served: Served) -> None:
    """Which hole, how deep, which way, what to do: on the screen with the alarm; one key acknowledges it."""
    with connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(ground, "rig-1", "anna", Clock())
        async with app.run_test(size=SIZE) as pilot:
            text = await until(app, served, lambda text: "ON TARGET" in text and "MD 6.0/20.0 m" in text)
            assert "go on" in text
            await asyncio.to_thread(served.do, drift)
            # each part of the screen is an answer of its own, and those of the way to this depth come first
            header = "HOLE rig-1 * live 0.0s  MD 10.0/20.0 m  tubes 5  health good  alarms 1"
            told = "STEER: ends 73 ± 19 cm (95 %) at 0 deg N; within 45 cm: < 1 %"  # its deadline stands below
            row = ">  1 raised projection 20.0 m 0 deg N: 80 ± 43 cm (95 %) over 100 % of 45 cm"
            text = await until(app, served, lambda text: all(part in text for part in (header, told, row)), speaks)
            lines = text.splitlines()
            assert len(lines) <= SIZE[1]
            assert lines[0].rstrip() == header
            assert lines[1].strip() == told
            assert lines[2].strip() == "steer to 180 deg S before 10.1 m, 0.1 m are left"
            await pilot.press("a")
            text = await until(
                app, served, lambda text: "acknowledge alarm 1: done" in text and "1 ack anna proj" in text, speaks
            )
            await pilot.press("a")
            await until(app, served, lambda text: "alarm 1: anna has acknowledged it" in text, speaks)


class Lossy:
    """A ground station of whose published answers the bus drops some."""

    def __init__(self, ground: Ground, dropped: set[str]) -> None:
        self.ask, self.order = ground.ask, ground.order
        self._ground = ground
        self._dropped = dropped

    def follow(self, path: str, call: Callable[[str, View], object]) -> None:
        self._ground.follow(path, lambda path, view: None if path in self._dropped else call(path, view))


async def test_what_the_bus_has_dropped_is_asked_for(tmp_path: Path) -> None:
    """An alarm that was acknowledged is shown so, though no word of it arrived."""
    rig = Rig(tmp_path, target=20.0)
    for stop in range(1, 4):
        rig.drill(stop, 0.3)
    with serving(rig) as served, connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(Lossy(ground, {"alarms", "orders", "status"}), "rig-1", "anna", Clock())
        async with app.run_test(size=SIZE):
            await app.workers.wait_for_complete()  # every answer of the beginning has arrived
            await asyncio.to_thread(served.do, drift)
            await until(app, served, lambda text: ">  1 raised projection" in text and "MD 10.0" in text, speaks)
            await asyncio.to_thread(ground.order, "alarm", "ben", action="acknowledge", number=1)
            await until(app, served, lambda text: ">  1 ack ben proj" in text, speaks)


async def test_a_ground_station_that_is_frozen_is_dont_know_and_not_green(served: Served) -> None:
    clock = Clock()
    with connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(ground, "rig-1", "anna", clock)
        async with app.run_test(size=SIZE):
            await app.workers.wait_for_complete()  # every answer of the beginning has arrived
            await until(app, served, lambda text: "* live 0.0s" in text and "DON'T KNOW" not in text)
            clock.now += 4.0
            await until(app, served, lambda text: "* live 4.0s" in text and "DON'T KNOW" not in text)
            clock.now += 1.0
            text = await until(app, served, lambda text: "DON'T KNOW: no verdict from the ground" in text)
            assert "NOT LIVE" in text.splitlines()[0]
            assert "do not count on it" in text


async def test_without_a_ground_station_the_screen_says_so(served: Served) -> None:
    with connect_to_ground(served.endpoint, "rig-7", timeout=10.0) as ground:
        app = CrewApp(ground, "rig-7", "anna", Clock())
        async with app.run_test(size=SIZE) as pilot:
            text = "\n".join(shown(app))
            assert "DON'T KNOW: no ground station has been heard yet" in text
            await pilot.press("t", "a")
            assert "acknowledge: no alarm is open" in "\n".join(shown(app))


def picture(**answers: Any) -> Picture:
    found = Picture("rig-1")
    for path, view in answers.items():
        found.on_answer(path, view, 0.0)
    return found


def alarm(number: int, **more: Any) -> dict[str, Any]:
    row = {
        "number": number, "state": "raised", "code": "clock", "level": "bad", "subject": f"tube {number}",
        "detail": "its rig time is ahead", "threshold": "", "md_m": None, "wind": None, "azimuth_deg": None,
        "acknowledged_by": None,
    }  # fmt: skip
    return row | more


def test_the_chosen_alarm_is_in_sight_however_many_there_are() -> None:
    many = picture(
        alarms={"revision": 1, "utc": "", "open": [alarm(n) for n in range(40)], "flood": True, "left_out": 9}
    )
    for chosen in (0, 3, 17, 39):
        lines = screen_panels.alarms_panel(many, chosen, 5).plain.splitlines()
        assert len(lines) == 5
        assert lines[0].startswith("ALARMS 40 open  FLOOD, 9 more")
        assert [line for line in lines if line.startswith(">")] == [lines[1 + min(chosen, 3)]]
        assert f">{chosen:3d} raised clock tube {chosen}" in "\n".join(lines)


def test_a_long_string_shows_the_tubes_that_are_not_well() -> None:
    tubes = [{"tube": n, "md_m": None, "age_s": 0.5, "stale": n in (3, 40)} for n in range(50, 0, -1)]
    lines = screen_panels.string_panel(picture(string={"revision": 1, "utc": "", "tubes": tubes})).plain.splitlines()
    assert len(lines) == screen_panels.PLAN_HEIGHT
    assert lines[0].endswith("(50)")
    assert [int(line.split()[0]) for line in lines[1:3]] == [40, 3]


def test_the_joints_of_a_wall_stand_below_the_string_the_worst_first() -> None:
    joint = {"joint": "H3-H2", "thickness_m": 0.784, "probability_where_surveyed": 0.97}
    joints = [joint | {"joint": "H3-H4", "thickness_m": 0.91, "probability_where_surveyed": 2e-7}, joint]
    wall = {"problem": None, "required_thickness_m": 0.8, "allowed_probability": 0.01, "joints": joints}
    tubes = [{"tube": n, "md_m": None, "age_s": 0.5, "stale": False} for n in range(20, 0, -1)]
    found = picture(
        string={"revision": 1, "utc": "", "tubes": tubes}, wall={"revision": 1, "utc": "", "wall": wall}
    )  # fmt: skip
    lines = screen_panels.string_panel(found).plain.splitlines()
    assert len(lines) == screen_panels.PLAN_HEIGHT
    assert lines[-2:] == ["H3-H2 78 cm P(thin) 1", "H3-H4 91 cm P(thin) 2e-07"]


def test_every_line_fits_the_screen() -> None:
    long = picture(
        alarms={"revision": 1, "utc": "", "open": [alarm(1, detail="x" * 300, wind="NNE", azimuth_deg=22, md_m=12.0)]},
        verdict={
            "revision": 1, "utc": "", "verdict": "out", "by_surveys": "out", "line": "x" * 200, "why": ["y" * 200],
            "todo": "z" * 200, "off": None, "steer": None, "good_for_s": 4.5, "target_m": 20.0,
        },
        orders={"revision": 1, "utc": "", "orders": []},
    )  # fmt: skip
    for part in (
        screen_panels.header_panel(long, 0.0),
        screen_panels.verdict_panel(long, 0.0),
        screen_panels.alarms_panel(long, 0, 5),
        screen_panels.actions_panel(long, 2),
    ):
        assert max(map(len, part.plain.splitlines())) <= screen_panels.WIDTH


@pytest.mark.parametrize(
    ("off", "half_width", "within", "shown"),
    [
        (22.0, 4.0, 99.4, " ends |    -x-     |P 99%"),
        (38.0, 12.0, 88.0, " ends |      ----x->P 88%"),  # up to 50 of 45 cm
        (70.0, 15.0, 0.3, " ends |            >P  0%"),
        (2.0, 9.0, 100.0, " ends |x--         |P100%"),
    ],
)
def test_the_end_is_shown_as_what_it_may_be(off: float, half_width: float, within: float, shown: str) -> None:
    """Twelve cells are the limit: the interval of 95 %, the place expected in it, an arrow where it goes beyond."""
    row = {"deviation_cm": off, "limit_cm": 45.0}
    found = screen_panels.ending_row(row, {"half_width_cm": half_width, "within_percent": within})
    assert found.plain.rstrip() == shown
    assert len(found.plain) == screen_panels.STRIP_WIDTH


def test_a_line_that_is_too_long_leaves_the_deadline_to_the_line_below() -> None:
    line = "WATCH: ends 38 ± 12 cm (95 %) at 253 deg WSW; within 45 cm: 88 %; act before 14.0 m"
    assert screen_panels.short_line(line) == "WATCH: ends 38 ± 12 cm (95 %) at 253 deg WSW; within 45 cm: 88 %"
    assert screen_panels.short_line(line[:78]) == line[:78]


def test_an_older_answer_does_not_replace_a_newer_one() -> None:
    found = picture(status={"revision": 7, "utc": "2026-01-01T00:00:02+00:00", "tubes": 2})
    found.on_answer("status", {"revision": 5, "utc": "2026-01-01T00:00:01+00:00", "tubes": 1}, 1.0)
    assert found.status["tubes"] == 2
    found.on_answer("status", {"revision": 1, "utc": "2026-01-01T00:00:09+00:00", "tubes": 3}, 2.0)  # after a restart
    assert found.status["tubes"] == 3


def test_an_answer_is_missed_that_is_of_before_its_path_changed_or_of_a_former_start() -> None:
    def at(revision: int, minute: int, **more: Any) -> dict[str, Any]:
        return {"revision": revision, "utc": f"2026-01-01T00:{minute:02d}:00+00:00"} | more

    known = picture(
        status=at(7, 5),
        verdict=at(3, 1),
        string=at(9, 2),
        column=at(9, 8),
        wall=at(2, 2),
        alarms=at(1, 4),
        setup=at(1, 4),
        adjustment=at(1, 4),
    )
    assert known.missed == []
    rows = [
        {"path": "status", "changed_at": 7},
        {"path": "alarms", "changed_at": 2},
        {"path": "events", "changed_at": 8},
    ]
    known.on_answer("changes", at(8, 6, changes=rows), 1.0)
    # of the two that are newer than the word of the changes one came after it, the other is of a former start
    assert known.missed == ["string", "alarms", "orders"]


@pytest.mark.parametrize(
    ("line", "name", "parameters"),
    [
        ("north action=tell angle_deg=12", "north", {"action": "tell", "angle_deg": "12"}),
        ("  accept_joints action=confirm ", "accept_joints", {"action": "confirm"}),
        ("take_survey tube=3", "take_survey", {"tube": "3"}),
    ],
)  # fmt: skip
def test_an_order_is_typed_as_its_name_and_its_parameters(line: str, name: str, parameters: dict[str, str]) -> None:
    assert parse_order(line) == (name, parameters)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("", "expected the name of an order, such as north"),
        ("north 12", "north: expected parameters as name=value, got 12"),
        ("north =12", "north: expected parameters as name=value, got =12"),
    ],
)
def test_a_line_that_is_no_order_is_told(line: str, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        parse_order(line)


async def test_north_is_missed_on_the_setup_panel_told_in_a_line_and_taken_back(tmp_path: Path) -> None:
    """The five-second task: which item costs most at the toe, and what is to be done next."""
    unknown = dict.fromkeys(("north_std_deg", "north_check_deg", "north_check_std_deg", "mount_tilt_std_deg"))
    rig = Rig(tmp_path, target=20.0, **unknown)
    rig.run(5.0)
    for stop in range(1, 4):
        rig.drill(stop, 0.3)
    with serving(rig) as served, connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(ground, "rig-1", "anna", Clock())
        async with app.run_test(size=SIZE) as pilot:
            await until(app, served, lambda text: "DON'T KNOW: not told: north" in text, speaks_of(3))
            await pilot.press("u")
            text = await until(app, served, lambda text: "NOT READY TO DRILL" in text, speaks_of(3))
            lines = [line.rstrip() for line in text.splitlines()]
            assert len(lines) <= SIZE[1]
            assert "NOT READY TO DRILL, not told: north" in lines
            assert "next: tell north: cmd/north?action=tell;angle_deg=..;sigma_deg=.." in lines
            head = next(place for place, line in enumerate(lines) if line.startswith("item"))
            told = rig.ask("setup")
            assert lines[head + 1].split()[:4] == ["north", f"{told['items'][0]['toe_cm']:.1f}", "any", "104"]
            worst = next(row for row in told["items"] if row["item"] == told["worst"])
            assert f"costs most at the toe: {worst['words']}, {worst['toe_cm']:.1f} cm" in lines
            await pilot.press("o", *"north action=tell angle_deg=12.5 sigma_deg=0.3", "enter")
            text = await until(app, served, lambda text: "not checked: north" in text, speaks_of(3))
            assert "next: check north: cmd/north?action=check;angle_deg=..;sigma_deg=.." in text
            await pilot.press("o", *"north action=check angle_deg=12.4 sigma_deg=0.3", "enter")
            text = await until(app, served, lambda text: "\nREADY TO DRILL" in text, speaks_of(3))
            todo = rig.ask("setup")["todo"]
            assert "north" not in todo
            assert f"next: {todo}" in text
            await pilot.press("o", *"setup action=undo", "enter")
            await until(app, served, lambda text: "not checked: north" in text, speaks_of(3))
            await pilot.press("o", *"setup action=undo", "enter")
            await until(app, served, lambda text: "NOT READY TO DRILL, not told: north" in text, speaks_of(3))
            await pilot.press("o", *"what", "escape", "u")
            await until(app, served, lambda text: "of the tolerance" in text, speaks_of(3))


async def test_a_board_is_checked_from_the_screen_and_what_is_wrong_stands_first(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "ground", target=20.0)
    rig.obey = TubeProcess(TubeSettings(1), tmp_path / "tube")._commands.obey  # a board without a reading yet
    rig.run(5.0)
    rig.drill(1, 0.3)
    with serving(rig) as served, connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(ground, "rig-1", "anna", Clock())
        async with app.run_test(size=SIZE) as pilot:
            await until(app, served, lambda text: "tubes 1" in text, speaks_of(1))
            await pilot.press("o", *"check_board tube=1", "enter")
            text = await until(app, served, lambda text: "[esc] back" in text, speaks_of(1))
            lines = [line.rstrip() for line in text.splitlines()]
            assert len(lines) <= SIZE[1]
            head = next(place for place, line in enumerate(lines) if "[esc] back" in line)
            assert lines[head].startswith("check_board tube=1: done: wrong: readings")
            assert lines[head + 1] == "readings: 0 of the last 0 cycles"
            assert "disk: " in text
            assert "of the tolerance" not in text
            await pilot.press("escape")
            await until(app, served, lambda text: "of the tolerance" in text, speaks_of(1))


async def test_what_the_tubes_say_opens_with_one_key_and_names_a_sensor_that_stepped(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=20.0, accelerometer_bias_std_deg=0.06, mount_tilt_std_deg=0.05, north_std_deg=0.3)
    rig.run(5.0)
    for stop in range(1, 5):
        survey_stop(rig, stop)
    with serving(rig) as served, connect_to_ground(served.endpoint, timeout=10.0) as ground:
        app = CrewApp(ground, "rig-1", "anna", Clock())
        async with app.run_test(size=SIZE) as pilot:
            await pilot.press("w")
            text = await until(app, served, lambda text: "all 10 readings fit together" in text, speaks_of(4))
            lines = [line.rstrip() for line in text.splitlines()]
            assert len(lines) <= SIZE[1]
            assert "all 10 readings fit together: nothing is wrong" in lines
            assert any(line.startswith("next stop: ") for line in lines)
            head = next(place for place, line in enumerate(lines) if line.startswith("sigma "))
            sigma = float(lines[head].split()[1])
            parts = [line.split(maxsplit=3) for line in lines[head + 1 : head + 6]]
            parts = [one for one in parts if one[2:3] == ["%"]]
            assert len(parts) >= 3
            assert sum(float(cm) ** 2 for cm, *_ in parts) ** 0.5 == pytest.approx(sigma, rel=0.1)
            assert any(line.startswith("not in it: ") for line in lines)

            def stepped(hand: Rig) -> None:
                for stop in range(5, 8):
                    survey_stop(hand, stop, 0.16)

            await asyncio.to_thread(served.do, stepped)
            text = await until(app, served, lambda text: "1 THING IS WRONG" in text, speaks_of(7))
            assert "accelerometer of tube 3 steps by" in text
            assert "\nor mount of tube 3 tilted by" in text
            assert "\ndo: go on, it is put right; calibrate tube 3 or change it when it is out; toe " in text
            await pilot.press("w")
            await until(app, served, lambda text: "of the tolerance" in text, speaks_of(7))


def speaks_of(tubes: int) -> Callable[[Rig], None]:
    """A rig of so many tubes that speaks as it does all the time."""
    return lambda rig: rig.speak(tubes)
