// @ts-check
// The visible part of the Bode plot: of frequency in all charts, of the other axis in each. Kept in the address.
import { chosen, remember } from "./address.js";

/** @import { Range } from "./chart.js" */

const CHARTS = 3;
const SHARE_MIN = 1e-6; // of the value: a smaller range cannot be drawn

/**
 * A range that is scaled around a value.
 *
 * @param {Range} range
 * @param {number} at the value that keeps its place
 * @param {number} factor below one to see less of it
 * @param {boolean} log
 * @returns {Range}
 */
export function scaled([low, high], at, factor, log) {
  if (log) return [at * (low / at) ** factor, at * (high / at) ** factor];
  return [at + (low - at) * factor, at + (high - at) * factor];
}

/**
 * A range that is moved by a share of itself.
 *
 * @param {Range} range
 * @param {number} share
 * @param {boolean} log
 * @returns {Range}
 */
export function shifted([low, high], share, log) {
  if (log) return [low * (high / low) ** share, high * (high / low) ** share];
  return [low + (high - low) * share, high + (high - low) * share];
}

/** @param {string} text */
function rangeOf(text) {
  const [low, high] = text.split("_").map(Number);
  return low < high && Number.isFinite(high - low) ? /** @type {Range} */ ([low, high]) : null;
}

/** @param {Range | null} range */
const textOf = (range) => (range ? range.map((v) => String(Number(v.toPrecision(6)))).join("_") : "");

export class Zoom {
  constructor() {
    /** Full range of frequency, Hz. @type {Range} */
    this.whole = [1, 10];
    /** Visible range of frequency, Hz. @type {Range} */
    this.sight = this.whole;
    /** Visible range of each chart; null where it follows the curves. @type {(Range | null)[]} */
    this.heights = Array.from({ length: CHARTS }, (_, i) => rangeOf(chosen(`bode-y${i}`, "")));
    this.remembered = rangeOf(chosen("bode-x", ""));
    this.of = "";
  }

  /**
   * The curves cover another range; what was chosen remains where it belongs to the same axis and quantity.
   *
   * @param {Range} whole
   * @param {string} of axis, lines and quantity
   */
  begin(whole, of) {
    if (this.of && this.of !== of) this.heights.fill(null);
    const same = this.whole[0] === whole[0] && this.whole[1] === whole[1],
      kept = same && this.sight !== this.whole ? this.sight : this.remembered;
    this.of = of;
    this.whole = whole;
    this.sight = kept && kept[0] < whole[1] && kept[1] > whole[0] ? kept : whole;
    this.remembered = null;
    this.note();
  }

  /** @param {Range} sight */
  across([low, high]) {
    const inside = /** @type {Range} */ ([Math.max(low, this.whole[0]), Math.min(high, this.whole[1])]);
    const full = inside[0] === this.whole[0] && inside[1] === this.whole[1];
    if (inside[1] - inside[0] > SHARE_MIN * inside[1]) this.sight = full ? this.whole : inside;
    this.note();
  }

  /**
   * @param {number} chart
   * @param {Range} range
   */
  along(chart, range) {
    if (range[1] - range[0] > SHARE_MIN * Math.max(1, ...range.map(Math.abs))) this.heights[chart] = range;
    this.note();
  }

  reset() {
    this.sight = this.whole;
    this.heights.fill(null);
    this.note();
  }

  note() {
    remember("bode-x", textOf(this.sight === this.whole ? null : this.sight), "");
    for (const [i, range] of this.heights.entries()) remember(`bode-y${i}`, textOf(range), "");
  }
}
