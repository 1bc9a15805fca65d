// @ts-check
// Parameters over time with 95 % bounds, valid if the model is complete: a small chart for each.
import { axis, chart } from "./chart.js";
import { element } from "./make.js";
import { Series } from "./series.js";
import { colour } from "./theme.js";
import { timeAxis, timeLabel } from "./time-ticks.js";
import { worded } from "./worded.js";
import { afterNumber, pair, plain } from "./words.js";

/** @import { Trend } from "./messages.js" */

const BOUND = 1.959964;

/**
 * @param {number} value
 * @param {number} sigma
 * @param {string} unit
 */
export const bounded = (value, sigma, unit) =>
  Number.isFinite(value) ? pair(value, BOUND * sigma) + afterNumber(unit && worded(unit)) : "–";

// A parameter with its chart, which is built when it is first drawn.
class Item extends Series {
  /** @type {import("./chart.js").Chart | null} */
  made = null;
  words = element("span");
  dirty = true;
}

export class Trends {
  /**
   * @param {HTMLElement} host
   * @param {(trend: Trend) => boolean} wanted selects the parameters that are shown here
   * @param {string} empty shown instead of none
   * @param {(name: string) => string} title of a chart
   */
  constructor(host, wanted, empty, title = (name) => worded(name.replaceAll("_", " "))) {
    this.host = host;
    this.wanted = wanted;
    this.empty = empty;
    this.title = title;
    this.note = element("p", { class: "zone-note" });
    /** @type {[fromS: number, toS: number] | null} the span that is shown; null for all */
    this.span = null;
    /** @type {Map<string, Item>} */
    this.items = new Map();
  }

  /** @param {Trend[]} list */
  begin(list) {
    const before = this.items;
    for (const item of before.values()) item.made?.destroy();
    this.items = new Map();
    this.host.replaceChildren(element("p", { class: "empty" }, this.empty));
    for (const trend of list) this.take(trend);
    // The drawn model is that of the fit before, until the next one arrives.
    for (const [key, item] of this.items) {
      item.shown = before.get(key)?.shown ?? null;
      write(item);
    }
    this.draw();
  }

  /**
   * Take all rows of a parameter at first, later the newest row.
   *
   * @param {Trend} trend
   */
  take(trend) {
    if (!this.wanted(trend)) return;
    const item = this.itemOf(trend);
    item.take(trend);
    item.dirty = true;
  }

  /** @param {Trend} trend */
  itemOf(trend) {
    const key = `${trend.model}\0${trend.name}`;
    const item = this.items.get(key) ?? new Item(trend);
    this.items.set(key, item);
    return item;
  }

  /** The values of the fit that is drawn. @param {Trend[]} list one row of each parameter */
  show(list) {
    for (const item of this.items.values()) item.shown = null;
    for (const trend of list) if (this.wanted(trend)) this.itemOf(trend).show(trend);
    for (const item of this.items.values()) write(item);
  }

  /** @param {Item} item */
  build(item) {
    if (this.host.querySelector(".empty")) this.host.replaceChildren(element("div", { class: "trends" }), this.note);
    const host = element("div", { class: "plot", role: "img", "aria-label": this.title(item.name) });
    this.host.firstElementChild?.append(
      element(
        "div",
        { class: "trend", "data-name": item.name },
        element("h3", {}, this.title(item.name), item.words),
        host,
      ),
    );
    const edges = ["high", "low"].map((label) => ({
      label,
      stroke: () => "transparent",
      width: 0,
      points: { show: false },
    }));
    return chart(
      host,
      {
        padding: [6, 6, 0, 0],
        cursor: { show: false },
        scales: {
          x: { time: false, range: (_u, low, high) => this.span ?? [low ?? 0, high ?? 1] },
          y: { range: (_u) => reach(item, this.span) },
        },
        axes: [
          axis("", { size: 18, ...timeAxis }),
          axis("", { size: 56, space: 24, values: (_u, s) => s.map((v) => plain(v, 4)) }),
        ],
        series: [
          {},
          { label: item.name, stroke: () => colour("measured"), width: 1.6, points: { show: false } },
          ...edges,
        ],
        bands: [{ series: [2, 3], fill: () => colour("band") }],
      },
      [[], [], [], []],
    );
  }

  // Draw the parameters that changed.
  draw(span = this.span) {
    if (this.host.closest("[hidden]")) return;
    if (span !== this.span) this.refresh();
    this.span = span;
    let low = Infinity,
      high = -Infinity;
    for (const item of this.items.values()) {
      if (item.s.every((s) => s === 0 || Number.isNaN(s)) && item.s.some((s) => s === 0)) continue; // it is fixed
      item.made ??= this.build(item);
      low = Math.min(low, item.t[0] ?? low);
      high = Math.max(high, item.t.at(-1) ?? high);
      if (!item.dirty) continue;
      item.dirty = false;
      /** @param {number} v */
      const known = (v) => (Number.isFinite(v) ? v : null);
      /** @param {number} sign */
      const edge = (sign) => item.v.map((v, i) => known(v + sign * BOUND * item.s[i]));
      item.made.setData([item.t, item.v.map(known), edge(1), edge(-1)]);
    }
    const [from, to] = span ?? [low, high];
    this.note.textContent = this.items.size ? timeLabel(from, to) : "";
  }

  // Draw all again: another span or another clock.
  refresh() {
    for (const item of this.items.values()) item.dirty = true;
  }
}

/** Its value in words. @param {Item} item */
function write({ name, unit, shown, words }) {
  const value = !shown || name.endsWith("_frequency") ? "" : bounded(shown.v, shown.s, unit);
  words.textContent = shown && !Number.isFinite(shown.v) ? worded(shown.status) : value;
}

/**
 * The range of 90 % of the values and their bounds: one outlier does not hide the rest.
 *
 * @param {Series} series
 * @param {[fromS: number, toS: number] | null} span
 * @returns {import("./chart.js").Range}
 */
function reach({ t, v, s }, span) {
  /** @type {(_: number, i: number) => boolean} */
  const seen = (_, i) => !span || (t[i] >= span[0] && t[i] <= span[1]);
  const sorted = v
    .filter(seen)
    .filter(Number.isFinite)
    .sort((a, b) => a - b);
  if (!sorted.length) return [0, 1];
  /** @param {number} share */
  const q = (share) => sorted[Math.round(share * (sorted.length - 1))];
  const spread = s
    .filter(seen)
    .filter(Number.isFinite)
    .sort((a, b) => a - b);
  const room = 1.5 * BOUND * (spread[spread.length >> 1] || 0),
    low = q(0.03) - room,
    high = q(0.97) + room;
  const least = Math.max(0.02 * Math.abs(q(0.5)), 1e-12);
  return high - low < least ? [q(0.5) - least, q(0.5) + least] : [low, high];
}
