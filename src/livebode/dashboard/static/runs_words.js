// @ts-check
// What the list shows of a run, in words.
import { language, tr } from "./language.js";
import { worded } from "./worded.js";
import { afterNumber, fixed, hertz, pair } from "./words.js";

/** @import { RunRow } from "./runs_feed.js" */

const LOCALE = language.code === "en" ? "sv-SE" : language.code;
const DATE = new Intl.DateTimeFormat(LOCALE, {
  year: "numeric",
  month: "2-digit",
  day: "2-digit",
  hour: "2-digit",
  minute: "2-digit",
  hourCycle: "h23",
});
const DAY = new Intl.DateTimeFormat(LOCALE, { year: "numeric", month: "2-digit", day: "2-digit" });
const ZONE = new Intl.DateTimeFormat(language.code === "en" ? "en-GB" : language.code, { timeZoneName: "short" });

/**
 * Date, time of day and zone of the viewer.
 *
 * @param {number} unixS
 */
export function dateTime(unixS) {
  const date = new Date(1000 * unixS);
  const zone = ZONE.formatToParts(date).find(({ type }) => type === "timeZoneName")?.value ?? "";
  return `${DATE.format(date).replace(",", "")} ${zone}`;
}

/** @param {number} unixS */
export const day = (unixS) => DAY.format(new Date(1000 * unixS));

/** @param {RunRow} run */
export function began(run) {
  if (run.begun !== null) return dateTime(run.begun);
  return run.written === null ? "–" : tr("written {time}", { time: dateTime(run.written) });
}

/** @param {number | null} s */
export function duration(s) {
  if (s === null) return "–";
  if (s < 120) return `${fixed(s, 1)} s`;
  const minutes = Math.round(s / 60);
  return minutes < 120 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** @param {number} bytes */
export function size(bytes) {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let power = 0;
  for (let rest = bytes; rest >= 999.5 && power < units.length - 1; rest /= 1000) power++;
  const value = bytes / 1000 ** power;
  return `${fixed(value, power && value < 9.95 ? 1 : 0)} ${units[power]}`;
}

/** @param {RunRow} run */
export function state(run) {
  return {
    finished: tr("finished"),
    recording: tr("being recorded"),
    stopped: tr("stopped before its end"),
    broken: tr("cannot be read"),
  }[run.state];
}

/** @param {RunRow} run */
export function verdict(run) {
  return { ok: tr("OK"), check: tr("check"), alarm: tr("ALARM"), open: tr("not assessed") }[run.tone];
}

/** @param {RunRow} run */
export function lines(run) {
  if (!run.lines || run.low_hz === null || run.high_hz === null) return "–";
  if (run.lines === 1) return `${hertz(run.low_hz)} Hz`;
  return `${run.lines} · ${hertz(run.low_hz)}–${hertz(run.high_hz)} Hz`;
}

/** @param {string} name */
export const quantity = (name) => worded(name.replaceAll("_", " "));

/**
 * A value with its 95 % bound: as many digits as the bound determines.
 *
 * @param {number} value
 * @param {number} bound
 * @param {string} unit
 */
export function bounded(value, bound, unit) {
  if (!Number.isFinite(value)) return "–";
  return pair(value, bound) + afterNumber(unit && worded(unit));
}

/**
 * The quantities of the newest fit that say most: resonances first.
 *
 * @param {RunRow} run
 */
export function fit(run) {
  const score = /** @param {string} name */ (name) => (/^(anti)?resonance(_\d+)?$/.test(name) ? 0 : 1);
  return run.fit.toSorted((a, b) => score(a[0]) - score(b[0])).slice(0, 3);
}

/**
 * The address of a run's page, at a time of the run.
 *
 * @param {string} name
 * @param {number} [timeS]
 */
export const pageOf = (name, timeS) =>
  `/run/${encodeURIComponent(name)}/${timeS === undefined ? "" : `#at=${Number(timeS.toFixed(6))}`}`;
