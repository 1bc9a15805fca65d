// Events, newest first; those that a person should act on can be acknowledged.
import { element } from "./make.js";
import { post } from "./link.js";
import { moment } from "./words.js";

const ALARMS = new Set([
  "change",
  "change-corrected",
  "baseline-unknown",
  "doubtful",
  "gap",
  "loss",
  "overflow",
  "disconnected",
  "refused",
  "restart",
  "record-paused",
  "wrong-rate",
  "clock-jump",
  "layout-changed",
  "unit-changed",
]);
const SHOWN_MAX = 300;

export class Events {
  constructor(host, only, count, onError) {
    Object.assign(this, { host, only, count, onError, all: new Map(), waiting: new Set() });
    only.addEventListener("change", () => this.draw());
    count.addEventListener("click", () => {
      only.checked = true;
      this.draw();
      host.focus();
      host.scrollIntoView({ block: "nearest" });
    });
  }

  begin(axis, may) {
    this.axis = axis;
    this.may = may;
    this.all.clear();
    this.draw();
  }

  take(list) {
    for (const notice of list) {
      this.all.set(notice.id, notice);
      if (notice.acknowledged) this.waiting.delete(notice.id);
    }
    this.draw();
  }

  draw() {
    const list = [...this.all.values()].reverse(),
      alarm = (n) => ALARMS.has(n.kind);
    const open = list.filter((n) => alarm(n) && !n.acknowledged).length;
    this.count.hidden = !open;
    this.count.textContent = `⚠ ${open} ${open === 1 ? "alarm" : "alarms"}`;
    const shown = list.filter((n) => !this.only.checked || alarm(n)).slice(0, SHOWN_MAX);
    const kept = document.activeElement?.dataset?.event;
    this.host.replaceChildren(
      ...(shown.length
        ? shown.map((n) => this.item(n, alarm(n)))
        : [element("li", {}, element("p", {}, this.only.checked ? "no alarms" : "no events yet"))]),
    );
    if (kept) (this.host.querySelector(`[data-event="${CSS.escape(kept)}"]`) || this.host).focus();
  }

  item(notice, alarm) {
    const { id, kind, time_s: timeS, message, acknowledged } = notice;
    let act = element("span", {}, acknowledged ? "✓ seen" : "");
    if (!acknowledged && this.may && alarm) {
      act = element(
        "button",
        {
          type: "button",
          "data-event": id,
          "aria-label": `Acknowledge: ${message}`,
          disabled: this.waiting.has(id),
          onclick: () => this.acknowledge(id),
        },
        "Acknowledge",
      );
    }
    return element(
      "li",
      { class: `${alarm && !acknowledged ? "alarm" : ""}${acknowledged ? " seen" : ""}`, "data-id": id },
      element("time", {}, moment(timeS)),
      element("p", {}, element("span", { class: "kind" }, `${alarm ? "⚠ " : ""}${kind}`), message),
      act,
    );
  }

  async acknowledge(event) {
    this.waiting.add(event);
    this.draw();
    try {
      await post("/api/acknowledge", { axis: this.axis, event });
    } catch (error) {
      this.waiting.delete(event);
      this.onError(error.message);
      this.draw();
    }
  }
}
