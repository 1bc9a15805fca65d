// @ts-check
// Peaks and antiresonances of a curve, with frequency and damping.

/** @import { Numbers } from "./curves.js" */
/** @import { Curves } from "./messages.js" */
/**
 * A peak or an antiresonance. `damping` is (f₂ − f₁)/2f at half power (3.01 dB beside the extremum), NaN where the curve
 * does not come that far on both sides. `lowHz`, `highHz` are the frequencies beside it, between which it is.
 *
 * @typedef {{peak: boolean, hz: number, lowHz: number, highHz: number, db: number, damping: number, of: Curves}} Extremum
 */

const HALF_POWER_DB = 10 * Math.log10(2);
const PROMINENCE_DB = 0.5;

/**
 * The extremum next to a frequency, or null.
 *
 * @param {number[]} hz
 * @param {Numbers} db
 * @param {Numbers} reach
 * @param {number} from Hz
 * @param {boolean} right
 */
export function next(hz, db, reach, from, right) {
  const all = [...extrema(hz, db, reach, true), ...extrema(hz, db, reach, false)].sort((a, b) => a.hz - b.hz);
  return (right ? all.find((e) => e.hz > from * (1 + 1e-9)) : all.findLast((e) => e.hz < from * (1 - 1e-9))) ?? null;
}

/**
 * All peaks, or all antiresonances, that differ from their surroundings by more than 0.5 dB and the bounds of both.
 *
 * @param {number[]} hz
 * @param {Numbers} db
 * @param {Numbers} reach bound/|value|; NaN where there is none
 * @param {boolean} peak
 * @returns {Omit<Extremum, "of">[]}
 */
export function extrema(hz, db, reach, peak) {
  const use = hz.map((_, i) => i).filter((i) => Number.isFinite(db[i]));
  const x = use.map((i) => Math.log(hz[i])),
    y = use.map((i) => (peak ? db[i] : -db[i]));
  const found = [];
  for (let i = 1; i + 1 < y.length; i++) {
    if (!(y[i] > y[i - 1] && y[i] >= y[i + 1])) continue;
    // Peak and surroundings both have their bound.
    const bounds = 40 * Math.log10(1 + (reach[use[i]] || 0));
    if (prominence(y, i) < Math.max(PROMINENCE_DB, bounds)) continue;
    const [at, height] = vertex(x.slice(i - 1, i + 2), y.slice(i - 1, i + 2));
    const below = crossing(x, y, i, -1, height - HALF_POWER_DB),
      above = crossing(x, y, i, 1, height - HALF_POWER_DB);
    const f = Math.exp(at),
      damping = (Math.exp(above) - Math.exp(below)) / (2 * f);
    const [lowHz, highHz] = [hz[use[i - 1]], hz[use[i + 1]]];
    found.push({ peak, hz: f, lowHz, highHz, db: peak ? height : -height, damping });
  }
  return found;
}

/**
 * How far one must go down from a peak to reach a higher one.
 *
 * @param {number[]} y
 * @param {number} i
 */
function prominence(y, i) {
  /** @param {number} by */
  const least = (by) => {
    let low = y[i];
    for (let k = i + by; k >= 0 && k < y.length && y[k] <= y[i]; k += by) low = Math.min(low, y[k]);
    return low;
  };
  return y[i] - Math.max(least(-1), least(1));
}

/**
 * Top of the parabola through three points.
 *
 * @param {number[]} x
 * @param {number[]} y
 * @returns {[x: number, y: number]}
 */
export function vertex([x0, x1, x2], [y0, y1, y2]) {
  const [left, right] = [(y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)],
    bend = (right - left) / (x2 - x0);
  if (!(bend < 0)) return [x1, y1];
  const at = (x0 + x1) / 2 - left / (2 * bend);
  return [at, y1 + (at - x1) * (left + bend * (at - x0))];
}

/**
 * Where a curve falls below a level beside a peak, linear between two points; NaN if it does not, or rises above it.
 *
 * @param {number[]} x
 * @param {number[]} y
 * @param {number} i
 * @param {1 | -1} by
 * @param {number} level
 */
function crossing(x, y, i, by, level) {
  for (let k = i; k + by >= 0 && k + by < y.length; k += by) {
    if (y[k + by] > y[i]) return NaN;
    if (y[k + by] <= level) return x[k] + ((x[k + by] - x[k]) * (y[k] - level)) / (y[k] - y[k + by]);
  }
  return NaN;
}
