// The hole from above, north up: tolerance at the target, path, region of uncertainty, where it will end with 95 %.

import { shape } from "./dom.js";

const REACH = 118; // of the drawing, from its middle to an edge
const SHOWN_LIMITS = 1.6; // limits to which the circle of the end is shown whole
const FURTHEST = 0.86; // part of it that is used
const STEPS_CM = [1, 2, 5, 10, 20, 50, 100, 200, 500];

/** @typedef {import("./answers").ColumnAnswer} ColumnAnswer */
/** @typedef {import("./answers").UncertaintyAnswer} UncertaintyAnswer */
/** @typedef {import("./answers").PlanEllipse} PlanEllipse */

/**
 * Draw into `place` what is known of the column.
 * @param {Element} place
 * @param {ColumnAnswer} column
 * @param {UncertaintyAnswer} [uncertainty]
 */
export function drawPlan(place, column, uncertainty) {
  const stations = column.stations;
  const end = column.projection;
  const limit = (end ?? column.worst).limit_cm;
  const marks = end ? [...stations, end] : stations;
  const cone = column.ahead?.cone ?? [];
  const spread = cone.at(-1)?.radius_cm ?? column.ahead?.half_width_cm ?? 0;
  const furthest = end ? Math.min(end.deviation_cm + spread, SHOWN_LIMITS * limit) : 0;
  const reach = Math.max(limit, furthest, ...marks.map((m) => Math.hypot(m.north_cm, m.east_cm)), 1);
  const scale = (FURTHEST * REACH) / reach;
  const x = (m) => m.east_cm * scale;
  const y = (m) => -m.north_cm * scale;
  const last = stations.at(-1);
  const parts = [
    shape("line", { x1: -REACH, x2: REACH, y1: 0, y2: 0, class: "axis" }),
    shape("line", { x1: 0, x2: 0, y1: -REACH, y2: REACH, class: "axis" }),
    ...[0.5, 0.8].map((part) => shape("circle", { r: part * limit * scale, class: "limit part" })),
    shape("circle", { r: limit * scale, class: "limit full" }),
    shape("polyline", { points: stations.map((m) => `${x(m)},${y(m)}`).join(" "), class: "path" }),
    ...stations.slice(1).map((m) => shape("circle", { cx: x(m), cy: y(m), r: m === last ? 4 : 2.5, class: "dot" })),
  ];
  const ellipse = uncertainty?.stations.at(-1)?.plan_ellipse;
  if (last && ellipse) parts.push(region(x(last), y(last), ellipse, scale));
  if (end) parts.push(...toe([last, ...cone].map((m) => `${x(m)},${y(m)}`), x(end), y(end), spread * scale));
  parts.push(...letters(limit, scale));
  const label = end
    ? `Plan: ends ${end.deviation_cm.toFixed(0)} \u00b1 ${(column.ahead?.half_width_cm ?? 0).toFixed(0)} cm off at ${end.direction_deg.toFixed(0)} degrees, limit ${limit.toFixed(0)} cm`
    : "Plan: nothing surveyed yet";
  const box = `${-REACH} ${-REACH} ${2 * REACH} ${2 * REACH}`;
  place.replaceChildren(shape("svg", { viewBox: box, role: "img", "aria-label": label }, ...parts));
}

/** @param {PlanEllipse} ellipse */
function region(cx, cy, ellipse, scale) {
  const [rx, ry] = [ellipse.major_m, ellipse.minor_m].map((m) => Math.max(100 * m * scale, 0.5));
  const turn = `rotate(${ellipse.azimuth_deg - 90} ${cx} ${cy})`;
  return shape("ellipse", { cx, cy, rx, ry, transform: turn, class: "region" });
}

function toe(way, x, y, radius) {
  return [
    shape("circle", { cx: x, cy: y, r: Math.max(radius, 1), class: "cone" }),
    shape("polyline", { points: way.join(" "), class: "ahead" }),
    shape("path", { d: `M${x - 5},${y - 5}l10,10m0,-10l-10,10`, class: "toe" }),
  ];
}

function letters(limit, scale) {
  const wanted = limit / 2;
  const step = STEPS_CM.findLast((cm) => cm <= wanted) ?? STEPS_CM[0];
  const [left, low] = [-REACH + 4, REACH - 6];
  return [
    shape("text", { x: 4, y: -REACH + 11 }, "N"),
    shape("text", { x: REACH - 12, y: -4 }, "E"),
    shape("path", { d: `M${left},${low - 4}v4h${step * scale}v-4`, class: "toe" }),
    shape("text", { x: left + 3, y: low - 7 }, `${step} cm`),
    shape("text", { x: REACH - 4, y: low, "text-anchor": "end", class: "quiet" }, `ring ${limit.toFixed(0)} cm`),
  ];
}
