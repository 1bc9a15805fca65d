// @ts-check
// One parameter over time, thinned if it is long.

/** @import { Sent, Trend } from "./messages.js" */
/** @typedef {{t: number, v: number, s: number, status: string}} Row Time, value, sigma and status. */

const POINTS_MAX = 1500;
/** @param {Sent} v */
const number = (v) => (v === null ? NaN : v);

export class Series {
  /** @param {{model: string, name: string, unit: string}} parameter */
  constructor({ model, name, unit }) {
    this.model = model;
    this.name = name;
    this.unit = unit;
    /** @type {number[]} times */
    this.t = [];
    /** @type {number[]} values */
    this.v = [];
    /** @type {number[]} sigmas */
    this.s = [];
    /** @type {string[]} */
    this.status = [];
    /** The row of the fit that is drawn. @type {Row | null} */
    this.shown = null;
  }

  /** The row of the fit that is drawn. @param {Trend} trend with one row */
  show({ time_s: [t], value: [v], sigma: [s], status: [status] }) {
    this.shown = { t, v: number(v), s: number(s), status };
  }

  /**
   * Take all rows at first, later the newest row.
   *
   * @param {Trend} trend
   */
  take(trend) {
    trend.time_s.forEach((t, i) => {
      if (t <= (this.t.at(-1) ?? -Infinity)) return;
      this.t.push(t);
      this.v.push(number(trend.value[i]));
      this.s.push(number(trend.sigma[i]));
      this.status.push(trend.status[i]);
    });
    if (this.t.length > POINTS_MAX) this.thin();
  }

  thin() {
    const last = this.t.length - 1;
    /** @type {(_: unknown, i: number) => boolean} */
    const kept = (_, i) => i % 2 === 0 || i === last;
    this.t = this.t.filter(kept);
    this.v = this.v.filter(kept);
    this.s = this.s.filter(kept);
    this.status = this.status.filter(kept);
  }
}
