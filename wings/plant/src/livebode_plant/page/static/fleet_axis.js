// @ts-check
// The dialog of one axis: its values, its alarm, and links to its own pages.
import { chip, persons } from "./alarmrows.js";
import { AxisTrend } from "./fleet_trend.js";
import { kindWords, LOOKS, since, span, thousands, value } from "./fleet_words.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";
import { worded } from "./worded.js";
import { signed } from "./words.js";

/** @import { Acts } from "./fleet_acts.js" */
/** @import { AxisRow, FleetFeed } from "./fleet_feed.js" */

const ALARMS = ["alarm", "returned", "acknowledged", "shelved"];

export class AxisDialog {
  dialog = $("axis", HTMLDialogElement);
  trend = new AxisTrend($("axis-trend"));
  shown = "";

  /**
   * @param {FleetFeed} feed
   * @param {Acts} acts
   * @param {(path: string) => void} onPath empty when it is closed
   */
  constructor(feed, acts, onPath) {
    this.feed = feed;
    this.acts = acts;
    this.onPath = onPath;
    this.dialog.addEventListener("close", () => {
      if (this.dialog.open) return; // for another axis, before this event came
      this.path = "";
      this.trend.close();
      feed.watch({ axis: null });
      onPath("");
    });
    this.dialog.addEventListener("click", ({ target }) => {
      if (target === this.dialog) this.dialog.close();
    });
  }

  path = "";

  /** @param {number} axis */
  open(axis) {
    this.path = this.feed.paths[axis];
    this.shown = "";
    $("axis-title").textContent = this.path;
    for (const id of ["axis-state", "axis-facts", "axis-links"]) $(id).replaceChildren();
    this.buttons([]);
    this.feed.watch({ axis });
    this.onPath(this.path);
    this.trend.open(this.path);
    if (!this.dialog.open) this.dialog.showModal();
  }

  /** @param {AxisRow | null | undefined} row */
  take(row) {
    if (!row || !this.dialog.open || this.feed.paths[row.axis] !== this.path) return;
    const { sign, words, key } = LOOKS[row.look];
    const look = element("span", { class: `look look-${key}` }, `${sign} ${words}`);
    const alarm = row.state === "normal" ? [] : [chip(row)];
    // The state of an alarm says the same in more words.
    $("axis-state").replaceChildren(...(alarm.length && ALARMS.includes(key) ? alarm : [look, " ", ...alarm]));
    $("axis-facts").replaceChildren(
      ...facts(row).flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]),
    );
    const waiting = this.acts.waiting.has(this.acts.key(row));
    const key2 = JSON.stringify([row.state, row.raised, this.acts.may, waiting]);
    if (key2 === this.shown) return;
    this.shown = key2;
    this.buttons(this.acts.buttons(row, () => this.dialog.focus(), 0));
    this.links(row);
  }

  /** @param {HTMLElement[]} acts */
  buttons(acts) {
    const close = element("button", { type: "button", onclick: () => this.dialog.close() }, tr("Close"));
    $("axis-acts").replaceChildren(...acts, close);
  }

  /** @param {AxisRow} row */
  links({ url }) {
    const trends = this.feed.fleet?.trends;
    const found = [
      ...(url ? [[url, tr("Page of this axis")]] : []),
      ...(trends ? [[`${trends}#${new URLSearchParams({ find: this.path })}`, tr("Trend of a year")]] : []),
    ];
    $("axis-links").replaceChildren(
      ...found.map(([href, text]) =>
        element("a", { href, class: "button", target: "_blank", rel: "noopener noreferrer" }, text),
      ),
    );
  }
}

/** @param {AxisRow} row @returns {[string, string][]} */
function facts(row) {
  /** @type {[string, string][]} */
  const found = [];
  if (row.parameter) {
    const text =
      row.value === null || row.change_percent === null
        ? value(row)
        : tr("{value}, {percent} % from the baseline", { value: value(row), percent: signed(row.change_percent, 1) });
    found.push([worded(row.parameter.replaceAll("_", " ")), text]);
  }
  if (row.kind && row.state !== "normal")
    found.push([tr("Alarm"), [kindWords(row.kind), since(row.raised_s), ...persons(row)].filter(Boolean).join(" · ")]);
  found.push([tr("Newest response"), tr("{time} ago", { time: span(row.lag_s) })]);
  found.push([
    tr("Gaps"),
    row.gaps ? tr("{gaps}, {lost} samples lost", { gaps: row.gaps, lost: thousands(row.lost) }) : tr("none"),
  ]);
  found.push([tr("Worker"), [row.worker, tr("partition {number}", { number: row.partition ?? 0 })].join(" · ")]);
  return found;
}
