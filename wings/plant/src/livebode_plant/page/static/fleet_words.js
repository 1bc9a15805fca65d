// @ts-check
// How an axis of a fleet looks, and the words for it. The numbers of the looks are those of fleet_board.py.
import { hourMinute } from "./clock.js";
import { tr } from "./language.js";
import { worded } from "./worded.js";
import { afterNumber, fixed, pair, signed } from "./words.js";

/** @import { AxisRow } from "./fleet_feed.js" */

/**
 * @typedef {object} Look
 * @property {string} key
 * @property {string} sign
 * @property {string} words
 * @property {string} fill colour of look.css; empty: hollow
 * @property {string} ink of sign and edge
 */

/** @type {Look[]} */
export const LOOKS = [
  { key: "open", sign: "○", words: tr("not assessed"), fill: "", ink: "muted" },
  { key: "ok", sign: "✓", words: tr("OK"), fill: "tile-ok", ink: "good" },
  { key: "check", sign: "◆", words: tr("check"), fill: "tile-check", ink: "warn" },
  { key: "alarm", sign: "⚠", words: tr("alarm, not acknowledged"), fill: "alarm", ink: "paper" },
  { key: "returned", sign: "↩", words: tr("over, not acknowledged"), fill: "", ink: "alarm" },
  { key: "acknowledged", sign: "☑", words: tr("acknowledged, active"), fill: "alarm-ground", ink: "alarm" },
  { key: "shelved", sign: "⏸", words: tr("shelved"), fill: "ground", ink: "muted" },
  { key: "not-ready", sign: "⊘", words: tr("machine not ready"), fill: "ground", ink: "muted" },
  { key: "silent", sign: "∅", words: tr("no samples"), fill: "", ink: "warn" },
  { key: "behind", sign: "◷", words: tr("late"), fill: "", ink: "warn" },
  { key: "lost", sign: "✕", words: tr("no worker"), fill: "ink", ink: "paper" },
];
/** Numbers of looks in the order of their urgency. */
export const URGENT = [3, 10, 8, 4, 2, 5, 9, 7, 6, 0, 1];

/** @type {Record<string, string>} */
const KINDS = {
  change: tr("changed from the baseline"),
  gap: tr("samples lost"),
  loss: tr("samples lost"),
  disconnected: tr("source not connected"),
  backlog: tr("computation is behind"),
};

/** @param {string} kind */
export const kindWords = (kind) => KINDS[kind] ?? worded(kind.replaceAll("-", " "));

/** @param {number | null} s */
export function span(s) {
  if (s === null) return "–";
  if (s < 10) return `${fixed(s, 1)} s`;
  if (s < 120) return `${Math.round(s)} s`;
  return s < 7200 ? `${Math.round(s / 60)} min` : `${Math.round(s / 3600)} h`;
}

/** @param {number} n */
export const thousands = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, "\u202f");

/** @param {AxisRow} row */
export const value = ({ value, bound, unit = "" }) =>
  value === null ? "–" : pair(value, bound ?? NaN) + afterNumber(unit);

/**
 * What is noteworthy of an axis, beside how it looks.
 *
 * @param {AxisRow} row
 */
export function remarks(row) {
  const found = [];
  if (row.kind && row.state !== "normal") found.push(kindWords(row.kind));
  if (row.change_percent !== null && row.parameter && row.value !== null)
    found.push(`${worded(row.parameter.replaceAll("_", " "))} ${signed(row.change_percent, 1)}\u00a0%`);
  if (row.lag_s !== null && row.lag_s > 2) found.push(tr("newest response {time} ago", { time: span(row.lag_s) }));
  if (row.lost) found.push(tr("{count} samples lost", { count: thousands(row.lost) }));
  return found;
}

/** @param {number} unixS */
export const since = (unixS) => (unixS > 0 ? hourMinute(unixS) : "");
