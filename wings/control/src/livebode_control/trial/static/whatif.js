// @ts-check
// What the loop would be with a factor C on its controllers: L·C from the curve that is shown, with its bounds.
import { complex } from "./curves.js";

/** @import { Curve, Numbers } from "./curves.js" */
/** @import { Quantity } from "./messages.js" */
/** @import { Factor } from "./trial.js" */
/** @typedef {[re: number, im: number]} Complex */

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

/** @param {number} deg @param {number} to */
const nearest = (deg, to) => deg - 360 * Math.round((deg - to) / 360);

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
 * @param {Factor} factor C at the frequencies of the curve
 * @returns {Curve | null}
 */
export function tried(curve, quantity, factor) {
  if (!quantity || quantity === "plant") return null;
  const { re, im } = complex(curve),
    count = curve.hz.length;
  const [db, deg, reach] = [0, 0, 0].map(() => new Float64Array(count));
  for (let i = 0; i < count; i++) {
    const v = /** @type {Complex} */ ([re[i], im[i]]),
      loop = loopOf(v, quantity),
      c = /** @type {Complex} */ ([factor.re[i], factor.im[i]]),
      next = times(loop, c),
      below = onePlus(next);
    const value = quantity === "open loop" ? next : over(quantity === "sensitivity" ? ONE : next, below);
    const slope = quantity === "open loop" ? size(c) : size(c) * (size(onePlus(loop)) / size(below)) ** 2;
    db[i] = 20 * Math.log10(size(value));
    // On the branch of the curve itself: C adds its own phase, and noise adds no turn.
    const shift = quantity === "open loop" ? factor.deg[i] : 0;
    deg[i] = nearest((Math.atan2(value[1], value[0]) * 180) / Math.PI, curve.deg[i] + shift);
    reach[i] = (curve.reach[i] * size(v) * slope) / size(value);
  }
  const nothing = curve.hz.map(() => NaN);
  return { ...curve, frame: null, db, deg, reach, noise: nothing, distorted: nothing, coherence: nothing };
}

/** @typedef {{kind: "gain" | "phase", hz: number, value: number, reach: number}} Margin dB or °, at a crossing */

/**
 * Margins of an open loop at its crossings between its frequencies, linear over log f: how much the gain may change where
 * the phase is an odd multiple of 180°, and the phase above −180° where |L| = 1. Those of smallest size of either kind.
 *
 * @param {Numbers} hz
 * @param {Numbers} db
 * @param {Numbers} deg
 * @param {Numbers} reach bound/|L|, NaN where it is not known
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
