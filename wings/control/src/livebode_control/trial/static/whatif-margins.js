// @ts-check
// Bandwidth and margins of the described loop and of a trial: of the measured plant, and of the worst within its bounds.
import { tr } from "./language.js";
import { element } from "./make.js";
import {
  keepsClear,
  largestAbove,
  largestFall,
  nearestHz,
  predicted,
  stable,
  widest,
  withUnknown,
} from "./predicted.js";
import { feedback, nothing } from "./trial.js";
import { orNoLimit } from "./whatif-text.js";
import { worded } from "./worded.js";
import { fixed, hertz, plain } from "./words.js";

/** @import { LoopBand, LoopFacts } from "./loop.js" */
/** @import { Disc, Predicted } from "./predicted.js" */
/** @import { Trial } from "./trial.js" */
/** `worst` is null where a plant within the bounds is unstable. @typedef {{measured: Predicted, worst: Predicted | null} | null} Both null where the measured loop is unstable */

const ABOVE_MAX = 0.5; // |L| above the lines: below it, no phase makes Ms larger than 2

/** Usual limits of a servo loop. @type {[name: keyof Predicted, words: string, small: (v: number) => boolean, digits: number][]} */
const ROWS = [
  ["bandwidthHz", tr("bandwidth, Hz"), () => false, 4],
  ["gainMarginDb", tr("gain margin, dB"), (v) => v < 6, 3],
  ["phaseMarginDeg", tr("phase margin, °"), (v) => v < 30, 3],
  ["ms", tr("peak sensitivity Ms"), (v) => v > 2, 3],
  ["disk", tr("disk margin"), () => false, 3],
];

/** L at every place. @param {LoopBand} band @param {LoopFacts} facts @param {Trial} trial @returns {Disc[]} */
export function loops(band, facts, trial) {
  const f = feedback(band.parts, band.frequency_hz, facts, trial);
  return band.places.map((place) => {
    const [re, im, radius] = [0, 1, 2].map(() => new Float64Array(f.re.length));
    for (let i = 0; i < re.length; i++) {
      re[i] = place.re[i] * f.re[i] - place.im[i] * f.im[i];
      im[i] = place.re[i] * f.im[i] + place.im[i] * f.re[i];
      radius[i] = place.radius[i] * Math.hypot(f.re[i], f.im[i]);
    }
    return { re, im, radius, rise: place.rise };
  });
}

/** @param {LoopBand} band @param {Disc[]} places @returns {Both} */
export function both({ frequency_hz: hz, known }, places) {
  if (!places.every((place) => stable(hz, place))) return null;
  const above = largestFall(places, known);
  return {
    measured: predicted(hz, places, known, false),
    worst: keepsClear(places, known) && above < 1 ? withUnknown(predicted(hz, places, known, true), above) : null,
  };
}

export class TrialMargins {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host;
    /** @type {LoopFacts | null} */
    this.facts = null;
    /** @type {Both} */
    this.before = null;
    /** @type {Both} */
    this.after = null;
    this.nearHz = NaN;
    /** @type {Map<string, HTMLElement>} */
    this.cells = new Map();
  }

  /** @param {LoopFacts} facts */
  begin(facts) {
    this.facts = facts;
    this.cells.clear();
    const { band } = facts;
    if (!band) {
      this.host.replaceChildren(element("p", { class: "empty" }, worded(facts.band_why_not)));
      return;
    }
    this.before = both(band, loops(band, facts, nothing()));
    const cell = (/** @type {string} */ name) => {
      const made = element("td", { "data-name": name });
      this.cells.set(name, made);
      return made;
    };
    const sides = ["before", "after"],
      kinds = ["measured", "worst"];
    const rows = ROWS.map(([name, words]) =>
      element(
        "tr",
        {},
        element("th", { scope: "row" }, words),
        ...sides.flatMap((side) => kinds.map((kind) => cell(`${side} ${kind} ${name}`))),
      ),
    );
    const head = (/** @type {string} */ words, /** @type {number} */ span) =>
      element("th", { scope: span > 1 ? "colgroup" : "col", colspan: span }, words);
    const [measured, worst] = [tr("measured"), tr("worst plant")];
    this.note = element("p", { class: "note" });
    this.host.replaceChildren(
      element(
        "table",
        { class: "margins" },
        element(
          "thead",
          {},
          element("tr", {}, element("td", {}), head(tr("before"), 2), head(tr("after"), 2)),
          element("tr", {}, element("td", {}), ...[measured, worst, measured, worst].map((words) => head(words, 1))),
        ),
        element("tbody", {}, ...rows),
      ),
      this.note,
    );
    this.fill("before", this.before);
  }

  /** @param {Trial} trial */
  draw(trial) {
    const { facts, note } = this,
      band = facts?.band;
    if (!facts || !band || !note) return;
    const places = loops(band, facts, trial);
    this.after = both(band, places);
    this.nearHz = nearestHz(band.frequency_hz, places, band.known);
    this.fill("after", this.after);
    const text = [wideWords(band, places, this.after), about(band), aboveWords(band, places)].filter(Boolean).join(" ");
    if (note.textContent !== text) note.textContent = text;
  }

  /** @param {"before" | "after"} side @param {Both} found */
  fill(side, found) {
    for (const kind of /** @type {const} */ (["measured", "worst"]))
      for (const [row, [name, , small, digits]] of ROWS.entries()) {
        const cell = this.cells.get(`${side} ${kind} ${name}`);
        const value = found?.[kind]?.[name];
        if (!cell) continue;
        const mark = value === undefined || small(value);
        cell.className = mark ? "small" : "";
        // Said once: without stability there is no margin.
        const none = row ? "–" : found ? tr("unstable possible") : tr("unstable");
        cell.textContent = value === undefined ? none : `${orNoLimit(value, digits)}${mark ? " ⚠" : ""}`;
      }
  }
}

/** Why a plant within the bounds may be unstable. @param {LoopBand} band @param {Disc[]} places @param {Both} found */
function wideWords({ frequency_hz: hz, known, lines_hz: lines }, places, found) {
  if (!found || found.worst || keepsClear(places, known)) return "";
  const { place, at, share } = widest(places, known),
    near = Math.max(hz[at], lines[0]);
  const words = { hz: hertz(Number(near.toPrecision(3))), percent: plain(100 * share, 2) };
  if (places.length === 1)
    return tr(
      "Unstable possible: the response near {hz} Hz is known only within ± {percent} %. A longer measurement, or more excitation there, makes the bound narrower.",
      words,
    );
  return tr(
    "Unstable possible: at place {n} of {count} the response near {hz} Hz is known only within ± {percent} %. A longer measurement, or more excitation there, makes the bound narrower.",
    { ...words, n: place + 1, count: places.length },
  );
}

/** In one line. @param {Both} found */
export function briefWords(found) {
  if (!found) return tr("after: unstable");
  const { bandwidthHz, gainMarginDb, phaseMarginDeg, ms } = found.measured;
  const margins = [
    gainMarginDb < Infinity ? `${orNoLimit(gainMarginDb)} dB` : tr("any gain"),
    phaseMarginDeg < Infinity ? `${orNoLimit(phaseMarginDeg)}°` : tr("any phase"),
  ];
  const bandwidth = bandwidthHz < Infinity ? `${orNoLimit(bandwidthHz)} Hz` : tr("any bandwidth");
  return tr("after: {margins} · Ms {ms}", { margins: [bandwidth, ...margins].join(" · "), ms: orNoLimit(ms) });
}

/** @param {LoopBand} band */
const about = ({ places, lines_hz: lines, confidence }) =>
  tr(
    "Mean response of the run, places: {places}; {lines} lines, {low} … {high} Hz. Worst plant: within the {percent} % bounds of all lines together.",
    {
      places: places.length,
      lines: lines.length,
      low: hertz(lines[0]),
      high: hertz(lines[lines.length - 1]),
      percent: fixed(100 * confidence, 0),
    },
  );

/** @param {LoopBand} band @param {Disc[]} places */
function aboveWords({ known, lines_hz: lines }, places) {
  const [size, most] = [largestFall(places, known), largestAbove(places, known)],
    high = hertz(lines[lines.length - 1]);
  if (size > ABOVE_MAX)
    return tr(
      "⚠ Above {high} Hz nothing was measured, and |L| may reach {size} there: the margins need less than {most}.",
      {
        high,
        size: orNoLimit(size, 2),
        most: fixed(ABOVE_MAX, 1),
      },
    );
  const db = (/** @type {number} */ ratio) => fixed(20 * Math.log10(ratio), 0);
  const words = tr(
    "The margins hold up to {high} Hz; above it if no resonance exceeds the fall by more than {db} dB.",
    {
      high,
      db: db(ABOVE_MAX / size),
    },
  );
  return most > ABOVE_MAX
    ? [words, tr("⚠ The lines permit one of {db} dB.", { db: db(most / size) })].join(" ")
    : words;
}
