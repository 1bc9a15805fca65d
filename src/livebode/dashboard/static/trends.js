// Parameters over time with the bound that holds 95 %: a small chart for each.
import { axis, chart } from "./chart.js";
import { element } from "./make.js";
import { colour } from "./theme.js";
import { originOf, plain } from "./words.js";

const BOUND = 1.959964,
  POINTS_MAX = 1500;

export const bounded = (value, sigma, unit) =>
  Number.isFinite(value)
    ? `${plain(value)}${Number.isFinite(sigma) && sigma > 0 ? ` ± ${plain(BOUND * sigma, 2)}` : ""}${unit ? ` ${unit}` : ""}`
    : "–";

const number = (v) => (v === null ? NaN : v);

export class Trends {
  // `wanted` says which parameters are shown here.
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

  // All rows of a parameter at the beginning, and later the newest one.
  take(trend) {
    if (!this.wanted(trend)) return;
    const key = `${trend.model}\0${trend.name}`;
    if (!this.items.has(key)) this.items.set(key, { ...trend, t: [], v: [], s: [] });
    const item = this.items.get(key);
    trend.time_s.forEach((t, i) => {
      if (item.t.length && t <= item.t.at(-1)) return;
      item.t.push(t);
      item.v.push(number(trend.value[i]));
      item.s.push(number(trend.sigma[i]));
    });
    if (item.t.length > POINTS_MAX)
      for (const name of ["t", "v", "s"])
        item[name] = item[name].filter((_, i) => i % 2 === 0 || i === item[name].length - 1);
    item.status = trend.status.at(-1);
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
          axis("", { size: 18, space: 60 }),
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

  // Draw what changed, each with its value at a moment, or the newest.
  draw(atS = NaN) {
    if (this.host.hidden) return;
    for (const item of this.items.values()) {
      if (item.s.every((s) => s === 0 || Number.isNaN(s)) && item.s.some((s) => s === 0)) continue; // it is held at a value
      if (!item.made) this.build(item);
      const at = nearest(item, atS);
      const words = item.name.endsWith("_frequency") ? "" : bounded(item.v[at], item.s[at], item.unit);
      item.words.textContent = Number.isFinite(item.v[at]) ? words : item.status;
      if (!item.dirty) continue;
      item.dirty = false;
      const origin = originOf(item.t[0] ?? 0),
        known = (v) => (Number.isFinite(v) ? v : null);
      const edge = (sign) => item.v.map((v, i) => known(v + sign * BOUND * item.s[i]));
      item.made.setData([item.t.map((t) => t - origin), item.v.map(known), edge(1), edge(-1)]);
    }
  }
}

function nearest({ t, v }, atS) {
  let best = -1;
  if (!Number.isFinite(atS)) {
    for (best = t.length - 1; best > 0 && !Number.isFinite(v[best]); best--);
    return best;
  }
  t.forEach((time, i) => {
    if (best < 0 || Math.abs(time - atS) < Math.abs(t[best] - atS)) best = i;
  });
  return best;
}

// What nine tenths of the values span, and their bounds: one odd fit does not hide the rest.
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
