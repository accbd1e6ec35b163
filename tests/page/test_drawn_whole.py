"""Every element of every drawing of the page, in its order: what it is, where, and what is written on it.

Beside `test_drawn_coordinates.py`, which measures a drawing by what is written on it: here the sizes of the drawings
stand as numbers, so that a letter, a ring or a grid line that is lost or moved is noticed, too.
"""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from playwright.sync_api import Page
from told_page import CONE, END, REGIONS, STATIONS, column, cone, ellipse, row, tell, verdict

pytestmark = pytest.mark.slow
DRAWN = """(place) => [...document.querySelectorAll(`#${place} svg > *`)].map((one) => {
  const given = Object.fromEntries([...one.attributes].map((a) => [a.name, a.value]));
  return [one.tagName, given.class ?? "", given.points ?? given.d ?? null, given, one.textContent];
})"""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
Element = tuple[str, str, list[float], str]


def numbers(text: str) -> list[float]:
    return [float(one) for one in NUMBER.findall(text)]


def drawn(page: Page, place: str) -> list[Any]:
    """Elements of a drawing: its kind, its class, its numbers in the order of the letters of their names, its text."""
    found = []
    for kind, name, points, given, text in page.evaluate(DRAWN, place):
        sizes = numbers(points) if points is not None else [float(given[n]) for n in sorted(given) if n in PLACES]
        turned = numbers(given.get("transform", ""))
        found.append((kind, name, sizes + turned, text + {"middle": "|", "end": "<"}.get(given.get("text-anchor"), "")))
    return found


PLACES = {"cx", "cy", "r", "rx", "ry", "x", "y", "x1", "x2", "y1", "y2"}


def same(expected: list[Element]) -> list[Any]:
    return [(kind, name, pytest.approx(sizes, abs=0.011), text) for kind, name, sizes, text in expected]


def flat(*points: tuple[float, float]) -> list[float]:
    return [number for point in points for number in point]


def label(page: Page, place: str) -> str:
    return str(page.locator(f"#{place} svg").get_attribute("aria-label"))


def show(page: Page, revision: int, shown: dict[str, Any], **more: Any) -> None:
    """Have a column drawn at once: a verdict paints."""
    if "bit" in more:
        told = {"bit_md_m": more["bit"], "rig": "rig-1", "health": "good", "tubes": 1}
        tell(page, "status", told, revision)
    if "regions" in more:
        tell(page, "uncertainty", more["regions"], revision)
    tell(page, "column", shown, revision)
    tell(page, "verdict", verdict(revision), revision)


AXES: list[Element] = [
    ("line", "axis", [-118.0, 118.0, 0.0, 0.0], ""),
    ("line", "axis", [0.0, 0.0, -118.0, 118.0], ""),
]


def rings(limit: float, scale: float) -> list[Element]:
    kinds = ((0.5, "limit part"), (0.8, "limit part"), (1.0, "limit full"))
    return [("circle", kind, [part * limit * scale], "") for part, kind in kinds]


def letters(limit: float, step: float, scale: float) -> list[Element]:
    return [
        ("text", "", [4.0, -107.0], "N"),
        ("text", "", [106.0, -4.0], "E"),
        ("path", "toe", [-114.0, 108.0, 4.0, step * scale, -4.0], ""),
        ("text", "", [-111.0, 105.0], f"{step:.0f} cm"),
        ("text", "quiet", [114.0, 112.0], f"ring {limit:.0f} cm<"),
    ]


def test_of_the_plan_every_element(page: Page) -> None:
    show(page, 1, column(*STATIONS, end=END), regions=REGIONS)
    a_cm = 0.86 * 118.0 / 50.0  # the limit at the end is wider than 30.6 + 12.5
    places = [(0.0, 0.0), (0.0, -10.0 * a_cm), (7.0 * a_cm, -12.0 * a_cm)]
    x, y = -6.0 * a_cm, -30.0 * a_cm
    assert drawn(page, "plan") == same([
        *AXES, *rings(50.0, a_cm),
        ("polyline", "path", flat(*places), ""),
        ("circle", "dot", [*places[1], 2.5], ""),
        ("circle", "dot", [*places[2], 4.0], ""),
        ("ellipse", "region", [*places[2], 8.0 * a_cm, 3.0 * a_cm, -60.0, *places[2]], ""),
        ("circle", "cone", [x, y, 12.5 * a_cm], ""),
        ("polyline", "ahead", flat(places[2], (a_cm, -16.0 * a_cm), (x, y)), ""),
        ("path", "toe", [x - 5.0, y - 5.0, 10.0, 10.0, 0.0, -10.0, -10.0, 10.0], ""),
        *letters(50.0, 20.0, a_cm),
    ])  # fmt: skip
    assert label(page, "plan") == "Plan: ends 31 ± 17 cm off at 349 degrees, limit 50 cm"
    # an end of which little is known: as far as 1.6 limits is shown; a small ellipse is still seen
    wide = column(*STATIONS, end=END)
    wide["ahead"] = {"cone": [cone(20.0, 30.0, -6.0, 70.0, 60.0)], "half_width_cm": 70.0, "surveyed_sigma_cm": 3.0}
    show(page, 2, wide, regions={"stations": [ellipse(10.0, 0.0, 0.0, 30.0)]})
    a_cm = 0.86 * 118.0 / 80.0
    found = drawn(page, "plan")
    assert found[:5] == same([*AXES, *rings(50.0, a_cm)])
    assert found[8:10] == same([
        ("ellipse", "region", [7.0 * a_cm, -12.0 * a_cm, 0.5, 0.5, -60.0, 7.0 * a_cm, -12.0 * a_cm], ""),
        ("circle", "cone", [-6.0 * a_cm, -30.0 * a_cm, 60.0 * a_cm], ""),
    ])  # fmt: skip
    # without a cone the circle has the half width; a path that went astray is shown whole
    plain = column(row(0.0, 0.0, 0.0), row(5.0, -80.0, 60.0), end=row(20.0, 3.0, 4.0))
    plain["ahead"] = {"cone": [], "half_width_cm": 17.0, "surveyed_sigma_cm": 3.0}
    show(page, 3, plain)
    a_cm = 0.86 * 118.0 / 100.0
    (circle,) = [one for one in drawn(page, "plan") if one[1] == "cone"]
    assert circle[2] == pytest.approx([4.0 * a_cm, -3.0 * a_cm, 17.0 * a_cm])
    # nothing ahead is known, and nothing is surveyed
    plain["ahead"] = None
    show(page, 4, plain)
    (circle,) = [one for one in drawn(page, "plan") if one[1] == "cone"]
    assert circle[2] == pytest.approx([4.0 * a_cm, -3.0 * a_cm, 1.0])
    assert label(page, "plan") == "Plan: ends 5 ± 0 cm off at 53 degrees, limit 40 cm"
    show(page, 5, column() | {"worst": row(0.0, 0.0, 0.0, limit=1.5)})
    a_cm = 0.86 * 118.0 / 1.5
    found = drawn(page, "plan")
    assert found[:5] == same([*AXES, *rings(1.5, a_cm)])
    assert found[6:] == same(letters(2.0, 1.0, a_cm))  # the ring is told in whole centimetres
    assert label(page, "plan") == "Plan: nothing surveyed yet"


def strip(widest: float, deepest: float) -> tuple[Any, Any]:
    return (
        lambda cm: 34.0 + min(max(cm, 0.0), widest) / widest * 214.0,
        lambda m: 22.0 + m / deepest * 260.0,
    )


def grid(x: Any, y: Any, depths: tuple[int, ...], widths: tuple[int, ...]) -> list[Element]:
    found: list[Element] = [("text", "quiet", [2.0, 11.0], "MD m"), ("text", "quiet", [258.0, 11.0], "cm off<")]
    for m in depths:
        found.append(("line", "axis", [34.0, 248.0, y(m), y(m)], ""))
        found.append(("text", "", [29.0, y(m) + 4.0], f"{m}<"))
    return found + [("text", "", [x(cm), 18.0], f"{cm}|") for cm in widths]


def test_of_the_strip_every_element(page: Page) -> None:
    show(page, 1, column(*STATIONS, end=END), bit=12.5)
    x, y = strip(1.08 * 50.0, 20.0)
    off = [(0.0, 0.0), (10.0, 5.0), (math.hypot(12.0, 7.0), 10.0)]
    sigmas = [3.0, 1.5, 4.0]

    def line(points: list[tuple[float, float]]) -> list[float]:
        return flat(*((x(cm), y(m)) for cm, m in points))

    limits = [(20.0, 0.0), (25.0, 5.0), (30.0, 10.0), (50.0, 20.0)]
    right = [(cm + 2.0 * sigma, m) for (cm, m), sigma in zip(off, sigmas, strict=True)]
    left = [(cm - 2.0 * sigma, m) for (cm, m), sigma in zip(off, sigmas, strict=True)]
    ahead = [(one["deviation_cm"], one["half_width_cm"], one["md_m"]) for one in CONE]
    cone_right, cone_left = [(c + h, m) for c, h, m in ahead], [(c - h, m) for c, h, m in ahead]
    bit = y(12.5)
    assert drawn(page, "strip") == same([
        *grid(x, y, (0, 5, 10, 15, 20), (20, 40)),
        ("polyline", "limit part", line([(0.5 * c, m) for c, m in limits]), ""),
        ("polyline", "limit part", line([(0.8 * c, m) for c, m in limits]), ""),
        ("polyline", "limit full", line(limits), ""),
        ("polygon", "band", line(right + left[::-1]), ""),
        ("polyline", "path", line(off), ""),
        ("circle", "dot", [x(10.0), y(5.0), 2.5], ""),
        ("circle", "dot", [x(off[2][0]), y(10.0), 2.5], ""),
        ("polygon", "cone", line([off[2], *cone_right, *cone_left[::-1]]), ""),
        ("polyline", "ahead", line([off[2], *((c, m) for c, _, m in ahead)]), ""),
        ("text", "quiet", [x(25.0) - 2.0, y(20.0) + 13.0], "50|"),
        ("text", "quiet", [x(40.0) - 2.0, y(20.0) + 13.0], "80|"),
        ("text", "quiet", [x(50.0) - 2.0, y(20.0) + 13.0], "100 %|"),
        ("path", "dot", [248.0, bit, 9.0, -5.0, 10.0], ""),
        ("text", "", [245.0, bit - 4.0], "bit<"),
        ("line", "bit", [34.0, 248.0, bit, bit], ""),
    ])  # fmt: skip
    assert label(page, "strip") == "Deviation over depth: 13.9 cm of 30.0 cm at 10.0 m"
    # a cone that opens is shown to 2.2 limits, and what is beyond stays at the edge; a letter leaves room for the name
    wide = column(*STATIONS, end=END)
    wide["ahead"] = {"cone": [cone(20.0, 30.0, -6.0, 300.0, 60.0)], "half_width_cm": 70.0, "surveyed_sigma_cm": 3.0}
    show(page, 2, wide)
    x, y = strip(1.08 * 2.2 * 50.0, 20.0)
    found = drawn(page, "strip")
    assert [one for one in found if one[0] == "text" and one[2][1] == 18.0] == same(
        [("text", "", [x(50.0), 18.0], "50|")]
    )
    (opened,) = [one for one in found if one[1] == "cone"]
    assert opened[2] == pytest.approx(line([off[2], (200.0, 20.0), (0.0, 20.0)]))
    # a hole that is farther off, or deeper, than anything that is planned; no end is foreseen, no bit is known
    show(page, 3, column(row(0.0, 0.0, 0.0), row(42.0, 30.0, 40.0, limit=10.0, sigma=5.0)), bit=None)
    x, y = strip(1.08 * 60.0, 42.0)
    found = drawn(page, "strip")
    assert found[:14] == same(grid(x, y, (0, 10, 20, 30, 40), (20, 40)))
    assert [one[1] for one in found[14:]] == ["limit part", "limit part", "limit full", "band", "path", "dot"]
    assert found[18][2] == pytest.approx(line([(0.0, 0.0), (50.0, 42.0)]))
    show(page, 4, column())
    assert label(page, "strip") == "Deviation over depth: nothing surveyed yet"


def test_in_space_every_element(page: Page) -> None:
    """Towards 90 degrees north is to the left; from 30 degrees above the design axis is shorter by the cosine."""
    page.click("#space")
    page.evaluate(
        "async () => Object.assign((await import('/static/js/space.js')).view, { azimuth: 90, elevation: 30 })"
    )
    many = [row(float(m), 0.0, 0.5 * m, limit=20.0 + m) for m in range(14)]
    regions = {"stations": [ellipse(float(m), 0.08, 0.02, 0.0) for m in (0, 3, 13)]}
    foreseen = [cone(14.0 + k, float(k), 7.0, 4.0, 2.0 + k) for k in range(6)]
    end = row(20.0, 5.0, 7.0, limit=40.0)
    shown = column(*many, end=end) | {"ahead": {"cone": foreseen, "half_width_cm": 4.0, "surveyed_sigma_cm": 3.0}}
    show(page, 2, shown, regions=regions)
    across, along = 0.34 * 2.0 * 118.0 / 40.0, 2.0 * 0.74 * 118.0 / 20.0 * math.cos(math.radians(30.0))

    def seen(north: float, east: float, md: float) -> tuple[float, float]:
        return -north * across, (md - 10.0) * along - east * across * 0.5

    def ring(north: float, east: float, md: float, to_north: float, to_east: float) -> list[float]:
        turns = [math.tau * k / 48 for k in range(48)]
        return flat(*(seen(north + to_north * math.cos(t), east + to_east * math.sin(t), md) for t in turns))

    # of fifteen limits every third is shown, counted from the end
    assert drawn(page, "plan") == same([
        ("polyline", "axis", flat(seen(0.0, 0.0, 0.0), seen(0.0, 0.0, 20.0)), ""),
        *(("polygon", "limit part", ring(0.0, 0.0, float(k), 20.0 + k, 20.0 + k), "") for k in (2, 5, 8, 11)),
        ("polygon", "limit full", ring(0.0, 0.0, 20.0, 40.0, 40.0), ""),
        ("polygon", "region", ring(0.0, 1.5, 3.0, 8.0, 2.0), ""),
        ("polygon", "region", ring(0.0, 6.5, 13.0, 8.0, 2.0), ""),
        ("polyline", "path", flat(*(seen(0.0, 0.5 * m, float(m)) for m in range(14))), ""),
        ("circle", "dot", [*seen(0.0, 6.5, 13.0), 4.0], ""),
        ("polyline", "ahead", flat(seen(0.0, 6.5, 13.0), *(seen(k, 7.0, 14.0 + k) for k in range(6))), ""),
        *(("polygon", "cone", ring(float(k), 7.0, 14.0 + k, 2.0 + k, 2.0 + k), "") for k in (1, 3, 5)),
        ("polyline", "axis", flat(seen(0.0, 0.0, 0.0), seen(20.0, 0.0, 0.0)), ""),
        ("text", "", [*seen(24.0, 0.0, 0.0)], "N|"),
        ("text", "quiet", [-114.0, -107.0], "20 m"),
        ("text", "quiet", [114.0, -107.0], "across ×23<"),
    ])  # fmt: skip
    assert label(page, "plan") == "3-D: towards 90 degrees, 30 degrees from above"


def test_of_the_course_every_element_and_what_is_written_below_it(page: Page) -> None:
    used = (10.0, 30.0, 156.0)
    moments = [
        {
            "moment": 7 + k,
            "at_s": 60.4 * k,
            "md_m": 2.04 * k,
            "deviation_cm": 1.0,
            "limit_cm": 40.0,
            "used_percent": one,
        }
        for k, one in enumerate(used)
    ]
    state = """() => { const at = (name) => document.getElementById(name); return [at("moment").value, at("moment").max,
      at("moment").disabled, at("live").disabled, at("then").textContent, at("moment").getAttribute("aria-valuetext"),
      document.body.classList.contains("then")]; }"""
    nothing = "nothing yet: a moment is kept at the end of every stop"
    tell(page, "history", {"moments": []})
    tell(page, "verdict", verdict(1))
    assert page.evaluate(state) == ["0", "0", True, True, nothing, nothing, False]
    answered: dict[str, Any] = column(row(0.0, 0.0, 0.0), row(2.0, 5.0, 0.0))
    page.route("**/api/column?moment=*", lambda route: route.fulfill(json=answered))
    tell(page, "history", {"moments": moments[:2]}, 2)
    tell(page, "verdict", verdict(2))
    assert page.evaluate(state) == ["2", "2", False, True, "live", "live", False]
    page.focus("#moment")
    page.keyboard.press("ArrowLeft")
    text = "plan and strip as of rig time 60 s, 2.0 m: 30 % of the tolerance; the verdict is of now"
    assert page.evaluate(state) == ["1", "2", False, False, text, text, True]
    tell(page, "history", {"moments": moments}, 3)  # what was chosen stays chosen
    tell(page, "verdict", verdict(3))
    assert page.evaluate(state) == ["1", "3", False, False, text, text, True]
    width = float(page.locator("#course svg").get_attribute("viewBox").split()[2])  # type: ignore[union-attr]
    assert width == max(page.evaluate("document.getElementById('course').clientWidth"), 240)
    places = [(34.0 + k / 2.0 * (width - 40.0), 84.0 - one / 156.0 * 78.0) for k, one in enumerate(used)]
    expected: list[Element] = []
    for level, kind in ((50, "limit part"), (80, "limit part"), (100, "limit full")):
        y = 84.0 - level / 156.0 * 78.0
        expected.append(("line", kind, [34.0, width - 6.0, y, y], ""))
        expected.append(("text", "quiet", [30.0, y + 4.0], f"{level}<"))
    expected += [("polyline", "path", flat(*places), ""), ("circle", "dot", [*places[1], 5.0], "")]
    assert drawn(page, "course") == same(expected)
    assert label(page, "course") == "Of the tolerance used after each of 3 stops, percent"
    tell(page, "history", {"moments": moments[:1]}, 4)  # another hole: what was chosen is gone
    tell(page, "verdict", verdict(4))
    assert page.evaluate(state) == ["1", "1", False, True, "live", "live", False]
    (path,) = [one for one in drawn(page, "course") if one[1] == "path"]
    assert path[2] == pytest.approx([34.0, 84.0 - 10.0 / 120.0 * 78.0])


def test_a_column_of_a_moment_that_is_no_longer_asked_for_is_not_drawn(page: Page) -> None:
    moments = [
        {
            "moment": 4 + k,
            "md_m": 2.0,
            "at_s": 60.0,
            "stations": 3,
            "off_cm": 12.0,
            "limit_cm": 40.0,
            "used_percent": 30.0,
        }
        for k in range(3)
    ]
    held: list[Any] = []

    def hold(route: Any) -> None:
        held.append(route)

    page.route("**/api/column?moment=*", hold)
    tell(page, "history", {"moments": moments})
    tell(page, "verdict", verdict(1))
    page.focus("#moment")
    for count in (1, 2):
        page.keyboard.press("ArrowLeft")
        while len(held) < count:
            page.wait_for_timeout(5)
    assert [route.request.url.rpartition("=")[2] for route in held] == ["6", "5"]

    def answer(route: Any, content: dict[str, Any]) -> str:
        with page.expect_response("**/api/column?moment=*"):
            route.fulfill(json=content)
        page.wait_for_timeout(20)
        return page.locator("#plan").inner_html()

    newest = answer(held[1], column(row(0.0, 0.0, 0.0), row(2.0, 5.0, 1.0)))
    late = answer(held[0], column(row(0.0, 0.0, 0.0), row(2.0, -9.0, 4.0)))
    assert late == newest
    page.keyboard.press("ArrowLeft")
    while len(held) < 3:
        page.wait_for_timeout(5)
    assert answer(held[2], {"error": "gone"}) == newest
    page.keyboard.press("ArrowRight")
    while len(held) < 4:
        page.wait_for_timeout(5)
    assert answer(held[3], column(row(0.0, 0.0, 0.0), row(2.0, -9.0, 4.0))) != newest
