// @ts-check
// The curves of a Bode plot: at their own frequencies as they are, and over one grid as they are drawn.
import { halfDeg, highDb, lowDb, REFERENCES } from "./frames.js";

/** @import { Curves, Frame } from "./messages.js" */
/** @import { Viewing } from "./view.js" */
/** @typedef {(number | null | undefined)[]} Values Over the grid; `undefined` is connected, `null` is a gap. */
/** @typedef {Float32Array | Float64Array | number[]} Numbers */

/**
 * A curve at its own frequencies, in the displayed quantity, before any option of the view is applied. `reach` is
 * bound/|value| (95 %), `noise` and `distorted` that of parts of the bound (parts.js), `index` the place of each frequency
 * in the grid.
 *
 * @typedef {object} Curve
 * @property {Frame | null} frame null where it is computed from others
 * @property {number[]} hz
 * @property {number[]} index
 * @property {Numbers} db
 * @property {Numbers} deg without jumps of whole turns
 * @property {Numbers} reach
 * @property {Numbers} noise
 * @property {Numbers} distorted
 * @property {Numbers} coherence
 */

/** In the order of reading. @type {Curves[]} */
export const LISTED = ["result", "measured", ...REFERENCES, "baseline", "model", "what if"];
/** In the order of drawing: the model is above the measured points. @type {Curves[]} */
export const NAMES = [...REFERENCES, "baseline", "measured", "model", "what if", "result"];

/**
 * @param {Frame} frame of one response or of a model
 * @param {number[]} lines
 * @param {number[]} grid
 * @param {number[]} at index in the grid of each line
 * @returns {Curve}
 */
export function curveOf(frame, lines, grid, at) {
  const whole = frame.kind === "model" && frame.columns === grid.length;
  return {
    frame,
    hz: whole ? grid : lines,
    index: whole ? grid.map((_, i) => i) : at,
    db: frame.magnitude,
    deg: frame.phase,
    reach: frame.reach,
    noise: frame.noise,
    distorted: frame.distorted,
    coherence: frame.coherence,
  };
}

/**
 * A curve as complex numbers with their bound.
 *
 * @param {Curve} curve
 */
export function complex({ db, deg, reach }) {
  const count = db.length,
    [re, im, radius] = [new Float64Array(count), new Float64Array(count), new Float64Array(count)];
  for (let i = 0; i < count; i++) {
    const size = 10 ** (db[i] / 20),
      angle = (deg[i] * Math.PI) / 180;
    re[i] = size * Math.cos(angle);
    im[i] = size * Math.sin(angle);
    radius[i] = size * reach[i];
  }
  return { re, im, radius };
}

/** @typedef {ReturnType<typeof overGrid>} Drawn */

/**
 * From a curve to arrays over the grid; between its frequencies `undefined` (connected), where it is not valid `null`.
 *
 * @param {Curve} curve
 * @param {Viewing} seen magnitude and phase in the view
 * @param {number} points of the grid
 */
export function overGrid(curve, { db, deg }, points) {
  const { index, reach, coherence } = curve;
  /** @param {(i: number) => number} of */
  const spread = (of) => {
    /** @type {Values} */
    const found = new Array(points).fill(undefined);
    for (let i = 0; i < index.length; i++) {
      const value = of(i);
      found[index[i]] = Number.isNaN(value) ? null : value;
    }
    return found;
  };
  /** @param {Numbers} of */
  const edges = (of) => ({
    dbHigh: spread((i) => highDb(db[i], of[i])),
    dbLow: spread((i) => lowDb(db[i], of[i])),
    degHigh: spread((i) => deg[i] + halfDeg(of[i])),
    degLow: spread((i) => deg[i] - halfDeg(of[i])),
  });
  return {
    db: spread((i) => db[i]),
    deg: spread((i) => deg[i]),
    ...edges(reach),
    /** Edges of the inner parts of the bound, from the outside. */
    inner: () => [edges(curve.distorted), edges(curve.noise)],
    // Values that differ from zero; other values of an overlaid curve must not set the scale.
    dbSure: spread((i) => (reach[i] >= 1 ? NaN : db[i])),
    degSure: spread((i) => (reach[i] >= 1 ? NaN : deg[i])),
    coherence: spread((i) => coherence[i]),
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
 * @param {Drawn} curve
 * @param {Drawn} beside
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
