// The string, the joints of the wall, the alarms and the orders as lists.

import { byId, element, fillList, shown, write } from "./dom.js";

const FEWEST_ORDERS = 8;
const MOST_FINDINGS = 6;
const VERDICTS = { tight: "tight", not_proven: "NOT PROVEN to be tight", not_tight: "NOT TIGHT so far" };
const DONE = { sent: "sent …", acknowledged: "under way …", done: "done", failed: "FAILED" };
const SIGNS = { bad: "▲", degraded: "●", notice: "○" };

/** @typedef {import("./answers").WallNeighbourhood} WallNeighbourhood */
/** @typedef {import("./answers").AlarmsAnswer} AlarmsAnswer */
/** @typedef {import("./answers").Alarm} Alarm */
/** @typedef {import("./answers").OrdersAnswer} OrdersAnswer */
/** @typedef {import("./picture.js").Picture} Picture */

/**
 * A row a tube from the top down: grey while nothing is wrong.
 * @param {Picture} picture
 * @param {number} sinceHeard seconds
 */
export function showString(picture, sinceHeard) {
  const tubes = picture.tubes();
  byId("string").classList.toggle("linkless", tubes.every((row) => margins(row).length === 0));
  fillList(byId("tubes"), tubes, (row) => row.tube, () => element("tr", {}, ...cells(7)), (line, row) => {
    line.className = row.stale ? "grave" : row.flags?.length ? "serious" : "";
    const age = row.age_s === null || row.age_s === undefined ? null : row.age_s + sinceHeard;
    const link = margins(row);
    const mode = row.stale ? "silent" : [row.mode ?? "no state", ...(row.flags ?? [])].join(", ").replaceAll("_", " ");
    const texts = [row.tube, shown(row.md_m), shown(row.yaw_deg), shown(row.sigma_yaw_deg, 2), shown(age, 0), link.length ? Math.min(...link).toFixed(0) : "–", mode];
    texts.forEach((text, place) => write(line.children[place], String(text)));
  });
}

/**
 * The joints with the neighbours, the worst first, with the verdict and what speaks against more.
 * @param {WallNeighbourhood | null} [wall]
 */
export function showWall(wall) {
  byId("wall").hidden = !wall;
  if (!wall) return;
  write(byId("wall-title"), `Wall ${wall.name}, hole ${wall.hole}`);
  write(byId("wall-problem"), wall.problem ?? `${VERDICTS[wall.verdict]}; required ${(100 * wall.required_thickness_m).toFixed(0)} cm`);
  const findings = wall.findings.slice(0, MOST_FINDINGS);
  if (findings.length < wall.findings.length) findings.push(`and ${wall.findings.length - findings.length} more`);
  fillList(byId("wall-findings"), findings, (text) => text, () => element("li"), write);
  const joints = [...wall.joints].sort((a, b) => (b.probability_where_surveyed ?? 0) - (a.probability_where_surveyed ?? 0));
  fillList(byId("joints"), joints, (joint) => joint.joint, () => element("tr", {}, ...cells(4)), (line, joint) => {
    const thin = joint.thickness_m !== null && joint.thickness_m < wall.required_thickness_m;
    line.className = thin ? "grave" : (joint.probability_where_surveyed ?? 0) > wall.allowed_probability ? "serious" : "";
    const chance = joint.probability_where_surveyed;
    const thickness = joint.thickness_m === null ? null : 100 * joint.thickness_m;
    const part = joint.surveyed_percent < 100 ? `, ${joint.surveyed_percent} % surveyed` : "";
    const texts = [joint.joint, shown(thickness, 0), shown(joint.thinnest_at_m), chance === null ? "not surveyed" : `${chance.toPrecision(1)}${thin ? " too thin" : ""}${part}`];
    texts.forEach((text, place) => write(line.children[place], text));
  });
}

/**
 * Open alarms, the worst first, each with what may be done about it; `act` takes the action and the alarm.
 * @param {AlarmsAnswer} [alarms]
 */
export function showAlarms(alarms, act) {
  const open = alarms?.open ?? [];
  write(byId("alarms-title"), `Alarms ${open.length}`);
  write(byId("flood"), alarms?.flood ? `FLOOD: ${alarms.raised_last_hour} in the last hour, ${alarms.left_out} more` : open.length ? "" : "none");
  fillList(byId("alarm-list"), open, (alarm) => alarm.number, (alarm) => alarmItem(alarm, act), fillAlarm);
}

/** @param {Alarm} alarm */
function alarmItem(alarm, act) {
  const named = (name, text) => {
    const button = element("button", { type: "button", class: name, "aria-label": `${text} alarm ${alarm.number}` }, text);
    button.addEventListener("click", () => act(name, alarm.number));
    return button;
  };
  const text = element("div", { class: "text" }, element("p", { class: "what" }), element("p", { class: "more" }));
  const buttons = [named("acknowledge", "Acknowledge"), named("shelve", "Shelve 30 min"), named("unshelve", "Take back")];
  return element("li", {}, text, element("div", { class: "buttons" }, ...buttons));
}

/** @param {Alarm} alarm */
function fillAlarm(item, alarm) {
  const active = alarm.state === "raised" || alarm.state === "latched";
  item.className = `${alarm.level} ${active ? "active" : ""}`;
  const way = alarm.wind === null ? "" : ` at ${alarm.azimuth_deg.toFixed(0)}° ${alarm.wind}`;
  const where = alarm.md_m === null ? "" : ` at ${alarm.md_m.toFixed(1)} m`;
  const what = alarm.subject === "column" ? alarm.code : `${alarm.code.replaceAll("_", " ")}, ${alarm.subject}`;
  write(item.querySelector(".what"), `${SIGNS[alarm.level]} ${alarm.number} ${what}${where}${way}: ${alarm.detail}`);
  const over = alarm.threshold ? ` · over ${alarm.threshold}` : "";
  const since = alarm.since_utc ? ` · since ${alarm.since_utc.slice(11, 19)} UTC` : "";
  const who = { acknowledged: ` by ${alarm.acknowledged_by}`, shelved: ` by ${alarm.shelved_by} until ${alarm.shelved_until_utc?.slice(11, 16)} UTC` }[alarm.state] ?? "";
  write(item.querySelector(".more"), `${alarm.state}${who}${over}${since}`);
  item.querySelector(".acknowledge").hidden = !active;
  item.querySelector(".shelve").hidden = alarm.state === "shelved";
  item.querySelector(".unshelve").hidden = alarm.state !== "shelved";
}

/**
 * The newest orders of anybody, the newest first, and what became of them.
 * @param {OrdersAnswer} [orders]
 */
export function showOrders(orders) {
  const newest = (orders?.orders ?? []).slice(-FEWEST_ORDERS).reverse();
  fillList(byId("orders"), newest, (order) => order.order, () => element("li", {}, element("span"), element("span", { class: "by" })), (item, order) => {
    const whom = order.tube === null ? "" : ` tube ${order.tube}`;
    const about = order.arguments.number === undefined ? "" : ` ${order.arguments.number}`;
    const name = [order.command.replaceAll("_", " "), order.action].filter(Boolean).join(" ");
    item.className = order.state;
    const detail = order.detail ? `: ${order.detail}` : "";
    write(item.firstChild, `${name}${about}${whom}: ${DONE[order.state]}${detail}`);
    write(item.lastChild, ` · ${order.by} ${order.ordered_utc.slice(11, 19)} UTC`);
  });
}

/**
 * The tubes that may be told to survey, the lowest chosen until the user chooses another.
 * @param {Picture} picture
 */
export function showTubes(picture) {
  const tubes = (picture.answers.string?.tubes ?? []).map((row) => String(row.tube)).reverse();
  const select = byId("tube");
  if ([...select.options].map((option) => option.value).join() === tubes.join()) return;
  const chosen = select.dataset.chosen;
  select.replaceChildren(...tubes.map((tube) => element("option", { value: tube }, tube)));
  if (chosen && tubes.includes(chosen)) select.value = chosen;
}

const margins = (row) => [row.upper_margin_db, row.lower_margin_db].filter((db) => db !== null && db !== undefined);
const cells = (count) => Array.from({ length: count }, () => element("td"));
