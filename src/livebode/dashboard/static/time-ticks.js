// @ts-check
// Marks of a time axis at round times of the shown clock, also across a change between summer and winter time.
import { choice, dayOf, timeOf, today, wallS, zoneOf } from "./clock.js";
import { tr } from "./language.js";
import { mark } from "./words.js";

const DAY_S = 86400;
const STEPS_S = [
  ...[0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30],
  ...[60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200],
  ...[1, 2, 7, 14, 28, 91, 182, 364].map((days) => days * DAY_S),
];
const LETTER_PX = 7,
  // Resolution of seconds since 1970 as a number, with room.
  DIGIT_S = 1e-6,
  GAP_PX = 18,
  // Times of a run are printed as seconds up to here, then as h:min:s.
  SECONDS_MAX = 120;

/**
 * @param {number} value
 * @param {number} step
 */
const rest = (value, step) => ((value % step) + step) % step;

/** @param {number} stepS */
const digitsOf = (stepS) => (stepS >= 60 ? -1 : stepS >= 1 ? 0 : stepS >= 0.1 ? 1 : stepS >= 0.01 ? 2 : 3);

/**
 * Round times of the shown clock from `low` to `high`, in a room of so many pixels.
 *
 * @param {number} low
 * @param {number} high
 * @param {number} room
 */
export function timeSplits(low, high, room) {
  const zone = new Set([zoneOf(low), zoneOf(high)]).size > 1 ? zoneOf(low).length + 1 : 0;
  const run = choice() === "run";
  /** @param {number} stepS */
  const fits = (stepS) => {
    const letters = (stepS >= 60 && !run ? 5 : 8 + Math.max(0, digitsOf(stepS) + 1)) + zone;
    return ((high - low) / stepS) * (letters * LETTER_PX + GAP_PX) <= room;
  };
  const step = STEPS_S.find(fits) ?? Math.ceil((high - low) / DAY_S) * DAY_S;
  // After the change of a zone the marks are at round times again, and further apart rather than twice.
  /** @param {number} at */
  const round = (at) => {
    const off = rest(wallS(at), step);
    return at + (off >= step / 2 ? step - off : -off);
  };
  const found = [];
  const first = round(low + rest(-wallS(low), step));
  for (let at = first; at <= high + DIGIT_S; at = round(at + step))
    if (at >= low - DIGIT_S) found.push(Math.min(high, Math.max(low, at)));
  return found;
}

/**
 * The words of such marks: with the zone if it changes among them, and the date at midnight.
 *
 * @param {number[]} splits
 */
export function timeMarks(splits) {
  const step = splits.slice(1).reduce((least, v, i) => Math.min(least, v - splits[i]), Infinity);
  if (choice() === "run") return runMarks(splits.map(wallS), step);
  const zones = splits.map(zoneOf),
    change = new Set(zones).size > 1;
  return splits.map((at, i) => {
    const timeS = at + 1e-6; // not the end of the tenth before it
    const midnight = step >= 60 && rest(wallS(timeS), DAY_S) < 1;
    const text = midnight ? dayOf(timeS).replace(/^\d{4}-/, "") : timeOf(timeS, digitsOf(step * 1.001));
    return change ? `${text} ${zones[i]}` : text;
  });
}

/**
 * @param {number[]} seconds
 * @param {number} step
 */
function runMarks(seconds, step) {
  if (seconds.every((v) => Math.abs(v) <= SECONDS_MAX)) return seconds.map(mark);
  return seconds.map((v) => {
    const whole = Math.floor(Math.abs(v) + 1e-6);
    /** @param {number} part */
    const two = (part) => String(part).padStart(2, "0");
    const fine = step < 0.999 ? mark(Math.abs(v) - whole).slice(1) : "";
    return `${v < 0 ? "−" : ""}${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}${fine}`;
  });
}

/**
 * The label of a time axis: with date and zone, or both zones if it changes.
 *
 * @param {number} low
 * @param {number} high
 */
export function timeLabel(low, high) {
  if (choice() === "run")
    return Math.max(Math.abs(wallS(low)), Math.abs(wallS(high))) > SECONDS_MAX
      ? tr("time in h:min:s")
      : tr("time in s");
  if (!Number.isFinite(low) || !Number.isFinite(high)) return tr("time");
  const days = [...new Set([dayOf(low), dayOf(high)])].join(" … "),
    zone = [...new Set([zoneOf(low), zoneOf(high)])].join(" → ");
  if (days === today()) return tr("time, {zone}", { zone });
  return tr("time on {day}, {zone}", { day: days, zone });
}

/**
 * Marks and words for a chart.
 *
 * @type {Pick<uPlot.Axis, "splits" | "values" | "filter">}
 */
export const timeAxis = {
  splits: (u, _axis, low, high) => timeSplits(low, high, u.bbox.width / devicePixelRatio),
  filter: (_u, splits) => splits,
  values: (_u, splits) => timeMarks(splits),
};
