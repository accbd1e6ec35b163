// What the tubes say about each other: what is wrong, of what the ± is made, what would be found, the next stop.

import { byId, element, fillList, write } from "./dom.js";

/** @typedef {import("./answers").AdjustmentAnswer} AdjustmentAnswer */
/** @typedef {import("./answers").ColumnAnswer} ColumnAnswer */

const LEAST_PERCENT = 0.05; // of the variance at the toe, below which a source is not worth a row

/**
 * Calm while nothing is wrong: one line, and the rest behind what opens.
 * @param {AdjustmentAnswer} found
 */
export function showChecks(found) {
  const doubt = found.blunders.some((row) => row.is_doubt);
  byId("fit").className = doubt ? "doubt" : found.blunders.length ? "wrong" : "";
  write(byId("fit"), capital(found.said));
  fillList(byId("blunders"), found.blunders, (row) => row.text, blunderItem, fillBlunder);
  write(byId("next-stop"), found.next_stop ? `Next stop: ${found.next_stop.words}.` : "");
  write(byId("spread-toe"), toeText(found));
  const rows = found.parts.filter((row) => row.percent >= LEAST_PERCENT);
  fillList(byId("parts"), rows, (row) => row.source, () => element("tr", {}, ...Array.from({ length: 3 }, () => element("td"))), (line, row) => {
    const texts = [shownCm(row.sigma_cm), `${row.percent < 1 ? "< 1" : row.percent.toFixed(0)} %`, row.words];
    texts.forEach((text, place) => write(line.children[place], text));
  });
  write(byId("left-out"), `Not in it: ${found.left_out}.`);
  fillList(byId("unfound-list"), found.unfound, (row) => row.kind, () => element("li"), (item, row) => write(item, `${capital(row.words)}.`));
}

/**
 * How much of the ± of the end is what lies ahead, and how much was surveyed.
 * @param {ColumnAnswer} column
 */
export function showEnd(column) {
  const { ahead, projection } = column;
  const whole = projection && ahead ? projection.sigma_cm ** 2 : 0;
  if (!whole) return write(byId("spread-end"), "");
  const surveyed = Math.min(1, ahead.surveyed_sigma_cm ** 2 / whole);
  const [ground, told] = [1 - surveyed, surveyed].map((part) => (100 * part).toFixed(0));
  write(byId("spread-end"), `The end is foreseen within ± ${shownCm(ahead.half_width_cm)} cm (95 %). Of that ${ground} parts in 100 are how the ground may bend the hole from here on, ${told} are what was surveyed.`);
}

/** Open of what the ± is made from where the ± stands. */
export function connectChecks() {
  const spread = byId("spread");
  byId("open-spread").addEventListener("click", () => {
    spread.open = true;
    spread.scrollIntoView({ block: "nearest" });
    spread.querySelector("summary").focus({ preventScroll: true });
  });
}

/** @param {AdjustmentAnswer} found */
function toeText(found) {
  if (found.sigma_toe_cm === null) return "";
  const sigma = `σ ${shownCm(found.sigma_toe_cm)} cm at the last station, ${found.toe_md_m.toFixed(1)} m`;
  const whose = found.counts ? "" : " (stations are fused one by one: elsewhere the ± is theirs)";
  return `${sigma}${whose}. Twice that is the ± of 95 % there. It is made of:`;
}

function blunderItem() {
  return element("li", {}, element("p", { class: "what" }), element("p", { class: "or" }), element("p", { class: "cost" }), element("p", { class: "todo" }));
}

function fillBlunder(item, row) {
  item.className = row.is_doubt ? "doubt" : "";
  write(item.querySelector(".what"), `${row.is_doubt ? "●" : "▲"} ${capital(row.best)}`);
  write(item.querySelector(".or"), row.second ? `or ${row.second}` : "");
  const moved = row.moved_cm === null ? "" : `Not put right it would have the toe ${shownCm(row.moved_cm)} cm off; put right it leaves σ ${shownCm(row.sigma_cm)} cm.`;
  write(item.querySelector(".cost"), moved);
  write(item.querySelector(".todo"), `Do: ${row.todo}.`);
}

const shownCm = (cm) => (cm < 0.005 ? "< 0.01" : cm.toFixed(cm >= 1 ? 1 : 2));
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
