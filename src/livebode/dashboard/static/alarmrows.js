// @ts-check
// Rows of the lists of alarms and events, and of their history.
import { hourMinute, moment } from "./clock.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { worded } from "./worded.js";

/** @import { Alarm, Notice, Transition } from "./messages.js" */
/** @typedef {{label: string, words: string, act: () => void, disabled?: boolean}} Act */

/** @type {Record<string, [sign: string, words: string]>} */
export const STATES = {
  unacknowledged: ["⚠", tr("not acknowledged")],
  returned: ["↩", tr("over, not acknowledged")],
  acknowledged: ["✓", tr("acknowledged, active")],
  shelved: ["⏸", tr("shelved")],
  suppressed: ["⊘", tr("suppressed: not ready")],
  normal: ["", tr("normal")],
};
/** @type {Record<string, string>} */
const WHAT = {
  raised: tr("raised"),
  returned: tr("over"),
  acknowledged: tr("acknowledged"),
  shelved: tr("shelved"),
  unshelved: tr("unshelved"),
  suppressed: tr("suppressed"),
  unsuppressed: tr("no longer suppressed"),
  chattering: tr("chattering"),
};
/** @type {Record<string, string>} */
const PRIORITIES = { high: tr("high priority"), medium: tr("medium priority"), low: tr("low priority") };

/** @param {{state: string} | null} alarm */
export const open = (alarm) => alarm?.state === "unacknowledged" || alarm?.state === "returned";

/**
 * Whether an alarm chatters at the newest time of the run.
 *
 * @param {Alarm} alarm
 * @param {number} nowS
 */
export const chatters = ({ chatters_until_s: untilS }, nowS) => untilS !== null && !(nowS > untilS);

/**
 * What is known of an alarm beside its message.
 *
 * @param {Notice} notice
 * @param {number} nowS
 */
function remarks({ alarm, count, first_s: firstS }, nowS) {
  const found = count > 1 ? [tr("{count} times since {time}", { count, time: moment(firstS) })] : [];
  if (!alarm) return found;
  const { returned_s: returnedS } = alarm;
  if (chatters(alarm, nowS)) found.unshift(tr("chattering: raised 3 times or more in a minute"));
  if (returnedS !== null && returnedS > alarm.since_s) found.push(tr("over since {time}", { time: moment(returnedS) }));
  return [...found, ...persons(alarm)];
}

/**
 * Who acted, and why.
 *
 * @param {Partial<Pick<Alarm, "by" | "comment" | "shelf">>} alarm
 */
export function persons({ by, comment, shelf }) {
  const found = by ? [tr("acknowledged by {name}", { name: by }) + (comment ? `: ${comment}` : "")] : [];
  if (shelf)
    found.push(
      tr("shelved by {name} until {time}: {reason}", {
        name: shelf.by,
        time: hourMinute(shelf.until_s),
        reason: shelf.reason,
      }),
    );
  return found;
}

/** @param {{state: string, priority: string}} alarm */
export function chip({ state, priority }) {
  const [sign, words] = STATES[state];
  const text = [`${sign} ${words}`, PRIORITIES[priority]].filter(Boolean).join(" · ");
  return element("span", { class: `state ${state} ${priority}` }, text);
}

/** @param {Act} act */
export const actButton = ({ label, words, act, disabled }, tabindex = -1) =>
  element(
    "button",
    {
      type: "button",
      tabindex,
      "aria-label": label,
      disabled: disabled ?? false,
      onclick: (event) => {
        event.stopPropagation();
        act();
      },
    },
    words,
  );

/**
 * @param {string} cause
 * @param {string} look
 * @param {number} timeS that is written in the row
 * @param {number} momentS to which a click goes
 * @param {(Node | string)[]} words
 * @param {Act[]} acts
 */
function row(cause, look, timeS, momentS, words, acts) {
  return element(
    "div",
    { role: "row", tabindex: -1, class: look, "data-cause": cause, "data-time": momentS },
    element("time", { role: "gridcell" }, moment(timeS)),
    element("p", { role: "gridcell" }, ...words),
    element("span", { role: "gridcell", class: "acts" }, ...acts.map((act) => actButton(act))),
  );
}

/**
 * @param {Notice} notice
 * @param {number} nowS
 * @param {Act[]} acts
 */
export function noticeRow(notice, nowS, acts) {
  const { alarm, kind, cause, count, seen, last_s: lastS } = notice;
  const state = alarm?.state ?? "normal";
  const shown = alarm && state !== "normal" ? [chip(alarm), " "] : [];
  const look = `${open(alarm) ? "alarm" : ""}${seen >= count ? " seen" : ""}`;
  return row(
    cause,
    look,
    lastS,
    alarm?.at_s ?? lastS,
    [
      ...shown,
      element("span", { class: "kind" }, worded(kind)),
      worded(notice.words),
      ...remarks(notice, nowS).map((text) => element("span", { class: "often" }, text)),
    ],
    acts,
  );
}

/** @param {Transition} transition */
export function historyRow(transition) {
  const { cause, time_s: timeS, what, kind, by, comment, count } = transition;
  const person = by ? [by, comment].filter(Boolean).join(": ") : "";
  return row(
    cause,
    "",
    timeS,
    timeS,
    [
      element("span", { class: "state" }, count > 1 ? `${WHAT[what]} · ${count} ×` : WHAT[what]),
      " ",
      element("span", { class: "kind" }, worded(kind)),
      worded(transition.words),
      ...(person ? [element("span", { class: "often" }, person)] : []),
    ],
    [],
  );
}
