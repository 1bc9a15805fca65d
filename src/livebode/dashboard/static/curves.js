// @ts-check
// The curves of a Bode plot on one grid of frequencies: the lines and the points of the model between them.
import { halfDeg, highDb, lowDb } from "./frames.js";

/** @import { Curves, Frame } from "./messages.js" */
/** @typedef {(number | null | undefined)[]} Values Over the grid; `undefined` is connected, `null` is a gap. */

/** @type {Curves[]} */
export const NAMES = ["measured", "reference", "baseline", "model"];

/** @typedef {ReturnType<typeof overGrid>} Curve */

/**
 * From a frame at the lines or on the grid to arrays over the grid; between lines `undefined` (connected), at an
 * invalid line `null` (a gap).
 *
 * @param {Frame} frame
 * @param {number[]} grid
 * @param {number[]} at index in the grid of each line
 */
export function overGrid(frame, grid, at) {
  const whole = frame.columns === grid.length && frame.kind === "model";
  /** @param {(i: number) => number} of */
  const spread = (of) => {
    /** @type {Values} */
    const found = new Array(grid.length).fill(undefined);
    for (let i = 0; i < frame.columns; i++) {
      const value = of(i);
      found[whole ? i : at[i]] = Number.isNaN(value) ? null : value;
    }
    return found;
  };
  const { magnitude, phase, reach, coherence } = frame;
  return {
    db: spread((i) => magnitude[i]),
    dbHigh: spread((i) => highDb(magnitude[i], reach[i])),
    dbLow: spread((i) => lowDb(magnitude[i], reach[i])),
    deg: spread((i) => phase[i]),
    degHigh: spread((i) => phase[i] + halfDeg(reach[i])),
    degLow: spread((i) => phase[i] - halfDeg(reach[i])),
    // Values that differ from zero; other values of an overlaid curve must not set the scale.
    dbSure: spread((i) => (reach[i] >= 1 ? NaN : magnitude[i])),
    degSure: spread((i) => (reach[i] >= 1 ? NaN : phase[i])),
    coherence: spread((i) => coherence[i]),
    frame,
    turns: 0,
  };
}

/**
 * @param {number | null | undefined} v
 * @returns {v is number}
 */
const known = (v) => Number.isFinite(v);

/**
 * Whole turns that shift the phase of a curve next to that of another one, degrees.
 *
 * @param {Curve} curve
 * @param {Curve} beside
 */
export function turns(curve, beside) {
  const away = [];
  for (let i = 0; i < curve.deg.length; i++) {
    const a = curve.deg[i],
      b = beside.deg[i];
    if (known(a) && known(b)) away.push((b - a) / 360);
  }
  away.sort((x, y) => x - y);
  return away.length ? 360 * Math.round(away[away.length >> 1]) : 0;
}

/**
 * @param {Values} values
 * @param {number} by
 */
export const moved = (values, by) => (by === 0 ? values : values.map((v) => (known(v) ? v + by : v)));

/**
 * Lowest and highest drawn value, with bounds as far as they leave room for the rest.
 *
 * @param {Values[]} curves
 * @param {Values[]} edges
 * @param {number} room
 * @returns {[low: number, high: number]}
 */
export function extent(curves, edges, room) {
  let low = Infinity,
    high = -Infinity;
  for (const curve of curves)
    for (const v of curve)
      if (known(v)) {
        low = Math.min(low, v);
        high = Math.max(high, v);
      }
  const reach = Math.max(0.35 * (high - low), room),
    least = low - reach,
    most = high + reach;
  for (const edge of edges)
    for (const v of edge)
      if (known(v)) {
        low = Math.min(low, Math.max(v, least));
        high = Math.max(high, Math.min(v, most));
      }
  return [low, high];
}
