// What the page knows of the rig, and how old it is. No elements, no network.
//
// Every answer is aged by when it arrived here: a ground station that is frozen sends nothing, and what it said last is
// then worth nothing. Times are milliseconds.

const FRESH_WITHOUT_WORD_S = 4.5;
const DELAYS_KEPT = 60;
const KEEP_OUT = "do not drill on by this screen until the cause is mended";

/** @typedef {import("./answers").Answers} Answers */
/** @typedef {import("./answers").Verdict} Verdict */
/** @typedef {import("./answers").StringTube} StringTube */
/** @typedef {import("./answers").NodeAnswer} NodeAnswer */

export class Picture {
  constructor() {
    this.forget();
  }

  /** Begin anew: another ground station, or another start of it. */
  forget() {
    /** @type {Partial<Answers>} the newest of each path */
    this.answers = {};
    this.verdictAt = null;
    this.delays = [];
  }

  /**
   * Take an answer; an older one than is known changes nothing.
   * @template {keyof Answers} Path
   * @param {Path} path
   * @param {Answers[Path]} answer
   */
  onAnswer(path, answer, at) {
    const known = this.answers[path];
    if (known && answer.revision < known.revision && answer.utc < known.utc) return;
    this.answers[path] = answer;
    if (path === "verdict") {
      this.verdictAt = { ...at, late: this.lateness(answer.utc, at.wall) };
    }
  }

  // An answer that waited on its way, in a machine that slept, is older than its arrival: by what it took longer than
  // the quickest of late. Clocks of two machines need not agree for that.
  lateness(utc, wall) {
    const delay = wall - Date.parse(utc);
    this.delays.push(delay);
    if (this.delays.length > DELAYS_KEPT) this.delays.shift();
    return delay - Math.min(...this.delays);
  }

  /** Seconds since the newest verdict; the longer of what two clocks say, since one of them stands while a machine sleeps. */
  age(now) {
    if (!this.verdictAt) return Infinity;
    const { steady, wall, late } = this.verdictAt;
    return (Math.max(now.steady - steady, now.wall - wall, 0) + late) / 1000;
  }

  isLive(now) {
    return this.age(now) <= (this.answers.verdict?.good_for_s ?? FRESH_WITHOUT_WORD_S);
  }

  /**
   * The verdict, or DON'T KNOW once it is too old to count on.
   * @returns {Partial<Verdict>}
   */
  verdict(now) {
    const found = this.answers.verdict;
    if (found && this.isLive(now)) return found;
    const silent = found
      ? `no verdict from the ground station for ${Math.floor(this.age(now))} s`
      : "no ground station has been heard yet";
    return { ...(found ?? { by_surveys: "dont_know" }), verdict: "dont_know", line: `DON'T KNOW: ${silent}`, why: [silent], todo: KEEP_OUT };
  }

  /**
   * State of each tube from the top down.
   * @returns {(StringTube & Partial<NodeAnswer>)[]}
   */
  tubes() {
    const string = this.answers.string;
    return (string?.tubes ?? []).map((row) => {
      const node = this.answers[`nodes/${row.tube}`] ?? {};
      return node.revision >= string.revision ? { ...row, ...node } : { ...node, ...row };
    });
  }
}
