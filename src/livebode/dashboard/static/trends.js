// @ts-check
// Parameters over time with 95 % bounds, valid if the model is complete: a small chart for each.
import { axis, chart } from "./chart.js";
import { ticks } from "./clock.js";
import { element } from "./make.js";
import { recognised } from "./recognition.js";
import { Series } from "./series.js";
import { colour } from "./theme.js";
import { plain } from "./words.js";

/** @import { Trend } from "./messages.js" */

const BOUND = 1.959964;

/**
 * @param {number} value
 * @param {number} sigma
 * @param {string} unit
 */
export const bounded = (value, sigma, unit) =>
  Number.isFinite(value)
    ? `${plain(value)}${Number.isFinite(sigma) && sigma > 0 ? ` ± ${plain(BOUND * sigma, 2)}` : ""}${unit ? ` ${recognised(unit)}` : ""}`
    : "–";

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
   */
  constructor(host, wanted, empty) {
    this.host = host;
    this.wanted = wanted;
    this.empty = empty;
    /** @type {Map<string, Item>} */
    this.items = new Map();
  }

  /** @param {Trend[]} list */
  begin(list) {
    for (const item of this.items.values()) item.made?.destroy();
    this.items.clear();
    this.host.replaceChildren(element("p", { class: "empty" }, this.empty));
    for (const trend of list) this.take(trend);
    this.draw();
  }

  /**
   * Take all rows of a parameter at first, later the newest row.
   *
   * @param {Trend} trend
   */
  take(trend) {
    if (!this.wanted(trend)) return;
    const key = `${trend.model}\0${trend.name}`;
    const item = this.items.get(key) ?? new Item(trend);
    this.items.set(key, item);
    item.take(trend);
    item.dirty = true;
  }

  /** @param {Item} item */
  build(item) {
    if (this.host.querySelector(".empty")) this.host.replaceChildren(element("div", { class: "trends" }));
    const host = element("div", { class: "plot" });
    this.host.firstElementChild?.append(
      element(
        "div",
        { class: "trend", "data-name": item.name },
        element("h3", {}, recognised(item.name.replaceAll("_", " ")), item.words),
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
        scales: { x: { time: false }, y: { range: (_u) => reach(item) } },
        axes: [
          axis("", { size: 18, space: 70, values: (_u, splits, _i, _space, step) => ticks(splits, step) }),
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

  // Draw the parameters that changed, each with its value at a time, or the newest.
  draw(atS = NaN) {
    if (this.host.hidden) return;
    for (const item of this.items.values()) {
      if (item.s.every((s) => s === 0 || Number.isNaN(s)) && item.s.some((s) => s === 0)) continue; // it is fixed
      item.made ??= this.build(item);
      const at = item.known(atS);
      const words = item.name.endsWith("_frequency") ? "" : bounded(item.v[at], item.s[at], item.unit);
      item.words.textContent = Number.isFinite(item.v[at]) ? words : recognised(item.status[at] ?? "");
      if (!item.dirty) continue;
      item.dirty = false;
      /** @param {number} v */
      const known = (v) => (Number.isFinite(v) ? v : null);
      /** @param {number} sign */
      const edge = (sign) => item.v.map((v, i) => known(v + sign * BOUND * item.s[i]));
      item.made.setData([item.t, item.v.map(known), edge(1), edge(-1)]);
    }
  }
}

/**
 * The range of 90 % of the values and their bounds: one outlier does not hide the rest.
 *
 * @param {Series} series
 * @returns {import("./chart.js").Range}
 */
function reach({ v, s }) {
  const sorted = v.filter(Number.isFinite).sort((a, b) => a - b);
  if (!sorted.length) return [0, 1];
  /** @param {number} share */
  const q = (share) => sorted[Math.round(share * (sorted.length - 1))];
  const spread = s.filter(Number.isFinite).sort((a, b) => a - b);
  const room = 1.5 * BOUND * (spread[spread.length >> 1] || 0),
    low = q(0.03) - room,
    high = q(0.97) + room;
  const least = Math.max(0.02 * Math.abs(q(0.5)), 1e-12);
  return high - low < least ? [q(0.5) - least, q(0.5) + least] : [low, high];
}
