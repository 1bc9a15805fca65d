// @ts-check
// One parameter over time, thinned if it is long.

/** @import { Sent, Trend } from "./messages.js" */

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

  /**
   * Index of the row nearest to a time; without a time, of the newest row.
   *
   * @param {number} timeS
   */
  at(timeS) {
    if (!Number.isFinite(timeS)) return this.t.length - 1;
    let best = 0;
    this.t.forEach((t, i) => {
      if (Math.abs(t - timeS) < Math.abs(this.t[best] - timeS)) best = i;
    });
    return best;
  }

  /**
   * The same, but without a time the newest row with a value.
   *
   * @param {number} timeS
   */
  known(timeS) {
    let at = this.at(timeS);
    if (!Number.isFinite(timeS)) while (at > 0 && !Number.isFinite(this.v[at])) at--;
    return at;
  }
}
