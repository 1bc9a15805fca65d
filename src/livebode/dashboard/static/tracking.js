// @ts-check
// Chosen lines over time or over the position, with their bands.
import { axis, chart, steady } from "./chart.js";
import { moment } from "./clock.js";
import { endLabels } from "./end-labels.js";
import { halfDeg, highDb, lowDb } from "./frames.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { drawingPicture } from "./picture.js";
import { between } from "./rows.js";
import { colour } from "./theme.js";
import { timeAxis, timeLabel } from "./time-ticks.js";
import { linesInAddress, linesNear, rememberLines, toggle } from "./tracked_lines.js";
import { hertz, label, mark } from "./words.js";

/** @import { Chart } from "./chart.js" */
/** @import { History, Named, Run } from "./messages.js" */
/** @import { View } from "./view.js" */

const COLOURS = 10,
  GAP_S = 2;

export class Tracking {
  /**
   * @param {HTMLElement} host
   * @param {HTMLElement} chips
   * @param {View} view units of the Bode plot
   */
  constructor(host, chips, view) {
    this.host = host;
    this.chips = chips;
    this.view = view;
    /** @type {(u: Chart) => void} a chart was built */
    this.onBuilt = () => {};
    /** @type {"magnitude" | "phase"} */
    this.what = "magnitude";
    /** @type {"time" | "position"} */
    this.over = "time";
    /** @type {number[]} */
    this.lines = [];
    /** @type {number[]} indices of the tracked lines, in the order of their colours */
    this.chosen = [];
    /** The same of every axis, once a person has chosen them. @type {Map<string, number[]>} */
    this.choices = new Map();
    this.key = "";
    /** @type {Named} */
    this.schedule = { name: "", unit: "" };
    /** @type {History | null} */
    this.rows = null;
    this.fromS = NaN;
    this.toS = NaN;
    this.marked = NaN;
    /** @type {Chart | null} */
    this.made = null;
  }

  /**
   * @param {Run} facts
   * @param {Named} schedule
   */
  begin(facts, schedule) {
    this.fromS = NaN;
    this.toS = NaN;
    this.lines = facts.frequency_hz;
    this.schedule = schedule;
    this.rows = null;
    // Each axis has its own choice, independent of the lines of others.
    this.key = JSON.stringify([facts.axis, this.lines]);
    const asked = this.choices.get(this.key) ?? linesInAddress(this.lines);
    this.chosen = asked.length ? asked : linesNear(this.lines, []);
    if (asked.length) this.keep();
    this.drawChips();
    this.build();
  }

  // The choice of a person.
  keep() {
    this.choices.set(this.key, this.chosen);
    rememberLines(this.lines, this.chosen);
  }

  /** The lines that matter, unless a person has chosen others. @param {number[]} places Hz */
  suggest(places) {
    const lines = linesNear(this.lines, places);
    if (this.choices.has(this.key) || lines.join() === this.chosen.join()) return;
    this.chosen = lines;
    this.drawChips();
    const first = this.chips.querySelector("[aria-pressed=true]");
    if (first instanceof HTMLElement) this.chips.scrollLeft = first.offsetLeft - this.chips.offsetLeft - 3;
    this.build();
    if (this.rows) this.draw(this.rows, this.fromS, this.toS);
  }

  // Show nothing until the next `begin`.
  clear() {
    this.lines = [];
    this.chosen = [];
    this.rows = null;
    this.fromS = NaN;
    this.toS = NaN;
    this.marked = NaN;
    this.drawChips();
    this.build();
  }

  drawChips() {
    this.chips.replaceChildren(
      ...this.lines.map((f, i) => {
        const place = this.chosen.indexOf(i),
          swatch = element("span", { class: "swatch", "aria-hidden": "true" });
        if (place >= 0) swatch.style.color = `var(--t${place % COLOURS})`;
        return element(
          "button",
          {
            type: "button",
            "aria-pressed": String(place >= 0),
            "data-line": i,
            onclick: () => this.toggle(i),
            title: place >= 0 ? tr("Hide this line") : tr("Track this line"),
          },
          ...(place >= 0 ? [swatch] : []),
          `${hertz(f)} Hz`,
        );
      }),
    );
  }

  /** @param {number} i */
  toggle(i) {
    toggle(this.chosen, i);
    this.keep();
    this.drawChips();
    this.chips.querySelectorAll("button")[i]?.focus();
    this.build();
    if (this.rows) this.draw(this.rows, this.fromS, this.toS);
  }

  build() {
    this.made?.destroy();
    const deg = this.what === "phase",
      byPlace = this.over === "position";
    const range = steady(deg ? { step: 15, least: 30 } : { step: 2, least: 4 });
    /** @type {uPlot.Series[]} */
    const series = [{ label: "x" }];
    /** @type {uPlot.Band[]} */
    const bands = [];
    this.chosen.forEach((line, i) => {
      const first = series.length,
        ink = () => colour(`t${i % COLOURS}`);
      const points = { show: byPlace, size: 4, width: 0, fill: ink };
      const paths = byPlace ? () => null : undefined;
      series.push({ label: `${hertz(this.lines[line])} Hz`, stroke: ink, width: 1.7, points, paths });
      if (byPlace) return;
      for (const edge of ["high", "low"])
        series.push({ label: edge, stroke: () => "transparent", width: 0, points: { show: false } });
      bands.push({ series: [first + 1, first + 2], fill: () => `${ink()}2e` });
    });
    const place = label(this.schedule);
    this.made = chart(
      this.host,
      {
        scales: {
          x: { time: false, range: (_u, low, high) => this.sight(low, high) },
          y: { range: () => range(...this.reach()) },
        },
        axes: [
          axis(() => (byPlace ? place : timeLabel(this.fromS, this.toS)), {
            size: 28,
            ...(byPlace ? { space: 50, values: (_u, splits) => splits.map(mark) } : timeAxis),
          }),
          axis(deg ? tr("phase in °") : tr("magnitude in dB"), {
            size: 46,
            values: (_u, s) => s.map(mark),
          }),
        ],
        padding: [8, 44, 2, 0],
        series,
        bands,
        cursor: {
          drag: { x: false, y: false, setScale: false },
          y: false,
          points: { show: !byPlace, size: 6 },
          bind: { dblclick: () => () => null },
        },
        hooks: {
          draw: [(u) => this.mark(u), (u) => endLabels(u, this.named(), byPlace ? 1 : 3)],
          ready: [(u) => this.onBuilt(u)],
        },
      },
      [[], ...series.slice(1).map(() => [])],
    );
  }

  // The tracked lines, as they are written beside their curves.
  named() {
    return this.chosen.map((line, i) => ({ text: hertz(this.lines[line]), ink: colour(`t${i % COLOURS}`) }));
  }

  /**
   * @param {number | null} low
   * @param {number | null} high
   * @returns {[low: number, high: number]}
   */
  sight(low, high) {
    if (this.over === "position")
      return low === null || high === null
        ? [0, 1]
        : high > low
          ? [low - 0.02 * (high - low), high + 0.02 * (high - low)]
          : [low - 1, high + 1];
    return Number.isFinite(this.fromS) && this.toS > this.fromS ? [this.fromS, this.toS] : [0, 1];
  }

  /** @returns {[low: number, high: number]} */
  reach() {
    let low = Infinity,
      high = -Infinity;
    const stride = this.over === "position" ? 1 : 3;
    const data = this.made?.data ?? [];
    for (let s = 1; s < data.length; s += stride)
      for (const v of data[s] ?? [])
        if (v !== null && v !== undefined && Number.isFinite(v)) {
          low = Math.min(low, v);
          high = Math.max(high, v);
        }
    return [low, high];
  }

  /**
   * The rows between two times.
   *
   * @param {History} rows
   * @param {number} fromS
   * @param {number} toS
   */
  draw(rows, fromS, toS) {
    this.rows = rows;
    this.fromS = fromS;
    this.toS = toS;
    const order = between(rows, fromS, toS);
    const byPlace = this.over === "position";
    /** @type {number[]} */
    const x = [];
    /** @type {number[]} */
    const at = [];
    if (byPlace) {
      for (const r of order) if (Number.isFinite(rows.schedule[r])) at.push(r);
      at.sort((a, b) => rows.schedule[a] - rows.schedule[b]);
      for (const r of at) x.push(rows.schedule[r]);
    } else {
      const usual = order.length > 1 ? (rows.timeS[order[order.length - 1]] - rows.timeS[order[0]]) / order.length : 0;
      order.forEach((r, i) => {
        // A gap in the record is a gap in the curve.
        if (i && rows.timeS[r] - rows.timeS[order[i - 1]] > Math.max(GAP_S, 5 * usual)) {
          x.push(rows.timeS[r] - 1e-3);
          at.push(-1);
        }
        x.push(rows.timeS[r]);
        at.push(r);
      });
    }
    /** @type {[number[], ...(number | null)[][]]} */
    const data = [x];
    const deg = this.what === "phase",
      { aboveDb } = this.view;
    const level = (/** @type {number} */ c) => rows.magnitude[c] + aboveDb;
    for (const line of this.chosen) {
      /** @param {number} r */
      const cell = (r) => r * rows.columns + line;
      /** @param {(cell: number) => number} of */
      const value = (of) =>
        at.map((r) => {
          const v = r < 0 ? NaN : of(cell(r));
          return Number.isNaN(v) ? null : v;
        });
      data.push(value((c) => (deg ? rows.phase[c] : level(c))));
      if (byPlace) continue;
      data.push(value((c) => (deg ? rows.phase[c] + halfDeg(rows.reach[c]) : highDb(level(c), rows.reach[c]))));
      data.push(value((c) => (deg ? rows.phase[c] - halfDeg(rows.reach[c]) : lowDb(level(c), rows.reach[c]))));
    }
    this.made?.setData(data);
  }

  /** @param {Chart} u */
  mark(u) {
    if (drawingPicture() || this.over === "position" || !Number.isFinite(this.marked)) return;
    const x = u.valToPos(this.marked, "x", true),
      { ctx, bbox } = u;
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    ctx.save();
    ctx.strokeStyle = colour("ink");
    ctx.fillStyle = colour("ink");
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.textAlign = "left";
    ctx.font = `${11 * devicePixelRatio}px system-ui`;
    const words = moment(this.marked, true),
      room = bbox.left + bbox.width - ctx.measureText(words).width;
    ctx.fillText(words, Math.min(x + 5 * devicePixelRatio, room), bbox.top + 12 * devicePixelRatio);
    ctx.restore();
  }
}
