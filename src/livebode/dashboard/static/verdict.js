// @ts-check
// The first look: whether the display is current, and the one sentence on the machine that matters.
import { choice, hourMinute, runTime, wallS } from "./clock.js";
import { tr, trn } from "./language.js";
import { worded } from "./worded.js";
import { fixed, plain, signed } from "./words.js";

/** @import { AlarmFacts, Facts, Health, Verdict } from "./messages.js" */
/** @typedef {{up: boolean, facts: Facts, health: Health | null}} Known What the page knows of an axis. */
/** @typedef {"alarm" | "check" | "ok" | "open"} Tone */

/** @param {number} s */
const seconds = (s) => (s < 120 ? `${Math.round(s)} s` : `${Math.round(s / 60)} min`);

/**
 * Word and look of the lamp; green only if the display is current.
 *
 * @param {Known & {over: boolean}} known `over`: its server ended with the run
 * @param {{live: boolean, growing: boolean}} span
 * @param {boolean} paused
 * @returns {[word: string, look: string]}
 */
export function lamp({ up, over, facts, health }, { live, growing }, paused) {
  if (!up) return over ? [tr("recorded"), ""] : [tr("no connection"), "lost"];
  if (!facts.begun) return [tr("waiting for the first samples"), "stale"];
  if (paused) return [tr("paused"), "paused"];
  if (!live) return growing ? [tr("being recorded"), ""] : [tr("recorded"), ""];
  if (!health) return [tr("waiting for data"), "stale"];
  const { source, stale, silent_s: silentS = 0, backlog_s: backlogS, ending } = health;
  if (ending) return [tr("completing the record"), ""];
  if (source && !source.connected) return [tr("not connected, silent for {time}", { time: seconds(silentS) }), "stale"];
  if (stale) return [tr("silent for {time}", { time: seconds(silentS) }), "stale"];
  if (backlogS) return [tr("{time} behind", { time: seconds(backlogS) }), "stale"];
  return [tr("live"), "live"];
}

/**
 * By the clock of the page; an axis in another tile has a run and a clock of its own.
 *
 * @param {Verdict} verdict
 */
function sinceOf({ since_s: s, since_unix_s: unixS, other }) {
  if (other || choice() !== "run") return unixS === null ? runTime(s) : hourMinute(unixS);
  return runTime(s === null ? null : wallS(s));
}

/** @type {Record<string, [less: (size: string) => string, more: (size: string) => string]>} */
const EFFECTS = {
  stiffness: [(size) => tr("belt {size} % softer", { size }), (size) => tr("belt {size} % stiffer", { size })],
  load: [(size) => tr("load {size} % lighter", { size }), (size) => tr("load {size} % heavier", { size })],
  damping: [
    (size) => tr("belt's damping {size} % lower", { size }),
    (size) => tr("belt's damping {size} % higher", { size }),
  ],
  inertia: [
    (size) => tr("motor's inertia {size} % lower", { size }),
    (size) => tr("motor's inertia {size} % higher", { size }),
  ],
};

/**
 * What has changed, and by how much.
 *
 * @param {AlarmFacts} facts
 */
function effect(facts) {
  const { what = "", amount_percent: percent, place_m: place, name, of, amount, unit = "", entry } = facts;
  const known = EFFECTS[what];
  if (known && percent !== undefined) {
    const words = known[percent < 0 ? 0 : 1](fixed(Math.abs(percent), 1));
    return place === undefined ? words : tr("{what} at {place} m", { what: words, place: plain(place, 3) });
  }
  if (what === "machine") return tr("far from the baseline: another machine?");
  if (entry !== undefined && name === undefined && percent !== undefined) {
    return tr("response {entry} differs by {size} %", { entry, size: fixed(percent, 1) });
  }
  if (name === undefined || amount === undefined) return tr("different from the baseline");
  const size = `${signed(amount)} ${unit}`;
  return of === "value" || of === undefined
    ? `${worded(name)} ${size}`
    : tr("{quantity} at {name} {size}", { quantity: worded(of), name, size });
}

/** @type {Record<string, (verdict: Verdict) => string>} */
const SENTENCES = {
  change: (v) => tr("ALARM: {what} since {time}", { what: several(effect(v.facts), v.count), time: sinceOf(v) }),
  shelved: (v) =>
    tr("Check: {what} since {time} (shelved)", { what: several(effect(v.facts), v.count), time: sinceOf(v) }),
  silent: (v) => tr("Check: no samples for {time}", { time: seconds(v.seconds ?? 0) }),
  disconnected: (v) => tr("Check: source not connected for {time}", { time: seconds(v.seconds ?? 0) }),
  behind: (v) => tr("Check: tracking is {time} behind", { time: seconds(v.seconds ?? 0) }),
  alarms: (v) =>
    trn("Check: {n} alarm not acknowledged since {time}", "Check: {n} alarms not acknowledged since {time}", v.count, {
      time: sinceOf(v),
    }),
  active: (v) =>
    trn(
      "Check: {n} acknowledged alarm active since {time}",
      "Check: {n} acknowledged alarms active since {time}",
      v.count,
      {
        time: sinceOf(v),
      },
    ),
  suppressed: (v) => tr("Not assessed: not ready since {time}", { time: sinceOf(v) }),
  "not-monitored": (v) => tr("Not monitored since {time}: too little is known of the machine", { time: sinceOf(v) }),
  healthy: () => tr("Healthy: no difference from the baseline"),
  "no-baseline": () => tr("No baseline: not monitored"),
  "not-judged": () => tr("Not assessed: the baseline does not cover what the machine did"),
  "not-begun": () => tr("Not assessed: waiting for the first samples"),
};

/** For a tile that is read from three metres. @type {Record<string, (verdict: Verdict) => string>} */
const WORDS = {
  change: () => tr("ALARM"),
  shelved: () => tr("shelved"),
  silent: () => tr("no samples"),
  disconnected: () => tr("offline"),
  behind: () => tr("behind"),
  alarms: (v) => trn("{n} alarm", "{n} alarms", v.count),
  active: (v) => trn("{n} alarm", "{n} alarms", v.count),
  suppressed: () => tr("not ready"),
  "not-monitored": () => tr("not monitored"),
  healthy: () => tr("healthy"),
  "no-baseline": () => tr("no baseline"),
  "not-judged": () => tr("not judged"),
  "not-begun": () => tr("waiting"),
};

/**
 * One or two words on an axis.
 *
 * @param {boolean} up
 * @param {Verdict} verdict
 */
export const shortWord = (up, verdict) => (up && WORDS[verdict.word]?.(verdict)) || tr("no data");

/**
 * @param {string} what
 * @param {number} count
 */
const several = (what, count) => (count > 1 ? tr("{what}, and {more} more", { what, more: count - 1 }) : what);

/**
 * The sentence on an axis; without a verdict, or without a connection, nothing can be said.
 *
 * @param {boolean} up
 * @param {Verdict | undefined | null} verdict `other` if it is not on the axis of the page
 * @returns {{text: string, tone: Tone, detail: string}}
 */
export function sentence(up, verdict) {
  if (!up) return { text: tr("Not assessed: no connection to the server"), tone: "open", detail: "" };
  const words = verdict && SENTENCES[verdict.word];
  if (!words) return { text: tr("Not assessed: no current data of the machine"), tone: "open", detail: "" };
  return { text: words(verdict), tone: verdict.tone, detail: worded(verdict.words) };
}
