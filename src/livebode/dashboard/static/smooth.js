// @ts-check
// A fitted model in the complex plane, smooth between the frequencies at which it was computed.

/** @import { Numbers } from "./curves.js" */
/** @typedef {{x: ArrayLike<number>, y: ArrayLike<number>}} Path */
/** @typedef {[re: number, im: number]} Complex */

const PARTS = 8; // of an interval
const TURN = Math.PI / 180;

/** @param {Complex} a @returns {Complex} */
const inverse = ([re, im]) => {
  const square = re * re + im * im;
  return [re / square, -im / square];
};

/** @param {number} size @param {number} angle @returns {Complex} */
const polar = (size, angle) => [size * Math.cos(angle), size * Math.sin(angle)];

/** Real parts and imaginary parts. @param {Complex[]} values */
const split = (values) => [values.map(([re]) => re), values.map(([, im]) => im)];

/**
 * Cubics over log f, with the slopes of parabolas through three neighbours: of G or of 1/G, whichever parabolas to the left and
 * to the right differ less. Near a resonance 1/G is almost a parabola, near an antiresonance G.
 *
 * @param {Numbers} hz
 * @param {number[]} db
 * @param {number[]} deg
 * @param {boolean} round real and imaginary part; else degrees and dB
 * @returns {Path}
 */
export function smooth(hz, db, deg, round) {
  const t = Array.from(hz, Math.log),
    direct = db.map((level, i) => polar(10 ** (level / 20), deg[i] * TURN)),
    plain = split(direct),
    inverted = split(direct.map(inverse)),
    last = t.length - 1;
  const [x, y] = [/** @type {number[]} */ ([]), /** @type {number[]} */ ([])];
  /** @param {Complex} value @param {number} near its phase is on the turn of this one, ° */
  const add = ([re, im], near) => {
    const angle = Math.atan2(im, re) / TURN;
    x.push(round ? re : angle - 360 * Math.round((angle - near) / 360));
    y.push(round ? im : 20 * Math.log10(Math.hypot(re, im)));
  };
  for (let i = 0; i < last; i++) {
    add(direct[i], deg[i]);
    const peak = unlike(t, inverted, i) < unlike(t, plain, i),
      parts = peak ? inverted : plain;
    for (let part = 1; part < PARTS; part++) {
      const found = /** @type {Complex} */ (parts.map((v) => between(t, v, i, part / PARTS)));
      add(peak ? inverse(found) : found, deg[i]);
    }
  }
  if (last >= 0) add(direct[last], deg[last]);
  return { x, y };
}

/** Of the interval after a point. @param {number[]} t @param {number[]} v @param {number} i */
const slope = (t, v, i) => (v[i + 1] - v[i]) / (t[i + 1] - t[i]);

/** @param {number[]} t @param {number[]} v @param {number} i @param {number} share of the interval after the point i */
function between(t, v, i, share) {
  const wide = t[i + 1] - t[i],
    rise = v[i + 1] - v[i],
    [a, b] = [wide * tangent(t, v, i), wide * tangent(t, v, i + 1)];
  return v[i] + share * (a + share * (3 * rise - 2 * a - b + share * (a + b - 2 * rise)));
}

/** How much the parabolas on both sides of an interval differ, relative to the values. @param {number[]} t @param {number[][]} parts @param {number} i */
const unlike = (t, parts, i) =>
  Math.hypot(...parts.map((v) => bend(t, v, i) - bend(t, v, i + 1))) / Math.hypot(...parts.map((v) => v[i] + v[i + 1]));

/** Of the parabola through a point and its neighbours. @param {number[]} t @param {number[]} v @param {number} at */
function bend(t, v, at) {
  const k = Math.min(Math.max(at, 1), t.length - 2);
  return (slope(t, v, k) - slope(t, v, k - 1)) / (t[k + 1] - t[k - 1]);
}

/** Of the parabola through a point and its neighbours. @param {number[]} t @param {number[]} v @param {number} at */
function tangent(t, v, at) {
  if (at === 0) return slope(t, v, 0);
  if (at === t.length - 1) return slope(t, v, at - 1);
  const [before, after] = [t[at] - t[at - 1], t[at + 1] - t[at]];
  return (slope(t, v, at - 1) * after + slope(t, v, at) * before) / (before + after);
}
