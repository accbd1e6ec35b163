// The course of the hole: how much of the tolerance it used after every stop, and the column as it was known then.

import { byId, shape, write } from "./dom.js";

const [NARROWEST, HEIGHT, LEFT, EDGE] = [240, 90, 34, 6];
const FULLEST = 120; // percent, at least

/** @typedef {import("./answers").HistoryMoment} HistoryMoment */

/** The slider of the history; `show` takes the column of a moment, or null for the present one. */
export class History {
  constructor(show) {
    /** @type {HistoryMoment[]} */
    this.moments = [];
    this.show = show;
    /** @type {HistoryMoment | null} the moment that is shown, or null for the present */
    this.chosen = null;
    byId("moment").addEventListener("input", () => this.choose(Number(byId("moment").value)));
    byId("live").addEventListener("click", () => this.choose(this.moments.length));
  }

  /**
   * Take the moments; what was chosen stays chosen.
   * @param {HistoryMoment[]} moments
   */
  take(moments) {
    this.moments = moments;
    const slider = byId("moment");
    slider.max = String(moments.length);
    slider.disabled = moments.length === 0;
    const place = this.placeOfChosen();
    slider.value = String(place < 0 ? moments.length : place);
    if (this.chosen && place < 0) this.choose(moments.length);
    this.draw();
  }

  /** Where the chosen moment stands among those that were told last; -1 for the present or where it is gone. */
  placeOfChosen() {
    return this.chosen ? this.moments.findIndex((moment) => moment.moment === this.chosen.moment) : -1;
  }

  async choose(place) {
    this.chosen = this.moments[place] ?? null;
    byId("moment").value = String(place);
    byId("live").disabled = !this.chosen;
    document.body.classList.toggle("then", Boolean(this.chosen));
    this.tell();
    this.draw();
    const asked = this.chosen;
    const answer = asked && (await (await fetch(`/api/column?moment=${asked.moment}`)).json());
    if (asked === this.chosen && !answer?.error) this.show(answer);
  }

  tell() {
    const then = this.chosen;
    const text = then
      ? `plan and strip as of rig time ${then.at_s.toFixed(0)} s, ${then.md_m.toFixed(1)} m: ${then.used_percent.toFixed(0)} % of the tolerance; the verdict is of now`
      : this.moments.length ? "live" : "nothing yet: a moment is kept at the end of every stop";
    write(byId("then"), text);
    byId("moment").setAttribute("aria-valuetext", text);
  }

  draw() {
    this.tell();
    const width = Math.max(byId("course").clientWidth, NARROWEST); // letters are as large as elsewhere
    const used = this.moments.map((moment) => moment.used_percent);
    const most = Math.max(FULLEST, ...used);
    const x = (place) => LEFT + (place / Math.max(used.length - 1, 1)) * (width - LEFT - EDGE);
    const y = (percent) => HEIGHT - EDGE - (percent / most) * (HEIGHT - 2 * EDGE);
    const parts = [50, 80, 100].flatMap((level) => [
      shape("line", { x1: LEFT, x2: width - EDGE, y1: y(level), y2: y(level), class: `limit ${level < 100 ? "part" : "full"}` }),
      shape("text", { x: LEFT - 4, y: y(level) + 4, "text-anchor": "end", class: "quiet" }, String(level)),
    ]);
    parts.push(shape("polyline", { points: used.map((percent, place) => `${x(place)},${y(percent)}`).join(" "), class: "path" }));
    const place = this.placeOfChosen();
    if (place >= 0) parts.push(shape("circle", { cx: x(place), cy: y(used[place]), r: 5, class: "dot" }));
    const label = `Of the tolerance used after each of ${used.length} stops, percent`;
    byId("course").replaceChildren(shape("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, role: "img", "aria-label": label }, ...parts));
  }
}
