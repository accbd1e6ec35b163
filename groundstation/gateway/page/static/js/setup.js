// The setup: what is known of the rig and what it costs at the toe, and the form that tells it.

import { byId, element, fillList, write } from "./dom.js";

/** @typedef {import("./answers").SetupAnswer} SetupAnswer */
/** @typedef {import("./answers").SetupRow} SetupRow */

const LEAST_CM = 0.05; // below it a cost is no cost
const TUBE = ["tube", "tube", 1];
const FIELDS = {
  north: [["angle_deg", "zero from north °"], ["sigma_deg", "σ °"]],
  collar: [["inclination_deg", "inclination °"], ["azimuth_deg", "azimuth °"], ["sigma_deg", "σ °"]],
  joint: [TUBE, ["angle_deg", "angle °"], ["sigma_deg", "σ °"], ["used_deg", "node was told °", null], ["upper", "above it, 0 is the drive", null]],
  length: [TUBE, ["length_m", "length m"], ["sigma_m", "σ m"]],
  stick_up: [["height_m", "over the collar m"], ["sigma_m", "σ m"]],
  "check north": [["angle_deg", "second bearing of the zero °"], ["sigma_deg", "σ °"]],
  "check stick_up": [["height_m", "second reading, over the collar m"], ["sigma_m", "σ m"]],
};
const WITH_TUBE = ["joint", "length"]; // the others are one of the rig

/**
 * A row an item: what is missing first, then what costs most at the toe.
 * @param {SetupAnswer} [setup]
 * @param {number} now ms since 1970
 */
export function showSetup(setup, now) {
  if (!setup) return;
  byId("ready").className = setup.ready ? "" : "not";
  write(byId("ready"), setup.ready ? "Ready to drill: north and every joint are told" : `NOT READY TO DRILL, ${setup.hold}`);
  const whose = setup.surveyed ? "as surveyed" : "of the design";
  const [todo, how] = setup.todo.split(/: (.*)/);
  write(byId("worst"), `Costs most at the toe: ${setup.costs_most}`);
  write(byId("next"), `Next: ${todo}${how && !how.startsWith("cmd/") ? `: ${how}` : ""}`);
  write(byId("how"), how?.startsWith("cmd/") ? `by the form below, or ${how}` : "");
  write(byId("costs"), `Toe at ${setup.at_m.toFixed(1)} m, ${whose}. Its ± has besides: ${setup.left_out}.`);
  fillList(byId("setup-items"), setup.items, (row) => row.item, () => element("tr", {}, ...Array.from({ length: 7 }, () => element("td"))), (line, row) => {
    line.className = row.missing || /^(not|contra)/.test(row.check) ? "grave" : !row.told && row.toe_cm >= LEAST_CM ? "serious" : "";
    const toe = `${row.toe_cm.toFixed(1)}${row.toe_cm >= LEAST_CM && row.way === "along" ? " along" : ""}`;
    const texts = [row.words, toe, valueText(row), plain(row.sigma), row.unit, ageText(row, now), `${row.source}: ${row.detail}${row.check && "; "}${row.check}`];
    texts.forEach((text, place) => write(line.children[place], text));
  });
}

/** Connect the form; `order` takes a command and its parameters. */
export function connectSetup(order) {
  const kind = byId("tell-kind");
  kind.replaceChildren(...Object.keys(FIELDS).map((name) => element("option", { value: name }, name.replaceAll("_", " "))));
  const showFields = () => byId("tell-fields").replaceChildren(...FIELDS[kind.value].flatMap(([name, text, least]) => {
    const input = element("input", { id: `tell-${name}`, name, type: "number", step: "any" });
    input.required = least !== null;
    return [element("label", { for: `tell-${name}` }, text), input];
  }));
  kind.addEventListener("change", showFields);
  showFields();
  byId("tell").addEventListener("submit", (submitted) => {
    submitted.preventDefault();
    const told = [...byId("tell-fields").querySelectorAll("input")].filter((input) => input.value !== "");
    const parameters = Object.fromEntries(told.map((input) => [input.name, input.value]));
    const [name, action] = kind.value.startsWith("check ") ? [kind.value.slice(6), "check"] : [kind.value, "tell"];
    order(name, WITH_TUBE.includes(name) ? parameters : { action, ...parameters });
  });
  byId("take-back").addEventListener("click", () => order("setup", { action: "undo" }));
}

/** @param {SetupRow} row */
const valueText = (row) => (row.value.length ? row.value.map(plain).join(" to ") : row.told ? "of its node" : "any");
const plain = (value) => (value !== 0 && Math.abs(value) < 1e-4 ? "0" : String(Number(value.toPrecision(4))));

/** @param {SetupRow} row */
function ageText(row, now) {
  if (!row.utc) return "–";
  const minutes = Math.max(0, (now - Date.parse(row.utc)) / 60e3);
  return minutes < 90 ? `${minutes.toFixed(0)} min` : `${(minutes / 60).toFixed(0)} h`;
}
