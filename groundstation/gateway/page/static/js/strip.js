// Deviation over depth: what is allowed at each depth, the hole with its uncertainty, and the cone of where it goes.

import { shape } from "./dom.js";

const [WIDTH, HEIGHT] = [260, 300];
const [LEFT, RIGHT, TOP, LOW] = [34, 12, 22, 18]; // margins
const SHOWN_LIMITS = 2.2; // widest limits to which a cone is shown
const NAME = 50; // room for the name of the axis
const TICKS = [1, 2, 5, 10, 20, 50, 100, 200];

/** @typedef {import("./answers").ColumnAnswer} ColumnAnswer */
/** @typedef {import("./answers").ColumnDeviation} ColumnDeviation */
/** @typedef {import("./answers").ConeRow} ConeRow */

/**
 * Draw into `place` the deviation at every station and at the target.
 * @param {Element} place
 * @param {ColumnAnswer} column
 * @param {number | null} [bit] its measured depth
 */
export function drawStrip(place, column, bit) {
  const end = column.projection;
  const rows = end ? [...column.stations, end] : column.stations;
  const deepest = Math.max(column.design.target_m, ...rows.map((r) => r.md_m), 1);
  const cone = column.ahead?.cone ?? [];
  const allowed = Math.max(...rows.map((r) => r.limit_cm), 1);
  const reached = Math.max(...column.stations.map((r) => r.deviation_cm + 2 * r.sigma_cm), ...cone.map((r) => r.deviation_cm));
  const open = Math.max(0, ...cone.map((r) => r.deviation_cm + r.half_width_cm));
  const widest = 1.08 * Math.max(allowed, reached, Math.min(open, SHOWN_LIMITS * allowed));
  const x = (cm) => LEFT + (Math.min(Math.max(cm, 0), widest) / widest) * (WIDTH - LEFT - RIGHT);
  const y = (m) => TOP + (m / deepest) * (HEIGHT - TOP - LOW);
  const line = (points) => points.map(([cm, m]) => `${x(cm)},${y(m)}`).join(" ");
  const edge = (side) => column.stations.map((r) => [r.deviation_cm + side * 2 * r.sigma_cm, r.md_m]);
  const last = column.stations.at(-1);
  const parts = [
    ...grid(deepest, widest, x, y),
    ...[0.5, 0.8, 1].map((part) =>
      shape("polyline", { points: line(rows.map((r) => [part * r.limit_cm, r.md_m])), class: `limit ${part < 1 ? "part" : "full"}` }),
    ),
    shape("polygon", { points: line([...edge(1), ...edge(-1).reverse()]), class: "band" }),
    shape("polyline", { points: line(column.stations.map((r) => [r.deviation_cm, r.md_m])), class: "path" }),
    ...column.stations.slice(1).map((r) => shape("circle", { cx: x(r.deviation_cm), cy: y(r.md_m), r: 2.5, class: "dot" })),
  ];
  if (last && cone.length) parts.push(...coneOf(last, cone, line));
  if (end) parts.push(...fan(rows.at(-1), x, y));
  if (bit !== null && bit !== undefined) parts.push(...bitMark(y(bit)));
  const label = last
    ? `Deviation over depth: ${last.deviation_cm.toFixed(1)} cm of ${last.limit_cm.toFixed(1)} cm at ${last.md_m.toFixed(1)} m`
    : "Deviation over depth: nothing surveyed yet";
  place.replaceChildren(shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label }, ...parts));
}

/**
 * Where the hole will be with 95 %, and what is expected.
 * @param {ColumnDeviation} last
 * @param {ConeRow[]} cone
 */
function coneOf(last, cone, line) {
  const start = [[last.deviation_cm, last.md_m]];
  const side = (sign) => cone.map((r) => [r.deviation_cm + sign * r.half_width_cm, r.md_m]);
  return [
    shape("polygon", { points: line([...start, ...side(1), ...side(-1).reverse()]), class: "cone" }),
    shape("polyline", { points: line([...start, ...side(0)]), class: "ahead" }),
  ];
}

/** @param {ColumnDeviation} deep */
function fan(deep, x, y) {
  const names = [[0.5, "50"], [0.8, "80"], [1, "100 %"]];
  return names.map(([part, name]) =>
    shape("text", { x: x(part * deep.limit_cm) - 2, y: y(deep.md_m) + 13, "text-anchor": "middle", class: "quiet" }, name),
  );
}

function grid(deepest, widest, x, y) {
  const parts = [shape("text", { x: 2, y: 11, class: "quiet" }, "MD m"), shape("text", { x: WIDTH - 2, y: 11, "text-anchor": "end", class: "quiet" }, "cm off")];
  const [down, across] = [deepest / 5, widest / 4].map((wanted) => TICKS.find((tick) => tick >= wanted) ?? TICKS.at(-1));
  for (let m = 0; m <= deepest; m += down) {
    parts.push(shape("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(m), y2: y(m), class: "axis" }));
    parts.push(shape("text", { x: LEFT - 5, y: y(m) + 4, "text-anchor": "end" }, String(m)));
  }
  for (let cm = across; cm <= widest; cm += across) {
    if (x(cm) < WIDTH - NAME) parts.push(shape("text", { x: x(cm), y: TOP - 4, "text-anchor": "middle" }, String(cm)));
  }
  return parts;
}

function bitMark(at) {
  const end = WIDTH - RIGHT;
  return [
    shape("path", { d: `M${end},${at}l9,-5v10z`, class: "dot" }),
    shape("text", { x: end - 3, y: at - 4, "text-anchor": "end" }, "bit"),
    shape("line", { x1: LEFT, x2: end, y1: at, y2: at, class: "bit" }),
  ];
}
