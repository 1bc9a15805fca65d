// @ts-check
// Events, one row for each cause, newest first; alarms can be acknowledged.

import { moment } from "./clock.js";
import { tr, trn } from "./language.js";
import { post, reason } from "./link.js";
import { element } from "./make.js";
import { recognised } from "./recognition.js";

/** @import { Notice } from "./messages.js" */

const ALARMS = new Set([
  "change",
  "change-corrected",
  "baseline-unknown",
  "doubtful",
  "roles-doubtful",
  "window-doubtful",
  "phase-slip",
  "gap",
  "loss",
  "overflow",
  "disconnected",
  "refused",
  "waiting",
  "restart",
  "record-paused",
  "backlog",
  "wrong-rate",
  "clock-jump",
  "layout-changed",
  "unit-changed",
]);
const SHOWN_MAX = 300;

export class Events {
  /**
   * @param {HTMLElement} host
   * @param {HTMLInputElement} only
   * @param {HTMLElement} count
   * @param {(text: string) => void} onError
   */
  constructor(host, only, count, onError) {
    this.host = host;
    this.only = only;
    this.count = count;
    this.onError = onError;
    this.axis = 0;
    this.may = false;
    /** @type {Map<string, Notice>} */
    this.all = new Map();
    /** @type {Set<string>} causes whose acknowledgement is on its way */
    this.waiting = new Set();
    this.open = 0;
    only.addEventListener("change", () => this.draw());
    count.addEventListener("click", () => {
      only.checked = true;
      this.draw();
      host.focus();
      host.scrollIntoView({ block: "nearest" });
    });
  }

  /**
   * @param {number} axis
   * @param {boolean} may whether this person may acknowledge
   */
  begin(axis, may) {
    this.axis = axis;
    this.may = may;
    this.all.clear();
    this.draw();
  }

  /** @param {Notice[]} list */
  take(list) {
    for (const notice of list) {
      this.all.delete(notice.cause); // the newest goes to the end
      this.all.set(notice.cause, notice);
      if (notice.seen >= notice.count) this.waiting.delete(notice.cause);
    }
    this.draw();
  }

  draw() {
    const list = [...this.all.values()].sort((a, b) => b.last_s - a.last_s);
    /** @param {Notice} n */
    const alarm = (n) => n.kinds.some((kind) => ALARMS.has(kind));
    const open = list.filter((n) => alarm(n) && n.seen < n.count).length;
    this.open = open;
    this.count.hidden = !open;
    const alarms = trn("{n} alarm", "{n} alarms", open);
    this.count.textContent = `⚠ ${alarms}`;
    const shown = list.filter((n) => !this.only.checked || alarm(n)).slice(0, SHOWN_MAX);
    const kept = document.activeElement?.getAttribute("data-event");
    this.host.replaceChildren(
      ...(shown.length
        ? shown.map((n) => this.item(n, alarm(n)))
        : [element("li", {}, element("p", {}, this.only.checked ? tr("no alarms") : tr("no events yet")))]),
    );
    if (!kept) return;
    /** @type {HTMLElement | null} */
    const again = this.host.querySelector(`[data-event="${CSS.escape(kept)}"]`);
    (again ?? this.host).focus();
  }

  /**
   * @param {Notice} notice
   * @param {boolean} alarm
   */
  item(notice, alarm) {
    const { id, cause, kind, first_s: firstS, last_s: lastS, count, seen } = notice;
    const message = recognised(notice.message);
    const open = seen < count;
    /** @type {HTMLElement} */
    let act = element("span", {}, open ? "" : `✓ ${tr("acknowledged")}`);
    if (open && this.may && alarm) {
      act = element(
        "button",
        {
          type: "button",
          "data-event": cause,
          "aria-label":
            count > 1
              ? tr("Acknowledge all {count}: {message}", { count, message })
              : tr("Acknowledge: {message}", { message }),
          disabled: this.waiting.has(cause),
          onclick: () => this.acknowledge(cause, id),
        },
        count - seen > 1 ? tr("Acknowledge {count}", { count: count - seen }) : tr("Acknowledge"),
      );
    }
    const often = element(
      "span",
      { class: "often" },
      tr("{count} times since {time}", { count, time: moment(firstS) }),
    );
    return element(
      "li",
      { class: `${alarm && open ? "alarm" : ""}${open ? "" : " seen"}`, "data-cause": cause },
      element("time", {}, moment(lastS)),
      element(
        "p",
        {},
        element("span", { class: "kind" }, `${alarm ? "⚠ " : ""}${recognised(kind)}`),
        message,
        ...(count > 1 ? [often] : []),
      ),
      act,
    );
  }

  /**
   * All of a cause up to the event that is shown.
   *
   * @param {string} cause
   * @param {string} event
   */
  async acknowledge(cause, event) {
    this.waiting.add(cause);
    this.draw();
    try {
      await post("/api/acknowledge", { axis: this.axis, event });
    } catch (error) {
      this.waiting.delete(cause);
      this.onError(reason(error));
      this.draw();
    }
  }
}
