// Parameters over time with 95 % bounds, valid if the model is complete: a small chart for each.
import { axis, chart } from "./chart.js";
import { ticks } from "./clock.js";
import { element } from "./make.js";
import { colour } from "./theme.js";
import { Series } from "./series.js";
import { plain } from "./words.js";

const BOUND = 1.959964;

export const bounded = (value, sigma, unit) =>
  Number.isFinite(value)
    ? `${plain(value)}${Number.isFinite(sigma) && sigma > 0 ? ` ± ${plain(BOUND * sigma, 2)}` : ""}${unit ? ` ${unit}` : ""}`
    : "–";

export class Trends {
  // `wanted` selects the parameters that are shown here.
  constructor(host, wanted, empty) {
    Object.assign(this, { host, wanted, empty, items: new Map() });
  }

  begin(list) {
    for (const item of this.items.values()) item.made?.destroy();
    this.items.clear();
    this.host.replaceChildren(element("p", { class: "empty" }, this.empty));
    for (const trend of list) this.take(trend);
    this.draw();
  }

  // Take all rows of a parameter at first, later the newest row.
  take(trend) {
    if (!this.wanted(trend)) return;
    const key = `${trend.model}\0${trend.name}`;
    if (!this.items.has(key)) this.items.set(key, new Series(trend));
    const item = this.items.get(key);
    item.take(trend);
    item.dirty = true;
  }

  build(item) {
    if (!this.items.size || this.host.querySelector(".empty"))
      this.host.replaceChildren(element("div", { class: "trends" }));
    item.words = element("span");
    const host = element("div", { class: "plot" });
    this.host.firstChild.append(
      element(
        "div",
        { class: "trend", "data-name": item.name },
        element("h3", {}, item.name.replaceAll("_", " "), item.words),
        host,
      ),
    );
    const edges = ["high", "low"].map((label) => ({
      label,
      stroke: () => "transparent",
      width: 0,
      points: { show: false },
    }));
    item.made = chart(
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
      if (!item.made) this.build(item);
      const at = item.known(atS);
      const words = item.name.endsWith("_frequency") ? "" : bounded(item.v[at], item.s[at], item.unit);
      item.words.textContent = Number.isFinite(item.v[at]) ? words : item.status[at];
      if (!item.dirty) continue;
      item.dirty = false;
      const known = (v) => (Number.isFinite(v) ? v : null);
      const edge = (sign) => item.v.map((v, i) => known(v + sign * BOUND * item.s[i]));
      item.made.setData([item.t, item.v.map(known), edge(1), edge(-1)]);
    }
  }
}

// The range of 90 % of the values and their bounds: one outlier does not hide the rest.
function reach({ v, s }) {
  const sorted = v.filter(Number.isFinite).sort((a, b) => a - b);
  if (!sorted.length) return [0, 1];
  const q = (share) => sorted[Math.round(share * (sorted.length - 1))],
    spread = s.filter(Number.isFinite).sort((a, b) => a - b);
  const room = 1.5 * BOUND * (spread[spread.length >> 1] || 0),
    low = q(0.03) - room,
    high = q(0.97) + room;
  const least = Math.max(0.02 * Math.abs(q(0.5)), 1e-12);
  return high - low < least ? [q(0.5) - least, q(0.5) + least] : [low, high];
}
