// @ts-check
// The head of the page: whether the display is current, and the verdict on the machine.
import { tr } from "./language.js";
import { recognised } from "./recognition.js";

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
  if (!up) return [tr("no connection"), "lost"];
  if (!facts.begun) return [tr("waiting for the first samples"), "stale"];
  if (paused) return [tr("paused"), "paused"];
  if (!live) return growing ? [tr("being recorded"), ""] : [tr("recorded"), ""];
  if (!health) return [tr("waiting for data"), "stale"];
  const { source, stale, silent_s: silentS = 0 } = health;
  if (source && !source.connected) return [tr("not connected, silent for {time}", { time: seconds(silentS) }), "stale"];
  if (stale) return [tr("silent for {time}", { time: seconds(silentS) }), "stale"];
  if (source?.waiting_s && source.waiting_s > BACKLOG_S)
    return [tr("{time} behind", { time: seconds(source.waiting_s) }), "stale"];
  return [tr("live"), "live"];
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
  if (!up || !facts.begun || !health) return [tr("not assessed"), "open", tr("no current data of the machine")];
  if (health.alarms.length) {
    const names = health.alarms.map(recognised).join(tr(", "));
    return [tr("ALARM"), "alarm", tr("differs from the baseline: {names}", { names })];
  }
  if (look === "stale") return [tr("check"), "check", tr("no new samples")];
  if (openAlarms) return [tr("check"), "check", tr("{count} unacknowledged", { count: openAlarms })];
  if (!facts.baseline)
    return [tr("not assessed"), "open", tr("the run has no baseline; create one with livebode learn")];
  return [tr("OK"), "ok", tr("no significant difference from the baseline")];
}
