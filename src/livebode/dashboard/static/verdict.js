// @ts-check
// The head of the page: whether the display is current, and the verdict on the machine.

/** @import { Facts, Health } from "./messages.js" */
/** @typedef {{up: boolean, facts: Facts, health: Health | null}} Known What the page knows of an axis. */

const BACKLOG_S = 2;

/** @param {number} s */
const seconds = (s) => (s < 120 ? `${Math.round(s)} s` : `${Math.round(s / 60)} min`);

/**
 * Word and look of the lamp; green only if the display is current.
 *
 * @param {Known} known
 * @param {{live: boolean, growing: boolean}} span
 * @param {boolean} paused
 * @returns {[word: string, look: string]}
 */
export function lamp({ up, facts, health }, { live, growing }, paused) {
  if (!up) return ["no connection", "lost"];
  if (!facts.begun) return ["waiting for the first samples", "stale"];
  if (paused) return ["paused", "paused"];
  if (!live) return growing ? ["being recorded", ""] : ["recorded", ""];
  if (!health) return ["waiting for data", "stale"];
  const { source, stale, silent_s: silentS = 0 } = health;
  if (source && !source.connected) return [`not connected, silent for ${seconds(silentS)}`, "stale"];
  if (stale) return [`silent for ${seconds(silentS)}`, "stale"];
  if (source?.waiting_s && source.waiting_s > BACKLOG_S) return [`${seconds(source.waiting_s)} behind`, "stale"];
  return ["live", "live"];
}

/**
 * Word, look and reason: OK, check, ALARM or not assessed.
 *
 * @param {Known} known
 * @param {number} openAlarms
 * @param {string} look of the lamp
 * @returns {[word: string, look: string, reason: string]}
 */
export function verdict({ up, facts, health }, openAlarms, look) {
  if (!up || !facts.begun || !health) return ["not assessed", "open", "no current data of the machine"];
  if (health.alarms.length) return ["ALARM", "alarm", `differs from the baseline: ${health.alarms.join(", ")}`];
  if (look === "stale") return ["check", "check", "no new samples"];
  if (openAlarms) return ["check", "check", `${openAlarms} unacknowledged`];
  if (!facts.baseline) return ["not assessed", "open", "the run has no baseline; create one with livebode learn"];
  return ["OK", "ok", "no significant difference from the baseline"];
}
