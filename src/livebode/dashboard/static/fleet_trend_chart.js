// @ts-check
// A quantity of one axis over a year: means with their bounds, and the line of the trend.
import { tr } from "./language.js";
import { bounded, dateTime } from "./runs_words.js";
import { colour } from "./theme.js";
import { TrendChart } from "./trend_chart.js";
import { plain } from "./words.js";

/** @import { Chart, Range } from "./chart.js" */
/** @typedef {[at: number, value: number, bound: number]} LinePoint */

export class AxisTrendChart extends TrendChart {
  /** @type {LinePoint[]} the trend; empty without one */
  line = [];
  zoomed = false;

  /**
   * @param {HTMLElement} host
   * @param {(range: Range | null) => void} onZoom
   */
  constructor(host, onZoom) {
    super(host, { onZoom, onOpen: () => {} });
  }

  /** @override @param {Record<"quantity" | "from" | "to" | "value", string> & {count: number}} facts */
  about(facts) {
    return tr("{quantity}, {count} values from {from} to {to}; last: {value}. Arrow keys read them.", facts);
  }

  /** @override @param {Chart} u */
  ground(u) {
    const { ctx } = u,
      { line } = this;
    if (!line.length) return;
    /** @param {number} at @param {number} value */
    const place = (at, value) => ctx.lineTo(u.valToPos(at, "x", true), u.valToPos(value, "y", true));
    ctx.beginPath();
    for (const [at, value, bound] of line) place(at, value + bound);
    for (const [at, value, bound] of line.toReversed()) place(at, value - bound);
    ctx.fillStyle = colour("model");
    ctx.globalAlpha = 0.25;
    ctx.fill();
    ctx.globalAlpha = 1;
    ctx.beginPath();
    for (const [at, value] of line) place(at, value);
    ctx.strokeStyle = colour("model");
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.stroke();
  }

  /** @override */
  read() {
    const point = this.quantity.points[this.at];
    if (!point) {
      this.readout.replaceChildren("\u00a0");
      return;
    }
    const { at, value, bound, low, high, written } = point;
    const within = tr("90 %: {low} … {high}", { low: plain(low), high: plain(high) });
    const text = `${dateTime(at)}: ${bounded(value, bound, this.quantity.unit)} (${within})`;
    this.readout.textContent = written ? `${text} · ${tr("other settings")}` : text;
  }

  // Escape closes the dialog, unless there is a part of the year to leave.
  /** @override @param {KeyboardEvent} event */
  key(event) {
    if (event.key !== "Escape" || this.zoomed) super.key(event);
  }
}
