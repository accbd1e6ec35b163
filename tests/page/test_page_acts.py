"""What the page asks of the ground station and when: orders, sign-in, the stream, the theme, another program."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page, expect
from told_page import hear, tell, verdict

pytestmark = pytest.mark.slow
LOAD = "const load = (name) => import(`/static/js/${name}.js`);"
# all that is asked, and the answers that were laid out for it, one after the other
FETCH = """() => { window.asked = []; window.laid = [];
window.fetch = async (address, { method, headers, body, credentials }) => {
  const told = [headers["x-csrf-token"], headers["content-type"] ?? null, body ? JSON.parse(body) : null];
  window.asked.push([method, address, ...told, credentials]);
  const [status, content] = window.laid.shift() ?? [0, null];
  if (!status) throw new TypeError("no network");
  return { status, json: async () => content };
}; }"""
SIGNED = {
    "orders": True,
    "reads": True,
    "role": "driller",
    "name": "anna",
    "roles": ["driller", "reader"],
    "csrf": "c1",
}
OUT = {"orders": False, "reads": True, "roles": ["driller", "reader"], "csrf": "c0"}


def lay(page: Page, *answers: tuple[int, object]) -> None:
    page.evaluate("(answers) => { window.laid = answers; window.asked = []; }", [list(one) for one in answers])


def asked(page: Page, count: int) -> list[Any]:
    """The next requests, once so many were made and what follows of them is done."""
    page.wait_for_function("(count) => window.asked.length >= count && window.laid.length === 0", arg=count)
    page.evaluate("() => new Promise((done) => setTimeout(done, 0))")
    found: list[Any] = page.evaluate("window.asked.splice(0)")
    return found


def fresh(page: Page, session: dict[str, Any]) -> None:
    """The page anew, whose session was answered so."""
    page.evaluate(FETCH)
    lay(page, (200, session))
    page.evaluate(f"async () => {{ {LOAD} await (await load('session')).readSession(); }}")
    asked(page, 1)


def sign_in(page: Page, password: str = "secret") -> None:
    page.select_option("#role", "driller")
    page.fill("#who", "anna")
    page.fill("#password", password)
    page.click("#sign-now")


def order(name: str, body: dict[str, Any], token: str) -> list[Any]:
    return ["POST", f"/api/cmd/{name}", token, "application/json", body, "same-origin"]


def session(method: str, token: str, body: dict[str, Any] | None = None) -> list[Any]:
    return [method, "/api/session", token, "application/json" if body else None, body, "same-origin"]


LOGIN = {"role": "driller", "name": "anna", "password": "secret"}


def test_an_order_asks_for_a_role_once_and_is_sent_then(page: Page) -> None:
    tell(page, "string", {"tubes": [{"tube": 3, "stale": False}, {"tube": 2, "stale": False}]})
    tell(page, "verdict", verdict(1))
    fresh(page, OUT)
    page.click("#survey")
    expect(page.locator("#sign-in")).to_be_visible()
    assert page.locator("#role option").all_inner_texts() == ["driller", "reader"]
    lay(page, (403, {"error": "wrong"}))
    sign_in(page, "guess")
    assert asked(page, 1) == [session("POST", "c0", LOGIN | {"password": "guess"})]
    expect(page.locator("#sign-error")).to_have_text("wrong")
    expect(page.locator("#sign-now")).to_be_enabled()
    lay(page, (200, SIGNED), (202, {}))
    sign_in(page)
    assert asked(page, 2) == [session("POST", "c0", LOGIN), order("take_survey", {"tube": 2}, "c1")]
    expect(page.locator("#sign-in")).to_be_hidden()
    expect(page.locator("#sign")).to_have_text("Sign out anna")
    assert page.input_value("#password") == ""
    # signed in an order goes at once; a refusal is told, and the next success clears it
    lay(page, (400, {"error": "no depth"}))
    page.click("#depth")
    assert asked(page, 1) == [order("accept_depth", {"action": "confirm"}, "c1")]
    expect(page.locator("#message")).to_have_text("accept depth: no depth")
    lay(page, (202, {}))
    page.click("#depth")
    asked(page, 1)
    expect(page.locator("#message")).to_have_text("")
    # a session that has ended meanwhile is asked for anew, and what was ordered is ordered then, once
    lay(page, (401, {"error": "signed out"}))
    page.click("#depth")
    asked(page, 1)
    expect(page.locator("#sign-in")).to_be_visible()
    expect(page.locator("#message")).to_have_text("")
    expect(page.locator("#sign")).to_have_text("Sign in")
    page.click("#sign-cancel")  # and one who cancels that is asked again before anything is sent
    page.click("#depth")
    expect(page.locator("#sign-in")).to_be_visible()
    assert page.evaluate("window.asked") == []
    lay(page, (200, SIGNED | {"csrf": "c2"}), (202, {}))
    sign_in(page)
    assert asked(page, 2) == [session("POST", "c1", LOGIN), order("accept_depth", {"action": "confirm"}, "c2")]
    lay(page, (200, OUT))
    page.click("#sign")
    assert asked(page, 1) == [session("DELETE", "c2")]
    expect(page.locator("#sign")).to_have_text("Sign in")


def test_what_was_cancelled_is_not_ordered_by_the_next_sign_in(page: Page) -> None:
    fresh(page, OUT)
    page.click("#depth")
    page.fill("#password", "half")
    page.click("#sign-cancel")
    expect(page.locator("#sign-in")).to_be_hidden()
    assert page.input_value("#password") == ""
    page.click("#sign")
    lay(page, (200, SIGNED))
    sign_in(page)
    assert asked(page, 1) == [session("POST", "c0", LOGIN)]
    page.evaluate("() => new Promise((done) => setTimeout(done, 50))")
    assert page.evaluate("window.asked") == []


def test_who_may_not_even_read_is_asked_at_once_and_where_none_has_a_password_none_can_sign_in(page: Page) -> None:
    fresh(page, OUT | {"reads": False})
    expect(page.locator("#sign-in")).to_be_visible()
    page.click("#sign-cancel")
    fresh(page, OUT | {"roles": []})
    expect(page.locator("#sign-in")).to_be_hidden()
    page.click("#sign")
    expect(page.locator("#sign-error")).to_have_text("sign-in is off: the ground station has no passwords")
    expect(page.locator("#sign-now")).to_be_disabled()
    page.click("#sign-cancel")
    fresh(page, SIGNED)
    lay(page, (0, None))
    page.click("#depth")
    assert asked(page, 1) == [order("accept_depth", {"action": "confirm"}, "c1")]
    expect(page.locator("#message")).to_have_text("accept depth: the ground station does not answer")


def test_orders_of_alarms_and_of_the_setup_as_they_are_sent(page: Page) -> None:
    fresh(page, SIGNED)
    alarm = {"number": 7, "state": "raised", "code": "clock", "level": "bad", "subject": "rig", "detail": "",
             "wind": None, "md_m": None, "threshold": "", "since_utc": None}  # fmt: skip
    tell(page, "alarms", {"open": [alarm, alarm | {"number": 8, "state": "shelved"}]})
    tell(page, "verdict", verdict(1))
    for name, number, more in (("shelve", 7, {"minutes": 30}), ("acknowledge", 7, {}), ("unshelve", 8, {})):
        lay(page, (202, {}))
        page.click(f".{name}[aria-label$='alarm {number}']")
        assert asked(page, 1) == [order("alarm", {"action": name, "number": number} | more, "c1")]
    kinds = page.locator("#tell-kind option").all_inner_texts()
    assert kinds == ["north", "collar", "joint", "length", "stick up", "check north", "check stick up"]
    sent = []
    for kind in page.locator("#tell-kind option").evaluate_all("(rows) => rows.map((one) => one.value)"):
        page.select_option("#tell-kind", kind)
        needed = page.locator("#tell-fields input").evaluate_all("(rows) => rows.map((r) => [r.name, r.required])")
        for place, (name, required) in enumerate(needed, 1):
            if required:
                page.fill(f"#tell-{name}", str(place))
        lay(page, (202, {}))
        page.click("#tell button[type=submit]")
        (one,) = asked(page, 1)
        sent.append((one[1].rpartition("/")[2], one[4]))
    assert sent == [
        ("north", {"action": "tell", "angle_deg": "1", "sigma_deg": "2"}),
        ("collar", {"action": "tell", "inclination_deg": "1", "azimuth_deg": "2", "sigma_deg": "3"}),
        ("joint", {"tube": "1", "angle_deg": "2", "sigma_deg": "3"}),
        ("length", {"tube": "1", "length_m": "2", "sigma_m": "3"}),
        ("stick_up", {"action": "tell", "height_m": "1", "sigma_m": "2"}),
        ("north", {"action": "check", "angle_deg": "1", "sigma_deg": "2"}),
        ("stick_up", {"action": "check", "height_m": "1", "sigma_m": "2"}),
    ]
    lay(page, (202, {}))
    page.click("#take-back")
    assert asked(page, 1) == [order("setup", {"action": "undo"}, "c1")]


def test_a_stream_that_ends_or_says_nothing_is_joined_again(page: Page) -> None:
    found = page.evaluate(
        """async () => {
          const sources = [], later = [], every = [], found = [], heard = [], joins = [];
          let now = 0;
          const real = [window.EventSource, window.setTimeout, window.setInterval, performance.now];
          window.EventSource = class {
            constructor(address) { this.by = {}; this.address = address; this.open = true; sources.push(this); }
            addEventListener(kind, act) { this.by[kind] = act; }
            close() { this.open = false; }
          };
          window.setTimeout = (act, ms) => later.push([act, ms]);
          window.setInterval = (act, ms) => every.push([act, ms]);
          performance.now = () => now;
          const { follow } = await import("/static/js/stream.js");
          const stream = follow((kind, content) => heard.push([kind, content]), (stands) => joins.push(stands));
          [window.EventSource, window.setTimeout, window.setInterval] = real;
          window.EventSource = sources[0].constructor;
          const state = () => sources.map((one) => one.open);
          const [[look, often]] = every;
          sources[0].onopen();
          sources[0].by.answer({ data: '{"path":"column"}' }); sources[0].by.hello({ data: "{}" });
          now = 10000; look(); found.push(state());
          now = 10001; look(); found.push(state());
          now = 20000; sources[1].by.answer({ data: "1" }); now = 30000; look(); found.push(state());
          window.setTimeout = (act, ms) => later.push([act, ms]);
          sources[1].onerror(); found.push(state(), later.map(([, ms]) => ms));
          later[0][0](); found.push(state());
          window.setTimeout = real[1];
          stream.reopen(); found.push(state());
          performance.now = real[3]; window.EventSource = real[0];
          return [found, heard, joins, often, sources.map((one) => one.address)];
        }"""
    )
    assert found == [
        [
            [True],
            [False, True],
            [False, True],
            [False, False],
            [1500],
            [False, False, True],
            [False, False, False, True],
        ],
        [["answer", {"path": "column"}], ["hello", {}], ["answer", 1]],
        [True, False],
        5000,
        ["/api/stream"] * 4,
    ]


def test_a_theme_is_named_by_the_other_and_what_is_kept_must_be_one(page: Page) -> None:
    found = page.evaluate(
        """async () => {
          const { connectTheme } = await import("/static/js/theme.js"), found = [];
          const look = (kept) => {
            localStorage.clear();
            if (kept !== null) localStorage.setItem("borechain-theme", kept);
            const button = document.createElement("button");
            const now = () => found.push([document.documentElement.dataset.theme, button.textContent]);
            connectTheme(button); now(); button.click(); now(); found.push(localStorage.getItem("borechain-theme"));
          };
          look("dark"); look("sunlight"); look("pink"); look(null);
          return found;
        }"""
    )
    dark, sunlight = ["dark", "Sunlight"], ["sunlight", "Dark"]
    light = [sunlight, dark, "dark"]  # the machine of the test prefers what is light
    assert found == [dark, sunlight, "sunlight", *light, *light, *light]


def test_a_page_of_another_program_loads_itself_anew_and_one_of_the_same_stays(page: Page) -> None:
    page.evaluate("window.mine = true")
    hear(page, "hello", {"build": "1", "start": "9", "hole": "H1"})
    assert page.evaluate("window.mine") is True
    with page.expect_navigation():
        hear(page, "hello", {"build": "2", "start": "9", "hole": "H1"})
    assert page.evaluate("window.mine") is None


def test_what_is_exported_is_asked_for_as_it_was_filled_in(page: Page) -> None:
    page.evaluate(FETCH)
    page.evaluate("() => { window.laid = []; }")
    offer = "async (has) => (await import('/static/js/exports.js')).offerWall(has)"
    page.select_option("#export-format", "las")
    page.fill("#export-origin", "1, 2,3")
    for has_wall, grid, expected in (
        (False, "", "/api/exports/hole.las?origin=1%2C+2%2C3"),
        (True, "EPSG:25833", "/api/exports/hole.las?grid_crs=EPSG%3A25833"),
        (False, "EPSG:1", "/api/exports/hole.las?origin=1%2C+2%2C3&grid_crs=EPSG%3A1"),
    ):
        page.evaluate(offer, has_wall)
        assert page.evaluate("document.getElementById('export-wall').hidden") is not has_wall
        page.fill("#export-grid", grid)
        page.evaluate("""() => { window.fetch = async (address) => {
          window.told = address;
          return { status: 400, json: async () => ({ error: "no" }) };
        }; }""")
        page.click("#export button")
        expect(page.locator("#exported")).to_have_text("no")
        assert page.evaluate("window.told") == expected
    page.evaluate("() => { window.fetch = async () => { throw new TypeError('no network'); }; }")
    page.click("#export button")
    expect(page.locator("#exported")).to_have_text("the ground station does not answer")
