// @ts-check
// Times of a run: time of day in the viewer's zone if the run has a clock, otherwise the run's own time in s.
import { language, tr } from "./language.js";
import { fixed, mark } from "./words.js";

const LOCALE = language.code === "en" ? "en-GB" : language.code;
/** @type {Intl.DateTimeFormatOptions} */
const PLAIN = { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" };
/** @param {Intl.DateTimeFormatOptions} more */
const format = (more) => new Intl.DateTimeFormat(LOCALE, { ...PLAIN, ...more });
const TIME = format({}),
  TENTHS = format({ fractionalSecondDigits: 1 }),
  HUNDREDTHS = format({ fractionalSecondDigits: 2 }),
  // In English year-month-day, as in messages and reports.
  DAY = new Intl.DateTimeFormat(language.code === "en" ? "sv-SE" : language.code, {
    year: "numeric",
    month: "2-digit",
    day: "2-digit",
  }),
  ZONE = format({ timeZoneName: "short" });

/** @typedef {[fromS: number, since1970S: number][]} Clock Second of the run from which it is valid, and seconds since 1970 at second 0 of the run. */
/** @type {Clock} */
let clock = [];

/**
 * Whether another clock is used from here on.
 *
 * @param {Clock} pieces
 */
export function setClock(pieces) {
  const before = clock;
  clock = pieces;
  return JSON.stringify(before) !== JSON.stringify(clock);
}

/** @param {number} timeS */
const originS = (timeS) => (clock.findLast(([fromS]) => fromS <= timeS) ?? clock[0])[1];
/** @param {number} timeS */
const dateOf = (timeS) => new Date(1000 * (timeS + originS(timeS)));
/** @param {Date} date */
const zoneOf = (date) => ZONE.formatToParts(date).find(({ type }) => type === "timeZoneName")?.value ?? "";

/**
 * For a sentence: "14:32:07 CEST", with its date if that is not today; `fine` with hundredths.
 *
 * @param {number | undefined} timeS
 */
export function moment(timeS, fine = false) {
  if (timeS === undefined || !Number.isFinite(timeS)) return "–";
  if (!clock.length) return seconds(timeS);
  const date = dateOf(timeS),
    day = DAY.format(date);
  const words = `${(fine ? HUNDREDTHS : TIME).format(date)} ${zoneOf(date)}`;
  return day === DAY.format(new Date()) ? words : `${day} ${words}`;
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
 * For an axis of time, with marks that are so many seconds apart.
 *
 * @param {number[]} splits
 * @param {number} stepS
 */
export function ticks(splits, stepS) {
  if (!clock.length) return splits.map(mark);
  return splits.map((v) => (stepS < 0.1 ? HUNDREDTHS : stepS < 1 ? TENTHS : TIME).format(dateOf(v + 1e-6)));
}

/** @param {number} timeS */
export function timeLabel(timeS) {
  if (!clock.length) return tr("time in s");
  return Number.isFinite(timeS) ? tr("time, {zone}", { zone: zoneOf(dateOf(timeS)) }) : tr("time");
}
