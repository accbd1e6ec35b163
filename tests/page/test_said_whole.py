"""Every line that the page writes, read whole: of each panel once with everything in it, and once with nothing.

A panel is asked by itself in the browser, with answers that are written here; what it wrote is compared as it stands.
"""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page
from told_page import tell

pytestmark = pytest.mark.slow
READ = """const at = (name) => document.getElementById(name);
const text = (...names) => names.map((name) => at(name).textContent);
const cells = (row) => [...row.children].map((cell) => cell.textContent);
const rows = (name) => [...at(name).children].map((row) => [row.className, ...cells(row)]);
const load = (name) => import(`/static/js/${name}.js`);
"""


def ask(page: Page, script: str, argument: object = None) -> Any:
    """What a script finds, which may load parts of the page and read what they wrote."""
    return page.evaluate(f"async (given) => {{ {READ} {script} }}", argument)


SAID = {
    "verdict": "steer", "by_surveys": "steer", "good_for_s": 4.5, "target_m": 20.0, "line": "STEER: ends: 73 cm off",
    "todo": "steer to 180 deg", "why": ["3 stations", "73 cm off", "fresh"], "revision": 4,
    "utc": "2026-01-01T00:00:00Z",
}  # fmt: skip
STATUS = {
    "bit_md_m": 10.04,
    "rig": "rig-1",
    "health": "good",
    "tubes": 5,
    "utc": "2026-01-01T11:22:33.9Z",
    "revision": 4,
}


def test_verdict_and_facts_while_it_is_fresh_late_and_of_a_recording(kept_page: Page) -> None:
    found = ask(
        kept_page,
        """const { Picture } = await load("picture"), { showFacts, showVerdict } = await load("verdict");
        const start = Date.parse(given.said.utc), found = [];
        const picture = new Picture();
        const shown = (now, hello) => {
          showVerdict(picture, now, hello); showFacts(picture, now, hello);
          const lines = text("word", "told", "todo", "why", "hole", "replay", "printed", "facts");
          found.push([...lines, at("verdict").className, document.title, document.body.classList.contains("old")]);
        };
        const now = (s) => ({ steady: 1000 * s, wall: start + 1000 * s });
        shown(now(0), {});
        picture.onAnswer("verdict", given.said, now(1));
        picture.onAnswer("status", given.status, now(1));
        picture.onAnswer("alarms", { open: [1, 2], revision: 1, utc: "" }, now(1));
        shown(now(5.5), { hole: "H7", rig: "R" });
        shown(now(5.6), { rig: "R" });
        shown(now(99), { replay: "a.mcap", rig: "R" });
        const doubt = (by_surveys, line) => {
          picture.onAnswer("verdict", { ...given.said, verdict: "dont_know", by_surveys, line, revision: 5 }, now(100));
          picture.answers.status = undefined;
          shown(now(100), {});
        };
        doubt("watch", "DON'T KNOW: depth; 3 stations");
        doubt("dont_know", "DON'T KNOW: nothing");
        picture.answers.verdict.verdict = "never heard of";
        shown(now(100), {});
        return found;""",
        {"said": SAID, "status": STATUS},
    )
    silent = "do not drill on by this screen until the cause is mended"
    nothing = "NOT LIVE · MD –/– m · tubes – ·  · alarms –"
    unheard = "no ground station has been heard yet"
    facts = "MD 10.0/20.0 m · tubes 5 · health good · alarms 2"
    printed = "as of 2026-01-01 11:22:33 UTC"
    late, why = "no verdict from the ground station for 4 s", "3 stations; fresh"
    doubt = "the surveys alone said {}; do not count on it"
    unknown, bare = "DON'T KNOW", "live 99.0 s · MD –/20.0 m · tubes – ·  · alarms 2"
    replay = "REPLAY of a.mcap: what was known then; no rig is shown live"
    ends, steer, untold = "ends: 73 cm off", "steer to 180 deg", "DON'T KNOW rig-1"
    assert found[:4] == [
        [unknown, unheard, silent, "", "borechain", "", "", nothing, "dont_know", "DON'T KNOW", True],
        ["STEER", ends, steer, why, "H7", "", printed, f"live 4.5 s · {facts}", "steer", "STEER rig-1", False],
        [unknown, late, doubt.format("STEER"), "", "R", "", printed, f"NOT LIVE · {facts}", "dont_know", untold, True],
        ["Then: STEER", ends, steer, why, "R", replay, printed, f"REPLAY · {facts}", "dont_know", "STEER rig-1", False],
    ]  # fmt: skip
    # an answer that came 99 s later than the quickest is old; what it says stands there all the same
    late = "no verdict from the ground station for 99 s"
    bare = bare.replace("live 99.0 s", "NOT LIVE")
    assert found[4:] == [
        [unknown, late, doubt.format("WATCH"), "", "borechain", "", "", bare, "dont_know", "DON'T KNOW", True],
        [unknown, late, silent, "", "borechain", "", "", bare, "dont_know", "DON'T KNOW", True],
        [unknown, late, silent, "", "borechain", "", "", bare, "dont_know", "DON'T KNOW", True],
    ]


def test_a_picture_is_as_old_as_the_longer_of_two_clocks_says(kept_page: Page) -> None:
    found = ask(
        kept_page,
        """const { Picture } = await load("picture"), picture = new Picture(), utc = "2026-01-01T00:00:00Z";
        const wall = Date.parse(utc), age = (s, w) => picture.age({ steady: 1000 * s, wall: wall + 1000 * w });
        const found = [picture.isLive({ steady: 0, wall })];
        picture.onAnswer("verdict", { utc, revision: 1 }, { steady: 1000, wall: wall + 1000 });
        found.push(age(3, 2), age(2, 4), age(0, 0));
        found.push(...[5500, 5501].map((steady) => picture.isLive({ steady, wall })));
        picture.onAnswer("verdict", { utc, revision: 2 }, { steady: 1000, wall: wall + 1750 });
        found.push(age(1, 1));
        picture.forget();
        found.push(picture.verdictAt, picture.delays.length, Object.keys(picture.answers).length);
        found.push(picture.tubes().length);
        return found;""",
    )
    assert found == [False, 2, 3, 0, True, False, 0.75, None, 0, 0, 0]


TUBES = [
    {"tube": 3, "md_m": 2.04, "age_s": 1.4, "stale": False, "yaw_deg": 10.04, "sigma_yaw_deg": 0.126,
     "mode": "static_bias", "flags": [], "upper_margin_db": 12.4, "lower_margin_db": 3.6},
    {"tube": 2, "md_m": 4.0, "age_s": None, "stale": False, "flags": ["aiding_old", "not_saved"], "mode": "survey",
     "upper_margin_db": None, "lower_margin_db": 0.0},
    {"tube": 1, "md_m": None, "age_s": 60.0, "stale": True, "flags": ["not_saved"], "mode": "survey"},
]  # fmt: skip


def test_the_string_row_by_row(kept_page: Page) -> None:
    found = ask(
        kept_page,
        """const { showString, showTubes } = await load("lists");
        const shown = (tubes) => {
          showString({ tubes: () => tubes }, 2.2);
          return [rows("tubes"), at("string").classList.contains("linkless")];
        };
        const offered = (tubes) => {
          showTubes({ answers: { string: { tubes: tubes.map((tube) => ({ tube })) } } });
          return [[...at("tube").options].map((one) => [one.value, one.text]), at("tube").value];
        };
        const choose = (tube) => { at("tube").value = tube; at("tube").dispatchEvent(new Event("change")); };
        const found = [shown(given), shown(given.slice(2)), offered([3, 2, 1])];
        choose("2"); found.push(offered([4, 3, 2, 1]));
        choose("4"); found.push(offered([3, 2, 1]));
        found.push(offered([3, 2, 1, 9]));
        return found;""",
        TUBES,
    )
    last = ["grave", "1", "–", "–", "–", "62", "–", "silent"]
    first = ["", "3", "2.0", "10.0", "0.13", "4", "4", "static bias"]
    middle = ["serious", "2", "4.0", "–", "–", "–", "0", "survey, aiding old, not saved"]
    assert found[:2] == [[[first, middle, last], False], [[last], True]]
    assert found[2] == [[["1", "1"], ["2", "2"], ["3", "3"]], "1"]
    assert [offered[1] for offered in found[3:]] == ["2", "1", "9"]


def alarm(number: int, **change: Any) -> dict[str, Any]:
    return {
        "number": number, "state": "raised", "code": "tube_silent", "level": "bad", "subject": "tube 3",
        "detail": "60 s", "threshold": "", "md_m": None, "azimuth_deg": None, "wind": None, "since_utc": None,
        "acknowledged_by": None, "shelved_by": None, "shelved_until_utc": None,
    } | change  # fmt: skip


ALARMS = [
    alarm(1, code="projection", subject="column", md_m=20.04, azimuth_deg=181.6, wind="S", threshold="80 %",
          since_utc="2026-01-01T11:22:33.9Z"),
    alarm(2, state="acknowledged", acknowledged_by="anna", level="degraded"),
    alarm(3, state="shelved", shelved_by="ben", shelved_until_utc="2026-01-01T13:45:59Z", level="notice", md_m=0.0),
    alarm(4, state="latched"),
    alarm(5, state="cleared"),
]  # fmt: skip


def test_alarms_with_what_may_be_done_about_each(kept_page: Page) -> None:
    found = ask(
        kept_page,
        """const { showAlarms } = await load("lists"), acts = [];
        const act = (name, number) => acts.push([name, number]);
        const shown = (answer) => {
          showAlarms(answer, act);
          return [...text("alarms-title", "flood"), [...at("alarm-list").children].map((one) => [one.className,
            one.querySelector(".what").textContent, one.querySelector(".more").textContent,
            ...[...one.querySelectorAll("button")].filter((b) => !b.hidden)
              .map((b) => `${b.textContent}/${b.getAttribute("aria-label")}`)])];
        };
        const found = [shown(undefined), shown({ open: given, flood: true, raised_last_hour: 12, left_out: 7 })];
        for (const button of at("alarm-list").children[1].querySelectorAll("button")) button.click();
        found.push(acts, shown({ open: given.slice(1, 2), flood: false }), shown({ open: [], flood: false }));
        return found;""",
        ALARMS,
    )
    assert found[0] == ["Alarms 0", "none", []]
    title, flood, items = found[1]
    assert (title, flood) == ("Alarms 5", "FLOOD: 12 in the last hour, 7 more")

    def may(number: int, *names: str) -> list[str]:
        return [f"{name}/{name} alarm {number}" for name in names]

    does, later, back = "Acknowledge", "Shelve 30 min", "Take back"
    assert items == [
        ["bad active", "▲ 1 projection at 20.0 m at 182° S: 60 s", "raised · over 80 % · since 11:22:33 UTC",
         *may(1, does, later)],
        ["degraded ", "● 2 tube silent, tube 3: 60 s", "acknowledged by anna", *may(2, later)],
        ["notice ", "○ 3 tube silent, tube 3 at 0.0 m: 60 s", "shelved by ben until 13:45 UTC", *may(3, back)],
        ["bad active", "▲ 4 tube silent, tube 3: 60 s", "latched", *may(4, does, later)],
        ["bad ", "▲ 5 tube silent, tube 3: 60 s", "cleared", *may(5, later)],
    ]  # fmt: skip
    assert found[2] == [["acknowledge", 2], ["shelve", 2], ["unshelve", 2]]
    assert found[3][:2] == ["Alarms 1", ""]
    assert found[4] == ["Alarms 0", "none", []]


def order(number: int, **change: Any) -> dict[str, Any]:
    return {
        "order": number, "tube": None, "arguments": {}, "command": "take_survey", "action": "", "state": "sent",
        "detail": "", "by": "anna", "ordered_utc": f"2026-01-01T11:22:{number:02}.5Z",
    } | change  # fmt: skip


def test_orders_and_the_wall(kept_page: Page) -> None:
    orders = [
        order(1, tube=3, state="acknowledged"),
        order(2, command="alarm", action="shelve", arguments={"number": 4}, state="done", detail="30 min"),
        order(3, state="failed"),
    ]
    joint = {"thickness_m": 0.806, "thinnest_at_m": 4.04, "probability_where_surveyed": 0.012, "surveyed_percent": 100}
    joints = [
        joint | {"joint": "A", "probability_where_surveyed": None, "thickness_m": None, "surveyed_percent": 0},
        joint | {"joint": "B", "surveyed_percent": 99},
        joint | {"joint": "C", "thickness_m": 0.799, "probability_where_surveyed": 0.963},
        joint | {"joint": "D", "thickness_m": 0.8, "probability_where_surveyed": 0.01},
    ]
    wall = {"name": "w", "hole": "H2", "problem": None, "required_thickness_m": 0.804, "allowed_probability": 0.01}
    wall |= {
        "required_thickness_m": 0.8,
        "verdict": "not_proven",
        "joints": joints,
        "findings": [f"f{k}" for k in range(7)],
    }
    found = ask(
        kept_page,
        """const { showOrders, showWall } = await load("lists");
        showOrders(given.orders === null ? undefined : { orders: given.orders });
        const found = [rows("orders")];
        showWall(null); found.push(at("wall").hidden);
        showWall(given.wall);
        found.push([at("wall").hidden, ...text("wall-title", "wall-problem"), rows("wall-findings").length,
          at("wall-findings").lastChild.textContent, rows("joints")]);
        showWall({ ...given.wall, problem: "no file", findings: given.wall.findings.slice(0, 6) });
        found.push([...text("wall-problem"), at("wall-findings").lastChild.textContent]);
        return found;""",
        {"orders": orders, "wall": wall},
    )
    assert found[0] == [
        ["failed", "take survey: FAILED", " · anna 11:22:03 UTC"],
        ["done", "alarm shelve 4: done: 30 min", " · anna 11:22:02 UTC"],
        ["acknowledged", "take survey tube 3: under way …", " · anna 11:22:01 UTC"],
    ]
    assert found[1] is True
    assert found[2] == [
        False, "Wall w, hole H2", "NOT PROVEN to be tight; required 80 cm", 7, "and 1 more",
        [["grave", "C", "80", "4.0", "1 too thin"], ["serious", "B", "81", "4.0", "0.01, 99 % surveyed"],
         ["", "D", "80", "4.0", "0.01"], ["", "A", "–", "4.0", "not surveyed"]],
    ]  # fmt: skip
    assert found[3] == ["no file", "f5"]


def item(name: str, **change: Any) -> dict[str, Any]:
    return {
        "item": name, "words": f"the {name}", "value": [12.34567], "sigma": 0.3, "unit": "deg", "source": "told",
        "detail": "by anna", "told": True, "missing": False, "utc": "", "check": "", "toe_cm": 1.26, "way": "across",
    } | change  # fmt: skip


def test_the_setup_item_by_item(kept_page: Page) -> None:
    setup = {
        "ready": True, "hold": "not told: north", "todo": "tell north: cmd/north?action=tell",
        "costs_most": "north, 3 cm", "at_m": 20.04, "surveyed": True, "left_out": "gravity",
    }  # fmt: skip
    items = [
        item("north", missing=True, told=False, value=[], toe_cm=30.0),
        item("collar", value=[0.5, 1.0], way="along", utc="2026-01-01T00:00:00Z"),
        item("play", value=[], toe_cm=0.04, way="along", utc="2026-01-01T00:31:00Z", check="checked by ben"),
        item("joint", check="contradicted by ben", sigma=0.00004),
        item("length", check="not checked", sigma=0.0001, value=[-3e-5, 0.0]),
        item("mount", told=False, value=[], toe_cm=0.05, way="along"),
        item("gravity", told=False, toe_cm=0.049, utc="2026-01-01T02:05:00Z"),
    ]
    found = ask(
        kept_page,
        """const { showSetup } = await load("setup"), now = Date.parse("2026-01-01T02:00:00Z");
        const shown = (setup) => {
          showSetup(setup, now);
          return [...text("ready", "worst", "next", "how", "costs"), at("ready").className];
        };
        showSetup(undefined, now);
        const other = { ...given, ready: false, todo: "go on: as it is", surveyed: false, items: [] };
        return [shown(given), rows("setup-items"), shown(other), shown({ ...given, todo: "go on" }).slice(2, 4)];""",
        setup | {"items": items},
    )
    costs = "Toe at 20.0 m, {}. Its ± has besides: gravity."
    worst, ready = "Costs most at the toe: north, 3 cm", "Ready to drill: north and every joint are told"
    form = "by the form below, or cmd/north?action=tell"
    assert found[0] == [ready, worst, "Next: tell north", form, costs.format("as surveyed"), ""]
    hold = "NOT READY TO DRILL, not told: north"
    assert found[2] == [hold, worst, "Next: go on: as it is", "", costs.format("of the design"), "not"]
    assert found[3] == ["Next: go on", ""]
    assert found[1] == [
        ["grave", "the north", "30.0", "any", "0.3", "deg", "–", "told: by anna"],
        ["", "the collar", "1.3 along", "0.5 to 1", "0.3", "deg", "2 h", "told: by anna"],
        ["", "the play", "0.0", "of its node", "0.3", "deg", "89 min", "told: by anna; checked by ben"],
        ["grave", "the joint", "1.3", "12.35", "0", "deg", "–", "told: by anna; contradicted by ben"],
        ["grave", "the length", "1.3", "0 to 0", "0.0001", "deg", "–", "told: by anna; not checked"],
        ["serious", "the mount", "0.1 along", "any", "0.3", "deg", "–", "told: by anna"],
        ["", "the gravity", "0.0", "12.35", "0.3", "deg", "0 min", "told: by anna"],
    ]


BLUNDER = {
    "is_doubt": False, "text": "one", "best": "mount of tube 3 turned", "second": "joint slipped (less likely)",
    "moved_cm": 12.34, "sigma_cm": 0.456, "todo": "go on",
}  # fmt: skip


def test_what_the_tubes_say_line_by_line(kept_page: Page) -> None:
    told = {
        "said": "two things are wrong", "next_stop": {"words": "turn to 90 deg"}, "sigma_toe_cm": 0.0049,
        "toe_md_m": 14.04, "counts": False, "left_out": "mistakes too small to find",
        "unfound": [{"kind": "a", "words": "a step is found from 3 mg"}],
        "blunders": [BLUNDER, BLUNDER | {"is_doubt": True, "text": "two", "second": None, "moved_cm": None}],
        "parts": [{"source": "n", "sigma_cm": 9.96, "percent": 98.6, "words": "north"},
                  {"source": "t", "sigma_cm": 0.996, "percent": 0.99, "words": "tubes"},
                  {"source": "c", "sigma_cm": 0.004, "percent": 0.05, "words": "collar"},
                  {"source": "p", "sigma_cm": 0.001, "percent": 0.049, "words": "play"}],
    }  # fmt: skip
    found = ask(
        kept_page,
        """const { showChecks, showEnd } = await load("checks");
        const shown = (found) => { showChecks(found);
          const lines = text("fit", "next-stop", "spread-toe", "left-out");
          return [...lines, at("fit").className, rows("blunders"), rows("parts")]; };
        const end = (ahead, projection) => { showEnd({ ahead, projection }); return at("spread-end").textContent; };
        const ahead = { half_width_cm: 0.99, surveyed_sigma_cm: 3 };
        return [shown(given), [...at("unfound-list").children].map((one) => one.textContent),
          shown({ ...given, blunders: given.blunders.slice(0, 1), next_stop: null, sigma_toe_cm: null, parts: [] }),
          shown({ ...given, blunders: [], counts: true, sigma_toe_cm: 1, parts: [] }).slice(2, 5),
          end(ahead, { sigma_cm: 6 }), end(ahead, { sigma_cm: 2 }), end(null, { sigma_cm: 2 }), end(ahead, null),
          end(ahead, { sigma_cm: 0 })];""",
        told,
    )
    wrong = ["", "▲ Mount of tube 3 turned", "or joint slipped (less likely)",
             "Not put right it would have the toe 12.3 cm off; put right it leaves σ 0.46 cm.",
             "Do: go on."]  # fmt: skip
    whose = " (stations are fused one by one: elsewhere the ± is theirs)"
    toe = "σ {} cm at the last station, 14.0 m{}. Twice that is the ± of 95 % there. It is made of:"
    left_out = "Not in it: mistakes too small to find."
    assert found[0] == [
        "Two things are wrong", "Next stop: turn to 90 deg.", toe.format("< 0.01", whose), left_out, "doubt",
        [wrong, ["doubt", "● Mount of tube 3 turned", "", "", "Do: go on."]],
        [["", "10.0", "99 %", "north"], ["", "1.00", "< 1 %", "tubes"], ["", "< 0.01", "< 1 %", "collar"]],
    ]  # fmt: skip
    assert found[1] == ["A step is found from 3 mg."]
    assert found[2] == ["Two things are wrong", "", "", left_out, "wrong", [wrong], []]
    assert found[3] == [toe.format("1.0", ""), left_out, ""]
    end = (
        "The end is foreseen within ± 0.99 cm (95 %). Of that {} parts in 100 are how the ground may bend the hole "
        "from here on, {} are what was surveyed."
    )
    assert found[4:] == [end.format(75, 25), end.format(0, 100), "", "", ""]


def test_a_list_is_written_to_and_not_made_anew(kept_page: Page) -> None:
    found = ask(
        kept_page,
        """const { element, fillList, shown, write } = await load("dom"), list = element("ul"), found = [];
        const made = [];
        const fill = (...names) => {
          fillList(list, names, (name) => name[0], (name) => { made.push(name); return element("li"); }, write);
          return [...list.children].map((one) => `${one.dataset.key}=${one.textContent}`).join();
        };
        found.push(fill("a", "b", "c"));
        const kept = list.children[1];
        found.push(fill("c2", "b2"), kept === list.children[1]);
        found.push(fill("d", "b3", "c3"), kept === list.children[1], fill(), made.join());
        found.push(shown(null), shown(undefined), shown(0), shown(1.25, 2), shown(2.96), shown(7.6, 0));
        return found;""",
    )
    assert found == [
        "a=a,b=b,c=c", "c=c2,b=b2", True, "d=d,b=b3,c=c3", True, "", "a,b,c,d", "–", "–", "0.0", "1.25", "3.0", "8",
    ]  # fmt: skip


def test_what_stays_while_the_string_speaks_ages(page: Page) -> None:
    """The ages of the tubes run on from when the string was heard last, and a tube's own word is the string's, too."""
    page.evaluate("() => { window.steady = performance.now(); performance.now = () => window.steady; }")
    tell(page, "string", {"tubes": [TUBES[0] | {"age_s": 1.0}]})
    seen = """(ms) => {
      window.steady += ms; document.dispatchEvent(new Event("visibilitychange"));
      const cells = document.querySelectorAll("#tubes tr td"); return [cells[4].textContent, cells[6].textContent];
    }"""
    assert [page.evaluate(seen, ms) for ms in (0, 3000, 4000)] == [[age, "static bias"] for age in ("1", "4", "8")]
    tell(page, "nodes/3", {"age_s": 0.4, "mode": "survey"}, 2)
    assert [page.evaluate(seen, ms) for ms in (0, 2000)] == [["0", "survey"], ["2", "survey"]]
