// @ts-check
// What the loop would be with one more filter C in it: L·C from the curve that is shown, with its bounds. A calculation
// in the page; nothing of it is recorded or sent.
import { complex } from "./curves.js";

/** @import { Curve, Numbers } from "./curves.js" */
/** @import { Quantity } from "./messages.js" */
/**
 * Zero is without this part; the gain in dB.
 *
 * @typedef {{gainDb: number, lowpassHz: number, notchHz: number, notchDamping: number, delayMs: number}} Filter
 */
/** @typedef {[re: number, im: number]} Complex */

export const NONE = /** @type {Readonly<Filter>} */ ({
  gainDb: 0,
  lowpassHz: 0,
  notchHz: 0,
  notchDamping: 0.3,
  delayMs: 0,
});
const DEPTH = 10; // of the notch at its frequency: 20 dB

/** @param {Complex} a @param {Complex} b @returns {Complex} */
const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
/** @param {Complex} a @param {Complex} b @returns {Complex} */
const over = ([a, b], [c, d]) => {
  const size = c * c + d * d;
  return [(a * c + b * d) / size, (b * c - a * d) / size];
};
/** @param {Complex} a */
const size = ([a, b]) => Math.hypot(a, b);
/** @type {Complex} */
const ONE = [1, 0];
/** @param {Complex} a @returns {Complex} */
const onePlus = ([a, b]) => [1 + a, b];

/**
 * C at a frequency: gain, 1/(1 + jf/f₁), a notch (1 − r² + 2jζr/10)/(1 − r² + 2jζr) with r = f/f₂, and a delay.
 *
 * @param {Filter} filter
 * @param {number} hz
 * @returns {Complex}
 */
export function filterAt({ gainDb, lowpassHz, notchHz, notchDamping, delayMs }, hz) {
  const gain = 10 ** (gainDb / 20),
    late = (-2 * Math.PI * hz * delayMs) / 1000;
  let c = /** @type {Complex} */ ([gain * Math.cos(late), gain * Math.sin(late)]);
  if (lowpassHz > 0) c = over(c, [1, hz / lowpassHz]);
  if (notchHz > 0) {
    const r = hz / notchHz,
      wide = 2 * notchDamping * r;
    c = over(times(c, [1 - r * r, wide / DEPTH]), [1 - r * r, wide]);
  }
  return c;
}

/** @param {number} deg @param {number} to */
const nearest = (deg, to) => deg - 360 * Math.round((deg - to) / 360);

/**
 * Phase of C along frequency, without jumps: all of it but the delay is between −180° and 180°.
 *
 * @param {Filter} filter
 * @param {number} hz
 */
function phaseOf(filter, hz) {
  const [re, im] = filterAt({ ...filter, delayMs: 0 }, hz);
  return (Math.atan2(im, re) * 180) / Math.PI - 0.36 * hz * filter.delayMs;
}

/** The open loop of a value of a quantity. @param {Complex} v @param {Quantity} quantity @returns {Complex} */
function loopOf(v, quantity) {
  if (quantity === "closed loop") return over(v, [1 - v[0], -v[1]]);
  if (quantity === "sensitivity") return over([1 - v[0], -v[1]], v);
  return v;
}

/**
 * The same quantity with C in the loop; null for the plant, which has no loop. Bounds to first order: |δL| times |C| for
 * L, and |C|·|1 + L|²/|1 + L·C|² times the bound for T = L/(1 + L) and S = 1/(1 + L).
 *
 * @param {Curve} curve
 * @param {Quantity | null} quantity of the curve
 * @param {Filter} filter
 * @returns {Curve | null}
 */
export function tried(curve, quantity, filter) {
  if (!quantity || quantity === "plant") return null;
  const { re, im } = complex(curve),
    count = curve.hz.length;
  const [db, deg, reach] = [0, 0, 0].map(() => new Float64Array(count));
  for (let i = 0; i < count; i++) {
    const v = /** @type {Complex} */ ([re[i], im[i]]),
      loop = loopOf(v, quantity),
      c = filterAt(filter, curve.hz[i]),
      next = times(loop, c),
      below = onePlus(next);
    const value = quantity === "open loop" ? next : over(quantity === "sensitivity" ? ONE : next, below);
    const slope = quantity === "open loop" ? size(c) : size(c) * (size(onePlus(loop)) / size(below)) ** 2;
    db[i] = 20 * Math.log10(size(value));
    // On the branch of the curve itself: C adds its own phase, and noise adds no turn.
    const shift = quantity === "open loop" ? phaseOf(filter, curve.hz[i]) : 0;
    deg[i] = nearest((Math.atan2(value[1], value[0]) * 180) / Math.PI, curve.deg[i] + shift);
    reach[i] = (curve.reach[i] * size(v) * slope) / size(value);
  }
  const nothing = curve.hz.map(() => NaN);
  return { ...curve, frame: null, db, deg, reach, noise: nothing, coherence: nothing };
}

/** @typedef {{kind: "gain" | "phase", hz: number, value: number, reach: number}} Margin dB or °, at a crossing */

/**
 * Margins of an open loop at its crossings between its frequencies, linear over log f: how much the gain may change where
 * the phase is an odd multiple of 180°, and the phase above −180° where |L| = 1. Those of smallest size of either kind.
 *
 * @param {Numbers} hz
 * @param {Numbers} db
 * @param {Numbers} deg
 * @param {Numbers} reach 3σ/|L|, NaN where it is not known
 * @returns {Margin[]}
 */
export function marginsOf(hz, db, deg, reach) {
  /** @type {Margin[]} */
  const found = [];
  for (let i = 1; i < hz.length; i++) {
    /** @param {Numbers} of @param {number} share */
    const mix = (of, share) => of[i - 1] + share * (of[i] - of[i - 1]);
    /** @param {"gain" | "phase"} kind @param {number} share @param {number} value */
    const add = (kind, share, value) =>
      found.push({ kind, hz: hz[i - 1] * (hz[i] / hz[i - 1]) ** share, value, reach: mix(reach, share) });
    const turns = [deg[i - 1], deg[i]].map((v) => (v + 180) / 360);
    const turn = Math.ceil(Math.min(...turns));
    if (turn < Math.max(...turns)) {
      const share = (turn - turns[0]) / (turns[1] - turns[0]);
      add("gain", share, -mix(db, share));
    }
    if (db[i - 1] * db[i] < 0) {
      const share = db[i - 1] / (db[i - 1] - db[i]),
        phase = mix(deg, share) + 180;
      add("phase", share, phase - 360 * Math.round(phase / 360));
    }
  }
  return /** @type {const} */ (["gain", "phase"]).flatMap((kind) => {
    const all = found.filter((one) => one.kind === kind);
    return all.length ? [all.reduce((a, b) => (Math.abs(b.value) < Math.abs(a.value) ? b : a))] : [];
  });
}
