// @ts-check
// A quantity of one axis over a year: means with their bounds, and the line of the trend.
import { tr } from "./language.js";
import { bounded, dateTime } from "./runs_words.js";
import { colour } from "./theme.js";
import { dot, stroke, TrendChart } from "./trend_chart.js";
import { plain } from "./words.js";

/** @import { Chart, Range } from "./chart.js" */
/** @import { Point } from "./trends_data.js" */
/** @typedef {[at: number, value: number, bound: number]} LinePoint */

const ROOM_PX = 5; // of a point with its bars

export class AxisTrendChart extends TrendChart {
  /** @type {LinePoint[]} the trend; empty without one */
  line = [];
  zoomed = false;
  crowded = false;

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
  paint(u) {
    this.crowded = ROOM_PX * this.inside.length > u.width;
    super.paint(u);
  }

  // Bars of points that are close would cover each other, and the trend.
  /** @override @param {Chart} u @param {Point} point @param {boolean} chosen */
  point(u, point, chosen) {
    if (chosen || !this.crowded) {
      super.point(u, point, chosen);
      return;
    }
    const { at, value, bound, written } = point;
    u.ctx.lineWidth = devicePixelRatio;
    u.ctx.strokeStyle = colour("band");
    stroke(u, at, value - bound, value + bound);
    u.ctx.fillStyle = colour(written ? "muted" : "measured");
    dot(u, at, value, 1.2);
  }

  /** @override @param {Chart} u */
  finish(u) {
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
    this.readout.textContent = written ? [text, tr("other settings")].join(" · ") : text;
  }

  // Escape closes the dialog, unless there is a part of the year to leave.
  /** @override @param {KeyboardEvent} event */
  key(event) {
    if (event.key !== "Escape" || this.zoomed) super.key(event);
  }
}
