"""The page without a ground station, which is told by hand: its answers, and what it draws of them."""

from __future__ import annotations

import http.server
import math
from importlib.resources import files
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

STATIC = Path(str(files("groundstation.gateway.page").joinpath("static")))
# the stream is told by hand, and answers that were read are counted, once what follows of them is done
STREAM = """window.answered = 0;
const fetched = window.fetch;
window.fetch = async (...asked) => {
  const response = await fetched(...asked), json = response.json.bind(response);
  response.json = async () => {
    const read = await json();
    setTimeout(() => { window.answered += 1; }, 0);
    return read;
  };
  return response;
};
window.EventSource = class {
  constructor() { this.by = {}; window.heard = (kind, content) => this.by[kind]?.({ data: JSON.stringify(content) }); }
  addEventListener(kind, act) { this.by[kind] = act; }
  close() {}
}"""
# points of a drawing, as lists of numbers; of an ellipse its centre, the end of its longer axis and its lengths
READ = """([selector]) => [...document.querySelectorAll(selector)].map((one) => {
  const number = (name) => Number(one.getAttribute(name));
  if (one.tagName === "circle") return { x: number("cx"), y: number("cy"), r: number("r") };
  if (one.tagName === "line") return { x1: number("x1"), y1: number("y1"), x2: number("x2"), y2: number("y2") };
  if (one.tagName === "ellipse") {
    const turned = one.transform.baseVal.consolidate().matrix;
    const seen = (x, y) => { const p = new DOMPoint(x, y).matrixTransform(turned); return { x: p.x, y: p.y }; };
    const [cx, cy, rx, ry] = ["cx", "cy", "rx", "ry"].map(number);
    return { centre: seen(cx, cy), along: seen(cx + rx, cy), across: seen(cx, cy + ry) };
  }
  const points = one.getAttribute("points");
  if (points !== null) return points.trim().split(/\\s+/).map((pair) => pair.split(",").map(Number));
  return one.getAttribute("d") ?? { text: one.textContent, x: number("x"), y: number("y") };
})"""


class Files(http.server.SimpleHTTPRequestHandler):
    """The page's files, at the addresses that the ground station gives them."""

    def translate_path(self, path: str) -> str:
        name = path.partition("?")[0].removeprefix("/static/").lstrip("/")
        return str(STATIC / (name or "index.html"))

    def log_message(self, *_: Any) -> None:
        pass


def hear(page: Page, kind: str, content: object) -> None:
    page.evaluate("([kind, content]) => window.heard(kind, content)", [kind, content])


def tell(page: Page, path: str, answer: dict[str, Any], revision: int = 1) -> None:
    """An answer of the ground station."""
    said = {"revision": revision, "utc": f"2026-01-01T00:00:{revision:02}Z"} | answer
    hear(page, "answer", {"path": path, "answer": said})


def row(md: float, north: float, east: float, limit: float = 40.0, sigma: float = 3.0) -> dict[str, Any]:
    deviation = math.hypot(north, east)
    return {
        "md_m": md, "along_m": md, "north_cm": north, "east_cm": east, "deviation_cm": deviation, "sigma_cm": sigma,
        "deviation_percent": 1.0, "direction_deg": math.degrees(math.atan2(east, north)) % 360.0, "limit_cm": limit,
        "used_percent": 100.0 * deviation / limit, "level_percent": 0.0,
    }  # fmt: skip


def cone(md: float, north: float, east: float, half_width: float, radius: float) -> dict[str, Any]:
    return row(md, north, east) | {"half_width_cm": half_width, "radius_cm": radius}


END = row(20.0, 30.0, -6.0, limit=50.0, sigma=9.0)
CONE = [cone(14.0, 16.0, 1.0, 4.0, 5.0), cone(20.0, 30.0, -6.0, 17.0, 12.5)]


def column(*stations: dict[str, Any], end: dict[str, Any] | None = None) -> dict[str, Any]:
    ahead = {"cone": CONE, "half_width_cm": 17.0, "surveyed_sigma_cm": 3.0} if end else None
    return {
        "design": {"target_m": 20.0}, "stations": list(stations), "worst": stations[-1] if stations else END,
        "projection": end, "ahead": ahead, "dominant": None,
    }  # fmt: skip


STATIONS = [row(0.0, 0.0, 0.0, 20.0), row(5.0, 10.0, 0.0, 25.0, 1.5), row(10.0, 12.0, 7.0, 30.0, 4.0)]


def ellipse(md: float, major: float, minor: float, azimuth: float) -> dict[str, Any]:
    return {"md_m": md, "plan_ellipse": {"major_m": major, "minor_m": minor, "azimuth_deg": azimuth}}


REGIONS = {"stations": [ellipse(5.0, 0.01, 0.005, 0.0), ellipse(10.0, 0.08, 0.03, 30.0)]}


def read(page: Page, selector: str) -> list[Any]:
    found: list[Any] = page.evaluate(READ, [selector])
    return found


def verdict(revision: int, **change: Any) -> dict[str, Any]:
    return {
        "verdict": "on_target", "by_surveys": "on_target", "good_for_s": 1e6, "why": [], "line": "ON TARGET: so",
        "todo": "go on", "target_m": 20.0, "revision": revision, "utc": f"2026-01-01T00:00:{revision:02}Z",
    } | change  # fmt: skip
