// @ts-check
// Times of a run: time of day in the viewer's zone or in UTC if the run has a clock, otherwise, or as an option, the
// run's own time.
import { chosen, remember } from "./address.js";
import { language, numeral } from "./language.js";
import { fixed } from "./words.js";

/** @typedef {"zone" | "utc" | "run"} Shown The browser's zone, UTC, or the time since the start of the run. */
/** @typedef {[fromS: number, since1970S: number][]} Clock Second of the run from which it is valid, and seconds since 1970 at second 0 of the run. */

const LOCALE = language.code === "en" ? "en-GB" : language.code;
// In English year-month-day, as in messages and reports.
const DAY_LOCALE = language.code === "en" ? "sv-SE" : language.code;
/** @type {readonly Shown[]} */
export const SHOWN = ["zone", "utc", "run"];
/** @type {Shown} */
let shown = chosen("clock", SHOWN[0], SHOWN);
/** @type {Clock} */
let clock = [];
let startS = 0;
/** @type {Set<() => void>} */
const listeners = new Set();
/** @type {Map<string, Intl.DateTimeFormat>} */
const formats = new Map();

/**
 * @param {string} name
 * @param {string} locale
 * @param {Intl.DateTimeFormatOptions} options
 */
function format(name, locale, options) {
  const key = `${name} ${shown}`,
    known = formats.get(key);
  if (known) return known;
  const timeZone = shown === "utc" ? "UTC" : undefined;
  const made = new Intl.DateTimeFormat(locale, { ...options, timeZone, hourCycle: "h23" });
  formats.set(key, made);
  return made;
}

/** @type {Intl.DateTimeFormatOptions} */
const MINUTES = { hour: "2-digit", minute: "2-digit" };
/**
 * Time of day with this many digits after the second, without seconds if negative.
 *
 * @param {Date} date
 * @param {number} digits
 */
function timeOfDay(date, digits) {
  if (digits < 0) return format("minutes", LOCALE, MINUTES).format(date);
  const places = /** @type {1 | 2 | 3} */ (digits);
  return format(`digits ${digits}`, LOCALE, {
    ...MINUTES,
    second: "2-digit",
    ...(digits ? { fractionalSecondDigits: places } : {}),
  }).format(date);
}
/** @param {Date} date */
const day = (date) => format("day", DAY_LOCALE, { year: "numeric", month: "2-digit", day: "2-digit" }).format(date);
/** @param {Date} date */
const zone = (date) =>
  format("zone", LOCALE, { ...MINUTES, timeZoneName: "short" })
    .formatToParts(date)
    .find(({ type }) => type === "timeZoneName")?.value ?? "";

/**
 * Whether another clock is used from here on.
 *
 * @param {Clock} pieces
 * @param {number} runStartS second of the run at which it started
 */
export function setClock(pieces, runStartS) {
  const before = JSON.stringify([clock, startS]);
  clock = pieces;
  startS = runStartS;
  return before !== JSON.stringify([clock, startS]);
}

/** Whether the run has a time of day. */
export const known = () => clock.length > 0;
/** What is shown; without a time of day always the run's own time. */
export const choice = () => (known() ? shown : "run");

/** @param {Shown} value */
export function choose(value) {
  shown = value;
  remember("clock", value, SHOWN[0]);
  for (const listener of listeners) listener();
}

/** @param {() => void} listener */
export function onClock(listener) {
  listeners.add(listener);
}

/** @param {number} timeS */
const originS = (timeS) => (clock.findLast(([fromS]) => fromS <= timeS) ?? clock[0])[1];
/** @param {number} timeS */
const dateOf = (timeS) => new Date(1000 * (timeS + originS(timeS)));

/**
 * Seconds that the shown clock reads: local time of day without its zone, or time since the start.
 *
 * @param {number} timeS
 */
export function wallS(timeS) {
  if (choice() === "run") return timeS - (known() ? startS : 0);
  const unixS = timeS + originS(timeS);
  return shown === "utc" ? unixS : unixS - 60 * new Date(1000 * unixS).getTimezoneOffset();
}

/** @param {number} timeS */
export const zoneOf = (timeS) => (choice() === "run" ? "" : zone(dateOf(timeS)));
export const today = () => day(new Date());
/** @param {number} timeS */
export const dayOf = (timeS) => (choice() === "run" ? "" : day(dateOf(timeS)));
/**
 * @param {number} timeS
 * @param {number} digits
 */
export const timeOf = (timeS, digits) => timeOfDay(dateOf(timeS), digits);

/**
 * For a sentence: "14:32:07 CEST", with its date if that is not today.
 *
 * @param {Date} date
 */
export function clockTime(date, digits = 0) {
  const words = `${timeOfDay(date, digits)} ${zone(date)}`;
  return day(date) === today() ? words : `${day(date)} ${words}`;
}

/**
 * Hours and minutes by the shown clock, with the date if that is not today; also of axes with another clock.
 *
 * @param {number} unixS
 */
export function hourMinute(unixS) {
  const date = new Date(1000 * unixS),
    words = `${timeOfDay(date, -1)}${shown === "utc" ? " UTC" : ""}`;
  return day(date) === today() ? words : `${day(date)} ${words}`;
}

/** A duration since the start of a run, for a sentence. @param {number | null} timeS */
export const runTime = (timeS) => (timeS === null ? "–" : seconds(timeS));

/** Now, with its date, which paper needs. */
export const printTime = () => full(new Date());
/** @param {Date} date */
const full = (date) => `${day(date)} ${timeOfDay(date, 0)} ${zone(date)}`;

// Parts of a date, for its form in the language.
const RECORDED = /** @type {Intl.DateTimeFormatOptions} */ ({
  year: "numeric",
  month: "2-digit",
  day: "2-digit",
  ...MINUTES,
  second: "2-digit",
});

/**
 * A time in a recorded sentence, by the shown clock.
 *
 * @param {number} unixS
 */
export function recordedTime(unixS) {
  if (known() && shown === "run") return `${numeral(wallS(ofUnix(unixS)).toFixed(1))} s`;
  const date = new Date(1000 * unixS),
    parts = format("recorded", "sv-SE", RECORDED).formatToParts(date),
    found = Object.fromEntries(parts.map(({ type, value }) => [type, value]));
  return language.date
    .replace("%Y", found.year)
    .replace("%m", found.month)
    .replace("%d", found.day)
    .replace("%H:%M:%S", `${found.hour}:${found.minute}:${found.second}`)
    .replace("%Z", zone(date));
}

/**
 * A time of the run for a sentence; `fine` with hundredths.
 *
 * @param {number | undefined} timeS
 */
export function moment(timeS, fine = false) {
  if (timeS === undefined || !Number.isFinite(timeS)) return "–";
  return choice() === "run" ? seconds(wallS(timeS)) : clockTime(dateOf(timeS), fine ? 2 : 0);
}

/** @param {number} timeS */
function seconds(timeS) {
  const sign = timeS < 0 ? "−" : "",
    size = Math.abs(timeS);
  if (size < 120) return `${sign}${fixed(size, 2)} s`;
  const whole = Math.floor(size),
    hours = Math.floor(whole / 3600),
    minutes = Math.floor(whole / 60) % 60;
  return `${sign}${hours ? `${hours} h ` : ""}${minutes} min ${whole % 60} s`;
}

/**
 * For the name of a file: 20261025T015812+0200, or 12.35s.
 *
 * @param {number} timeS
 */
export function stamp(timeS) {
  if (choice() === "run") return `${wallS(timeS).toFixed(2)}s`;
  const aheadMin = Math.round((wallS(timeS) - timeS - originS(timeS)) / 60);
  const local = new Date(1000 * wallS(timeS)).toISOString().slice(0, 19).replace(/[-:]/g, "");
  if (shown === "utc") return `${local}Z`;
  const size = Math.abs(aheadMin);
  const zoneDigits = [Math.floor(size / 60), size % 60].map((v) => String(v).padStart(2, "0")).join("");
  return `${local}${aheadMin < 0 ? "-" : "+"}${zoneDigits}`;
}

/**
 * For the address of the page: time of day in UTC if the run has a clock, else seconds of the run.
 *
 * @param {number} timeS
 */
export const toAddress = (timeS) => (known() ? dateOf(timeS).toISOString() : timeS.toFixed(3));

/**
 * Time of the run of what `toAddress` wrote; NaN if it is not a time, or if the run has no clock.
 *
 * @param {string} text
 */
export function fromAddress(text) {
  if (/^-?\d+(\.\d+)?$/.test(text)) return Number(text);
  const unixS = Date.parse(text) / 1000;
  return ofUnix(unixS);
}

/** Time of the run; NaN if it has no clock. @param {number} unixS */
function ofUnix(unixS) {
  const found = clock.findLast(([fromS, since1970S]) => fromS <= unixS - since1970S) ?? clock[0];
  return found ? unixS - found[1] : NaN;
}
