// The hole from the side, turned as one likes: tolerance, path and regions along the design axis, enlarged across it.

import { byId, shape } from "./dom.js";

const REACH = 118; // of the drawing, from its middle to an edge
const [TALL, WIDE] = [0.74, 0.34]; // parts of it that the length and the widest ring take
const [RING, RINGS, REGIONS, CIRCLES] = [48, 5, 12, 4]; // points of a ring; how many rings, regions, circles of the cone
const RAD = Math.PI / 180;
const TURN_PER_PX = 0.7; // degrees

/** Where the viewer looks: towards an azimuth, and how far from above (degrees). */
export const view = { azimuth: 30, elevation: 20 };

/** @typedef {import("./answers").ColumnAnswer} ColumnAnswer */
/** @typedef {import("./answers").ColumnDeviation} ColumnDeviation */
/** @typedef {import("./answers").UncertaintyAnswer} UncertaintyAnswer */

/**
 * Draw into `place` the column as it is seen from the view.
 * @param {Element} place
 * @param {ColumnAnswer} column
 * @param {UncertaintyAnswer} [uncertainty]
 */
export function drawSpace(place, column, uncertainty) {
  const stations = column.stations;
  const end = column.projection;
  const rows = end ? [...stations, end] : stations;
  const length = Math.max(column.design.target_m, ...rows.map((r) => r.md_m), 1);
  const widest = Math.max(...rows.map((r) => Math.max(r.limit_cm, Math.hypot(r.north_cm, r.east_cm))), 1);
  const [down, across] = [(2 * TALL * REACH) / length, (WIDE * 2 * REACH) / widest];
  const [sin, cos] = [Math.sin(view.azimuth * RAD), Math.cos(view.azimuth * RAD)];
  const [rise, fall] = [Math.sin(view.elevation * RAD), Math.cos(view.elevation * RAD)];
  const seen = (north_cm, east_cm, along_m) => {
    const [right, away] = [east_cm * cos - north_cm * sin, north_cm * cos + east_cm * sin];
    return `${(right * across).toFixed(2)},${((along_m - length / 2) * down * fall - away * across * rise).toFixed(2)}`;
  };
  const at = (r) => seen(r.north_cm, r.east_cm, r.along_m);
  const ring = (r, radius) => around((n, e) => seen(radius * n, radius * e, r.along_m));
  const last = stations.at(-1);
  const parts = [
    shape("polyline", { points: [seen(0, 0, 0), seen(0, 0, length)].join(" "), class: "axis" }),
    ...spread(rows, RINGS).map((r) => shape("polygon", { points: ring(r, r.limit_cm), class: `limit ${r === rows.at(-1) ? "full" : "part"}` })),
    ...regions(stations, uncertainty, seen),
    shape("polyline", { points: stations.map(at).join(" "), class: "path" }),
  ];
  if (last) parts.push(dot(at(last)));
  const cone = column.ahead?.cone ?? [];
  if (last && cone.length) parts.push(shape("polyline", { points: [last, ...cone].map(at).join(" "), class: "ahead" }));
  parts.push(...spread(cone, CIRCLES).map((r) => shape("polygon", { points: around((n, e) => seen(r.north_cm + r.radius_cm * n, r.east_cm + r.radius_cm * e, r.along_m)), class: "cone" })));
  parts.push(...compass(seen, widest), ...words(length, (100 * across) / down));
  const label = `3-D: towards ${view.azimuth.toFixed(0)} degrees, ${view.elevation.toFixed(0)} degrees from above`;
  const box = `${-REACH} ${-REACH} ${2 * REACH} ${2 * REACH}`;
  place.replaceChildren(shape("svg", { viewBox: box, role: "img", "aria-label": label, class: "turned" }, ...parts));
}

/** Let `place` be dragged, and the slider turn it; `changed` draws it anew. */
export function connectSpace(place, changed) {
  const slider = byId("turn");
  slider.value = String(view.azimuth);
  slider.addEventListener("input", () => {
    view.azimuth = Number(slider.value);
    changed();
  });
  place.addEventListener("pointerdown", (event) => place.setPointerCapture(event.pointerId)); // it may leave the drawing
  place.addEventListener("pointermove", (event) => {
    if (!event.buttons || !place.querySelector(".turned")) return;
    view.azimuth = (view.azimuth - event.movementX * TURN_PER_PX + 360) % 360;
    view.elevation = Math.min(Math.max(view.elevation + event.movementY * TURN_PER_PX, 0), 90);
    slider.value = String(Math.round(view.azimuth));
    changed();
  });
}

function around(point) {
  return Array.from({ length: RING }, (_, k) => point(Math.cos((k * 360 * RAD) / RING), Math.sin((k * 360 * RAD) / RING))).join(" ");
}

/**
 * At most `count` of the rows, evenly, with the last among them.
 * @param {ColumnDeviation[]} rows
 */
function spread(rows, count) {
  const step = Math.max(Math.ceil(rows.length / count), 1);
  return rows.filter((_, k) => (rows.length - 1 - k) % step === 0);
}

/**
 * @param {ColumnDeviation[]} stations
 * @param {UncertaintyAnswer} [uncertainty]
 */
function regions(stations, uncertainty, seen) {
  const found = new Map((uncertainty?.stations ?? []).map((s) => [s.md_m, s.plan_ellipse]));
  return spread(stations.filter((r) => found.has(r.md_m) && r.md_m > 0), REGIONS).map((r) => {
    const { major_m, minor_m, azimuth_deg } = found.get(r.md_m);
    const [c, s] = [Math.cos(azimuth_deg * RAD), Math.sin(azimuth_deg * RAD)];
    const edge = (u, v) => [100 * (major_m * u * c - minor_m * v * s), 100 * (major_m * u * s + minor_m * v * c)];
    const points = around((u, v) => seen(r.north_cm + edge(u, v)[0], r.east_cm + edge(u, v)[1], r.along_m));
    return shape("polygon", { points, class: "region" });
  });
}

function dot(point) {
  const [cx, cy] = point.split(",");
  return shape("circle", { cx, cy, r: 4, class: "dot" });
}

function compass(seen, widest) {
  const [from, to, letter] = [seen(0, 0, 0), seen(widest / 2, 0, 0), seen(0.6 * widest, 0, 0).split(",")];
  return [shape("polyline", { points: `${from} ${to}`, class: "axis" }), shape("text", { x: letter[0], y: letter[1], "text-anchor": "middle" }, "N")];
}

function words(length, enlarged) {
  return [
    shape("text", { x: -REACH + 4, y: -REACH + 11, class: "quiet" }, `${length.toFixed(0)} m`),
    shape("text", { x: REACH - 4, y: -REACH + 11, "text-anchor": "end", class: "quiet" }, `across \u00d7${enlarged.toFixed(0)}`),
  ];
}
