// The page: takes what the stream brings, shows it four times a second, and connects the buttons.

import { connectChecks, showChecks, showEnd } from "./checks.js";
import { byId, write } from "./dom.js";
import { connectExports, offerWall } from "./exports.js";
import { History } from "./history.js";
import { showAlarms, showOrders, showString, showTubes, showWall } from "./lists.js";
import { Picture } from "./picture.js";
import { drawPlan } from "./plan.js";
import { connectSession, order, readSession } from "./session.js";
import { connectSetup, showSetup } from "./setup.js";
import { follow } from "./stream.js";
import { drawStrip } from "./strip.js";
import { connectTheme } from "./theme.js";
import { showFacts, showVerdict } from "./verdict.js";

const REFRESH_MS = 250;
const SHELVED_MIN = 30;
const AGED_EVERY_MS = 30e3;

const picture = new Picture();
const changed = new Set();
let hello = {};
let stringAt = 0;
let agedAt = 0; // when ages of what was told were written last
let earlier = null; // the column of a moment of the history
let space = null; // what draws it in 3-D, once it is wanted
let drawHole = drawPlan;
const history = new History((column) => {
  earlier = column;
  drawColumn();
});

const moment = () => ({ steady: performance.now(), wall: Date.now() });

function onHeard(kind, content) {
  if (kind === "hello") {
    if (hello.build && hello.build !== content.build) location.reload(); // the program is another than this page's
    if (hello.start !== content.start) picture.forget();
    hello = content;
    return;
  }
  picture.onAnswer(content.path, content.answer, moment());
  if (content.path === "string" || content.path.startsWith("nodes/")) stringAt = performance.now();
  changed.add(content.path.replace(/^nodes\/.*/, "string"));
  if (content.path === "verdict") paint();
}

function paint() {
  const now = moment();
  showVerdict(picture, now, hello);
  showFacts(picture, now, hello);
  const { status, wall, alarms, orders } = picture.answers;
  const isNew = (...paths) => paths.some((path) => changed.has(path));
  if (isNew("history")) history.take(picture.answers.history.moments);
  if (isNew("column", "uncertainty", "status")) drawColumn();
  if (isNew("setup") || now.steady > agedAt + AGED_EVERY_MS) {
    agedAt = now.steady;
    showSetup(picture.answers.setup, now.wall);
  }
  if (isNew("adjustment")) showChecks(picture.answers.adjustment);
  if (isNew("column")) showEnd(picture.answers.column);
  if (isNew("wall")) {
    showWall(wall?.wall);
    offerWall(Boolean(wall?.wall));
  }
  if (isNew("alarms")) showAlarms(alarms, orderAboutAlarm);
  if (isNew("orders")) showOrders(orders);
  if (isNew("string")) showTubes(picture);
  changed.clear();
  showString(picture, (performance.now() - stringAt) / 1000);
}

/** Draw the column of now, or of the moment that the history shows. */
function drawColumn() {
  const { column, uncertainty, status } = picture.answers;
  if (earlier) {
    drawHole(byId("plan"), earlier);
    drawStrip(byId("strip"), earlier);
  } else if (column) {
    drawHole(byId("plan"), column, uncertainty);
    drawStrip(byId("strip"), column, status?.bit_md_m);
  }
}

/** Show the hole in 3-D, or from above again. */
async function turnPlan() {
  const module = await import("./space.js");
  if (!space) module.connectSpace(byId("plan"), drawColumn);
  space = module;
  const isTurned = drawHole === drawPlan;
  drawHole = isTurned ? space.drawSpace : drawPlan;
  byId("space").setAttribute("aria-pressed", String(isTurned));
  byId("turning").hidden = !isTurned;
  drawColumn();
}

const tell = (line) => write(byId("message"), line);

function orderAboutAlarm(action, number) {
  order("alarm", { action, number, ...(action === "shelve" ? { minutes: SHELVED_MIN } : {}) }, tell);
}

byId("survey").addEventListener("click", () => order("take_survey", { tube: Number(byId("tube").value) }, tell));
byId("depth").addEventListener("click", () => order("accept_depth", { action: "confirm" }, tell));
byId("tube").addEventListener("change", (event) => { event.target.dataset.chosen = event.target.value; });
byId("space").addEventListener("click", turnPlan);
byId("print").addEventListener("click", () => window.print());
connectChecks();
connectExports();
connectSetup((name, parameters) => order(name, parameters, tell));
connectTheme(byId("theme"));

const stream = follow(onHeard, () => {});
connectSession(() => stream.reopen());
readSession();
setInterval(paint, REFRESH_MS);
document.addEventListener("visibilitychange", paint);
paint();
