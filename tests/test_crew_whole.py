"""Every panel of the crew's screen whole, character by character, of answers in which no two numbers are equal."""

from __future__ import annotations

import datetime
from typing import Any

import pytest
from rich.text import Text

from borechain.crew.checks_panel import checks_panel
from borechain.crew.picture import Picture
from borechain.crew.reply_panel import reply_panel
from borechain.crew.screen_panels import (
    actions_panel,
    alarms_panel,
    header_panel,
    plan_panel,
    string_panel,
    strip_panel,
    verdict_panel,
)
from borechain.crew.setup_panel import setup_panel

HEAD = {"revision": 1, "utc": "2026-05-04T06:00:00Z"}
VERDICT = {
    "verdict": "steer", "by_surveys": "steer", "line": "STEER: 12.3 cm off towards 45 deg NE; act before 17.5 m",
    "todo": "steer by 0.5 deg to 225 deg", "why": ["within 45 cm: 41 %", "act before 17.5 m", "one tube alone"],
    "target_m": 20.0, "good_for_s": 4.0,
}  # fmt: skip


def station(md: float, north: float, east: float, used: float) -> dict[str, float]:
    return {"md_m": md, "north_cm": north, "east_cm": east, "limit_cm": 45.0, "used_percent": used}


COLUMN = {
    "stations": [
        station(0.0, 0.0, 0.0, 0.0), station(2.0, 0.0, 10.0, 22.2), station(4.0, 10.0, 20.0, 79.9),
        station(6.0, 20.0, 20.0, 80.0), station(8.0, 30.0, 20.0, 99.9), station(10.0, 40.0, 20.0, 100.0),
    ],
    "projection": station(20.0, -30.0, -40.0, 99.0) | {"deviation_cm": 30.0},
    "worst": station(9.0, 1.0, 2.0, 3.0), "ahead": {"half_width_cm": 7.5, "within_percent": 49.9},
}  # fmt: skip
TUBES = [
    {"tube": 9, "age_s": None},
    {"tube": 8, "age_s": 2000.0, "stale": True},
    {"tube": 6, "age_s": 0.4},
    {"tube": 4, "age_s": 3.0},
]
NODES = {
    8: {"yaw_deg": 350.06, "sigma_yaw_deg": 1.234, "mode": "tracking"},
    6: {"yaw_deg": 7.04, "sigma_yaw_deg": 0.056, "mode": "alignment", "flags": ["rate_exceeded"]},
    4: {"yaw_deg": 123.42, "sigma_yaw_deg": 12.3, "mode": "survey"},
}


def joint(name: str, thickness: float | None, chance: float | None) -> dict[str, Any]:
    return {"joint": name, "thickness_m": thickness, "probability_where_surveyed": chance}


WALL = {
    "problem": None, "required_thickness_m": 0.3, "allowed_probability": 0.01,
    "joints": [
        joint("A-B", 0.412, 0.0123), joint("B-C", 0.299, 0.2), joint("C-D", None, None), joint("D-E", 0.5, 0.01),
    ],
}  # fmt: skip


def alarm(number: int, state: str, level: str, **more: Any) -> dict[str, Any]:
    usual = {
        "code": f"code_{number}", "subject": "column", "md_m": None, "wind": None, "azimuth_deg": None, "threshold": "",
        "acknowledged_by": None, "detail": f"detail {number}",
    }  # fmt: skip
    return {"number": number, "state": state, "level": level} | usual | more


ALARMS = [
    alarm(11, "raised", "bad", md_m=12.34, wind="SW", azimuth_deg=225, threshold="50 % of 45 cm"),
    alarm(7, "acknowledged", "bad", acknowledged_by="anna", subject="tube 8"),
    alarm(5, "latched", "bad"),
    alarm(4, "raised", "degraded"),
    alarm(3, "shelved", "degraded"),
    alarm(2, "raised", "notice"),
]


@pytest.fixture
def picture() -> Picture:
    """All that a ground station says, heard at 100 s of the screen's clock."""
    made = Picture("rig-7")
    views: dict[str, Any] = {
        "verdict": VERDICT, "status": {"bit_md_m": 13.5, "health": "degraded", "tubes": 7}, "column": COLUMN,
        "wall": {"wall": WALL}, "alarms": {"open": ALARMS, "flood": True, "left_out": 5},
        "string": {"tubes": TUBES} | {"revision": 5}, **{f"nodes/{tube}": node for tube, node in NODES.items()},
    }  # fmt: skip
    for path, view in views.items():
        made.on_answer(path, HEAD | view, 100.0)
    return made


def lines(text: Text) -> list[str]:
    return [line.rstrip() for line in text.plain.split("\n")]


def styles(text: Text) -> list[str]:
    """Style of each line, none where it has none."""
    begins, at = [], 0
    for line in text.plain.split("\n"):
        begins.append(at)
        at += len(line) + 1
    found = {span.start: str(span.style) for span in text.spans}
    return [found.get(begin, str(text.style)) for begin in begins]


@pytest.mark.parametrize(
    ("now", "first", "style"), [(104.0, "* live 4.0s", "bold"), (104.5, "* NOT LIVE", "reverse bright_black")]
)
def test_the_head_says_whose_how_fresh_how_deep_and_what_stands(
    picture: Picture, now: float, first: str, style: str
) -> None:
    found = header_panel(picture, now)
    assert lines(found) == [f"HOLE rig-7 {first}  MD 13.5/20.0 m  tubes 7  health degraded  alarms 6"]
    assert (len(found.plain), str(found.style)) == (80, style)


def test_the_verdict_is_three_lines_without_what_its_first_says_already(picture: Picture) -> None:
    found = verdict_panel(picture, 104.0)
    assert lines(found) == [
        " STEER: 12.3 cm off towards 45 deg NE; act before 17.5 m",
        " steer by 0.5 deg to 225 deg",
        " within 45 cm: 41 %; one tube alone",
    ]
    assert styles(found) == 3 * ["bold white on dark_orange3"]
    late = verdict_panel(picture, 106.5)
    assert lines(late) == [
        " DON'T KNOW: no verdict from the ground station for 6 s",
        " the surveys alone said steer; do not count on it",
        "",
    ]
    assert styles(late) == 3 * ["bold white on magenta"]


@pytest.mark.parametrize("path", ["status", "alarms", "string", "nodes/4"])
def test_nothing_but_a_verdict_makes_a_verdict_newer(picture: Picture, path: str) -> None:
    picture.on_answer(path, HEAD | picture.answers[path], 200.0)
    assert not picture.is_live(200.0)
    assert picture.age(201.0) == 1.0
    assert lines(verdict_panel(picture, 200.0))[0] == " DON'T KNOW: no verdict from the ground station for 100 s"


def test_the_plan_cell_by_cell(picture: Picture) -> None:
    """Half a metre is four and a half lines: 11 cm a line, 5.5 cm a letter."""
    assert lines(plan_panel(picture)) == [
        "           N",
        "       ........@",
        "     ..        o..",
        "    .          o  .",
        "   .           o   .",
        "   .       o o     .",
        "   .               .",
        "    .             .",
        "    x..         ..",
        "       .........",
        "",
    ]


def test_the_strip_letter_by_letter(picture: Picture) -> None:
    found = strip_panel(picture)
    assert lines(found) == [
        "  MD m  of the tolerance",
        "   2.0 |===   :  :  |  22%",
        "   4.0 |==========  |  80%",
        "   6.0 |==========  |  80%",
        "   8.0 |============| 100%",
        "  10.0 |============| 100%",
        " ends |      --x-  |P 50%",
    ]
    assert styles(found) == ["bold", "", "", "yellow", "yellow", "bold red", "bold red"]


@pytest.mark.parametrize(
    ("within", "style"), [(49.9, "bold red"), (50.0, "yellow"), (94.9, "yellow"), (95.0, ""), (100.0, "")]
)
def test_the_end_is_marked_by_its_chance(picture: Picture, within: float, style: str) -> None:
    picture.answers["column"] = COLUMN | {"ahead": {"half_width_cm": 7.5, "within_percent": within}}
    assert styles(strip_panel(picture))[-1] == style


def test_the_string_tube_by_tube_and_the_two_worst_joints(picture: Picture) -> None:
    found = string_panel(picture)
    assert lines(found) == [
        "tube yaw deg sigma age mode",
        "  9      -     -   - no state",
        "  8  350.1  1.23 999 silent",
        "  6    7.0  0.06   0 alignmen",
        "  4  123.4 12.30   3 survey",
        "B-C 30 cm P(thin) 0.2",
        "A-B 41 cm P(thin) 0.01",
    ]
    assert styles(found) == [
        "bold", "bright_black", "bold red", "yellow", "bright_black", "bold red", "yellow",
    ]  # fmt: skip
    picture.answers["wall"] = {"wall": WALL | {"joints": WALL["joints"][2:]}}  # type: ignore[index]
    calm = string_panel(picture)
    assert lines(calm)[-2:] == ["D-E 50 cm P(thin) 0.01", "C-D not surveyed yet"]
    assert styles(calm)[-2:] == ["bright_black", "bright_black"]
    picture.answers["wall"] = {"wall": WALL | {"problem": "no column of this name"}}
    assert lines(string_panel(picture))[-1] == "wall: no column of this name"


def test_a_node_that_is_newer_than_the_string_is_shown_as_it_says_itself(picture: Picture) -> None:
    node = {"tube": 6, "age_s": 0.4, "mode": "still", "yaw_deg": 8.0, "sigma_yaw_deg": 0.1, "stale": True}
    string = {"tubes": [{"tube": 6, "age_s": 60.0, "stale": False}], "revision": 7}
    for revision, shown in ((6, "  6    8.0  0.10  60 still"), (7, "  6    8.0  0.10   0 silent")):
        picture.answers |= {"string": HEAD | string, "nodes/6": HEAD | node | {"revision": revision}}
        assert lines(string_panel(picture))[1] == shown


@pytest.mark.parametrize(
    ("chosen", "numbers", "marked"),
    [
        (0, [11, 7, 5, 4], 11), (3, [11, 7, 5, 4], 4), (4, [7, 5, 4, 3], 3), (5, [5, 4, 3, 2], 2),
        (9, [5, 4, 3, 2], 2),  # those below have gone meanwhile: the last is what an order is about
    ],
)  # fmt: skip
def test_the_chosen_alarm_is_in_sight_and_marked(
    picture: Picture, chosen: int, numbers: list[int], marked: int
) -> None:
    head, *rows = lines(alarms_panel(picture, chosen, 5))
    assert head == "ALARMS 6 open  FLOOD, 5 more"
    assert [int(row[1:4]) for row in rows] == numbers
    assert [int(row[1:4]) for row in rows if row.startswith(">")] == [marked]


def test_an_alarm_says_its_state_place_way_and_threshold(picture: Picture) -> None:
    found = alarms_panel(picture, 0, 7)
    assert lines(found)[1:] == [
        "> 11 raised code_11 12.3 m 225 deg SW: detail 11 over 50 % of 45 cm",
        "   7 ack anna code_7 tube 8: detail 7",
        "   5 latched code_5: detail 5",
        "   4 raised code_4: detail 4",
        "   3 shelved code_3: detail 3",
        "   2 raised code_2: detail 2",
    ]
    assert styles(found)[1:] == ["bold red", "bright_black", "bold red", "yellow", "bright_black", ""]
    picture.answers["alarms"] = {"open": []}
    assert lines(alarms_panel(picture, 0, 5)) == ["ALARMS 0 open", "none"]


def test_orders_say_by_whom_what_to_whom_and_what_became_of_it(picture: Picture) -> None:
    orders = [
        {"tube": None, "action": "tell", "detail": "", "by": "ben", "command": "north", "state": "done"},
        {"tube": 4, "action": "", "detail": "no answer", "by": "anna", "command": "take_survey", "state": "failed"},
        {"tube": 3, "action": "", "detail": "", "by": "cora", "command": "align", "state": "sent"},
    ]
    picture.answers["orders"] = {"orders": orders}
    assert lines(actions_panel(picture, 3)) == [
        "ACTIONS", "anna: take_survey tube 4 failed: no answer", "cora: align tube 3 sent",
    ]  # fmt: skip
    assert lines(actions_panel(picture, 4))[1] == "ben: north tell done"


def item(name: str, **more: Any) -> dict[str, Any]:
    usual = {
        "item": name, "value": [], "sigma": 0.5, "unit": "deg", "toe_cm": 1.0, "told": True, "missing": False,
        "check": "", "utc": "", "source": "default",
    }  # fmt: skip
    return usual | more


def test_the_setup_item_by_item() -> None:
    items = [
        item("north", value=[1.25], sigma=0.31, toe_cm=2.34, utc="2026-05-04T05:31:00Z", source="anna"),
        item("collar", value=[0.5, 123.456], sigma=0.02, toe_cm=12.3, utc="2026-05-04T04:29:00Z", source="ben"),
        item("joint.4-3", told=False, missing=True, sigma=180.0, toe_cm=99.9),
        item("length.2", value=[2.0], unit="m", sigma=0.001, toe_cm=0.05, told=False, source="design"),
        item("length.1", value=[2.0], unit="m", sigma=0.001, toe_cm=0.049, told=False, source="design"),
        item("stick_up", value=[0.4], unit="m", sigma=0.01, check="contradicted by 0.6 m", utc="2026-05-04T04:31:00Z"),
        item("mount.3", sigma=1.0, check="checked by 0.1"),
        item("mount.2"),
    ]
    setup = {"ready": False, "hold": "not told: joint.4-3", "costs_most": "joint 4-3, 99.9 cm", "todo": "tell joint"}
    seen = Picture("rig-7", answers={"setup": setup | {"items": items}})
    found = setup_panel(seen, datetime.datetime(2026, 5, 4, 6, 0, tzinfo=datetime.UTC))
    assert lines(found) == [
        "NOT READY TO DRILL, not told: joint.4-3",
        "costs most at the toe: joint 4-3, 99.9 cm",
        "next: tell joint",
        "item            toe cm           value     sigma unit      age source",
        "north              2.3            1.25      0.31 deg    29 min anna",
        "collar            12.3    0.5 to 123.5      0.02 deg       2 h ben",
        "joint.4-3         99.9             any       180 deg         - default",
        "length.2           0.1               2     0.001 m           - design",
        "length.1           0.0               2     0.001 m           - design",
        "stick_up           1.0             0.4      0.01 m      89 min default contradi~",
        "mount.3            1.0     of its node         1 deg         - default checked ~",
    ]
    assert styles(found) == [
        "bold white on magenta", "bold", "bold", "bold", "bright_black", "bright_black", "bold red", "yellow",
        "bright_black", "bold red", "bright_black",
    ]  # fmt: skip
    seen.answers["setup"] = setup | {"items": items, "ready": True}
    ready = setup_panel(seen, datetime.datetime(2026, 5, 4, 6, 0, tzinfo=datetime.UTC))
    assert lines(ready)[0] == "READY TO DRILL: north and every joint are told"
    assert styles(ready)[0] == "bold"


def part(words: str, sigma: float, percent: float) -> dict[str, Any]:
    return {"words": words, "sigma_cm": sigma, "percent": percent}


ADJUSTMENT: dict[str, Any] = {
    "said": "all 28 readings fit together", "blunders": [], "next_stop": {"words": "turn the string by 90 deg"},
    "sigma_toe_cm": 3.456, "toe_md_m": 14.0, "counts": True, "left_out": "mistakes too small to find",
    "unfound": [{"words": "a bias of 5 mg of tube 3 would not be found and has the toe 2 cm off"}],
    "parts": [
        part("bias of tube 1", 3.0, 75.4), part("north", 1.5, 18.6), part("joint 2-1", 0.75, 4.7),
        part("play", 0.3, 0.8), part("gravity", 0.24, 0.5), part("collar", 0.23, 0.49),
    ],
}  # fmt: skip


def test_what_the_tubes_say_line_by_line() -> None:
    seen = Picture("rig-7", answers={"adjustment": ADJUSTMENT})
    found = checks_panel(seen)
    assert lines(found) == [
        "all 28 readings fit together",
        "next stop: turn the string by 90 deg",
        "sigma 3.46 cm at 14.0 m; ± of 95 % is twice that; made of cm",
        "   3.00   75 %  bias of tube 1",
        "   1.50   19 %  north",
        "   0.75    5 %  joint 2-1",
        "   0.30    1 %  play",
        "   0.24    0 %  gravity",
        "a bias of 5 mg of tube 3 would not be found and has the toe 2 cm off",
        "not in it: mistakes too small to find",
    ]
    assert styles(found)[0] == "bold"
    seen.answers["adjustment"] = ADJUSTMENT | {"counts": False, "parts": 3 * ADJUSTMENT["parts"]}
    many = lines(checks_panel(seen))
    assert len(many) == 11
    assert many[2] == "sigma 3.46 cm at 14.0 m, beside stations fused one by one; ± of 95 % is twice t~"
    assert many[-2:] == lines(found)[-2:]


@pytest.mark.parametrize(
    ("is_doubt", "style", "rows"), [(True, "bold white on magenta", "yellow"), (False, "bold white on red", "bold red")]
)
def test_what_is_wrong_with_a_hole_comes_first(is_doubt: bool, style: str, rows: str) -> None:
    blunder = {
        "is_doubt": is_doubt, "best": "tube 3 has a step of its bias", "second": "joint 4-3 slipped",
        "todo": "calibrate it", "moved_cm": 12.34,
    }  # fmt: skip
    found = checks_panel(Picture("rig-7", answers={"adjustment": ADJUSTMENT | {"blunders": [blunder, blunder]}}))
    assert lines(found)[:4] == [
        "ALL 28 READINGS FIT TOGETHER", "tube 3 has a step of its bias", "or joint 4-3 slipped",
        "do: calibrate it; toe 12.3 cm off were it not put right",
    ]  # fmt: skip
    assert styles(found)[:4] == [style, rows, "bright_black", "bold"]
    assert lines(found)[4] == "next stop: turn the string by 90 deg"


def test_a_reply_has_what_is_wrong_first_and_never_more_than_its_lines() -> None:
    values = {
        "good": False, "wrong": "noise, disk", "sensor": "mpu6500 at 0x68, 50.0 Hz", "noise": "n " * 50, "disk": "full"
    }  # fmt: skip
    text = reply_panel("check_board tube=3: done", values)
    assert lines(text) == [
        "check_board tube=3: done    [esc] back",
        f"noise: {'n ' * 36}n",
        f"  {'n ' * 12}n",
        "disk: full",
        "good: no; sensor: mpu6500 at 0x68, 50.0 Hz",
    ]
    assert styles(text) == ["bold", "bold red", "bold red", "bold red", ""]
    numbers = {f"stage_{k}": k / 3.0 for k in range(60)}
    found = lines(reply_panel("timing tube=3: done", numbers))
    assert len(found) == 11
    assert "stage_4: 1.33333" in found[1]
    assert found[-1] == "and 5 lines more"
