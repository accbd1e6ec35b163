// The verdict and the line of facts: the largest thing on the page.

import { byId, shown, write } from "./dom.js";

const WORDS = { on_target: "ON TARGET", watch: "WATCH", steer: "STEER", out: "OUT", dont_know: "DON'T KNOW" };

/** @typedef {import("./picture.js").Picture} Picture */

/**
 * Show the verdict of this moment; that of a replay has no colour, lest it be taken for the present one.
 * @param {Picture} picture
 */
export function showVerdict(picture, now, { replay }) {
  const found = (replay && picture.answers.verdict) || picture.verdict(now);
  const section = byId("verdict");
  const colour = replay ? "dont_know" : found.verdict;
  if (section.className !== colour) section.className = colour;
  const word = WORDS[found.verdict] ?? WORDS.dont_know;
  write(byId("word"), replay ? `Then: ${word}` : word);
  write(byId("told"), found.line.replace(/^[^:]*: /, ""));
  const doubt = found.verdict === "dont_know" && found.by_surveys !== "dont_know";
  write(byId("todo"), doubt ? `the surveys alone said ${WORDS[found.by_surveys]}; do not count on it` : found.todo);
  write(byId("why"), found.why.filter((why) => !found.line.endsWith(why)).join("; "));
  document.title = `${word} ${picture.answers.status?.rig ?? ""}`;
}

/**
 * Show which hole, how fresh, how deep, what stands.
 * @param {Picture} picture
 */
export function showFacts(picture, now, { hole, rig, replay }) {
  const { status, verdict, alarms } = picture.answers;
  const live = Boolean(replay) || picture.isLive(now);
  document.body.classList.toggle("old", !live);
  write(byId("hole"), hole || rig || status?.rig || "borechain");
  write(byId("replay"), replay ? `REPLAY of ${replay}: what was known then; no rig is shown live` : "");
  write(byId("printed"), status ? `as of ${status.utc.slice(0, 19).replace("T", " ")} UTC` : "");
  const fresh = replay ? "REPLAY" : live ? `live ${picture.age(now).toFixed(1)} s` : "NOT LIVE";
  const depth = `MD ${shown(status?.bit_md_m)}/${shown(verdict?.target_m)} m`;
  const health = status ? `health ${status.health}` : "";
  write(byId("facts"), [fresh, depth, `tubes ${status?.tubes ?? "–"}`, health, `alarms ${alarms?.open.length ?? "–"}`].join(" · "));
}
