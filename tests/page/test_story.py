"""The page in a real browser: a hole from its first tube to STEER, what the crew does about it, and silence."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from beating import Beating, beating
from page_client import PASSWORD
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.slow
Open = Callable[..., Page]
COUNT_ROWS = """window.counts = [];
    new MutationObserver(() => window.counts.push(document.querySelectorAll("#tubes tr").length))
    .observe(document.getElementById("tubes"), { childList: true })"""
STRAIGHT, LEANING = (0.3, 0.3, 0.3), (1.0, 1.9)  # deg
SURVEYED_AGAIN = re.compile(r"take survey tube 1: done · anna")


def drill(rig: Beating, stop: int, inclination_deg: float) -> None:
    rig.do(lambda hand: hand.drill(stop, inclination_deg))


def test_the_string_grows_from_one_tube_to_ten(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path) as rig:
        page = watched(rig.url)
        page.evaluate(COUNT_ROWS)
        for stop in range(1, 11):
            drill(rig, stop, 0.3)
            expect(page.locator("#tubes tr")).to_have_count(stop)
            expect(page.locator("#tubes tr").first).to_contain_text(str(stop))
        expect(page.locator("#facts")).to_contain_text("MD 20.0/20.0 m · tubes 10")
        expect(page.locator("#word")).to_have_text("ON TARGET")
        assert page.evaluate("window.counts") == sorted(page.evaluate("window.counts"))  # no row went on the way
        assert page.evaluate("document.querySelectorAll('#tubes .grave').length") == 0


def sign_in(page: Page, password: str = PASSWORD) -> None:
    page.fill("#who", "anna")
    page.fill("#password", password)
    page.click("#sign-now")


def test_a_hole_from_its_first_tube_to_steer_and_what_the_crew_does(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path) as rig:
        page = watched(rig.url)
        expect(page.locator("#word")).to_have_text("DON'T KNOW")
        expect(page.locator("#told")).to_have_text("no station has been surveyed yet")
        for stop in (1, 2, 3):
            drill(rig, stop, 0.3)
            expect(page.locator("#tubes tr")).to_have_count(stop)
        expect(page.locator("#word")).to_have_text("ON TARGET")
        expect(page.locator("#verdict")).to_have_class("on_target")
        expect(page.locator("#todo")).to_have_text("go on")
        expect(page.locator("#alarm-list li")).to_have_count(0)
        expect(page.locator("#plan svg")).to_have_attribute(
            "aria-label", re.compile("ends 10 ± 14 cm off at 0 degrees")
        )
        for stop, inclination_deg in enumerate(LEANING, 4):
            drill(rig, stop, inclination_deg)
        # what was known earlier, and back to now
        expect(page.locator("#course svg")).to_have_attribute("aria-label", re.compile("after each of 4 stops"))
        page.locator("#moment").focus()
        page.keyboard.press("Home")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        expect(page.locator("#then")).to_contain_text("6.0 m: 22 % of the tolerance; the verdict is of now")
        expect(page.locator("#plan svg")).to_have_attribute("aria-label", re.compile("ends 10 ± 14 cm off"))
        page.click("#live")
        expect(page.locator("#plan svg")).to_have_attribute("aria-label", re.compile("ends 73 ± 19 cm off"))
        # the task: which hole, how far off, how deep, which way, what to do, until when; read from what is shown
        expect(page.locator("#word")).to_have_text("STEER")
        expect(page.locator("#hole")).to_have_text("rig-1")
        expect(page.locator("#facts")).to_contain_text("MD 10.0/20.0 m · tubes 5 · health good · alarms 1")
        told = "ends 73 ± 19 cm (95 %) at 0 deg N; within 45 cm: < 1 %; act before 10.1 m"
        expect(page.locator("#told")).to_have_text(told)
        expect(page.locator("#todo")).to_have_text("steer to 180 deg S before 10.1 m, 0.1 m are left")
        alarm = page.locator("#alarm-list li", has_text="projection")
        expect(alarm.locator(".what")).to_contain_text("1 projection at 20.0 m at 0° N: 80 ± 43 cm (95 %)")
        # one action, which asks for the role once
        alarm.locator("text=Acknowledge").click()
        sign_in(page, "not the password")
        expect(page.locator("#sign-error")).to_contain_text("wrong password or role; the next try is looked at in 1 s")
        sign_in_when_it_is_looked_at(page)
        expect(alarm.locator(".more")).to_contain_text("acknowledged by anna")
        expect(page.locator("#orders")).to_contain_text("alarm acknowledge 1: done · anna")
        expect(page.locator("#alarm-list")).to_contain_text("wrong password, page: 1 since the ground station started")
        alarm.locator("text=Shelve 30 min").click()
        expect(alarm.locator(".more")).to_contain_text("shelved by anna until")
        alarm.locator("text=Take back").click()
        expect(alarm.locator(".more")).to_contain_text("acknowledged by anna")
        # a survey by the button, its course and its outcome
        page.select_option("#tube", "1")
        page.click("text=Take survey")
        expect(page.locator("#orders li").first).to_contain_text("take survey tube 1: sent")
        number = rig.served.rig.ask("orders")["orders"][-1]["order"]
        rig.do(lambda hand: hand.ground.model.orders.finish(number))
        rig.do(lambda hand: hand.ground.operator.publish_orders())
        expect(page.locator("#orders li").first).to_have_text(SURVEYED_AGAIN)
        page.click("text=Sign out anna")
        expect(page.locator("#sign")).to_have_text("Sign in")


def sign_in_when_it_is_looked_at(page: Page) -> None:
    """Try until the wait after a wrong password is over."""
    page.fill("#password", PASSWORD)
    while page.locator("#sign-in").is_visible():
        if page.locator("#sign-now").is_enabled():
            page.press("#password", "Enter")


def test_a_frozen_ground_station_is_dont_know_and_never_green(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path, STRAIGHT) as rig:
        page = watched(rig.url)
        expect(page.locator("#word")).to_have_text("ON TARGET")
        with rig.frozen():
            expect(page.locator("#word")).to_have_text("DON'T KNOW")
            expect(page.locator("#verdict")).to_have_class("dont_know")
            expect(page.locator("#facts")).to_contain_text("NOT LIVE")
            expect(page.locator("#told")).to_contain_text("no verdict from the ground station for")
            expect(page.locator("#todo")).to_contain_text("the surveys alone said ON TARGET; do not count on it")
            seen = page.evaluate(
                """() => new Promise((done) => {
                  const seen = new Set(), started = performance.now();
                  const look = () => {
                    seen.add(document.getElementById("verdict").className);
                    if (performance.now() - started < 1500) requestAnimationFrame(look); else done([...seen]);
                  };
                  look();
                })"""
            )
            assert seen == ["dont_know"]
        expect(page.locator("#word")).to_have_text("ON TARGET")
        expect(page.locator("#facts")).to_contain_text("live")


def test_an_answer_that_waited_on_its_way_is_as_old_as_it_is(tmp_path: Path, watched: Open) -> None:
    """A machine that slept gets at once what was sent meanwhile; a clock that stood still must not make it fresh."""
    with beating(tmp_path, STRAIGHT) as rig:
        page = watched(rig.url)
        expect(page.locator("#word")).to_have_text("ON TARGET")
        judged = page.evaluate(
            """async () => {
              const { Picture } = await import("/static/js/picture.js");
              const picture = new Picture(), start = Date.parse("2026-01-01T00:00:00Z");
              const said = (second, arrived) => picture.onAnswer("verdict",
                { verdict: "on_target", by_surveys: "on_target", good_for_s: 4.5, why: [], revision: second,
                  utc: new Date(start + 1000 * second).toISOString() }, { steady: 0, wall: start + 1000 * arrived });
              const shown = (steady, wall) =>
                picture.verdict({ steady: 1000 * steady, wall: start + 1000 * wall }).verdict;
              const found = [];
              said(0, 100); found.push(shown(0, 100));          // the clocks differ by 100 s: fresh
              found.push(shown(4, 104), shown(5, 105));          // aged by both clocks
              said(6, 106); found.push(shown(0, 106 + 60));      // the steady clock stood still while it slept
              said(7, 170); found.push(shown(0, 170));           // sent long before it came
              return found;
            }"""
        )
        assert judged == ["on_target", "on_target", "dont_know", "dont_know", "dont_know"]


def test_over_a_network_the_page_asks_for_a_role_before_it_shows_anything(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path, STRAIGHT, host="0.0.0.0") as rig:
        page = watched(rig.url)
        expect(page.locator("#sign-in")).to_be_visible()
        expect(page.locator("#tubes tr")).to_have_count(0)
        sign_in(page)
        expect(page.locator("#word")).to_have_text("ON TARGET")
        expect(page.locator("#tubes tr")).to_have_count(3)


def test_everything_can_be_done_by_keyboard(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path, (*STRAIGHT, *LEANING)) as rig:
        page = watched(rig.url, color_scheme="light")
        expect(page.locator("#alarm-list li")).to_have_count(1)
        focused = "document.activeElement.textContent.trim() || document.activeElement.id"
        seen = []
        for _ in range(20):
            page.keyboard.press("Tab")
            seen.append(page.evaluate(focused))
            if seen[-1] == "Acknowledge":
                break
        assert {"To the alarms", "Dark", "Print", "Sign in", "Acknowledge"} <= set(seen)
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert outline == "solid"
        page.keyboard.press("Enter")
        expect(page.locator("#who")).to_be_focused()
        page.keyboard.type("anna")
        page.keyboard.press("Tab")
        page.keyboard.press("Tab")
        page.keyboard.type(PASSWORD)
        page.keyboard.press("Enter")
        expect(page.locator("#alarm-list .more")).to_contain_text("acknowledged by anna")
        page.keyboard.press("Escape")
        expect(page.locator("#sign-in")).to_be_hidden()
